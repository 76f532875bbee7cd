"""A damper that resists one direction more than the other."""

from ..effect import Effect, Parameter


class Asymmetry(Effect):
    """Asymmetry: the fluid's force differs between extension and compression.

    factor = 1 + ratio v / (|v| + v_s)
    """

    name = "asymmetry"
    site = "damper"
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = "Wang & Liao (2011), Smart Mater. Struct. 20(2), 023001 (review, asymmetric models)"
    expect = "residual in step with the force's size: of one sign in one direction, of the other in the other"
    parameters = {
        "ratio": Parameter(0.15, "1", (-0.9, 0.9), "half the difference between the directions"),
        "v_s": Parameter(1e-3, "m/s", (1e-6, 1.0), "speed over which the difference sets in"),
    }

    @staticmethod
    def factor(q, z, p):
        return 1.0 + p.ratio * q.v / (abs(q.v) + p.v_s)

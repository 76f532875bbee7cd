"""A damper that resists one direction more than the other."""

from ..effect import Effect
from ..parameter import Parameter


class Asymmetry(Effect):
    """Asymmetry: the fluid's force differs between extension and compression.

        factor = 1 + ratio (g + side (|g| - 1)),   g = v/(v^2 + v_s^2)^(1/2)

    Fast, the force is by the ratio more along +x and less the other way. Slow, it is that of the
    law (side 0), of the way back (1: a check valve that acts along +x alone), or of +x (-1).
    Leaves out a difference that depends on the voltage: doubt it when the ratio does.
    """

    name = "asymmetry"
    sites = ("damper",)
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = "Wang & Liao (2011), Smart Mater. Struct. 20(2), 023001 (review, asymmetric models)"
    expect = (
        "residual in step with the force's size: of one sign in one direction, of the other in the "
        "other"
    )
    amount = "ratio"
    parameters = {
        "ratio": Parameter(0.15, "1", (-0.9, 0.9), "largest change of the force, as a share"),
        "v_s": Parameter(1e-3, "m/s", (1e-6, 1.0), "speed over which the difference sets in"),
        "side": Parameter(0.0, "1", (-1.0, 1.0), "0 both directions, 1 along +x alone, -1 back"),
    }
    mimics = ("force_bias",)

    @staticmethod
    def factor(q, z, p):
        g = q.v / (q.v * q.v + p.v_s * p.v_s) ** 0.5
        return 1.0 + p.ratio * (g + p.side * (abs(g) - 1.0))

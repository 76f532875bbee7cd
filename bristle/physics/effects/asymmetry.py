"""A damper that resists one direction more than the other."""

from ..effect import Effect, Parameter


class Asymmetry(Effect):
    """Asymmetry: the fluid's force differs between extension and compression.

        factor = 1 + ratio g (sgn(v) + side)/(1 + |side|),   g = |v|/(|v|^2 + v_s^2)^(1/2)

    Side 0 changes both directions by as much, 1 that along +x alone, -1 the other alone (a check
    valve). Leaves out a difference that depends on the voltage: doubt it when the ratio does.
    """

    name = "asymmetry"
    site = "damper"
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = "Wang & Liao (2011), Smart Mater. Struct. 20(2), 023001 (review, asymmetric models)"
    expect = (
        "residual in step with the force's size: of one sign in one direction, of the other in the "
        "other"
    )
    parameters = {
        "ratio": Parameter(0.15, "1", (-0.9, 0.9), "largest change of the force, as a share"),
        "v_s": Parameter(1e-3, "m/s", (1e-6, 1.0), "speed over which the difference sets in"),
        "side": Parameter(0.0, "1", (-1.0, 1.0), "0 both directions, 1 or -1 one alone"),
    }

    @staticmethod
    def factor(q, z, p):
        onset = q.v / (q.v * q.v + p.v_s * p.v_s) ** 0.5
        return 1.0 + p.ratio * (onset + p.side * abs(onset)) / (1.0 + abs(p.side))

"""Orifice damping that grows faster than the speed."""

from ..effect import Effect, Parameter


class QuadraticDamping(Effect):
    """Quadratic damping: turbulent flow through the orifice adds a force like the speed squared.

    F = c_2 |v|^shape sgn(v)
    """

    name = "quadratic_damping"
    site = "damper"
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = "Merritt (1967), Hydraulic Control Systems, ch. 3 (orifice equation)"
    expect = "missing force in the direction of motion that grows steeply with speed"
    parameters = {
        "c_2": Parameter(100.0, "N.s2/m2", (0.0, 1e7), "coefficient (for shape 2)"),
        "shape": Parameter(2.0, "1", (1.4, 3.0), "exponent"),
    }

    @staticmethod
    def force(q, z, p):
        if q.v >= 0.0:
            return p.c_2 * q.v**p.shape
        return -p.c_2 * (-q.v) ** p.shape

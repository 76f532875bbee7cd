"""Orifice damping that grows faster than the speed."""

from ..effect import Effect
from ..parameter import Parameter

V_REF = 0.1  # m/s; keeps the unit of c_2 for every shape


class QuadraticDamping(Effect):
    """Quadratic damping: turbulent flow through the orifice adds a force like the speed squared.

        F = c_2 V_r^2 (|v|/V_r)^shape sgn(v),   V_r = 0.1 m/s

    With the exponent 1 it is the dashpot of a second load path, c_2 V_r [N s/m]; only a law without
    a constant viscous part, such as the modified Bingham law, can tell that from its own.

    Leaves out the laminar range below and cavitation above: doubt it when the force jumps or
    breaks off at the highest speeds.
    """

    name = "quadratic_damping"
    sites = ("damper",)
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = (
        "Merritt (1967), Hydraulic Control Systems, ch. 3 (orifice equation); shape 1.75: Blasius "
        "(1913), VDI-Forschungsheft 131"
    )
    expect = "missing force in the direction of motion that grows steeply with speed"
    amount = "c_2"
    parameters = {
        "c_2": Parameter(100.0, "N.s2/m2", (0.0, 1e7), "coefficient, at V_r for every shape"),
        "shape": Parameter(2.0, "1", (1.0, 3.5), "exponent: 2 turbulent, 1 a dashpot"),
    }
    start_grid = {"shape": (0.875, 1.0, 1.25)}

    @staticmethod
    def force(q, z, p):
        size = p.c_2 * V_REF**2 * (abs(q.v) / V_REF) ** p.shape
        return size if q.v >= 0.0 else -size

"""The modified Bingham law: a yield force, and a viscous part that dies out with speed."""

from __future__ import annotations

from ..command import Linear
from ..falling import EXPONENT, STANDARD, falling
from ..law import Law, Shape
from ..parameter import Parameter


class Bingham(Law):
    """Modified Bingham damper: f = (f_c + f_v V) sgn(v) + (c_0 + c_v V) v exp(-|v|/v_n).

    Reconstructed from the prose of Shirazi et al. (2012), IEEE TCST 20(5), eq. (1); valid for
    v != 0. While stuck, the yield force is whatever holds the motion, up to f_c + f_v V.
    """

    name = "bingham"
    parts = ("yield", "sign", "viscous")
    source = (
        "Shirazi, Mohammadpour, Grigoriadis & Song (2012), IEEE Trans. Control Syst. Technol. "
        "20(5), eq. (1)"
    )
    parameters = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(100.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(20.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "v_n": Parameter(0.02, "m/s", (1e-5, 1e2), "speed at which the viscous part is largest"),
        "exponent": EXPONENT,
    }
    command = {"yield_force": Linear("f_c", "f_v"), "viscosity": Linear("c_0", "c_v")}
    shapes = {"v_n": Shape(0.05, 5.0, 11, ("c_0", "c_v"), falls=True)}
    variants = {"standard": STANDARD}

    @staticmethod
    def limit(q, z, p):
        return p.yield_force

    @staticmethod
    def viscous(q, z, p):
        return p.viscosity * q.v * falling(q.v, p.v_n, p.exponent)

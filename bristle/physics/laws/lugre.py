"""The modified LuGre law: bristles that bend before they slip, stiffer under voltage."""

from __future__ import annotations

from ..command import Linear
from ..falling import EXPONENT, STANDARD, falling
from ..law import Law, Shape
from ..parameter import Parameter
from .dahl import moved


class LuGre(Law):
    """Modified LuGre damper: bristles with the mean deflection z bend before they slip.

        f  = (sigma_a + sigma_0 V) z + sigma_1 z' + (sigma_2 + sigma_b V) v exp(-|v|/v_n)
        z' = v - a_0 |v| z

    Reconstructed from Shirazi et al. (2012), IEEE TCST 20(5), eqs. (2), (3), after Terasawa, Sakai,
    Ohmori & Sano (2004), 43rd IEEE CDC. Steady sliding, z -> sgn(v)/a_0, is the Bingham law.
    """

    name = "lugre"
    parts = ("yield", "bristle", "viscous")
    source = (
        "Terasawa, Sakai, Ohmori & Sano (2004), 43rd IEEE CDC; Shirazi, Mohammadpour, Grigoriadis "
        "& Song (2012), IEEE Trans. Control Syst. Technol. 20(5), eqs. (2), (3)"
    )
    states = {"bristle_deflection": "m"}
    parameters = {
        "sigma_a": Parameter(650.0, "N/m", (0.0, 1e9), "stiffness of the bristles"),
        "sigma_0": Parameter(415.0, "N/(m.V)", (0.0, 1e9), "stiffness of the bristles per volt"),
        "sigma_1": Parameter(5.0, "N.s/m", (0.0, 1e7), "damping of the bristles"),
        "sigma_2": Parameter(100.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "sigma_b": Parameter(20.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "v_n": Parameter(0.02, "m/s", (1e-5, 1e2), "speed at which the viscous part is largest"),
        "a_0": Parameter(
            500.0, "1/m", (1.0, 1e7), "inverse of the bristles' deflection in sliding"
        ),
        "exponent": EXPONENT,
    }
    command = {"stiffness": Linear("sigma_a", "sigma_0"), "viscosity": Linear("sigma_2", "sigma_b")}
    shapes = {
        "v_n": Shape(0.05, 5.0, 11, ("sigma_2", "sigma_b"), falls=True),
        "a_0": Shape(0.5, 500.0, 13, ("sigma_a", "sigma_0", "sigma_1")),
    }
    variants = {"standard": STANDARD}

    @staticmethod
    def yielding(q, z, p):
        return p.stiffness * z.bristle_deflection

    @staticmethod
    def damping(q, z, p):
        v = q.v
        return p.sigma_1 * (v - p.a_0 / p.slip_length * abs(v) * z.bristle_deflection)

    @staticmethod
    def viscous(q, z, p):
        v = q.v
        return p.viscosity * v * falling(v, p.v_n, p.exponent)

    @staticmethod
    def rate(q, z, p):
        v = q.v
        return (v - p.a_0 / p.slip_length * abs(v) * z.bristle_deflection,)

    @staticmethod
    def advance(q, z, p):
        return (moved(z.bristle_deflection, q.v, p.a_0 / p.slip_length, q.dt),)

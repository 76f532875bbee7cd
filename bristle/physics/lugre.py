"""The modified LuGre law: bristles that bend before they slip, stiffer under voltage."""

from __future__ import annotations

from math import expm1
from typing import Any, ClassVar

from .bingham import EXPONENT, falling
from .effect import Parameter


class LuGre:
    """Modified LuGre damper with the mean bristle deflection z.

        f  = (sigma_a + sigma_0 V) z + sigma_1 z' + (sigma_2 + sigma_b V) v exp(-|v|/v_n)
        z' = v - a_0 |v| z

    Reconstructed from Shirazi et al. (2012), IEEE TCST 20(5), eqs. (2), (3), after Terasawa, Sakai,
    Ohmori & Sano (2004), 43rd IEEE CDC. Steady sliding, z -> sgn(v)/a_0, is the Bingham law.
    """

    name: ClassVar[str] = "lugre"
    parameters: ClassVar[dict[str, Parameter]] = {
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

    @staticmethod
    def bristle(
        z: float, v: float, V: float, p: Any, reach: float = 1.0, yield_factor: float = 1.0
    ) -> float:
        """Return the bristles' force [N] at deflection z [m], velocity v [m/s], voltage V [V].

        `reach` is the factor by which an effect moves the deflection at which they slip,
        `yield_factor` that of the yield force: of what bends, for in steady sliding the bristles'
        damping is no part of it.
        """
        rate = v - p.a_0 / reach * abs(v) * z
        bent = (p.sigma_a + p.sigma_0 * V) * z * yield_factor
        return bent + p.sigma_1 * rate  # type: ignore[no-any-return]

    @staticmethod
    def viscous(v: float, V: float, p: Any) -> float:
        """Return the viscous part [N] at velocity v [m/s] and voltage V [V]."""
        return (p.sigma_2 + p.sigma_b * V) * v * falling(v, p.v_n, p.exponent)  # type: ignore[no-any-return]

    @staticmethod
    def rate(z: float, v: float, p: Any, reach: float = 1.0) -> float:
        """Return the rate of the bristle deflection [m/s]; `reach` as in `bristle`."""
        return v - p.a_0 / reach * abs(v) * z  # type: ignore[no-any-return]

    @staticmethod
    def advance(z: float, v: float, dt: float, a_0: float) -> float:
        """Return the bristle deflection [m] after dt [s] at constant velocity v [m/s], exactly."""
        slip = a_0 * abs(v) * dt
        if slip < 1e-9:
            return z + (v - a_0 * abs(v) * z) * dt
        side = 1.0 if v > 0.0 else -1.0
        return z + (z - side / a_0) * expm1(-slip)

"""The modified Bingham law: a yield force, and a viscous part that dies out with speed."""

from __future__ import annotations

from math import exp
from typing import Any, ClassVar

from .effect import Parameter


def falling(v: float, v_n: float, exponent: float) -> float:
    """Return exp(-(|v|/v_n)^exponent), the fall of the viscous part with speed [1].

    `exponent` 0 stands for the standard law, whose factor is 1 at every speed.
    """
    if exponent == 0.0:
        return 1.0
    if exponent == 1.0:
        return exp(-abs(v) / v_n)
    return exp(-((abs(v) / v_n) ** exponent))


EXPONENT = Parameter(
    1.0, "1", (0.0, 4.0), "exponent of the fall exp(-(|v|/v_n)^exponent); 0: standard law, no fall"
)


class Bingham:
    """Modified Bingham damper: f = (f_c + f_v V) sgn(v) + (c_0 + c_v V) v exp(-|v|/v_n).

    Reconstructed from the prose of Shirazi et al. (2012), IEEE TCST 20(5), eq. (1); valid for
    v != 0. While stuck, the yield force is whatever holds the motion, up to f_c + f_v V.
    """

    name: ClassVar[str] = "bingham"
    parameters: ClassVar[dict[str, Parameter]] = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(100.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(20.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "v_n": Parameter(0.02, "m/s", (1e-5, 1e2), "speed at which the viscous part is largest"),
        "exponent": EXPONENT,
    }

    @staticmethod
    def yielding(V: float, p: Any) -> float:
        """Return the yield force [N] at voltage V [V]."""
        return p.f_c + p.f_v * V  # type: ignore[no-any-return]

    @staticmethod
    def viscous(v: float, V: float, p: Any) -> float:
        """Return the viscous part [N] at velocity v [m/s] and voltage V [V]."""
        return (p.c_0 + p.c_v * V) * v * falling(v, p.v_n, p.exponent)  # type: ignore[no-any-return]

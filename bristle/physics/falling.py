"""How a viscous part falls with speed, as both laws of Shirazi et al. (2012) have it."""

from __future__ import annotations

from math import exp

from .law import Variant
from .parameter import Parameter

EXPONENT = Parameter(
    1.0, "1", (0.0, 4.0), "exponent of the fall exp(-(|v|/v_n)^exponent); 0: standard law, no fall"
)

STANDARD = Variant({"exponent": 0.0}, idle=("v_n",), lacks="the exponential")
"""The law as it is without the fall: there is no speed to divide by."""


def falling(v: float, v_n: float, exponent: float) -> float:
    """Return exp(-(|v|/v_n)^exponent), the fall of the viscous part with speed [1].

    `exponent` 0 stands for the standard law, whose factor is 1 at every speed.
    """
    if exponent == 0.0:
        return 1.0
    if exponent == 1.0:
        return exp(-abs(v) / v_n)
    return exp(-((abs(v) / v_n) ** exponent))

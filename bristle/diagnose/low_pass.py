"""What a late load cell does to the force: a low-pass with its corner, or a delay."""

from __future__ import annotations

from math import pi, sqrt

from ..identify.assigned import late_effects
from ..physics.effect import EFFECTS
from ..quantity import plain
from .finding import Finding

MOSTLY = 0.6
"""Share of the lateness that a filter takes from which on the load cell is said to low-pass.

Two equal lags take all of it. Butterworth's filter of second order is fitted as 0.70 of it and a
delay, its corner then 11 % too high (`python -m benchmarks lab`, fault `cell`).
"""

_HALF_POWER = sqrt(sqrt(2.0) - 1.0)  # corner of two equal lags in series, by that of one


def low_pass_text(found: Finding) -> str:
    """Return what filter makes the force late, "" where the force is not late or only delayed.

    The filter is of second order, two equal lags in series, each of half the time that it takes.
    Its corner is where half the power is left.

    Parameters
    ----------
    found : the damper's finding
    """
    if found.kind != "effect" or found.after is None:
        return ""
    for name in late_effects([one for one in found.effects if one in EFFECTS]):
        time, share = (found.after.model.value(f"{name}.{one}") for one in EFFECTS[name].late)
        if share >= MOSTLY and time > 0.0:
            corner = _HALF_POWER / (2.0 * pi * 0.5 * share * time)
            return (
                f"{plain(100.0 * share, 2)} % of the {plain(1e3 * time)} ms by which the force is "
                f"late are a low-pass of second order, with its corner near {plain(corner, 2)} Hz: "
                "a filter of the load cell or its amplifier."
            )
    return ""

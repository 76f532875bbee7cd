"""What a late load cell does to the force: a low-pass with its corner, or a delay."""

from __future__ import annotations

from math import pi, sqrt

from ..identify.assigned import late_effects
from ..physics.effect import EFFECTS
from ..quantity import plain
from .finding import Finding

MOSTLY = 0.6
"""Share of the lateness that a filter takes from which on the load cell is said to low-pass."""


def low_pass_text(found: Finding) -> str:
    """Return what filter makes the force late, "" where the force is not late or only delayed.

    The filter is of second order; its corner is where half the power is left.

    Parameters
    ----------
    found : the damper's finding
    """
    if found.kind != "effect" or found.after is None:
        return ""
    for name in late_effects([one for one in found.effects if one in EFFECTS]):
        time, share, *more = (
            found.after.model.value(f"{name}.{one}") for one in EFFECTS[name].late
        )
        d = more[0] if more else 1.0  # else two equal lags
        if share >= MOSTLY and time > 0.0:
            natural = d / (pi * share * time)
            corner = natural * sqrt(1.0 - 2.0 * d * d + sqrt((1.0 - 2.0 * d * d) ** 2 + 1.0))
            return (
                f"{plain(100.0 * share, 2)} % of the {plain(1e3 * time)} ms by which the force is "
                f"late are a low-pass of second order (damping ratio {plain(d, 2)}), with its "
                f"corner near {plain(corner, 2)} Hz: a filter of the load cell or its amplifier."
            )
    return ""

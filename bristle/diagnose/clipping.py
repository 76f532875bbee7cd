"""Channels whose range ends before the motion does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..compare.names import joined
from ..data.channels import DRIVE, channel_unit
from ..data.checks.clipping import stands_at_top
from ..data.measurement import Measurement
from ..quantity import quantity
from .faults import SensorFault
from .rule import SENSOR, DecisionRule

Array = NDArray[np.float64]

NAMED = 3
"""Runs that a sentence names; of more it says how many there are."""

BESIDE = 4.0
"""Noises inside the end of a range within which a sample may have been cut."""


def clipped(runs: Sequence[Measurement], rule: DecisionRule = SENSOR) -> list[SensorFault]:
    """Return the channels that repeat an extreme: their range ends before the motion does."""
    found = []
    for channel in ("force", "displacement", "velocity", *DRIVE):
        there = [run for run in runs if run.has(channel) and _may_be_clipped(run, channel)]
        ends = {run.name: cut for run in there if (cut := _ends(run[channel], rule))}
        if ends:
            every = [end for cut in ends.values() for end in cut]
            at = joined([quantity(end, channel_unit(channel), 4) for end in _outermost(every)])
            named = joined([*ends]) if len(ends) <= NAMED else f"{len(ends)} runs"
            found.append(
                SensorFault(
                    channel, "clipping", max(map(abs, every)), 0.0,
                    f"{channel.capitalize()} repeats the very same extreme in {named}: its range "
                    f"ended at {at}.",
                    runs=tuple(ends) if len(ends) < len(runs) else (),
                )
            )  # fmt: skip
    return found


def _may_be_clipped(run: Measurement, channel: str) -> bool:
    """Return whether an extreme that repeats would mean anything.

    Without noise the extreme of a signal may well repeat, and a drive's level does. A channel that
    stands at its ends nearly always shows no noise either, but the others of its run do.
    """
    motion = ("force", "displacement", "velocity")
    noisy = _is_noisy(run, channel)
    if channel in motion and not noisy:
        return any(_is_noisy(run, other) for other in motion if other != channel)
    return noisy


def _is_noisy(run: Measurement, channel: str) -> bool:
    if not run.has(channel):
        return False
    top = float(np.max(np.abs(run[channel])))
    return 1e-4 * top < run.noise.get(channel, 0.0) < 0.2 * top


def _ends(values: Array, rule: DecisionRule) -> list[float]:
    """Return the values at which a signal is cut off: of both sides, of one, or none."""
    return [
        way * float(np.max(way * values))
        for way in (1.0, -1.0)
        if _stands_at_top(way * values, rule)
    ]


def _outermost(ends: Sequence[float]) -> list[float]:
    """Return the lowest of the lower ends and the highest of the upper ones."""
    lower, upper = [e for e in ends if e < 0.0], [e for e in ends if e >= 0.0]
    return [*([min(lower)] if lower else []), *([max(upper)] if upper else [])]


def beyond_range(
    values: Array, noise: float, level: float, rule: DecisionRule = SENSOR
) -> NDArray[np.bool_]:
    """Return which samples (n,) of a signal may have been cut off.

    What is cut may get its noise behind the cut: then it stands a little inside of it, too.

    Parameters
    ----------
    values : (n,) in the channel's unit
    noise : standard deviation of the channel, in the same unit
    level : size at which the channel was seen to be cut: a run may touch it a few times only
    rule : the numbers that decide
    """
    lost = np.zeros(len(values), dtype=np.bool_)
    for way in (1.0, -1.0):
        turned = way * values
        top, near = float(turned.max()), _rounding(values)
        if _stands_at_top(turned, rule) or abs(top - level) <= near:
            lost |= turned >= top - near - BESIDE * noise
    return lost


def _rounding(values: Array) -> float:
    return 1e-9 * float(np.max(np.abs(values)))


def _stands_at_top(values: Array, rule: DecisionRule) -> bool:
    return stands_at_top(values, _rounding(values), rule.longest, rule.crowded)

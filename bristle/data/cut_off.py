"""Samples that may have been cut off at the end of a channel's range: they say nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..quantity import quantity
from .channels import DRIVE, channel_unit
from .checks.clipping import stands_at_top
from .left_out import merged
from .measurement import Measurement

Array = NDArray[np.float64]

CHANNELS = ("force", "displacement", "velocity", *DRIVE)
"""Channels of a damper that are looked at."""

LONGEST, CROWDED = 5, 8.0
"""What `checks.clipping.stands_at_top` asks: samples of a stretch, times as many as a step below.
"""

BESIDE = 4.0
"""Noises inside the end of a range within which a sample may have been cut."""


def ends_of(
    run: Measurement, channel: str, longest: int = LONGEST, crowded: float = CROWDED
) -> list[float]:
    """Return the values at which a channel is cut off: of both sides, of one, or none.

    Parameters
    ----------
    run, channel : the run has the channel
    longest, crowded : as of `checks.clipping.stands_at_top`
    """
    if not _may_be_cut(run, channel):
        return []
    values = run[channel]
    return [
        way * float(np.max(way * values))
        for way in (1.0, -1.0)
        if stands_at_top(way * values, _rounding(values), longest, crowded)
    ]


def beyond_range(
    values: Array, noise: float, level: float, longest: int = LONGEST, crowded: float = CROWDED
) -> NDArray[np.bool_]:
    """Return which samples (n,) of a signal may have been cut off.

    What is cut may get its noise behind the cut: then it stands a little inside of it, too.

    Parameters
    ----------
    values : (n,) in the channel's unit
    noise : standard deviation of the channel, in the same unit
    level : size at which the channel was seen to be cut: a run may touch it a few times only
    longest, crowded : as of `checks.clipping.stands_at_top`
    """
    lost = np.zeros(len(values), dtype=np.bool_)
    near = _rounding(values)
    for way in (1.0, -1.0):
        turned = way * values
        top = float(turned.max())
        if stands_at_top(turned, near, longest, crowded) or abs(top - level) <= near:
            lost |= turned >= top - near - BESIDE * noise
    return lost


def outermost(ends: Iterable[float]) -> list[float]:
    """Return the lowest of the lower ends and the highest of the upper ones."""
    every = list(ends)
    lower, upper = [e for e in every if e < 0.0], [e for e in every if e >= 0.0]
    return [*([min(lower)] if lower else []), *([max(upper)] if upper else [])]


def without_cut_off(runs: Sequence[Measurement]) -> tuple[list[Measurement], tuple[str, ...]]:
    """Return runs of one rig whose samples that were cut off are marked, and sentences on them."""
    out, notes = list(runs), []
    for channel in CHANNELS:
        ends = [end for run in runs if run.has(channel) for end in ends_of(run, channel)]
        if not ends:
            continue
        level = max(map(abs, ends))
        for k, run in enumerate(out):
            if not run.has(channel):
                continue
            cut = beyond_range(run[channel], run.noise.get(channel, 0.0), level)
            if cut.any():
                out[k] = replace(run, saturated=merged(run.saturated, channel, cut))
                unit = channel_unit(channel)
                own = outermost(ends_of(run, channel) or ends)  # ranges may differ between runs
                at = " and ".join(quantity(end, unit, 4) for end in own)
                notes.append(
                    f"{run.name}: {channel} is cut off at {at}; the "
                    f"{100.0 * float(cut.mean()):.2g} % of its samples there are not judged."
                )
    return out, tuple(notes)


def _may_be_cut(run: Measurement, channel: str) -> bool:
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


def _rounding(values: Array) -> float:
    return 1e-9 * float(np.max(np.abs(values)))

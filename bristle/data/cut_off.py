"""Samples cut off at the end of a channel's range, and velocities that were computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import quantity
from .channels import DRIVE, channel_unit
from .left_out import merged
from .measurement import Measurement
from .noise import stretches

# Whether a channel was cut off at the end of its range, by three measures for three questions.
#
# All look at stretches of equal samples at an extreme, and none can stand for another. Before any
# model a channel of any sampling is asked, and a peak in coarse steps must not be taken for a cut:
# `clipped_ends`, which knows the step. A diagnosis leaves out what may have been cut, so chance
# must not cut it short: `stands_at_top`, on one side, its limits those of a decision rule. A fit
# refuses a force that carries nothing but its ends, whatever did that: `saturated_share`, both
# sides together, coarse steps included.


LONG = 5
"""Equal samples in a row at an extreme that a moving force does not show."""


def saturated_share(values: Array) -> float:
    """Return the share of samples (n,) that repeat an extreme in stretches of `LONG` or more."""
    count = 0
    for extreme in (values.max(), values.min()):
        lengths = np.diff(stretches(values == extreme))
        count += int(lengths[lengths >= LONG].sum())
    return count / len(values)


def stands_at_top(values: Array, near: float, longest: int, crowded: float) -> bool:
    """Return whether a signal (n,) is cut at its largest value.

    At a cut the very same number comes many times in a row; a noisy signal never does that. One in
    coarse steps does at its turns, but not many times more often than one step below.

    Parameters
    ----------
    values : (n,) in the channel's unit
    near : distance from the largest value that counts as equal, in the same unit
    longest : samples of a stretch at a turn at the most
    crowded : how many times as many samples as one step below a cut holds at the least
    """
    at_end = values >= values.max() - near
    stays, often = np.diff(stretches(at_end)).ravel(), int(at_end.sum())
    # Once may be a rest before or after the test, at that end of the stroke.
    if np.count_nonzero(stays >= longest) < 2 or often < 2 * longest:
        return False
    _, below = np.unique(values[~at_end], return_counts=True)
    return bool(len(below)) and often > crowded * float(np.mean(below[-longest:]))


def clipped_ends(values: Array, quantum: float) -> list[tuple[float, float, int]]:
    """Return (share of samples, level, stretches) of each end where a channel is cut off.

    A stretch is three or more equal samples at the largest or smallest value, away from the ends of
    the record. A turning point of a signal written in steps dwells there too, but then almost as
    long on the next step.
    """
    span = float(np.ptp(values))
    tolerance = max(0.5 * quantum, 1e-9 * span)
    found = []
    for extreme in (float(values.max()), float(values.min())):
        distance = np.abs(values - extreme)
        edges = stretches(distance <= tolerance).tolist()
        inner = [(a, b) for a, b in edges if b - a >= 3 and a > 0 and b < len(values)]
        count = sum(b - a for a, b in inner)
        near = max(quantum, 5e-3 * span) + tolerance
        beside = int(((distance > tolerance) & (distance <= near)).sum())
        levels = max(1.0, 5e-3 * span / quantum) if quantum else 1.0
        # How much longer a round peak dwells on the last step than on each of the next.
        round_peak = 0.707 * levels / ((levels + 0.5) ** 0.5 - 0.707)
        often = count >= 5 and (len(inner) > 1 or count >= 10)
        if often and count > 4.0 * round_peak * beside / levels:
            found.append((count / len(values), extreme, len(inner)))
    return sorted(found, key=lambda end: -end[0])


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


def beyond_range(values: Array, noise: float, level: float) -> Flags:
    """Return which samples (n,) of a signal may have been cut off.

    What is cut may get its noise behind the cut: then it stands a little inside of it, too.

    Parameters
    ----------
    values : (n,) in the channel's unit
    noise : standard deviation of the channel, in the same unit
    level : size at which the channel was seen to be cut: a run may touch it a few times only
    """
    lost = np.zeros(len(values), dtype=np.bool_)
    near = _rounding(values)
    for way in (1.0, -1.0):
        turned = way * values
        top = float(turned.max())
        if stands_at_top(turned, near, LONGEST, CROWDED) or abs(top - level) <= near:
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


# A velocity that was computed from the displacement tells nothing of its own.
#
# Its noise is that of the displacement, differentiated, so that the two channels agree in their
# noise
# as two instruments never do; a difference to one side is half a sample early or late as well.
#
# Two questions are asked. `numerical_derivative`, of two columns whose noise nobody knows yet: are
# they equal to the digits that were written? `derived_velocity`, of a measurement: do they agree
# better than the noise of the displacement lets two instruments agree?

AGREED = 0.1
"""Mismatch of a channel with a difference of the other, as a share of that difference's noise."""

WRITTEN = 1e-3
"""Median mismatch, as a share of the velocity's spread, that the digits of a file leave."""

SPREAD = {"backward": np.sqrt(2.0), "forward": np.sqrt(2.0), "central": np.sqrt(0.5)}
"""Noise of a difference, in noises of the displacement per sampling step."""

LATE = {"backward": 0.5, "forward": -0.5, "central": 0.0}
"""By how many samples a velocity comes late that is such a difference of the displacement."""


def derived_velocity(measurement: Measurement) -> str:
    """Return of which difference of the displacement the velocity is, "" where it is of none.

    Returns
    -------
    str
        "backward", "forward" or "central"; "" too without noise, when no difference can be told
        from a good instrument.
    """
    if not measurement.has("displacement", "velocity") or len(measurement.time) < 3:
        return ""
    noise = measurement.noise.get("displacement", 0.0) / measurement.step
    rests = mismatches(measurement["displacement"], measurement["velocity"], measurement.step)
    for name in ("backward", "forward", "central"):
        rest = rests[name]
        if _rms(rest[np.isfinite(rest)]) < AGREED * SPREAD[name] * noise:
            return name
    return ""


def numerical_derivative(x: Array, v: Array, step: float) -> str:
    """Return which difference of x (n,) a velocity v (n,) is to its digits, "" if it is none.

    Parameters
    ----------
    x, v : (n,) evenly spaced
    step : float, s
    """
    scale = float(np.std(v))
    if scale == 0.0 or len(x) < 10:
        return ""
    rests = mismatches(x, v, step)
    for name in ("central", "backward", "forward"):
        # What is written with few digits differs by their rounding.
        if float(np.median(np.abs(rests[name]))) < WRITTEN * scale:
            return f"{name} differences"
    return ""


def mismatches(x: Array, v: Array, step: float) -> dict[str, Array]:
    """Return by how much a velocity (n,) differs from each difference of x (n,), by its name."""
    rise = np.diff(x) / step
    return {
        "backward": v[1:] - rise,
        "forward": v[:-1] - rise,
        "central": v[1:-1] - 0.5 * (rise[1:] + rise[:-1]),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.inf

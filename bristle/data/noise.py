"""How noisy a channel is, and its spikes, from the channel alone.

Filters (1 - B)^a (1 + B)^b, B the shift by one sample, remove what is smooth and keep white noise
of a band around tan^2(pi f dt) = a/b. Where a signal jumps, bends or is switched the filters answer
too: blocks that hold more than white noise could are left out. Of the differences (b = 0) the
smallest answer is taken, for what is left of the signal only ever adds to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import sqrt
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array, Flags, Indices
from ..core.text import plain, quantity
from ..errors import RecordError
from .channels import DRIVE, channel_unit, device_channel

Kernel = tuple[int, int]

SHORTEST = 60
"""Fewest samples that a noise is estimated from."""
KNOWN = ("white", "low-passed")
"""Colours of a noise whose level is told from the channel, whatever its signal."""
_DIFFERENCES: tuple[Kernel, ...] = tuple((a, 0) for a in range(2, 10))
# From half the sampling rate downwards.
_BANDS: tuple[Kernel, ...] = ((9, 0), (8, 1), (8, 2), (6, 3), (5, 5), (4, 8), (4, 16))
_BLOCKS = (24, 8)  # samples; long ones tell more, short ones lie between frequent jumps
_JUMPY = 0.8  # share of the long blocks' level below which that of the short ones is the noise
_CLEANEST = 0.3  # the share of blocks that is taken to be free of jumps, to begin with
_CHANGES = 6  # of a channel that is switched rather than moved, at most per hundred samples
_KEPT = 0.97  # the share of blocks of white noise that the final threshold lets pass
_FLAT = 1.12  # neighbouring bands whose levels differ by less are flat
_RESTING = 0.03  # share of a channel's standard deviation below which it is at rest
_PARTS, _SHORT = 8, 25  # of a stretch at rest: parts, and samples of one at the least
_BENDS = 5  # degree of the curve that a slow motion follows over a stretch
_STILL = 0.5  # share of a stretch's RMS that its parts have about their own lines, at rest
_PERFECT = 1e-4  # no instrument's noise is a smaller share
_ROUGH = 0.15  # a noise above this share of a channel's standard deviation may be its signal


@dataclass(frozen=True)
class Noise:
    """The noise of a channel.

    `std` is its standard deviation in the channel's unit, rounding included. `quantum` is the step
    on which the values lie, 0 where there is none. `colour` says how far `std` can be trusted:

    - "white": up to half the sampling rate.
    - "low-passed": it fades towards there; `std` is that of white noise of the level below.
    - "blue": it grows towards there, as after a numerical derivative; `std` is an upper limit for
      what lies below.
    - "resting": nowhere flat, as after a filter; `std` is that of the quietest stretch, at rest.
    - "slow": nowhere flat and never at rest: it cannot be told from the signal; `std` is what the
      slowest stretches have about smooth curves, with the rest of the signal in it.
    - "hidden": as "slow", and nowhere slow; `std` is a lower limit.
    - "rough": the signal itself changes that much from sample to sample; `std` is an upper limit.
    - "none": there is no noise.
    """

    std: float
    quantum: float = 0.0
    colour: str = "white"

    @property
    def known(self) -> bool:
        """Whether it can be told from the signal, so that an error may be divided by it."""
        return self.colour not in ("slow", "hidden")


def white_noise(y: Array) -> float:
    """Return the standard deviation of the white noise on a channel, in the channel's unit.

    Parameters
    ----------
    y : (n,) evenly spaced samples, finite, n >= `SHORTEST`

    Raises
    ------
    RecordError
        If there are too few samples, or one is not finite.
    """
    return estimate_noise(y).std


def estimate_noise(y: Array) -> Noise:
    """Return the noise of a channel with its colour; see `white_noise`."""
    y = np.asarray(y, dtype=float)
    if y.ndim != 1 or len(y) < SHORTEST:
        raise RecordError(
            f"noise: {len(y)} samples; the noise of a channel needs {SHORTEST} or more."
        )
    if not np.isfinite(y).all():
        raise RecordError("noise: a sample is not finite; fill it or cut the channel there.")
    y = y - np.median(y)
    largest = float(np.abs(y).max())
    if largest == 0.0:
        return Noise(0.0, 0.0, "none")
    step = quantum(y)
    # Rounding to a step q leaves an error of q/sqrt(12), also where nothing moves.
    rounding = step / sqrt(12.0)
    std, block = _of_differences(y)
    # Numbers in double precision are rounded, too: below this nothing was measured.
    if max(std, rounding) < 256.0 * float(np.finfo(float).eps) * largest:
        return Noise(0.0, step, "none")
    if std <= rounding:
        return Noise(rounding, step)
    rough = std > _ROUGH * float(np.std(y))
    std, colour = (std, "rough") if rough else _in_bands(y, std, block)
    if colour == "hidden" or std < _PERFECT * float(np.std(y)):
        colour = "hidden"  # what is flat so far down is the rounding of numbers after a filter
        quiet, at_rest = quietest(y)
        if quiet < _RESTING * float(np.std(y)):
            std, colour = max(std, quiet), "resting" if at_rest else "slow"
    return Noise(max(std, rounding), step, colour)


def quietest(y: Array) -> tuple[float, bool]:
    """Return the RMS about a straight line in the quietest stretches, and whether they are at rest.

    A stretch is 2 % of a channel. At rest noise is as large about the lines of its short parts; a
    slow motion is not: then the RMS is that about curves, or its bend would count as noise.
    """
    size = max(100, len(y) // 50)
    if len(y) < 2 * size:
        return float("inf"), False
    rows = np.lib.stride_tricks.sliding_window_view(y, size)[:: size // 2]
    squares = _about_curves(rows, 1)
    # The quietest of many is quiet by chance, too: those that are not much louder belong to it.
    quiet = squares <= 6.0 * squares.min()
    short = size // min(_PARTS, size // _SHORT)
    parts = rows[quiet][:, : size // short * short].reshape(-1, short)
    found = float(np.sqrt(np.mean(squares[quiet])))
    at_rest = float(np.sqrt(np.mean(_about_curves(parts, 1)))) >= _STILL * found
    if at_rest or found >= _RESTING * float(np.std(y)):
        return found, at_rest
    return float(np.sqrt(np.mean(_about_curves(rows[quiet], _BENDS)))), False


def _about_curves(rows: Array, degree: int) -> Array:
    """Return the variances (m,) of rows (m, n) about a polynomial of each."""
    size = rows.shape[1]
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, size), degree + 1))
    about = rows - (rows @ basis) @ basis.T
    return np.asarray(np.sum(about**2, axis=1) / (size - degree - 1))


def quantum(y: Array) -> float:
    """Return the step on which the values of a channel lie, 0 where there is none.

    There is one when all values are whole multiples of it apart and many are met more than once.
    """
    levels = np.unique(y)
    if len(levels) < 3 or len(levels) > 0.7 * len(y) or is_switched(y):
        return 0.0
    span = float(levels[-1] - levels[0])
    gaps = np.diff(levels)
    step = float(gaps[gaps > 1e-9 * span].min())  # smaller ones are the rounding of a conversion
    # The smallest gap carries a rounding of its own; the mean over all whole multiples does not.
    for _ in range(3):
        multiples = np.round((levels - levels[0]) / step)
        step = span / max(float(multiples[-1]), 1.0)
    off = np.abs((levels - levels[0]) / step - multiples)
    return step if float(np.quantile(off, 0.95)) < 0.15 else 0.0


def is_switched(values: Array) -> bool:
    """Return whether a channel keeps to a few levels and jumps between them, as a voltage does."""
    finite = values[np.isfinite(values)]
    if len(finite) < 20:
        return False
    changes = np.count_nonzero(np.diff(finite))
    return bool(changes <= max(1, _CHANGES * len(finite) // 100))


def stretches(flat: Flags) -> Indices:
    """Return the first sample and the one after the last (k, 2) of each stretch that is true."""
    padded = np.concatenate([[0], flat.astype(np.int8), [0]])
    return np.asarray(np.flatnonzero(np.diff(padded)).reshape(-1, 2), dtype=np.int64)


def _of_differences(y: Array) -> tuple[float, int]:
    """Return the least level of the differences, and the samples of the blocks that tell it.

    Where a slow record's force jumps in most long blocks, those hold jumps, not noise.
    """
    long, short = (min(_level(y, k, size) for k in _DIFFERENCES) for size in _BLOCKS)
    return (short, _BLOCKS[1]) if 0.0 < short < _JUMPY * long else (long, _BLOCKS[0])


def _in_bands(y: Array, std: float, block: int) -> tuple[float, str]:
    """Return the standard deviation and the colour that the bands tell.

    The highest three neighbouring bands of one level are the noise; what rises below is signal.
    Frequent jumps, too, give lower bands one level: beside them only the highest three are noise.
    """
    levels = [_level(y, kernel, block) for kernel in _BANDS]
    wide = _FLAT * (1.0 + 3.0 / sqrt(len(y)))  # levels scatter on short channels
    for first in range(len(levels) - 2 if block == _BLOCKS[0] else 1):
        three = levels[first : first + 3]
        if max(three) <= wide * min(three):
            below = levels[first + 1 : 5]  # a signal only adds to these
            blue = bool(below) and min(below) < levels[0] / wide**2
            if blue or first == 0:
                return std, "blue" if blue else "white"
            return sum(three) / 3.0, "low-passed"
    return std, "blue" if levels[0] > wide * levels[2] else "hidden"


def _level(y: Array, kernel: Kernel, block: int) -> float:
    """Return the standard deviation of white noise that gives a filter's answer, from blocks."""
    weights, freedom = _filter(kernel, block)
    d = np.convolve(y, weights, "valid")
    total = np.concatenate([[0.0], np.cumsum(d * d)])
    begin = np.arange(0, len(d) - block + 1, block // 2)
    squares = (total[begin + block] - total[begin]) / block
    # Rounding error of the sums aside, a block of zeros holds one level of a coarse instrument.
    moving = squares > 1e-14 * float(squares.max())
    if np.mean(moving) > 0.1 and not is_switched(y):
        squares = squares[moving]
    found = float(np.quantile(squares, _CLEANEST)) / _chi2(_CLEANEST, freedom)
    if found <= 1e-14 * float(squares.max()):
        return 0.0
    bound = _chi2(_KEPT, freedom)
    for _ in range(20):
        kept = squares[squares <= bound * found]
        if not len(kept):
            break
        before, found = found, float(np.mean(kept)) / _truncated(freedom)
        if abs(found - before) < 1e-4 * before:
            break
    return sqrt(max(found, 0.0))


@cache
def _filter(kernel: Kernel, block: int) -> tuple[Array, float]:
    """Return the weights (a + b + 1,), of unit gain for white noise, and the freedom of a block.

    The freedom is that of chi2 for the mean square over a block of the filter's answers, which
    are correlated by the weights' own autocorrelation.
    """
    weights = np.ones(1)
    for _ in range(kernel[0]):
        weights = np.convolve(weights, [1.0, -1.0])
    for _ in range(kernel[1]):
        weights = np.convolve(weights, [1.0, 1.0])
    weights = weights / sqrt(float(weights @ weights))
    correlation = np.correlate(weights, weights, "full")[len(weights) :][: block - 1]
    share = 1.0 - np.arange(1, len(correlation) + 1) / block
    return weights, block / (1.0 + 2.0 * float(share @ correlation**2))


def _chi2(share: float, freedom: float) -> float:
    """Return a quantile of chi2 over its freedom (Wilson & Hilferty 1931, PNAS 17, 684-688)."""
    spread = 2.0 / (9.0 * freedom)
    return float((1.0 - spread + NormalDist().inv_cdf(share) * sqrt(spread)) ** 3)


@cache
def _truncated(freedom: float) -> float:
    """Return the mean of chi2 over its freedom when its highest values are cut off."""
    shares = (np.arange(400) + 0.5) / 400.0 * _KEPT
    return float(np.mean([_chi2(float(share), freedom) for share in shares]))


# Isolated spikes on a channel: one to three samples that stand out from those on either side.

LONGEST = 3
"""Samples in a row that are one spike; what lasts longer is no isolated one."""

_WINDOW = 2 * LONGEST + 1  # of the running median, which jumps with a step and not with a spike
_ABOVE_MOST = 8.0  # by what factor a spike exceeds what 99 % of the samples differ from it
_ABOVE_NOISE = 15.0  # standard deviations of the same, told from its median
_OF_RANGE = 0.03  # share of the channel's range that is worth a word
_INSIDE = 2.5  # by what factor more a spike stands out that stays inside the usual range
_TOLD = 3  # times that are told


class Spike(NamedTuple):
    """A spike: its channel, when [s], and how far it stands out, in the channel's SI unit."""

    channel: str
    time: float
    size: float


def find_spikes(y: Array) -> list[tuple[int, int]]:
    """Return the first sample and the one after the last of each spike of a channel (n,).

    Values that are missing are no spikes. A channel that is switched between levels has none.
    """
    good = np.flatnonzero(np.isfinite(y))
    if len(good) < 10 * _WINDOW or is_switched(y):
        return []
    from scipy.ndimage import median_filter

    there = y[good]
    apart = there - median_filter(there, _WINDOW, mode="nearest")
    size = np.abs(apart)
    low, high = np.quantile(there, [0.005, 0.995])
    least = max(
        _ABOVE_MOST * float(np.quantile(size, 0.99)),
        _ABOVE_NOISE * 1.4826 * float(np.median(size)),
        _OF_RANGE * float(high - low),
    )
    margin = _OF_RANGE * float(high - low)

    def stands_out(a: int, b: int) -> bool:
        """Return whether samples a to b are outside of the usual range, or alone and far off.

        A motion that turns back for a moment takes a yield force through its range and back.
        """
        part = there[a:b]
        if bool(np.all((part > high + margin) | (part < low - margin))):
            return True
        return b - a == 1 and float(size[a]) > _INSIDE * least

    return [
        (int(good[a]), int(good[b - 1]) + 1)
        for a, b in stretches(size > least).tolist()
        if b - a <= LONGEST and 0 < a < b < len(there) and stands_out(a, b)
    ]


def spikes_of(time: Array, channels: Mapping[str, Array], *, mask: bool) -> tuple[Spike, ...]:
    """Return the spikes of all channels; with `mask` their samples are missing from then on.

    Parameters
    ----------
    time : (n,) s
    channels : name to (n,) in SI, NaN where a value is missing
    mask : whether to make their samples NaN, in place
    """
    found = []
    for channel, y in channels.items():
        commands = (device_channel(channel) or ("", channel))[1] in DRIVE
        for begin, end in find_spikes(y):
            if commands and _at_a_switch(y, begin, end):
                continue
            before, after = (part[np.isfinite(part)] for part in (y[:begin], y[end:]))
            beside = np.concatenate([before[-LONGEST:], after[:LONGEST]])
            part = y[begin:end] - float(np.median(beside))
            most = int(np.nanargmax(np.abs(part)))
            found.append(Spike(channel, float(time[begin + most]), float(part[most])))
            if mask:
                y[begin:end] = np.nan
    return tuple(found)


def _at_a_switch(y: Array, begin: int, end: int) -> bool:
    """Return whether samples of a command overshoot where it is switched from level to level."""
    before, after = y[max(begin - LONGEST, 0) : begin], y[end : end + LONGEST]
    if not (np.isfinite(before).any() and np.isfinite(after).any()):
        return False
    levels = np.array([np.nanmedian(before), np.nanmedian(after)])
    size = float(np.nanmax(np.min(np.abs(y[begin:end, None] - levels), axis=1)))
    return float(np.ptp(levels)) >= size


def spikes_text(spikes: tuple[Spike, ...]) -> str:
    """Return the spikes of one channel as people say it, the largest first."""
    ordered = sorted(spikes, key=lambda one: -abs(one.size))
    unit = channel_unit(spikes[0].channel)
    told = [
        f"{quantity(one.size, unit, fine=True)} at {plain(one.time, 5)} s"
        for one in ordered[:_TOLD]
    ]
    more = f" and {len(spikes) - _TOLD} more" if len(spikes) > _TOLD else ""
    what = "an isolated spike" if len(spikes) == 1 else f"{len(spikes)} isolated spikes"
    return f"{spikes[0].channel} has {what}: {', '.join(told)}{more}"

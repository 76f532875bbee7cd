"""Even spacing in time: small jitter tolerated, short gaps filled, long ones cut, all of it said.

A gap is a spacing above 1.5 times the median, as in ground motions. What is filled is marked, so
that it never counts as measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array, Flags, Indices
from ..core.text import plain, plural
from ..errors import RecordError
from ..physics.motion_file import GAP
from .noise import SHORTEST, is_switched, stretches

# The even grid that times lie on, which were written with few digits or with some jitter.

ROUNDED = 0.51
"""Digits by which rounding may move a time: half of one, and a little for floating point."""

MOSTLY = 0.9
"""Share of times on a grid from which on the others are off it, and not all of them rounded."""


def even_grid(time: Array, step: float, tolerated: float) -> tuple[Array, Indices, float, float]:
    """Return an even grid, the place of each sample on it, and how far the times are from it.

    Parameters
    ----------
    time : (n,) s, increasing, without long gaps
    step : s, the median spacing
    tolerated : share of the step by which a time may be off and still tell where the grid is

    Returns
    -------
    grid : (m,) s
    places : (n,) index in the grid
    jitter : the largest distance of a time from its place, in steps
    digits : s, the step on which the times are written, 0 where none is seen
    """
    digits = _digits(time)
    places = _places(time, step, digits)
    # The median spacing of rounded times is rounded, too: the whole span knows the step better.
    slope, start = float(time[-1] - time[0]) / float(places[-1]), float(time[0])
    off = _distance(time, places, slope, start)
    if off.max() > 1e-6:
        slope, start = _line(time, places, off, digits, tolerated)
        off = _distance(time, places, slope, start)
    grid: Array = start + slope * np.arange(int(places[-1]) + 1, dtype=float)
    return grid, places.astype(np.int64), float(off.max()), digits


def _digits(time: Array) -> float:
    """Return the step on which times are written [s], 0 where none is seen."""
    widest = 1.01 * float(np.diff(time).max())
    late = float(np.quantile(np.abs(time), 1.0 - _MOVED))
    # With 6 significant digits it grows, 0.000333333 s, 10.0003 s: that of the last times tells.
    last = time[np.abs(time) >= 10.0 ** np.floor(np.log10(late))] if late > 0.0 else time
    return _unit(time, widest) or _unit(last, widest)


def _unit(time: Array, widest: float) -> float:
    """Return the largest decimal unit, `widest` at most, that divides times [s]; 0 for none."""
    # Seconds, and parts of a day, which take all digits that a number has.
    for size, powers, off in ((1.0, 7, 1e-4), (86400.0, 10, 5e-3)):
        for power in range(powers):
            unit = size * 10.0**-power
            if unit > widest:  # of different times two are a step apart at least
                continue
            if np.abs(time / unit - np.round(time / unit)).max() < off:
                return unit
    return 0.0


def _places(time: Array, step: float, digits: float) -> Array:
    spacing = np.diff(time)
    if 0.0 < digits <= ROUNDED * step:
        # 2.44 ms is written as 2 or 3 ms. By a median of 2, 3 ms could be one step or two.
        step = float(spacing[spacing <= step + 1.01 * digits].mean())
    return np.concatenate([[0.0], np.cumsum(np.maximum(np.round(spacing / step), 1.0))])


def _distance(time: Array, places: Array, slope: float, start: float) -> Array:
    return np.asarray(np.abs(time - start - slope * places) / slope)


def _line(
    time: Array, places: Array, off: Array, digits: float, tolerated: float
) -> tuple[float, float]:
    """Return slope and start of the line through the times, by place."""
    slope = start = 0.0
    for _ in range(2):  # the second time without what is far off
        near = off <= max(tolerated, float(np.quantile(off, 0.9)))
        slope, start = (float(one) for one in np.polyfit(places[near], time[near], 1))
        off = _distance(time, places, slope, start)
    if digits and np.mean(off <= tolerated) < MOSTLY:  # else times are a step off, here and there
        narrow = _narrowest(time, places)
        if np.abs(time - narrow[1] - narrow[0] * places).max() <= ROUNDED * digits:
            return narrow
    return slope, start


def _narrowest(time: Array, places: Array) -> tuple[float, float]:
    """Return slope and start of the line whose largest distance from the times is least.

    Rounding moves no time by more than half a digit, so this line shows whether rounding is all.
    Least squares miss that bound in short runs, and trimmed ones drift in long runs.
    """
    from scipy.optimize import minimize_scalar

    first = float(np.polyfit(places, time, 1)[0])
    flat = time - first * places
    room = 2.0 * float(np.ptp(flat)) / float(places[-1])  # two lines in the band differ by less
    found = minimize_scalar(
        lambda more: float(np.ptp(flat - more * places)), bounds=(-room, room), method="bounded",
        options={"xatol": 1e-4 * room},
    )  # fmt: skip
    rest = flat - found.x * places
    return first + float(found.x), float(rest.min() + rest.max()) / 2.0


MAX_FILLED = 3
"""Samples in a row that are filled by interpolation; a longer gap cuts the measurement."""
_TOLERATED = 0.02  # share of the step by which a time may be off before all is resampled
_MOVED = 0.02  # share of samples that may be off by more before all are interpolated

_TWO_RUNS = 0.6
"""Share of times that are those of the sample before, above which no second run explains them."""
_AROUND = 8
"""Samples on each side that tell how far a channel goes from one to the next."""
_AS_USUAL = 2.0
"""How much further it may go where it goes on."""

_SCALE = "The first row of numbers may be one of scales or ranges: remove it then."

LOST = "lie in no piece"
"""How a note says that samples are not read at all, for too many are missing around them."""


@dataclass(frozen=True)
class Sampling:
    """How a measurement was sampled, and what was done about it.

    `step` [s]; `recorded` samples in the file, `filled` of them made by interpolation; `jitter` the
    largest distance of a time from even spacing, as a share of the step; `digits` [s] the step on
    which the times are written, 0 where none is seen; `resampled` tells whether all samples are
    interpolated.
    """

    step: float
    recorded: int
    filled: int = 0
    jitter: float = 0.0
    digits: float = 0.0
    resampled: bool = False

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1.0 / self.step


@dataclass(frozen=True, eq=False)
class Even:
    """Evenly spaced pieces: per piece, times (n,), channels (n,) and which samples are measured."""

    pieces: list[tuple[Array, dict[str, Array], Flags]]
    sampling: Sampling
    notes: list[str]


def evenly(time: Array, channels: dict[str, Array], lines: Indices, name: str, place: str) -> Even:
    """Return channels at evenly spaced times.

    Parameters
    ----------
    time : (n,) s, as recorded
    channels : name to (n,), NaN where a value is missing
    lines : (n,) where each sample stands in the file
    name, place : the file, and what its `lines` count ("line" or "row"), for messages

    Raises
    ------
    RecordError
        If times go back, or appear twice with different values; if a channel holds no number; if
        no piece of `SHORTEST` samples is left.
    """
    notes: list[str] = []
    time, channels, lines = _in_order(time, channels, lines, name, place, notes)
    for channel, values in channels.items():
        if np.isnan(values).all():
            raise RecordError(
                f"{name}: {channel} has no number. Leave the channel out of all runs, with "
                f"--without {channel} (of bristle study new, or of bristle study channels once "
                "there is a study); or leave this file out, or correct it."
            )
    step = float(np.median(np.diff(time)))
    breaks = np.flatnonzero(np.diff(time) > (MAX_FILLED + 1.5) * step) + 1
    made = [
        _even_stretch(time[part], {key: values[part] for key, values in channels.items()}, step)
        for part in np.split(np.arange(len(time)), breaks)
        if len(part) >= SHORTEST
    ]
    if not made:
        raise RecordError(
            f"{name}: no {SHORTEST} samples follow each other without a gap of more than "
            f"{MAX_FILLED} samples of {_ms(step)}."
        )
    if len(breaks):
        widest = int(np.argmax(np.diff(time)))
        notes.append(
            f"{plural(len(breaks), 'gap')} in time, the longest from "
            f"{time[widest]:.6g} s to {time[widest + 1]:.6g} s: cut there"
        )
    longest = max(made, key=lambda one: len(one.even))
    sampling = Sampling(
        float((longest.even[-1] - longest.even[0]) / (len(longest.even) - 1)), len(time), 0,
        max(one.jitter for one in made), longest.digits, any(one.resampled for one in made),
    )  # fmt: skip
    notes += _grid_notes(made, time, sampling)
    pieces = [piece for one in made for piece in _pieces(one, name, notes)]
    if not pieces:
        missing, scarce = max((np.isnan(y).mean(), channel) for channel, y in channels.items())
        raise RecordError(
            f"{name}: {scarce} has no value in {missing:.0%} of the samples, so that no {SHORTEST} "
            "in a row are left. Record without gaps, or leave the run out."
        )
    kept = sum(len(piece[0]) for piece in pieces)
    filled = sum(int((~good).sum()) for _, _, good in pieces)
    lost = len(time) - (kept - filled)
    if lost > 0 and len(pieces) + len(breaks) > 1:
        notes.append(f"{lost:,} of {len(time):,} samples {LOST} of {SHORTEST} and are left out")
    if filled:
        notes.append(
            f"{filled} samples ({100.0 * filled / kept:.2g} %) were missing, at most {MAX_FILLED} "
            "in a row: filled by interpolation (PCHIP) and marked as not measured"
        )
    return Even(pieces, replace(sampling, filled=filled), notes)


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Samples without a long gap in time, on an even grid; `known` where they are measured."""

    even: Array
    channels: dict[str, Array]
    known: Flags
    jitter: float
    digits: float
    resampled: bool
    moved: int
    sparse: tuple[str, ...]


def _even_stretch(time: Array, channels: dict[str, Array], step: float) -> _Stretch:
    grid, places, jitter, digits = even_grid(time, step, _TOLERATED)
    off = np.abs(time - grid[places]) / step > max(_TOLERATED, ROUNDED * digits / step)
    at = np.where(off, time, grid[places])
    resampled = float(np.mean(off)) > _MOVED or not (np.diff(at) > 0.0).all()
    if resampled:
        count = int(np.floor((time[-1] - time[0]) / step * (1.0 + 1e-12))) + 1
        grid, at = time[0] + step * np.arange(count), time
    out, known, sparse = _on_grid(grid, at, channels, step)
    moved = 0 if resampled else int(off.sum())
    return _Stretch(grid, out, known, jitter, digits, resampled, moved, sparse)


def _grid_notes(made: list[_Stretch], time: Array, sampling: Sampling) -> list[str]:
    notes = []
    if sampling.resampled:
        spacing = np.diff(time)
        notes.append(
            f"spacing varies from {_ms(float(spacing.min()))} to {_ms(float(spacing.max()))}: "
            f"resampled to even {_ms(sampling.step)}, the median, by monotone cubic interpolation "
            "(PCHIP; switched channels keep their last value)"
        )
    elif sampling.jitter > 1e-3:
        moved = sum(one.moved for one in made)
        taken = f", and {moved} samples are moved there by interpolation" if moved else ""
        notes.append(
            f"times are off even spacing by up to {100 * sampling.jitter:.2g} % of "
            f"{_ms(sampling.step)}: taken as even{taken}"
        )
    for channel in dict.fromkeys(channel for one in made for channel in one.sparse):
        notes.append(f"{channel} has fewer samples than the other channels and is interpolated")
    return notes


def _ms(step: float) -> str:
    return f"{1e3 * step:.6g} ms"


def _in_order(
    time: Array,
    channels: dict[str, Array],
    lines: Indices,
    name: str,
    place: str,
    notes: list[str],
) -> tuple[Array, dict[str, Array], Indices]:
    """Return the samples with times that increase; refuse times that go back."""
    there = np.isfinite(time)
    if not there.all():
        first = int(lines[np.argmin(there)])
        notes.append(f"{int((~there).sum())} samples without a time are left out ({place} {first})")
    time, lines = time[there], lines[there]
    channels = {key: values[there] for key, values in channels.items()}
    if len(time) < SHORTEST:
        raise RecordError(
            f"{name}: {len(time)} samples. A measurement has {SHORTEST} at least, and says "
            "something of a damper only when it holds several cycles."
        )
    spacing = np.diff(time)
    back = np.flatnonzero(spacing < 0.0)
    if len(back):
        k = int(back[0])
        # What is advised leads on: there are runs to cut, or channels that go on as on one clock.
        parts = [part for part in np.split(lines, back + 1) if len(part) >= SHORTEST]
        way = [_SCALE] if k == 0 and len(back) == 1 else []
        if len(parts) > 1:
            way.append("If the file holds several runs, --split restart cuts it there.")
        if k and all(goes_on(values, back) for values in channels.values()):
            way.append(
                "All channels go on there: if the time is wrong, --step S, the sampling step in s, "
                "takes its place."
            )
        raise RecordError(
            f"{name}, {place} {lines[k + 1]}: time goes back, from {time[k]:.9g} s to "
            f"{time[k + 1]:.9g} s. {' '.join(way) or 'Times that increase are right.'}"
        )
    double = np.flatnonzero(spacing == 0.0)
    if not len(double):
        return time, channels, lines
    for k in double.tolist():
        same = all(
            values[k] == values[k + 1] or (np.isnan(values[k]) and np.isnan(values[k + 1]))
            for values in channels.values()
        )
        if not same:
            step = plain((time[-1] - time[0]) / (len(time) - 1), 3)
            do = "Channels jump to and fro there: two runs may lie in one file."
            if k == 0 and len(double) == 1:
                do = _SCALE
            elif len(double) > _TWO_RUNS * len(time) or all(
                _one_signal(values, double) for values in channels.values()
            ):
                do = (
                    "If times were written with too few digits, --step S, the sampling step in s "
                    f"(here about {step}), takes their place."
                )
            raise RecordError(
                f"{name}, {place} {lines[k + 1]}: the time {time[k]:.9g} s appears twice with "
                f"different values ({len(double)} such times in all). {do}"
            )
    keep = np.ones(len(time), dtype=bool)
    keep[double + 1] = False
    notes.append(f"{len(double)} samples that repeat the one before are left out")
    return time[keep], {key: values[keep] for key, values in channels.items()}, lines[keep]


def _one_signal(values: Array, double: Indices) -> bool:
    """Return whether a channel moves on through the samples whose times are there twice.

    Without the second of two such samples a channel moves as far, or half as far where all of it
    is noise; two channels that are written by turns move much less.
    """
    own = values[np.isfinite(values)]
    once = np.delete(values, double + 1)
    once = once[np.isfinite(once)]
    return bool(np.abs(np.diff(own)).sum() <= 2.5 * np.abs(np.diff(once)).sum())


def goes_on(values: Array, places: Indices) -> bool:
    """Return whether a channel goes on from samples to those behind them as it does around them.

    Parameters
    ----------
    values : (n,) of the channel, NaN where one is missing
    places : (m,) index of the last sample before each place
    """
    jumps = np.abs(np.diff(values))
    for k in places.tolist():
        around = np.concatenate([jumps[max(k - _AROUND, 0) : k], jumps[k + 1 : k + 1 + _AROUND]])
        usual = float(np.nanmax(around, initial=0.0))
        if jumps[k] > _AS_USUAL * usual + 1e-3 * float(np.nanmax(np.abs(values), initial=0.0)):
            return False
    return True


def _on_grid(
    even: Array, at: Array, channels: dict[str, Array], step: float
) -> tuple[dict[str, Array], Flags, tuple[str, ...]]:
    """Return channels on the grid, which of its samples lie next to measured ones, and which
    channels are written less often than the rest."""
    out: dict[str, Array] = {}
    sparse = []
    known = np.ones(len(even), dtype=bool)
    for channel, values in channels.items():
        finite = np.isfinite(values)
        x, y = at[finite], values[finite]
        if len(x) < 2:
            known[:] = False
            out[channel] = np.zeros(len(even))
            continue
        own = float(np.median(np.diff(x)))
        if own > GAP * step:
            sparse.append(channel)
        known &= covered(even, x, max(own, step))
        out[channel] = y if len(x) == len(even) and np.array_equal(x, even) else between(even, x, y)
    return out, known, tuple(sparse)


def between(even: Array, x: Array, y: Array) -> Array:
    """Return samples between others: switched channels keep their last value, others are curved.

    Parameters
    ----------
    even : (m,) s, the times wanted, evenly spaced
    x, y : (n,) s, increasing, and the samples, finite
    """
    if is_switched(y):
        nearly = even + 1e-6 * (even[1] - even[0])
        last = np.searchsorted(x, nearly, side="right") - 1
        return np.asarray(y[np.clip(last, 0, len(y) - 1)], dtype=float)
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(x, y)(np.clip(even, x[0], x[-1])), dtype=float)


def covered(even: Array, x: Array, step: float) -> Flags:
    """Return which times of a grid are samples, or lie between samples that are no gap apart.

    Parameters
    ----------
    even : (m,) s, the times of the grid
    x : (n,) s, those of the samples
    step : s, their usual spacing
    """
    after = np.searchsorted(x, even - 1e-6 * step)
    before = np.searchsorted(x, even + 1e-6 * step, side="right") - 1
    inside = (before >= 0) & (after < len(x))
    low, high = x[np.clip(before, 0, len(x) - 1)], x[np.clip(after, 0, len(x) - 1)]
    return inside & (high - low <= GAP * step)


def _pieces(
    one: _Stretch, name: str, notes: list[str]
) -> list[tuple[Array, dict[str, Array], Flags]]:
    """Cut a stretch where more than `MAX_FILLED` values in a row are missing, and at its ends."""
    size = len(one.even)
    bounds, gaps = [0], []
    for start, stop in stretches(~one.known).tolist():
        if stop - start > MAX_FILLED or start == 0 or stop == size:
            bounds += [start, stop]
            gaps.append((start, stop))
    bounds.append(size)
    if gaps:
        start, stop = max(gaps, key=lambda gap: gap[1] - gap[0])
        notes.append(
            f"values are missing in {plural(len(gaps), 'place')}, the longest from "
            f"{one.even[start]:.6g} s to {one.even[stop - 1]:.6g} s: cut there"
        )
    return [
        (one.even[a:b], {key: values[a:b] for key, values in one.channels.items()}, one.known[a:b])
        for a, b in zip(bounds[::2], bounds[1::2], strict=True)
        if b - a >= SHORTEST
    ]

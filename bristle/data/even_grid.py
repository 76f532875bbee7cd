"""The even grid that times lie on, which were written with few digits or with some jitter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .table import Array

ROUNDED = 0.51
"""Digits by which rounding may move a time: half of one, and a little for floating point."""

MOSTLY = 0.9
"""Share of times on a grid from which on the others are off it, and not all of them rounded."""


def even_grid(
    time: Array, step: float, tolerated: float
) -> tuple[Array, NDArray[np.int64], float, float]:
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
    for power in range(7):
        unit = 10.0**-power
        if np.abs(time / unit - np.round(time / unit)).max() < 1e-4:
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

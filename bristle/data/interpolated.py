"""A channel that was interpolated to a faster rate before it was stored: it is straight in pieces.

Between two measured samples an interpolated channel lies on a straight line, to the last digit that
was written. No measured signal does so again and again at ever new slopes.
"""

from __future__ import annotations

import numpy as np

from .table import Array

FEWEST = 200
"""Samples from which on a pattern is no accident."""

STRAIGHT = 0.25
"""Share of samples on the line of their neighbours at the least: one of two is on it at twice the
rate, one of ten at 2.2 times, which is not told."""

BENT = 8.0
"""Times the last digit by which the others are off that line, in the middle."""

SLOPES = 30
"""Slopes that differ at the least: a triangle, or coarse steps, have few."""

WHOLE = 0.02
"""How near to a whole number a ratio is that number."""

DIGITS = 12
"""Significant digits beyond which a number is not rounded."""


def interpolated(y: Array) -> float:
    """Return how many samples of a channel come from one measured one, 0 where all were measured.

    Parameters
    ----------
    y : (n,) as stored, evenly spaced and finite
    """
    size = float(np.ptp(y))
    if len(y) < FEWEST or size == 0.0:
        return 0.0
    digit = _last_digit(y, size)
    slope = np.diff(y)
    off = np.abs(np.diff(slope))
    on_line = off <= 2.0 * digit
    moving = np.abs(slope[1:]) > digit
    bent = ~on_line
    if not bent.any() or float(np.mean(on_line & moving)) < STRAIGHT:
        return 0.0
    if float(np.median(off[bent])) < BENT * digit:
        return 0.0
    pieces = slope[1:][bent]
    if len(np.unique(np.round(pieces / max(2.0 * digit, 1e-9 * size)))) < SLOPES:
        return 0.0
    corners = int(bent[0]) + np.count_nonzero(bent[1:] & ~bent[:-1])  # two are bent beside most
    ratio = len(off) / corners
    return float(round(ratio)) if abs(ratio - round(ratio)) < WHOLE else ratio


def _last_digit(y: Array, size: float) -> float:
    """Return the value of the last digit that a channel was written with."""
    top = int(np.floor(np.log10(max(size, float(np.max(np.abs(y)))))))
    for places in range(-top, DIGITS - top):
        unit = 10.0**-places
        if np.all(np.abs(y - np.round(y / unit) * unit) <= 1e-6 * unit):
            return unit
    return float(10.0 ** (top - DIGITS))

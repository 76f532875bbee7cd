"""Planned motions and commands as a rig performs them: smooth, and held before each jump."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from ..data.command_limits import jumps
from .excitation import RATE, Motion, Programme, times

Array = NDArray[np.float64]


def seconds_of(time: Array) -> float:
    """Return how long a run with samples at `time` (n,) s is recorded [s]."""
    return float(np.floor((time[-1] - time[0]) * RATE + 1e-6) / RATE)


def motion_of(time: Array, displacement: Array) -> Motion:
    """Return the motion through planned samples: a spline of order five."""
    spline = make_interp_spline(time - time[0], displacement, k=5)
    first, second = spline.derivative(1), spline.derivative(2)
    return Motion(
        times(seconds_of(time)), lambda q: (float(spline(q)), float(first(q)), float(second(q)))
    )


def ground_of(time: Array, acceleration: Array) -> Array:
    """Return a planned ground acceleration at the recorder's instants (n,), straight between."""
    return np.asarray(np.interp(times(seconds_of(time)), time - time[0], acceleration))


def programme_of(time: Array, command: Array) -> Programme:
    """Return the voltage through planned samples: straight between them, held before a jump.

    A jump comes at the recorder's instant that is nearest to its sample.
    """
    height = np.where(jumps(command), np.diff(command, prepend=command[:1]), 0.0)
    at = np.flatnonzero(height)
    moments = np.round((time[at] - time[0]) * RATE) / RATE
    smooth = (command - np.cumsum(height)).tolist()
    step = (time[-1] - time[0]) / (time.size - 1)
    levels = np.concatenate([[0.0], np.cumsum(height[at])]).tolist()
    edges = moments.tolist()

    def value(now: float) -> float:
        place = min(max(now / step, 0.0), len(smooth) - 1.0)
        k = min(int(place), len(smooth) - 2)
        level = levels[bisect_right(edges, now + 1e-9)]
        return float(smooth[k] + (smooth[k + 1] - smooth[k]) * (place - k) + level)

    return Programme(value, tuple(dict.fromkeys(edges)))

"""A velocity that was computed from the displacement tells nothing of its own.

Its noise is that of the displacement, differentiated, so that the two channels agree in their noise
as two instruments never do; a difference to one side is half a sample early or late as well.

Two questions are asked. `numerical_derivative`, of two columns whose noise nobody knows yet: are
they equal to the digits that were written? `derived_velocity`, of a measurement: do they agree
better than the noise of the displacement lets two instruments agree?
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .measurement import Measurement

Array = NDArray[np.float64]

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

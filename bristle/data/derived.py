"""A velocity that was computed from the displacement tells nothing of its own.

Its noise is that of the displacement, differentiated, so that the two channels agree in their noise
as two instruments never do; a difference to one side is half a sample early or late as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .measurement import Measurement

Array = NDArray[np.float64]

AGREED = 0.1
"""Mismatch of a channel with a difference of the other, as a share of that difference's noise."""

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
    x, v, dt = measurement["displacement"], measurement["velocity"], measurement.step
    noise = measurement.noise.get("displacement", 0.0) / dt
    step = np.diff(x) / dt
    tried = {
        "backward": (v[1:] - step, np.sqrt(2.0)),
        "forward": (v[:-1] - step, np.sqrt(2.0)),
        "central": (v[1:-1] - 0.5 * (step[1:] + step[:-1]), np.sqrt(0.5)),
    }
    for name, (rest, size) in tried.items():
        if _rms(rest[np.isfinite(rest)]) < AGREED * size * noise:
            return name
    return ""


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.inf

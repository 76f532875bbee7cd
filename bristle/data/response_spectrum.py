"""The response spectrum: how hard a motion shakes what stands on it, by its period."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from ..errors import RecordError

DAMPING = 0.05
"""Share of critical damping of the usual spectrum."""
LEAST, MOST, COUNT = 0.05, 5.0, 80
"""The periods [s] of `usual_periods`, and how many there are."""
SAMPLES = 10
"""Samples in the shortest period: between them a peak is at most 5 % higher."""


def usual_periods(step: float) -> Array:
    """Return periods (n,) [s] from 0.05 to 5 s, evenly spaced in their logarithm.

    Parameters
    ----------
    step : time between two samples [s]; periods below ten of them are left out
    """
    periods = np.geomspace(LEAST, MOST, COUNT)
    return periods[periods >= SAMPLES * step * (1.0 - 1e-9)]


def response_spectrum(
    acceleration: Array, step: float, periods: Array, damping: float = DAMPING
) -> Array:
    """Return the peak absolute acceleration of oscillators on a moving base.

    The motion is linear between samples, and each oscillator is solved exactly for that, by the
    ramp-invariant filter of Smallwood (1981), Shock and Vibration Bulletin 51(1), 279-287. It is at
    rest before the first sample.

    Parameters
    ----------
    acceleration : (n,) of the base [m/s2], evenly spaced
    step : between its samples [s]
    periods : (m,) natural periods of the undamped oscillators [s]
    damping : share of critical damping [1], below 1

    Returns
    -------
    (m,) array
        m/s2; at the samples, so that of the shortest periods up to 5 % is missing.

    Raises
    ------
    RecordError
        If a sample is not finite, or a number is out of its range.
    """
    from scipy.signal import lfilter

    motion, wanted = np.asarray(acceleration, dtype=float), np.asarray(periods, dtype=float)
    if motion.ndim != 1 or not len(motion) or not np.isfinite(motion).all():
        raise RecordError("a response spectrum needs a row of finite accelerations.")
    if not (step > 0.0 and 0.0 <= damping < 1.0):
        raise RecordError(
            f"a step of {step:g} s, a damping of {damping:g}; above 0, and from 0 to below 1 are "
            "right."
        )
    if not np.all(wanted >= SAMPLES * step * (1.0 - 1e-9)):
        raise RecordError(
            f"a period of {wanted.min():g} s is too short for samples {step:g} s apart: "
            f"{SAMPLES * step:g} s or more is right."
        )
    return np.array(
        [
            np.max(np.abs(lfilter(*_filter(2.0 * np.pi * step / period, damping), motion)))
            for period in wanted
        ]
    )


def _filter(turn: float, damping: float) -> tuple[list[float], list[float]]:
    """Return numerator and denominator for a turn of the oscillator per step [rad]."""
    swing = turn * np.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * turn)
    c, s = decay * np.cos(swing), decay * np.sin(swing) / swing
    return [1.0 - s, 2.0 * (s - c), decay**2 - s], [1.0, -2.0 * c, decay**2]

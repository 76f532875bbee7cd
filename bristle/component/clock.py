"""A clock of its own: which samples a step ends on or passes, and what is measured at them.

A sample is taken when a step ends on or passes its instant, from the inputs as they stand at that
step. Between samples the outputs stand.
"""

from __future__ import annotations

from math import ceil, floor

from ..physics.linear import Row

ORIGIN, COMING = -2, -1
"""What the state of a sampled component holds last: time of sample 0 [s], number of the next."""

ROUNDING = 1e-6
"""Share of a sample period by which a step's end may miss an instant."""

MOST_SAMPLES = 1_000_000
"""Samples in one step beyond which the step is taken for a mistake."""

LONG_STEP = 1
"""The step is longer than the sample period."""

TOO_MANY_SAMPLES = -1
"""The step holds more than `MOST_SAMPLES`."""


def first_sample(time: float, period: float, origin: float, coming: float) -> int:
    """Return the number of the first sample that a step takes.

    Parameters
    ----------
    time : begin of the step [s]
    period : time between two samples [s]
    origin : time of sample 0 [s]
    coming : number of the next sample [1]; no sample before it is taken again
    """
    return max(int(coming), ceil((time - origin) / period - ROUNDING))


def last_sample(end: float, period: float, origin: float) -> int:
    """Return the last sample [1] up to the time `end` [s]."""
    return floor((end - origin) / period + ROUNDING)


def step_code(dt: float, period: float, samples: float) -> int:
    """Return what is to be said of a step of dt [s] that takes so many samples."""
    if samples > MOST_SAMPLES:
        return TOO_MANY_SAMPLES
    return LONG_STEP if dt > period * (1.0 + ROUNDING) else 0


def measure(instant: float, dt: float, period: float, before: Row, now: Row, measured: Row) -> None:
    """Fill `measured` with the inputs at an instant of a step, linear over it.

    At the step's end they are those now, to the last digit.

    Parameters
    ----------
    instant : time since the start of the step [s]
    dt, period : length of the step and time between two samples [s]
    before, now : (m,) inputs at begin and end, each in its own unit
    measured : (m,) filled
    """
    share = instant / dt
    if share > 1.0 - ROUNDING * period / dt:
        for i in range(len(now)):
            measured[i] = now[i]
    else:
        share = max(share, 0.0)
        for i in range(len(now)):
            measured[i] = before[i] + share * (now[i] - before[i])

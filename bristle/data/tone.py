"""Frequency and amplitude of a motion, as far as it has one of each."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, log, pi
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.text import quantity
from .channels import Labels, label_text
from .measurement import Measurement
from .relation import band, differentiated

_TURNED = 0.3  # of half the range that a motion must pass on either side of its middle
_EVEN = 0.1  # share by which a period may differ from the middle one
_MOST = 0.8  # share of the periods that must not
_MIN_SAMPLES = 40  # samples

SAME = 1.2
"""Ratio within which a frequency that is stated and a measured one are the same."""

ROUGH = 4.0
"""The same where a motion has no single frequency."""

FAR = 8.0
"""Ratio from which a stated frequency contradicts such a motion."""

FULLY = 1.7
"""The same for an amplitude, which a rig need not reach, or its double, the stroke."""

TOLD = (1.0, 2.0)
"""Of how many amplitudes what is stated may be: an amplitude, or a stroke."""


class Tone(NamedTuple):
    """What a motion does: its `frequency` [Hz] and its `amplitude` [m].

    `even` tells whether it goes back and forth evenly, as a sine or a triangle; else the frequency
    is that of a sine with the same RMS of displacement and velocity.
    """

    frequency: float
    amplitude: float
    even: bool


def tone_of(run: Measurement) -> Tone | None:
    """Return the tone of a run on a bench; None where nothing moves, or motion is not measured."""
    if run.has("displacement"):
        return tone(run["displacement"], run.step)
    if run.has("velocity"):
        found = tone(run["velocity"], run.step)
        if found is not None:
            return found._replace(amplitude=found.amplitude / (2.0 * pi * found.frequency))
    return None


def tone(y: Array, step: float) -> Tone | None:
    """Return the tone of a signal (n,) that is sampled every `step` [s]; None where it rests."""
    low, high = (float(one) for one in np.quantile(y, [0.005, 0.995]))
    half = 0.5 * (high - low)
    if not half > 0.0 or len(y) < _MIN_SAMPLES:
        return None
    away = (y - 0.5 * (high + low)) / half
    sides = np.where(away > _TURNED, 1, np.where(away < -_TURNED, -1, 0))
    there = np.flatnonzero(sides)
    rises = there[1:][np.diff(sides[there]) > 0]
    periods = np.diff(rises) * step
    if len(periods) > 1:
        usual = float(np.median(periods))
        even = np.abs(periods - usual) <= max(_EVEN * usual, 1.5 * step)
        if np.mean(even) >= _MOST:
            return Tone(1.0 / float(np.mean(periods[even])), half, True)
    velocity = differentiated(y, step, min(band(y, step), 0.2 / step))
    frequency = float(np.std(velocity) / np.std(y)) / (2.0 * pi)
    return Tone(frequency, half, False) if frequency > 0.0 else None


def frequency_off(stated: float, found: Tone) -> float:
    """Return how far a stated frequency [Hz] is off, as a logarithm; infinite where it is 0."""
    return abs(log(stated / found.frequency)) if stated > 0.0 else inf


def amplitude_off(stated: float, found: Tone, told: Sequence[float] = TOLD) -> float:
    """Return how far a stated amplitude or stroke [m] is off, as a logarithm.

    Parameters
    ----------
    stated, found : what is told of a motion, and what it does
    told : how many amplitudes it may be
    """
    if not stated > 0.0:
        return inf
    return min(abs(log(stated / (times * found.amplitude))) for times in told)


def frequency_fits(stated: float, found: Tone) -> bool:
    """Return whether a frequency that is stated [Hz] can be that of a motion."""
    return frequency_off(stated, found) <= log(SAME if found.even else ROUGH)


def amplitude_fits(stated: float, found: Tone, told: Sequence[float] = TOLD) -> bool:
    """Return whether an amplitude that is stated [m] can be that of a motion, or its stroke."""
    return amplitude_off(stated, found, told) <= log(FULLY)


def times_told(labels: Sequence[Labels], found: Sequence[Tone | None]) -> float:
    """Return of how many amplitudes those that runs are labelled with are: 1, or 2 for strokes.

    All of a campaign are told in one way.

    Parameters
    ----------
    labels, found : (n,) of the runs, None where a motion is not known
    """
    known = [
        (size, tone)
        for one, tone in zip(labels, found, strict=True)
        if tone is not None and isinstance(size := one.get("amplitude"), float)
    ]
    return max(TOLD, key=lambda times: sum(amplitude_fits(*one, (times,)) for one in known))


def label_doubts(labels: Sequence[Labels], found: Sequence[Tone | None]) -> list[str]:
    """Return which labels of each run its motion contradicts, in words; "" where none.

    Parameters
    ----------
    labels, found : (n,) of the runs, None where a motion is not known
    """
    told = times_told(labels, found)
    return [
        "" if tone is None else _label_doubt(one, tone, told)
        for one, tone in zip(labels, found, strict=True)
    ]


def _label_doubt(labels: Labels, found: Tone, told: float) -> str:
    frequency, amplitude = labels.get("frequency"), labels.get("amplitude")
    wrong = []
    most = SAME if found.even else FAR
    slow = frequency == 0.0 and not found.even  # a ramp is called 0 Hz
    if isinstance(frequency, float) and not slow and frequency_off(frequency, found) > log(most):
        wrong.append(
            f"frequency is {label_text('frequency', frequency)} by its label, and the motion has "
            f"{'' if found.even else 'about '}{quantity(found.frequency, 'Hz', 3)}"
        )
    if isinstance(amplitude, float) and not amplitude_fits(amplitude, found, (told,)):
        wrong.append(
            f"amplitude is {label_text('amplitude', amplitude)} by its label, and the motion has "
            f"{quantity(found.amplitude, 'm', 3, fine=True)}"
        )
    return "; ".join(wrong)

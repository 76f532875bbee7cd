"""Synthetic ground motions for a training: of many kinds, so that no one kind is learnt."""

from __future__ import annotations

from math import log

import numpy as np

from bristle.core.arrays import Array
from bristle.data.ground_motion import GroundMotion

SECONDS = 10.0
"""Length of a motion of the training."""
_STEP, _WHOLE = 0.005, 16.0


def synthetic(random: np.random.Generator, h: float) -> Array:
    """Return a ground acceleration (N,) at 0, h, ... with the peak 1.

    White noise is filtered by a layer of ground (Kanai 1957, Tajimi 1960) with a high-pass (Clough
    & Penzien), under an envelope that swells and fades. Half of the motions carry a near-fault
    pulse after Mavroeidis & Papageorgiou (2003), Bull. Seism. Soc. Am. 93(3).

    Parameters
    ----------
    random : generator of the draws
    h : step [s]
    """
    t: Array = np.arange(round(_WHOLE / _STEP)) * np.float64(_STEP)
    a = _filtered(random, t) * _envelope(random, t)
    a /= np.abs(a).max()
    if random.random() < 0.5:
        a = a * random.uniform(0.2, 0.9) + _pulse(random, t)
        a /= np.abs(a).max()
    found: Array = np.interp(np.arange(round(SECONDS / h) + 1) * h, t, a)
    return found


def at_samples(motion: GroundMotion, h: float) -> Array:
    """Return a record (N,) at 0, h, ... with the peak 1; it ends with its strong part."""
    t = motion.time - motion.time[0]
    square = np.cumsum(np.square(motion.acceleration[1:]) * np.diff(t))
    strong = t[1 + int(np.searchsorted(square, 0.95 * square[-1]))]
    grid = np.arange(round(min(strong + 2.0, t[-1]) / h) + 1) * h
    found: Array = np.interp(grid, t, motion.acceleration / motion.peak)
    return found


def _between(random: np.random.Generator, low: float, high: float) -> float:
    """Return a draw that is even over the logarithm."""
    return float(np.exp(random.uniform(log(low), log(high))))


def _filtered(random: np.random.Generator, t: Array) -> Array:
    w = 2.0 * np.pi * np.fft.rfftfreq(len(t), _STEP)
    s = 1j * w / _between(random, 6.0, 40.0)
    damping = random.uniform(0.25, 0.9)
    gain = (1.0 + 2.0 * damping * s) / (1.0 + 2.0 * damping * s + s**2)
    low = w / random.uniform(0.7, 3.0)
    gain *= low**2 / (1.0 - low**2 + 1.4j * low)
    gain /= 1.0 + (w / (2.0 * np.pi * random.uniform(6.0, 20.0))) ** 4
    found: Array = np.fft.irfft(np.fft.rfft(random.standard_normal(len(t))) * gain, len(t))
    return found


def _envelope(random: np.random.Generator, t: Array) -> Array:
    rise = random.uniform(0.7, 2.5)
    fall, fading = rise + random.uniform(2.0, 6.0), random.uniform(1.0, 3.0)
    shape = np.where(t < fall, np.minimum(t / rise, 1.0) ** 2, np.exp((fall - t) / fading))
    swell, period, phase = random.uniform((0.0, 1.5, 0.0), (0.8, 5.0, 2.0 * np.pi))
    found: Array = shape * np.exp(swell * np.cos(2.0 * np.pi * t / period + phase))
    return found


def _pulse(random: np.random.Generator, t: Array) -> Array:
    period, cycles = _between(random, 0.35, 2.5), random.uniform(1.0, 2.5)
    at, phase = t - random.uniform(2.0, 4.5), random.uniform(0.0, 2.0 * np.pi)
    bell = 0.5 * (1.0 + np.cos(2.0 * np.pi * at / (cycles * period)))
    bell[np.abs(at) >= cycles * period / 2.0] = 0.0
    found: Array = bell * np.cos(2.0 * np.pi * at / period + phase)
    return found

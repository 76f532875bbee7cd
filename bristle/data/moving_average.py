"""A channel that was averaged over some samples before it was stored, told from its spectrum.

The mean of L samples has the gain |sin(pi L f dt) / (L sin(pi f dt))|: it is zero at every multiple
of 1/(L dt), whatever was averaged, motion, jumps or noise. No other filter has nulls at equal
distances up to half the sampling rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .noise import is_switched
from .table import Array

FEWEST = 1000
"""Samples from which on a spectrum is fine enough."""

SHORTEST = 3
"""Samples of an average whose null lies below half the sampling rate."""

_BETA = 14.0  # of the Kaiser window: 100 dB, deeper than a null
_BINS = 15  # whose lower third is one point of the spectrum: a periodic test has lines between
_QUANTILE = 0.3
_POINTS = 8  # between two nulls at the least
_BEGIN = 2.0  # times the band of a channel's own power from which on its spectrum is looked at
_BAND = 0.995  # share of that power
_DEGREE = 5  # of the polynomial that the rest of the spectrum is taken for, in log power
_FLOORS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)  # of what came on top behind the average, over a lobe
_EXPLAINED = 0.5  # share of the variance that the nulls must explain at the least
_TEETH = 12  # multiples of a periodic test's frequency that the nulls may not be
_PERIODIC = 0.5  # share of a channel's power in one line from which on it is periodic
_GAIN = 40.0  # log-likelihood, twice, that they must gain
_DEPTH = 1.2  # natural logarithm of power by which each null is below the lobes beside it


@dataclass(frozen=True)
class MovingAverage:
    """A mean of `length` samples, `nulls` of which were seen in the spectrum."""

    length: int
    nulls: int


def moving_average(y: Array, step: float) -> MovingAverage | None:
    """Return the moving average that a channel went through, None where none is seen.

    Parameters
    ----------
    y : (n,) as stored, evenly spaced and finite
    step : s
    """
    if len(y) < FEWEST or float(np.ptp(y)) == 0.0 or is_switched(y):
        return None
    frequency, level = _points(y)  # in samples^-1
    inside = frequency > _begin(y)
    if np.count_nonzero(inside) < 2 * _POINTS:
        return None
    frequency, level = frequency[inside], level[inside]
    spacing = float(frequency[1] - frequency[0])
    longest = int(1.0 / (_POINTS * spacing))
    polynomials = np.polynomial.chebyshev.chebvander(_scaled(frequency), _DEGREE)
    smooth = np.linalg.qr(polynomials)[0]
    plain = float(_left(smooth, level[:, None])[0])
    best, least = 0, plain
    for length in range(SHORTEST, longest + 1):
        left = float(np.min(_left(smooth, level[:, None] - _shapes(frequency, length))))
        if left < least:
            best, least = length, left
    if not best or least > (1.0 - _EXPLAINED) * plain:
        return None
    if len(level) * np.log(plain / least) < _GAIN or _is_comb(y, best):
        return None
    nulls = _depths(frequency, level, best)
    if len(nulls) < _fewest_nulls(best) or min(nulls) < _DEPTH:
        return None
    return MovingAverage(best, len(nulls))


def _fewest_nulls(length: int) -> int:
    """Return how many nulls must be seen: all that there are, two at the most."""
    return min(2, (length - 1) // 2)


def _is_comb(y: Array, length: int) -> bool:
    """Return whether nulls lie where a periodic channel has gaps between its harmonics."""
    power = np.abs(np.fft.rfft((y - np.mean(y)) * np.hanning(len(y)))) ** 2
    k = int(np.argmax(power))
    periodic = float(np.sum(power[max(k - 2, 0) : k + 3])) > _PERIODIC * float(np.sum(power))
    if not periodic or k == 0:
        return False
    order = len(y) / (length * k)
    return order < _TEETH and abs(order - max(round(order), 1)) < 0.1


def _points(y: Array) -> tuple[Array, Array]:
    """Return frequencies [1/sample] and the logarithm of the power there, from several bins."""
    window = np.kaiser(len(y), _BETA)
    power = np.abs(np.fft.rfft((y - np.mean(y)) * window)) ** 2
    power = np.maximum(power, 1e-24 * float(power.max()))
    count = len(power) // _BINS
    groups = np.log(power[: count * _BINS]).reshape(count, _BINS)
    at = (np.arange(count) * _BINS + 0.5 * (_BINS - 1)) / len(y)
    return at, np.quantile(groups, _QUANTILE, axis=1)


def _begin(y: Array) -> float:
    """Return the frequency [1/sample] from which on a spectrum has a simple shape."""
    power = np.abs(np.fft.rfft((y - np.mean(y)) * np.hanning(len(y)))) ** 2
    total = np.cumsum(power)
    return _BEGIN * float(np.searchsorted(total, _BAND * total[-1])) / len(y)


def _scaled(frequency: Array) -> Array:
    low, high = float(frequency[0]), float(frequency[-1])
    return np.asarray(2.0 * (frequency - low) / (high - low) - 1.0, dtype=float)


def _shapes(frequency: Array, length: int) -> Array:
    """Return the logarithm of an average's power gain (m, f) over what came on top behind it.

    Parameters
    ----------
    frequency : (m,) 1/sample
    length : samples; f is the number of `_FLOORS`
    """
    gain = np.sin(np.pi * length * frequency) / (length * np.sin(np.pi * frequency))
    floor = np.array(_FLOORS) / length**2
    return np.asarray(np.log(gain[:, None] ** 2 + floor), dtype=float)


def _left(smooth: Array, levels: Array) -> Array:
    """Return the mean squares (f,) that a smooth spectrum leaves of levels (m, f).

    `smooth` (m, d) are orthonormal shapes of such a spectrum.
    """
    return np.asarray(np.mean((levels - smooth @ (smooth.T @ levels)) ** 2, axis=0), dtype=float)


def _depths(frequency: Array, level: Array, length: int) -> list[float]:
    """Return by how much each null lies below the lower one of the lobes beside it."""
    out = []
    for k in range(1, (length - 1) // 2 + 1):
        apart = np.abs(frequency * length - k)
        null = level[apart < 0.12]
        lobes = [level[np.abs(frequency * length - k - side) < 0.2] for side in (-0.5, 0.5)]
        if len(null) and all(map(len, lobes)):
            out.append(min(float(np.mean(one)) for one in lobes) - float(np.min(null)))
    return out

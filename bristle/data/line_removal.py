"""A sinusoid taken off a channel, all else left as it is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .table import Array

Complex = NDArray[np.complex128]

_SLOW = 40.0  # Hz; what is slower is taken off before the jumps of a force are cut down
_CUT = 4.0  # standard deviations, told from the median, at which they are cut
_HALF_PIECE = 5.0  # s, half of a piece in which a sinusoid keeps its amplitude
BETA = 14.0  # of the Kaiser window: 100 dB, so that no motion leaks to where lines are looked for


def without_lines(y: Array, step: float, frequencies: Sequence[float]) -> Array:
    """Return a channel without lines: the sinusoids that fit it best are taken off.

    The sinusoid is fitted in pieces of ten seconds that overlap, so that it may drift. All else
    that the channel holds stays, at other frequencies to 0.1 Hz.

    Parameters
    ----------
    y : (n,) evenly spaced
    step : s
    frequencies : Hz
    """
    out = np.array(y, dtype=float)
    time = step * np.arange(len(y))
    for frequency in frequencies:
        wave = np.exp(2j * np.pi * frequency * time)
        out -= np.real(drifting_amplitude(out, step, frequency) * wave)
    return out


def drifting_amplitude(y: Array, step: float, frequency: float) -> Complex:
    """Return the complex amplitude (n,) of a sinusoid in a channel, told where it does not jump.

    It is linear between the middles of pieces of ten seconds that overlap by half.

    Parameters
    ----------
    y : (n,) evenly spaced
    step : s
    frequency : Hz
    """
    fast, most = without_slow(y, step)
    wave = np.exp(2j * np.pi * frequency * step * np.arange(len(y)))
    weight = (np.abs(fast) <= most).astype(float)
    n, half = len(y), max(round(_HALF_PIECE / step), 2)
    centres = np.linspace(0.0, n - 1.0, max(n // half - 1, 1)) if n > 2 * half else np.zeros(1)
    begins = [int(np.clip(centre - half, 0, max(n - 2 * half, 0))) for centre in centres]
    parts = [slice(begin, begin + 2 * half) for begin in begins]
    found = [amplitude_of(fast[part], wave[part], weight[part]) for part in parts]
    at = np.arange(n)
    real, imaginary = (np.interp(at, centres, of(found)) for of in (np.real, np.imag))
    return np.asarray((real + 1j * imaginary) / _passed(frequency, step), dtype=complex)


def amplitude_of(y: Array, wave: Complex, weight: Array | float = 1.0) -> complex:
    """Return the complex amplitude of a wave (n,) in y (n,): y = Re(amplitude wave).

    Under a Kaiser window, so that motions far below do not leak in; samples may have a weight (n,).
    """
    window = weight * np.kaiser(len(y), BETA)
    return complex(2.0 * np.sum(window * y * np.conj(wave)) / max(float(np.sum(window)), 1e-300))


def without_slow(y: Array, step: float) -> tuple[Array, float]:
    """Return a channel (n,) without what is slow, and the size at which its jumps are cut down."""
    fast = np.asarray(y - _slow(y, step), dtype=float)
    most = _CUT * 1.4826 * float(np.median(np.abs(fast)))
    return fast, most or float(np.max(np.abs(fast)))


def _slow(y: Array, step: float) -> Array:
    """Return the mean of a channel (n,) about each sample, weighted by a Hann window."""
    half = max(round(1.0 / (_SLOW * step)), 2)
    taps = np.hanning(2 * half + 1)[1:-1]
    padded = np.pad(y, half - 1, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(padded, taps / taps.sum(), "valid"), dtype=float)


def _passed(frequency: float, step: float) -> float:
    """Return what `without_slow` leaves of a line's amplitude."""
    half = max(round(1.0 / (_SLOW * step)), 2)
    taps = np.hanning(2 * half + 1)[1:-1]
    turns = np.cos(2.0 * np.pi * frequency * step * np.arange(1 - half, half))
    return 1.0 - float(taps @ turns) / float(taps.sum())

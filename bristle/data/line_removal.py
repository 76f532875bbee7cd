"""A sinusoid taken off a channel, all else left as it is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .table import Array

Complex = NDArray[np.complex128]

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
        out -= np.real(_drifting(out, wave, max(round(5.0 / step), 2)) * wave)
    return out


def _drifting(y: Array, wave: Complex, half: int) -> Complex:
    """Return the complex amplitude (n,) of a wave (n,) in y, linear between pieces of 2 `half`."""
    n = len(y)
    centres = np.linspace(0.0, n - 1.0, max(n // half, 1) + 1)
    found = []
    for centre in centres:
        part = slice(max(int(centre) - half, 0), int(centre) + half + 1)
        if centre < half:
            part = slice(0, min(2 * half, n))
        elif centre > n - 1 - half:
            part = slice(max(n - 2 * half, 0), n)
        found.append(amplitude_of(y[part], wave[part]))
    at = np.arange(n)
    real = np.interp(at, centres, np.real(found))
    return np.asarray(real + 1j * np.interp(at, centres, np.imag(found)), dtype=complex)


def amplitude_of(y: Array, wave: Complex) -> complex:
    """Return the complex amplitude of a wave (n,) in y (n,): y = Re(amplitude wave).

    Under a Kaiser window, so that motions far below do not leak in.
    """
    window = np.kaiser(len(y), BETA)
    return complex(2.0 * np.sum(window * y * np.conj(wave)) / np.sum(window))

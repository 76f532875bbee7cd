"""Fewer samples where there are more than a fit needs, behind an anti-alias filter."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..quantity import plain
from .noise import SHORTEST, is_switched
from .sampling import Even
from .table import Array

RATE = 500.0
"""Samples per second [Hz] that a fit needs: motion and force of a damper lie far below half."""

FAST = 2.0
"""Times that rate from which samples are left out: only whole numbers of them can be."""

_TAPS = 20  # of the filter per sample that is kept
_BETA = 5.0  # of its Kaiser window: 50 dB of what would be folded back
_HALF_POWER = 1.05  # its corner over half the new rate: white noise stays white when it folds


def decimated(even: Even, rate: float) -> tuple[Even, list[str]]:
    """Return evenly spaced pieces with fewer samples, and what was done about it.

    Switched channels keep every so many values; the others go through a linear-phase low-pass, so
    that nothing is delayed. A sample counts as measured where all are that it mostly consists of.

    Parameters
    ----------
    even : as recorded
    rate : Hz that is enough; 0 leaves all as it is

    Raises
    ------
    RecordError
        If too few samples would be left.
    """
    recorded = even.sampling.rate
    if rate <= 0.0 or recorded < FAST * rate * (1.0 - 1e-6):
        return even, []
    every = int(recorded / rate + 1e-6)
    pieces = [
        (
            time[::every],
            {name: _fewer(y, every) for name, y in channels.items()},
            _all_within(measured, every)[::every],
        )
        for time, channels, measured in even.pieces
        if len(time) // every >= SHORTEST
    ]
    if not pieces:
        raise RecordError(
            f"at {plain(rate)} Hz fewer than {SHORTEST} samples would be left; a lower rate than "
            f"the recorded {plain(recorded, 4)} Hz needs longer runs. Take rate out of study.toml."
        )
    step = even.sampling.step * every
    note = (
        f"decimated from {plain(recorded, 4)} Hz to {plain(1.0 / step, 4)} Hz behind an anti-alias "
        f"filter (linear phase, half power at {plain(0.5 / step, 4)} Hz)"
    )
    return Even(pieces, replace(even.sampling, step=step), even.notes), [note]


def _fewer(y: Array, every: int) -> Array:
    """Return every so many samples of a channel (n,), low-passed first if it is not switched."""
    if is_switched(y):
        return y[::every].copy()
    taps = _filter(every)
    half = min(len(taps) // 2, len(y) - 1)
    taps = taps[len(taps) // 2 - half : len(taps) // 2 + half + 1]
    # The signal goes on point-symmetrically, so that it has no step at its ends.
    padded = np.concatenate([2.0 * y[0] - y[half:0:-1], y, 2.0 * y[-1] - y[-2 : -half - 2 : -1]])
    from scipy.signal import fftconvolve

    return np.asarray(fftconvolve(padded, taps / taps.sum(), "valid")[::every], dtype=float)


@cache
def _filter(every: int) -> Array:
    from scipy.signal import firwin

    taps = firwin(_TAPS * every + 1, _HALF_POWER / every, window=("kaiser", _BETA))
    return np.asarray(taps, dtype=float)


def _all_within(measured: NDArray[np.bool_], every: int) -> NDArray[np.bool_]:
    """Return where all samples nearer than one that is kept were measured."""
    from scipy.ndimage import minimum_filter

    return np.asarray(minimum_filter(measured, 2 * every - 1, mode="nearest"), dtype=bool)

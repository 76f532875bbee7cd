"""Fewer samples where there are more than a fit needs, behind an anti-alias filter.

A motion is smooth: a long filter takes what would be folded back, and leaves the motion. A force
jumps where the motion turns or the command switches, and so do accelerations; a long filter would
ring there. They get a filter as short as the new step, and a model's force gets the same: see
`data.finer`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..quantity import plain
from .channels import DRIVE, is_smooth
from .finer import MOST, hann
from .noise import SHORTEST, Noise, estimate_noise, is_switched
from .sampling import Even
from .table import Array
from .timing import InTime

Flags = NDArray[np.bool_]

RATE = 500.0
"""Samples per second [Hz] that a fit needs: motion and force of a damper lie far below half."""

FAST = 2.0
"""Times that rate from which samples are left out: only whole numbers of them can be."""

_TAPS = 20  # of the long filter per sample that is kept
_BETA = 5.0  # of its Kaiser window: 50 dB of what would be folded back
_HALF_POWER = 1.05  # its corner over half the new rate: white noise stays white when it folds
_NONE = np.ones(1)


@dataclass(frozen=True, eq=False)
class Decimated:
    """Pieces with fewer samples.

    `parts` and, by command, `since` of each piece are those of `data.finer.Finer`; 1 and nothing
    where no sample was left out. `lost` of each piece says where the record of a channel that was
    moved in time holds nothing. `gain` is by channel what filter and interpolation leave of white
    noise, where there was one; `noise` of each piece that before them.
    `notes` says what was done, none where nothing was.
    """

    even: Even
    lost: Sequence[Mapping[str, Flags]]
    gain: Mapping[str, float] = field(default_factory=dict)
    noise: Sequence[Mapping[str, Noise]] = ()
    parts: int = 1
    since: Sequence[Mapping[str, Array]] = ()
    notes: tuple[str, ...] = ()


def decimated(even: Even, rate: float, moved: Sequence[InTime] = ()) -> Decimated:
    """Return evenly spaced pieces with fewer samples, and what was done about it.

    Commands keep every so many values, for they switch. The others go through a linear-phase
    low-pass, so that nothing is delayed. A sample counts as measured where all are that it mostly
    consists of.

    Parameters
    ----------
    even : as recorded
    rate : Hz that is enough; 0 leaves all as it is
    moved : of each piece, what is known of its channels that were moved in time

    Raises
    ------
    RecordError
        If too few samples would be left.
    """
    recorded = even.sampling.rate
    moved = moved or [InTime(channels) for _, channels, _ in even.pieces]
    if rate <= 0.0 or recorded < FAST * rate * (1.0 - 1e-6):
        left = {name: one.noise_left(name) for one in moved for name in one.between}
        lost, noise_before = [one.lost for one in moved], [one.noise for one in moved]
        return Decimated(even, lost, left, noise_before, since=[{} for _ in moved])
    every, parts = _thinning(recorded / rate)
    pieces, since, noise = [], [], []
    ended: list[dict[str, Flags]] = []
    gain: dict[str, float] = {}
    for (time, channels, measured), shift in zip(even.pieces, moved, strict=True):
        if len(time) // every < SHORTEST:
            continue
        taps = {name: _taps(name, y, every) for name, y in channels.items()}
        kept = {name: _filtered(y, taps[name])[::every].copy() for name, y in channels.items()}
        pieces.append((time[::every], kept, _all_within(measured, every)[::every]))
        commands = {name: y for name, y in channels.items() if name.endswith(DRIVE)}
        rest = {name: y for name, y in channels.items() if name not in commands}
        noise.append({n: shift.noise.get(n) or estimate_noise(y) for n, y in rest.items()})
        since.append({name: _since(y, every, parts) for name, y in commands.items()})
        ended.append(
            {name: ~_all_within(~flags, every)[::every] for name, flags in shift.lost.items()}
        )
        gain |= {name: shift.noise_left(name, own) for name, own in taps.items()}
    if not pieces:
        raise RecordError(
            f"at {plain(rate)} Hz fewer than {SHORTEST} samples would be left of "
            f"{plain(recorded, 4)} Hz: take rate out of study.toml, or measure longer."
        )
    step = even.sampling.step * every
    note = (
        f"decimated from {plain(recorded, 4)} Hz to {plain(1.0 / step, 4)} Hz behind an anti-alias "
        "filter (linear phase)"
    )
    return Decimated(
        Even(pieces, replace(even.sampling, step=step), even.notes), ended, gain, noise, parts,
        since, (note,),
    )  # fmt: skip


def _thinning(most: float) -> tuple[int, int]:
    """Return of how many samples one is kept, no more than `most`, and the parts of the new step.

    The parts are those in which a model is evaluated: whole numbers of samples as recorded.
    """
    every = int(most + 1e-6)
    recorded = -(-every // MOST)
    return every // recorded * recorded, every // recorded


def _since(V: Array, every: int, parts: int) -> Array:
    """Return at how many moments up to each kept sample (n,) a command is nearer to it than before.

    Parameters
    ----------
    V : the command as recorded
    every : one sample of so many is kept
    parts : moments per kept sample
    """
    kept = V[::every]
    rows = V[1 : every * (len(kept) - 1) + 1].reshape(-1, every)
    nearer = np.abs(rows - kept[1:, None]) < np.abs(rows - kept[:-1, None])
    count = np.append(1, np.maximum(nearer.sum(axis=1), 1))
    # A moment stands for the samples about it.
    return np.asarray((count - 0.5) * parts / every + 0.5)


def _taps(name: str, y: Array, every: int) -> Array:
    """Return the filter of a channel: long for a motion, short for what jumps, none for a command.

    Parameters
    ----------
    name, y : the channel and its samples (n,)
    every : one sample of so many is kept
    """
    if name.endswith(DRIVE):
        return _NONE
    if is_smooth(name):
        return _NONE if is_switched(y) else _long(every)
    return hann(every)


def _filtered(y: Array, taps: Array) -> Array:
    """Return a channel (n,) behind a filter; it goes on point-symmetrically at its ends."""
    if len(taps) == 1:
        return y
    from scipy.signal import fftconvolve

    half = min(len(taps) // 2, len(y) - 1)
    taps = taps[len(taps) // 2 - half : len(taps) // 2 + half + 1]
    padded = np.concatenate([2.0 * y[0] - y[half:0:-1], y, 2.0 * y[-1] - y[-2 : -half - 2 : -1]])
    return np.asarray(fftconvolve(padded, taps / taps.sum(), "valid"), dtype=float)


@cache
def _long(every: int) -> Array:
    from scipy.signal import firwin

    taps = firwin(_TAPS * every + 1, _HALF_POWER / every, window=("kaiser", _BETA))
    return np.asarray(taps, dtype=float)


def _all_within(measured: Flags, every: int) -> Flags:
    """Return where all samples nearer than one that is kept were measured."""
    from scipy.ndimage import minimum_filter

    return np.asarray(minimum_filter(measured, 2 * every - 1, mode="nearest"), dtype=bool)

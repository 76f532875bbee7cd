"""Fewer samples where there are more than a fit needs, behind an anti-alias filter.

A motion is smooth: a long filter takes what would be folded back, and leaves the motion. A force
jumps where the motion turns or the command switches, and so do accelerations; a long filter would
ring there, and a model that jumps as it should would be wrong. They get a filter as short as the
new step, and a sample whose neighbours jump is not judged.
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
_JUMPS = 4.0  # standard deviations by which samples about one leave a line where they jump


@dataclass(frozen=True, eq=False)
class Decimated:
    """Pieces with fewer samples; `jumps` of each says by channel where a force jumps (n,).

    `lost` of each piece says where the record of a channel that was moved in time holds nothing.
    `gain` is by channel what filter and interpolation leave of white noise, where there was one;
    `noise` of each piece that before them, of channels whose noise is not white behind them.
    `notes` says what was done, none where nothing was.
    """

    even: Even
    jumps: list[Mapping[str, Flags]]
    lost: list[Mapping[str, Flags]]
    gain: Mapping[str, float] = field(default_factory=dict)
    noise: list[Mapping[str, Noise]] = field(default_factory=list)
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
        none: list[Mapping[str, Flags]] = [{} for _ in moved]
        lost: list[Mapping[str, Flags]] = [one.lost for one in moved]
        return Decimated(even, none, lost, left, [one.noise for one in moved])
    every = int(recorded / rate + 1e-6)
    pieces, jumps, noise = [], [], []
    ended: list[Mapping[str, Flags]] = []
    gain: dict[str, float] = {}
    for (time, channels, measured), shift in zip(even.pieces, moved, strict=True):
        if len(time) // every < SHORTEST:
            continue
        taps = {name: _taps(name, y, every) for name, y in channels.items()}
        kept = {name: _filtered(y, taps[name])[::every].copy() for name, y in channels.items()}
        pieces.append((time[::every], kept, _all_within(measured, every)[::every]))
        short = {name: channels[name] for name, own in taps.items() if own is _short(every)}
        noise.append({n: shift.noise.get(n) or estimate_noise(y) for n, y in short.items()})
        forces = [name for name in short if name.endswith("force")]  # what models are held against
        found = {n: _jumps(short[n], every, noise[-1][n].std) for n in forces}
        jumps.append({name: flags for name, flags in found.items() if flags.any()})
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
    count = sum(int(flags.sum()) for one in jumps for flags in one.values())
    if count:
        note += f"; {count} samples beside jumps of {_named(jumps)} are not judged"
    return Decimated(
        Even(pieces, replace(even.sampling, step=step), even.notes), list(jumps), ended, gain,
        list(noise), (note,),
    )  # fmt: skip


def _named(jumps: list[dict[str, Flags]]) -> str:
    return ", ".join(dict.fromkeys(name for one in jumps for name in one))


def _taps(name: str, y: Array, every: int) -> Array:
    """Return the filter of a channel: long for a motion, short for what jumps, none for a command.

    Parameters
    ----------
    name, y : the channel and its samples (n,)
    every : one sample of so many is kept
    """
    if name in DRIVE or is_switched(y):
        return _NONE
    return _long(every) if is_smooth(name) else _short(every)


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


@cache
def _short(every: int) -> Array:
    return np.asarray(np.hanning(2 * every + 1)[1:-1], dtype=float)


def _jumps(y: Array, every: int, noise: float) -> Flags:
    """Return at which kept samples the samples about it leave a straight line by more than noise.

    Parameters
    ----------
    y : (n,) as recorded
    every : one sample of so many is kept
    noise : standard deviation of the channel, in its unit
    """
    window = np.arange(-every, every + 1)
    padded = np.concatenate([np.repeat(y[0], every), y, np.repeat(y[-1], every)])
    rows = np.lib.stride_tricks.sliding_window_view(padded, len(window))[::every]
    rows = rows - rows.mean(axis=1, keepdims=True)
    rows = rows - (rows @ window / (window @ window))[:, None] * window
    freedom = len(window) - 2
    power = np.sum(rows**2, axis=1) / freedom
    return np.asarray(power > noise**2 * (1.0 + _JUMPS * np.sqrt(2.0 / freedom)), dtype=bool)


def _all_within(measured: Flags, every: int) -> Flags:
    """Return where all samples nearer than one that is kept were measured."""
    from scipy.ndimage import minimum_filter

    return np.asarray(minimum_filter(measured, 2 * every - 1, mode="nearest"), dtype=bool)

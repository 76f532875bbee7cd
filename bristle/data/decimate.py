"""Fewer samples where there are more than a fit needs, behind a filter; clocks that differ.

A motion is smooth: a long filter takes what would be folded back, and leaves the motion. A force
jumps where the motion turns or the command switches, and so do accelerations; a long filter would
ring there. They get a filter as short as the new step, and a model's force gets the same: see
`data.decimate`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array, Flags
from ..core.text import plain
from ..errors import RecordError
from .channels import DRIVE, is_smooth
from .corrections import TIMING, Correction, jumps
from .noise import SHORTEST, Noise, estimate_noise, is_switched
from .sampling import Even

# Between samples: where a model is evaluated, and the filter behind it where the run is decimated.
#
# A force jumps where the motion turns or the command switches, and the measured one went through a
# short filter before samples were left out. So does a model's: it is evaluated at several moments
# per sample, on the motion between them, and what the same filter leaves is held against the
# measurement.

MOST = 10
"""Moments per sample at most, for a model costs as many times more. Up to here they are the samples
as recorded, and a model is exact; beyond, one that jumps where the motion turns is off by up to 1 %
of its RMS, others by less than a tenth of that."""


@cache
def hann(parts: int) -> Array:
    """Return the filter of a force (2 parts - 1,), as short as a step of so many parts; sum 1."""
    taps = np.hanning(2 * parts + 1)[1:-1]
    return np.asarray(taps / taps.sum(), dtype=float)


def between(y: Array, rate: Array | None, dt: float, parts: int = 2) -> Array:
    """Return samples (parts (n - 1) + 1,), of which every so many are those of y (n,).

    Parameters
    ----------
    y : (n,) samples, `dt` [s] apart
    rate : (n,) their derivative, for Hermite's cubic; None for a line
    dt : s
    parts : into how many the steps are cut
    """
    s = np.arange(parts) / parts
    shares = [1.0 - s, s]
    columns = [y[:-1], y[1:]]
    if rate is not None:
        bend = s * s * (3.0 - 2.0 * s)
        shares = [1.0 - bend, bend, dt * s * (1.0 - s) ** 2, -dt * s * s * (1.0 - s)]
        columns += [rate[:-1], rate[1:]]
    out = np.empty(parts * (len(y) - 1) + 1)
    out[:-1] = (np.column_stack(columns) @ np.array(shares)).ravel()
    out[::parts] = y
    return out


@dataclass(frozen=True, eq=False)
class Finer:
    """How a model of a run is evaluated: at `parts` moments per sample.

    `since` (n,) says at how many of the moments up to each sample the command had gone over to its
    value there, should it jump: a part of one where it jumped about a moment. `decimated` is
    whether samples were left out behind a filter.
    """

    parts: int
    since: Array
    decimated: bool = True

    @property
    def taps(self) -> Array:
        """The filter (k,) that is between the moments and the samples."""
        return hann(self.parts) if self.decimated else _NONE

    def of(self, part: slice) -> Finer:
        """Return that of some neighbouring samples."""
        return replace(self, since=self.since[part])

    def cut(self, parts: int) -> Finer:
        """Return the same with another number of moments per sample."""
        since = (self.since - 0.5) * parts / self.parts + 0.5
        return replace(self, parts=parts, since=since if self.decimated else self.since)

    def motion(self, x: Array, v: Array, a: Array, dt: float) -> tuple[Array, Array, Array]:
        """Return a motion (n,) at all moments (m,): Hermite's cubics, that of `a` by its slope.

        Parameters
        ----------
        x, v, a : (n,) displacement, velocity, acceleration [m, m/s, m/s2]
        dt : s between samples
        """
        slope = np.gradient(a, dt)
        return (
            between(x, v, dt, self.parts), between(v, a, dt, self.parts),
            between(a, slope, dt, self.parts),
        )  # fmt: skip

    def command(self, V: Array) -> Array:
        """Return a command (n,) at all moments (m,): held until it jumps, else on a line."""
        out, moments = between(V, None, 1.0, self.parts), np.arange(self.parts + 1)
        k = np.flatnonzero(jumps(V))[:, None]
        share = np.clip(moments - self.parts + self.since[k], 0.0, 1.0)
        out[self.parts * (k - 1) + moments] = (1.0 - share) * V[k - 1] + share * V[k]
        return out

    def filtered(self, force: Array) -> Array:
        """Return what the filter leaves at the samples (n,) of a force at all moments (m,)."""
        taps = self.taps
        half = len(taps) // 2
        with np.errstate(invalid="ignore"):  # a force that is not finite stays so, and is refused
            begin = 2.0 * force[0] - force[half:0:-1]
            end = 2.0 * force[-1] - force[-2 : -half - 2 : -1]
            around = np.concatenate([begin, force, end])
            rows = np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1)[:: self.parts]
            return np.asarray(rows @ taps)


TURN = 0.03
"""Change of a velocity from one moment to the next, over its RMS, that a model's states follow."""


def slow(v: Array, a: Array, dt: float) -> Finer | None:
    """Return how a model is evaluated between the samples of a run that was sampled slowly.

    What a law's states do from one sample to the next, where the motion turns or oil gives way, is
    lost in one step: a true model then errs by more than noise. So it goes on by `RATE` at the
    least, or by less where the motion hardly changes over a step. None where samples suffice.

    Parameters
    ----------
    v, a : velocity and acceleration (n,) [m/s, m/s2]
    dt : s between samples
    """
    turns = dt * float(np.linalg.norm(a)) / max(float(np.linalg.norm(v)), 1e-300)
    parts = int(min(np.ceil(RATE * dt - 1e-6), np.ceil(turns / TURN), MOST))
    return Finer(parts, np.ones(len(v)), decimated=False) if parts > 1 else None


# Channels whose clock is late, or runs fast or slow, at the times of the others.
#
# Values between two samples are interpolated linearly: a force that jumps would ring behind
# anything smoother. That lowers white noise, by a share that is known, so that noise is estimated
# before. Where a force bends so much between two samples that no line follows it, its value is not
# judged.


_ALONE = np.ones(1)
_BINS = 20  # of the distances from a sample, where a clock goes through all of them
_EXACT = 1e-9  # steps within which a value lies on a sample

MISSED = 1e-3
"""Share of a force's standard deviation that a line between two samples may miss, where its noise
is smaller: a signal of a simulation has none, and bends everywhere."""


@dataclass(frozen=True)
class InTime:
    """Channels (n,) at the times of the others, and what is known of those that were moved.

    By name: `lost` (n,) where the record does not tell what it was at that time; `between` (n,) how
    far from a sample of the record the values are, as shares of a step; `noise` that of the record.
    """

    channels: dict[str, Array]
    lost: dict[str, Flags] = field(default_factory=dict)
    between: dict[str, Array] = field(default_factory=dict)
    noise: dict[str, Noise] = field(default_factory=dict)

    def noise_left(self, channel: str, taps: Array = _ALONE) -> float:
        """Return what is left of a channel's white noise behind a filter.

        Parameters
        ----------
        channel : its name, moved or not
        taps : (k,) of the filter
        """
        weights = taps / taps.sum()
        if channel not in self.between or is_smooth(channel):
            return float(np.sqrt(np.sum(weights**2)))
        shares, edges = np.histogram(self.between[channel], _BINS, (0.0, 1.0))
        middles = 0.5 * (edges[1:] + edges[:-1])
        if np.ptp(self.between[channel]) < 1.0 / _BINS:  # a delay, the same for all
            middles[:] = np.mean(self.between[channel])
        power = [np.sum(np.convolve(weights, [1.0 - w, w]) ** 2) for w in middles]
        return float(np.sqrt(np.average(power, weights=shares)))


def _error(y: Array, first: NDArray[np.int_], between: Array) -> Array:
    """Return what linear interpolation behind samples `first` (n,) misses where a signal bends."""
    places = np.clip(first[:, None] + np.arange(-1, 3), 0, len(y) - 1)
    bend = y[places] @ np.array([0.5, -0.5, -0.5, 0.5])
    return np.asarray(0.5 * between * (1.0 - between) * np.abs(bend))


def in_time(
    channels: Mapping[str, Array], known: Mapping[str, Flags], step: float,
    corrections: Sequence[Correction], begin: float = 0.0,
) -> InTime:  # fmt: skip
    """Return channels at the times at which the others were measured.

    Parameters
    ----------
    channels : name to (n,), evenly spaced
    known : by channel (n,) False where it says nothing, such as where a sample was filled in
    step : s
    corrections : those of other faults are passed over
    begin : s since the record began, from which on a clock gains
    """
    out = InTime(dict(channels))
    for name, y in channels.items():
        own = [one for one in corrections if one.channel == name and one.fault in TIMING]
        if not own:
            continue
        rate = float(np.prod([1.0 + one.value for one in own if one.fault == "clock"]))
        late = sum(one.value for one in own if one.fault == "delay")
        last = len(y) - 1
        wanted = (np.arange(len(y)) + (begin + late) / step) * rate - begin / step
        place = np.clip(wanted, 0.0, last)
        first = np.floor(place + _EXACT).astype(int)
        second = np.ceil(place - _EXACT).astype(int)
        there = (wanted > -0.5) & (wanted < last + 0.5) & known[name][first] & known[name][second]
        out.channels[name] = np.interp(place, np.arange(len(y)), y)
        out.between[name] = np.clip(place - first, 0.0, 1.0)
        out.noise[name] = estimate_noise(y)
        if not (is_smooth(name) or name in DRIVE):
            most = max(out.noise[name].std, MISSED * float(np.std(y)))
            there &= _error(y, first, out.between[name]) <= most
        if not there.all():
            out.lost[name] = ~there
    return out


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

    `parts` and, by command, `since` of each piece are those of `data.decimate.Finer`; 1 and nothing
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
            f"{plain(recorded, 4)} Hz. A higher rate in study.toml is right, or a longer run; or "
            "the times are in another unit."
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

"""Lines in a channel's spectrum that neither motion nor command drives: mains hum and the like.

A line is a sinusoid that goes on through the whole record with one size and one phase, and that
stands alone in its spectrum. A periodic test has lines as well, its frequency and its harmonics,
and a force that jumps has many: they stand beside each other, so that none of them stands out.
What another channel shows at the same frequency moves the rig, or is no fault of one channel;
mains hum may be on several channels, and is none where the displacement moves with the velocity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .channels import DRIVE
from .line_removal import BETA, amplitude_of, drifting_amplitude, without_slow
from .mains import MAINS, MAINS_OFF, mains_lines, mains_of
from .noise import is_switched
from .table import Array

FEWEST = 500
"""Samples from which on a line can be told from what stands beside it."""

_HALF_WIDTH = 5  # bins of that window's main lobe to either side
_SMOOTH = 60  # bins to either side whose median is the level about a line
_POWER = 60.0  # a line's power over that level; chance reaches 60 in one of 1e26 bins
_ALONE = 4.0  # times the largest amplitude beside a line
_MAINS_ALONE = 2.5  # the same of a line of the mains, whose frequency is known beforehand
_BESIDE = 15.0  # Hz to either side that it must stand alone in
_TEETH = 6.0  # harmonics of a periodic test to either side that it must stand alone among
_LOW_ORDER = 12  # harmonics of a periodic test up to this order are its own, whatever their size
_MOVING = 0.1  # share of its RMS by which a command varies that may be periodic
_PERIODIC = 0.5  # share of a motion's power in one line from which on the test is periodic
_BLOCKS = 8  # of the record, over which a line keeps its size and phase
_STEADY = 0.4  # scatter of its blocks over its amplitude at the most
_ABOVE_MOTION = 3.0  # a line of no mains lies so many times above the band of the motion
_MOST_OF_SIGNAL = 0.5  # a line with more than this share of a channel's RMS is its signal
_ELSEWHERE = 9.0  # power over the level at which another channel shows the same line
_MOST = 8  # lines per channel
_MOTION = ("displacement", "velocity")


@dataclass(frozen=True)
class SpectralLine:
    """A line on a channel: its frequency [Hz] as recorded, its amplitude in the channel's unit.

    `mains` [Hz] is the mains frequency that it is a harmonic of, 0 for none; `order` which one;
    `folded` whether the harmonic lies beyond half the sampling rate and shows where it is folded
    to.
    """

    channel: str
    frequency: float
    amplitude: float
    mains: float = 0.0
    order: int = 0
    folded: bool = False


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Amplitudes (m,) of a channel at frequencies (m,) [Hz], and the level about each."""

    frequency: Array
    amplitude: Array
    level: Array

    def power(self, frequency: float) -> float:
        """Return the power at a frequency [Hz] over the level about it."""
        k = self.index(frequency)
        part = slice(max(k - 1, 0), k + 2)
        return float(np.max(self.amplitude[part] / self.level[part]) ** 2)

    def index(self, frequency: float) -> int:
        """Return the bin of a frequency [Hz]."""
        return min(round(frequency / float(self.frequency[1])), len(self.frequency) - 1)


def spectral_lines(channels: Mapping[str, Array], step: float) -> list[SpectralLine]:
    """Return the lines on channels of one run that neither its motion nor its command drives.

    Parameters
    ----------
    channels : name to (n,) in SI, evenly spaced and finite
    step : s

    Returns
    -------
    list of SpectralLine
        By channel, the largest first; none of runs of fewer than `FEWEST` samples.
    """
    able = {name: y for name, y in channels.items() if _is_able(name, y)}
    spectra = {name: _spectrum(_cut_down(y, step), step) for name, y in able.items()}
    drivers = [name for name, y in able.items() if _moves(name) or _commands(name, y)]
    top = max((_band_top(able[name], step) for name in able if _moves(name)), default=0.0)
    periods = [f for name in drivers if (f := _period(_spectrum(able[name], step)))]
    out: list[SpectralLine] = []
    for name, spectrum in spectra.items():
        found = [
            line
            for line in _lines(name, able[name], spectrum, step, periods)
            if line.mains or line.frequency > _ABOVE_MOTION * top
        ]
        rms = float(np.sqrt(np.mean(able[name] ** 2)))
        out += [one for one in found if one.amplitude < _MOST_OF_SIGNAL * rms]
    return [line for line in out if not _is_driven(line, out, spectra, able, step)]


def of_one_mains(
    runs: Sequence[Sequence[SpectralLine]], steps: Sequence[float], samples: Sequence[int]
) -> list[list[SpectralLine]]:
    """Return the lines of runs of one laboratory, which has one mains, or none.

    It is that of most lines, and of the lowest order among equals; a line of the other one may be
    of it as well, or is of no mains.

    Parameters
    ----------
    runs : (n,) lines of each run
    steps, samples : (n,) of each run, s and their number
    """
    every = [
        (line, step, 2.0 / (step * size))
        for lines, step, size in zip(runs, steps, samples, strict=True)
        for line in lines
    ]
    if len({line.mains for line, _, _ in every if line.mains}) < 2:
        return [list(lines) for lines in runs]
    scores = {}
    for mains in MAINS:
        found = [mains_of(line.frequency, step, width, (mains,)) for line, step, width in every]
        orders = [order + 100 * folded for own, order, folded in found if own]
        scores[mains] = (len(orders), -min(orders, default=0))
    best = max(MAINS, key=lambda mains: scores[mains])
    out = []
    for lines, step, size in zip(runs, steps, samples, strict=True):
        known = [mains_of(one.frequency, step, 2.0 / (step * size), (best,)) for one in lines]
        out.append([
            replace(one, mains=mains, order=order, folded=folded)
            for one, (mains, order, folded) in zip(lines, known, strict=True)
        ])  # fmt: skip
    return out


def _is_able(name: str, y: Array) -> bool:
    return len(y) >= FEWEST and float(np.ptp(y)) > 0.0 and not is_switched(y)


def _moves(name: str) -> bool:
    return name.endswith(_MOTION)


def _cut_down(y: Array, step: float) -> Array:
    """Return a channel (n,) without what is slow, its jumps cut down to the size of the rest.

    A jump is everywhere in a spectrum, and a line in every sample.
    """
    fast, most = without_slow(y, step)
    return np.clip(fast, -most, most)


def _commands(name: str, y: Array) -> bool:
    """Return whether a channel is a command that varies by more than what it picks up."""
    return name in DRIVE and float(np.std(y)) > _MOVING * float(np.sqrt(np.mean(y**2)))


def _spectrum(y: Array, step: float) -> _Spectrum:
    from scipy.ndimage import median_filter

    window = np.kaiser(len(y), BETA)
    scale = 2.0 / float(np.sum(window))
    size = np.asarray(np.abs(np.fft.rfft((y - np.mean(y)) * window)) * scale, dtype=float)
    level = np.sqrt(median_filter(size**2, 2 * _SMOOTH + 1, mode="nearest") / np.log(2.0))
    least = 1e-12 * float(size.max())
    return _Spectrum(
        np.asarray(np.fft.rfftfreq(len(y), step), dtype=float),
        size,
        np.asarray(np.maximum(level, least), dtype=float),
    )


def _band_top(y: Array, step: float) -> float:
    """Return the frequency [Hz] below which 99.5 % of the power of a motion's rate lies."""
    power = np.abs(np.fft.rfft((y - np.mean(y)) * np.hanning(len(y)))) ** 2
    total = np.cumsum(power)
    return float(np.fft.rfftfreq(len(y), step)[int(np.searchsorted(total, 0.995 * total[-1]))])


def _period(spectrum: _Spectrum) -> float:
    """Return the frequency [Hz] of a periodic motion or command, 0 where it is not periodic."""
    power = spectrum.amplitude**2
    k = int(np.argmax(power[_HALF_WIDTH:])) + _HALF_WIDTH
    own = float(np.sum(power[max(k - _HALF_WIDTH, 1) : k + _HALF_WIDTH + 1]))
    return float(spectrum.frequency[k]) if own > _PERIODIC * float(np.sum(power[2:])) else 0.0


def _lines(
    name: str, y: Array, spectrum: _Spectrum, step: float, periods: Sequence[float]
) -> list[SpectralLine]:
    """Return the lines of one channel that stand alone and keep their size."""
    ratio = (spectrum.amplitude / spectrum.level) ** 2
    peaks = np.flatnonzero(
        (ratio[1:-1] > _POWER)
        & (spectrum.amplitude[1:-1] >= spectrum.amplitude[:-2])
        & (spectrum.amplitude[1:-1] > spectrum.amplitude[2:])
    ) + 1  # fmt: skip
    peaks = peaks[(peaks > 2 * _HALF_WIDTH) & (peaks < len(ratio) - 2 * _HALF_WIDTH)]
    ordered = sorted(peaks.tolist(), key=lambda k: -float(ratio[k]))[: 4 * _MOST]
    kept = [k for k in ordered if _stands_alone(k, spectrum, step, periods)]
    cut, found = _cut_down(y, step), []
    for k in kept[:_MOST]:
        frequency = _refined(cut, float(spectrum.frequency[k]), step)
        if _is_steady(cut, frequency, step):
            mains, order, folded = mains_of(frequency, step, 2.0 / (step * len(y)))
            amplitude = float(np.mean(np.abs(drifting_amplitude(y, step, frequency))))
            found.append(SpectralLine(name, frequency, amplitude, mains, order, folded))
    return found


def _stands_alone(k: int, spectrum: _Spectrum, step: float, periods: Sequence[float]) -> bool:
    """Return whether no line of like size stands near a peak's bin, and the test has none there."""
    frequency, width = spectrum.frequency, float(spectrum.frequency[1])
    own = float(frequency[k])
    for period in periods:
        order = own / period
        if order < _LOW_ORDER + 0.5 and abs(order - round(order)) * period < 3.0 * width:
            return False
    reach = max([_BESIDE, *(_TEETH * period for period in periods)])
    beside = np.abs(frequency - own) <= reach
    beside &= np.abs(frequency - own) > _HALF_WIDTH * width
    beside[: _HALF_WIDTH + 1] = False
    for other in mains_lines(step):  # those of the mains may be as large
        beside &= np.abs(frequency - other) > max(_HALF_WIDTH * width, MAINS_OFF * other)
    known = mains_of(own, step, 2.0 * width)[0]
    least = _MAINS_ALONE if known else _ALONE
    return bool(spectrum.amplitude[k] > least * np.max(spectrum.amplitude[beside], initial=0.0))


def _refined(y: Array, frequency: float, step: float) -> float:
    """Return the frequency [Hz] near a bin's at which a channel has most power."""
    from scipy.optimize import minimize_scalar

    time, width = step * np.arange(len(y)), 1.0 / (step * len(y))
    centred = (y - np.mean(y)) * np.kaiser(len(y), BETA)

    def missing(f: float) -> float:
        return -float(np.abs(np.sum(centred * np.exp(-2j * np.pi * f * time))))

    bounds = (frequency - width, frequency + width)
    return float(minimize_scalar(missing, bounds=bounds, method="bounded").x)


def _is_steady(y: Array, frequency: float, step: float) -> bool:
    """Return whether a line keeps its size and its phase all along.

    The windows of neighbouring blocks overlap by half, for they are narrow where they end.
    """
    wave = np.exp(2j * np.pi * frequency * step * np.arange(len(y)))
    size = 2 * len(y) // (_BLOCKS + 1)
    begins = [k * size // 2 for k in range(_BLOCKS)]
    parts = np.array([amplitude_of(y[a : a + size], wave[a : a + size]) for a in begins])
    phase, block = np.unwrap(np.angle(parts)), np.arange(_BLOCKS)
    if float(np.max(np.abs(np.diff(phase)))) > 1.0:
        return False
    # The mains may drift: to second order in time that is no fault of the line.
    turned = parts * np.exp(-1j * np.polyval(np.polyfit(block, phase, 2), block))
    mean = complex(np.mean(turned))
    return bool(np.sqrt(np.mean(np.abs(turned - mean) ** 2)) < _STEADY * abs(mean))


def _is_driven(
    line: SpectralLine,
    found: Sequence[SpectralLine],
    spectra: Mapping[str, _Spectrum],
    channels: Mapping[str, Array],
    step: float,
) -> bool:
    """Return whether a line is motion or command, or no fault of its channel alone.

    Where the velocity is the rate of the displacement at the line's frequency, the rig moves so.
    """
    others = [
        name
        for name, spectrum in spectra.items()
        if name != line.channel and spectrum.power(line.frequency) > _ELSEWHERE
    ]
    if not others:
        return False
    if not line.mains or line.channel in DRIVE:
        return True
    wave = np.exp(2j * np.pi * line.frequency * step * np.arange(len(channels[line.channel])))
    for name in [line.channel, *others]:
        x, v = f"{_level(name)}displacement", f"{_level(name)}velocity"
        if x in (line.channel, *others) and v in (line.channel, *others):
            rate = 2j * np.pi * line.frequency * amplitude_of(channels[x], wave)
            shown = amplitude_of(channels[v], wave)
            if abs(rate - shown) < 0.3 * abs(shown):
                return True
    return False


def _level(name: str) -> str:
    """Return the part of a channel's name before its quantity: "base_", or ""."""
    return next((name.removesuffix(one) for one in _MOTION if name.endswith(one)), "")

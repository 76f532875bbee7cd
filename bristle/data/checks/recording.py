"""How channels were recorded: lines that nothing drives, averages, values between samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding
from ...core.text import plain, quantity
from ..channels import DRIVE
from ..corrections import BETA, Correction, amplitude_of, drifting_amplitude, without_slow
from ..measurement import Measurement
from ..noise import is_switched
from ..relation import power_spectrum, top_of

# A channel that was interpolated to a faster rate before it was stored: it is straight in pieces.
#
# Between two measured samples an interpolated channel lies on a straight line, to the last digit
# that was written. No measured signal does so again and again at ever new slopes.

MIN_PATTERN_SAMPLES = 200
"""Samples from which on a pattern is no accident."""

STRAIGHT = 0.25
"""Share of samples on the line of their neighbours at the least: one of two is on it at twice the
rate, one of ten at 2.2 times, which is not told."""

BENT = 8.0
"""Times the last digit by which the others are off that line, in the middle."""

SLOPES = 30
"""Slopes that differ at the least: a triangle, or coarse steps, have few."""

WHOLE = 0.02
"""How near to a whole number a ratio is that number."""

DIGITS = 12
"""Significant digits beyond which a number is not rounded."""


def interpolated(y: Array) -> float:
    """Return how many samples of a channel come from one measured one, 0 where all were measured.

    Parameters
    ----------
    y : (n,) as stored, evenly spaced and finite
    """
    size = float(np.ptp(y))
    if len(y) < MIN_PATTERN_SAMPLES or size == 0.0:
        return 0.0
    digit = _last_digit(y, size)
    slope = np.diff(y)
    off = np.abs(np.diff(slope))
    on_line = off <= 2.0 * digit
    moving = np.abs(slope[1:]) > digit
    bent = ~on_line
    if not bent.any() or float(np.mean(on_line & moving)) < STRAIGHT:
        return 0.0
    if float(np.median(off[bent])) < BENT * digit:
        return 0.0
    pieces = slope[1:][bent]
    if len(np.unique(np.round(pieces / max(2.0 * digit, 1e-9 * size)))) < SLOPES:
        return 0.0
    corners = int(bent[0]) + np.count_nonzero(bent[1:] & ~bent[:-1])  # two are bent beside most
    ratio = len(off) / corners
    return float(round(ratio)) if abs(ratio - round(ratio)) < WHOLE else ratio


def _last_digit(y: Array, size: float) -> float:
    """Return the value of the last digit that a channel was written with."""
    top = int(np.floor(np.log10(max(size, float(np.max(np.abs(y)))))))
    for places in range(-top, DIGITS - top):
        unit = 10.0**-places
        if np.all(np.abs(y - np.round(y / unit) * unit) <= 1e-6 * unit):
            return unit
    return float(10.0 ** (top - DIGITS))


# A channel that was averaged over some samples before it was stored, told from its spectrum.
#
# The mean of L samples has the gain |sin(pi L f dt) / (L sin(pi f dt))|: it is zero at every
# multiple of 1/(L dt), whatever was averaged, motion, jumps or noise. No other filter has nulls at
# equal distances up to half the sampling rate.

MIN_AVERAGED = 1000
"""Samples from which on a spectrum is fine enough."""

SHORTEST = 3
"""Samples of an average whose null lies below half the sampling rate."""

_BETA = 14.0  # of the Kaiser window: 100 dB, deeper than a null
_BINS = 15  # whose lower third is one point of the spectrum: a periodic test has lines between
_QUANTILE = 0.3
_POINTS = 8  # between two nulls at the least
_START = 2.0  # times the band of a channel's own power from which on its spectrum is looked at
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
    if len(y) < MIN_AVERAGED or float(np.ptp(y)) == 0.0 or is_switched(y):
        return None
    frequency, level = _points(y)  # in samples^-1
    inside = frequency > _START * top_of(y, 1.0, _BAND)
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
    seen = min(2, (best - 1) // 2)  # all nulls that there are must be, two at the most
    if len(nulls) < seen or min(nulls) < _DEPTH:
        return None
    return MovingAverage(best, len(nulls))


def _is_comb(y: Array, length: int) -> bool:
    """Return whether nulls lie where a periodic channel has gaps between its harmonics."""
    power = power_spectrum(y)
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


# Where the mains and their harmonics show in a record, those beyond half its rate included.

MAINS = (50.0, 60.0)
"""Frequencies of the mains [Hz]."""

MAINS_OFF = 2e-3  # share by which the mains may be off
_GRID_OFF = 4e-4  # what a grid keeps to: of the ripple of rectifiers, aliased, or chance names it
_LOW = 5  # the highest harmonic that is no such ripple
_BEYOND = (1, 2, 3, 4, 5, 6, 12)
"""Harmonics of the mains that are looked for beyond half the sampling rate.

The sixth and the twelfth are the ripple of rectifiers on three phases (6 and 12 pulses a period):
that of the amplifiers which drive rig and coil.
"""


def mains_lines(step: float) -> list[float]:
    """Return where the harmonics of the mains show at a sampling step [s], in Hz."""
    return [_folded(order * mains, step) for mains in MAINS for order in _orders(mains, step)]


def _orders(mains: float, step: float) -> list[int]:
    """Return the harmonics that are looked for: all up to half the rate, and those of `_BEYOND`."""
    below = range(1, int(0.5 / (step * mains)) + 1)
    return [*below, *(order for order in _BEYOND if order not in below)]


def _folded(frequency: float, step: float) -> float:
    """Return where a frequency [Hz] shows that is sampled every `step` [s]."""
    rate = 1.0 / step
    return abs(frequency - rate * round(frequency / rate))


def mains_of(
    frequency: float, step: float, width: float, among: Sequence[float] = MAINS
) -> tuple[float, int, bool]:
    """Return the mains frequency [Hz] that a line is of, the order, and whether it is folded.

    Parameters
    ----------
    frequency : Hz, as recorded
    step : sampling step [s]
    width : Hz within which it is known
    among : mains frequencies [Hz] that it may be of

    Returns
    -------
    (mains, order, folded)
        (0, 0, False) where it is none of the mains.
    """
    half = 0.5 / step
    for folded in (False, True):
        for mains in among:
            for order in _orders(mains, step):
                whole = order * mains
                if (whole > half) is not folded:
                    continue
                off = _GRID_OFF if folded and order > _LOW else MAINS_OFF
                if abs(_folded(whole, step) - frequency) <= max(off * whole, width):
                    return mains, order, folded
    return 0.0, 0, False


# Lines in a channel's spectrum that neither motion nor command drives: mains hum and the like.
#
# A line is a sinusoid that goes on through the whole record with one size and one phase, and that
# stands alone in its spectrum. A periodic test has lines as well, its frequency and its harmonics,
# and a force that jumps has many: they stand beside each other, so that none of them stands out.
# What another channel shows at the same frequency moves the rig, or is no fault of one channel;
# mains hum may be on several channels, and is none where the displacement moves with the velocity.

MIN_LINE_SAMPLES = 500
"""Samples from which on a line can be told from what stands beside it."""

_HALF_WIDTH = 5  # bins of that window's main lobe to either side
_SMOOTH = 60  # bins to either side whose median is the level about a line
_POWER = 60.0  # a line's power over that level; chance reaches 60 in one of 1e26 bins
_ALONE = 4.0  # times the largest amplitude beside a line
_MAINS_ALONE = 2.5  # the same of a line of the mains, whose frequency is known beforehand
_BESIDE = 15.0  # Hz to either side that it must stand alone in
_LINE_TEETH = 6.0  # harmonics of a periodic test to either side that it must stand alone among
_LOW_ORDER = 12  # harmonics of a periodic test up to this order are its own, whatever their size
_MOVING = 0.1  # share of its RMS by which a command varies that may be periodic
_PERIODIC_LINES = 0.5  # share of a motion's power in one line from which on the test is periodic
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
        By channel, the largest first; none of runs of fewer than `MIN_PATTERN_SAMPLES` samples.
    """
    able = {name: y for name, y in channels.items() if _is_able(y)}
    spectra = {name: _spectrum(_cut_down(y, step), step) for name, y in able.items()}
    drivers = [name for name, y in able.items() if _moves(name) or _commands(name, y)]
    top = max((top_of(able[name], step, _BAND) for name in able if _moves(name)), default=0.0)
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
    return [line for line in out if not _is_driven(line, spectra, able, step)]


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


def _is_able(y: Array) -> bool:
    return len(y) >= MIN_LINE_SAMPLES and float(np.ptp(y)) > 0.0 and not is_switched(y)


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


def _period(spectrum: _Spectrum) -> float:
    """Return the frequency [Hz] of a periodic motion or command, 0 where it is not periodic."""
    power = spectrum.amplitude**2
    k = int(np.argmax(power[_HALF_WIDTH:])) + _HALF_WIDTH
    own = float(np.sum(power[max(k - _HALF_WIDTH, 1) : k + _HALF_WIDTH + 1]))
    return float(spectrum.frequency[k]) if own > _PERIODIC_LINES * float(np.sum(power[2:])) else 0.0


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
    reach = max([_BESIDE, *(_LINE_TEETH * period for period in periods)])
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
    line: SpectralLine, spectra: Mapping[str, _Spectrum], channels: Mapping[str, Array], step: float
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


def check_recording(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield what the spectra of the channels of runs say of how they were recorded.

    Parameters
    ----------
    runs : with all samples of their files: fewer show neither nulls nor lines where they are
    """
    found = [spectral_lines(run.channels, run.step) for run in runs]
    found = of_one_mains(found, [run.step for run in runs], [len(run.time) for run in runs])
    # 300 Hz is a harmonic of either mains: only another line tells which.
    of_either = not any(one.mains and one.order * one.mains % 300.0 for one in chain(*found))
    for run, lines in zip(runs, found, strict=True):
        yield from _of_run(run, lines, "50 or 60 Hz" if of_either else "")


def _of_run(run: Measurement, lines: Sequence[SpectralLine], mains: str) -> Iterator[Finding]:
    for channel in dict.fromkeys(line.channel for line in lines):
        yield _of_lines(run, [line for line in lines if line.channel == channel], mains)
    if run.sampling.resampled:
        return  # its samples are means of others
    yield from _interpolated(run)
    for channel, values in run.channels.items():
        found = None if channel in DRIVE else moving_average(values, run.step)
        if found is not None:
            text = (
                f"{channel} is a moving average of {found.length} samples "
                f"({plain(1e3 * found.length * run.step)} ms): its spectrum has {found.nulls} "
                "nulls at equal distances. Jumps are rounded that long, and a delay or lag of "
                "that size may be the average's."
            )
            do = "Store the channel as it was sampled, and measure again if you can."
            yield Finding(
                "averaged", "warning", text, do, run.name, channel, found.length * run.step
            )


def _interpolated(run: Measurement) -> Iterator[Finding]:
    """Yield the channels that were interpolated to the run's rate; a command may be straight."""
    for channel, values in run.channels.items():
        of_one = 0.0 if channel in DRIVE else interpolated(values)
        if of_one:
            rate = plain(run.sampling.rate / of_one, 3)
            text = (
                f"{channel} is interpolated: {rate} samples per second were measured, those "
                "between lie on straight lines. Their noise is no measured one, and what is "
                f"faster than {plain(0.5 * run.sampling.rate / of_one, 3)} Hz is not in them."
            )
            do = f"Store what was measured, or set rate = {rate} in study.toml."
            yield Finding("interpolated", "warning", text, do, run.name, channel, of_one)


def _of_lines(run: Measurement, lines: Sequence[SpectralLine], mains: str) -> Finding:
    """Return the finding of all lines on one channel, the largest first."""
    ordered = sorted(lines, key=lambda one: -one.amplitude)
    channel, unit = ordered[0].channel, run.units[ordered[0].channel]
    rms = float(np.std(run[channel])) or 1.0
    told = [
        f"{plain(one.frequency, 4)} Hz of {quantity(one.amplitude, unit, 2, fine=True)} "
        f"({_origin(one, run, mains)})"
        for one in ordered
    ]
    what = "a line at" if len(told) == 1 else "lines at"
    text = (
        f"{channel} has {what} {', '.join(told)}; the largest is "
        f"{plain(100.0 * ordered[0].amplitude / rms, 2)} % of its RMS, and no motion drives it."
    )
    do = (
        "`bristle study check FOLDER --correct` takes it off. Look for a loop of the ground, or a "
        "shield that is open."
    )
    lines_off = tuple(Correction(channel, "line", round(one.frequency, 4)) for one in ordered)
    size = ordered[0].amplitude
    return Finding("lines", "warning", text, do, run.name, channel, size, lines_off)


def _origin(line: SpectralLine, run: Measurement, mains: str) -> str:
    """Return where a line is from, as far as its frequency tells: `mains` is of either, or ""."""
    if not line.mains:
        return "on this channel alone"
    whole = f"the mains of {mains or f'{line.mains:g} Hz'}"
    if line.order > 1:
        whole = f"{plain(line.order * line.mains, 4)} Hz of {whole}"
    if line.folded:
        return f"{whole}, aliased at {plain(run.sampling.rate, 4)} samples per second"
    return whole

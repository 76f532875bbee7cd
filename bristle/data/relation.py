"""How two channels belong together: one the derivative of the other, a force against a motion.

A first look at any two columns, whose units, signs and order may be wrong: gain and delay of the
derivative, to first order in the delay. `diagnosis.sensor_faults` asks more of a displacement and a
velocity that are known to be these: it integrates the velocity, for a derivative's noise would
drown a lag's order, a geophone's corner and a bias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.arrays import Array

CUT_OFF = 18.0
"""Low-pass at which channels are compared [Hz], where their own band is not wider."""
_BLOCKS = 8


@dataclass(frozen=True)
class Relation:
    """`y(t) = gain * dx/dt(t - delay) + offset`, both low-passed alike at `cut_off` [Hz].

    `gain_std`, `delay_std` [s] come from blocks of the record; `residual` is the RMS of what is
    left as a share of that of y, `correlation` that of y with dx/dt, `offset` in the unit of y.
    """

    gain: float
    gain_std: float
    delay: float
    delay_std: float
    offset: float
    residual: float
    correlation: float
    cut_off: float


def derivative_relation(x: Array, y: Array, step: float) -> Relation | None:
    """Return how y follows the derivative of x; None where one of them stands still.

    Parameters
    ----------
    x, y : (n,) evenly spaced
    step : float, s
    """
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0 or len(x) < 40:
        return None
    cut_off = band(y, step)
    derivative = differentiated(x, step, cut_off)
    other = low_passed(averaged(y - np.mean(y)), step, cut_off)
    edge = min(len(x) // 10, int(1.0 / (cut_off * step)) + 2)  # where the filter has one side only
    return _related(derivative[edge:-edge], other[edge:-edge], float(np.mean(y)), step, cut_off)


def band(y: Array, step: float) -> float:
    """Return the cut-off [Hz] that keeps what moves: 99 % of a channel's power, 18 Hz at least."""
    if np.ptp(y) == 0.0:
        return CUT_OFF
    return min(max(CUT_OFF, 1.5 * top_of(y, step, 0.99)), 0.4 / step)


def top_of(y: Array, step: float, share: float) -> float:
    """Return the frequency [Hz] below which a share of a channel's power lies."""
    total = np.cumsum(power_spectrum(y))
    if total[-1] <= 0.0:
        return 0.0
    return float(np.fft.rfftfreq(len(y), step)[int(np.searchsorted(total, share * total[-1]))])


def power_spectrum(y: Array) -> Array:
    """Return the power (n // 2 + 1,) of a channel (n,) about its mean, under Hann's window."""
    power: Array = np.abs(np.fft.rfft((y - np.mean(y)) * np.hanning(len(y)))) ** 2
    return power


def low_passed(y: Array, step: float, cut_off: float) -> Array:
    """Return a channel after a zero-phase low-pass: Butterworth, 2nd order, forth and back."""
    from scipy.signal import butter, sosfiltfilt

    if cut_off * step >= 0.45:
        return y
    sections = butter(2, cut_off, fs=1.0 / step, output="sos")
    return np.asarray(sosfiltfilt(sections, y), dtype=float)


def differentiated(x: Array, step: float, cut_off: float) -> Array:
    """Return the derivative of a channel: zero-phase low-pass, then central differences."""
    derivative: Array = np.gradient(low_passed(x - np.mean(x), step, cut_off), step)
    return derivative


def averaged(y: Array) -> Array:
    """Return the mean of a channel from one sample before to one after, by Simpson's rule.

    A central difference is this mean of the derivative: so the two are compared like with like.
    """
    out: Array = y.copy()
    out[1:-1] = (y[:-2] + 4.0 * y[1:-1] + y[2:]) / 6.0
    return out


def power_factor(force: Array, velocity: Array) -> tuple[float, int]:
    """Return the share of the power that a force dissipates, and how many blocks of 10 agree.

    The share is mean(f v) / (RMS f RMS v) without the means: 1 for a dashpot, 0 for a spring,
    negative for a force that is positive along the motion.
    """
    f, v = force - np.mean(force), velocity - np.mean(velocity)
    scale = float(np.std(f) * np.std(v))
    if scale == 0.0:
        return 0.0, 0
    share = float(np.mean(f * v)) / scale
    blocks = [float(np.sum(part)) for part in np.array_split(f * v, 10)]
    return share, sum(block * share > 0.0 for block in blocks)


def tells_sign(share: float, agree: int, samples: int) -> bool:
    """Return whether a power factor is large and steady enough to tell the sign of a force."""
    return abs(share) > max(0.03, 4.0 / samples**0.5) and agree >= 8


def _related(d: Array, y: Array, offset: float, step: float, cut_off: float) -> Relation | None:
    if float(np.std(d)) == 0.0 or float(np.std(y)) == 0.0:
        return None
    correlation = float(np.corrcoef(d, y)[0, 1])
    shift = _whole_steps(d, y)
    begin, end = max(0, shift), len(y) + min(0, shift)
    d, y = d[begin - shift : end - shift], y[begin:end]
    second = np.gradient(d, step)
    # y(t) = g d(t - tau): to first order in tau, g d - g tau d'.
    A = np.column_stack([d, second, np.ones(len(d))])
    (gain, turned, constant), *_ = np.linalg.lstsq(A, y, rcond=None)
    residual = float(np.std(y - A @ np.array([gain, turned, constant])) / np.std(y))
    blocks = [
        np.linalg.lstsq(part, rest, rcond=None)[0]
        for part, rest in zip(np.array_split(A, _BLOCKS), np.array_split(y, _BLOCKS), strict=True)
    ]
    gains = np.array([block[0] for block in blocks])
    delays = np.array([-block[1] / block[0] if block[0] else 0.0 for block in blocks])
    spread = np.sqrt(_BLOCKS)
    return Relation(
        float(gain), float(_robust(gains) / spread), float(shift * step - turned / gain),
        float(_robust(delays) / spread), float(offset + constant), residual, correlation, cut_off,
    )  # fmt: skip


def _robust(values: Array) -> float:
    return float(np.median(np.abs(values - np.median(values)))) / 0.6745


def _whole_steps(d: Array, y: Array) -> int:
    """Return the lag [samples] at which the cross-correlation is largest in size."""
    n = len(d)
    size = 1 << (2 * n - 1).bit_length()
    cross = np.fft.irfft(np.fft.rfft(y, size) * np.conj(np.fft.rfft(d, size)), size)
    reach = max(1, min(n // 10, 200))
    lags = np.concatenate([cross[: reach + 1], cross[-reach:]])
    best = int(np.argmax(np.abs(lags)))
    return best if best <= reach else best - len(lags)

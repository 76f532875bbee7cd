"""Where a residual lives in frequency: its power against that of the noise, band by band."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..identification.search import z_scale
from .predictions import RunPrediction

_CYCLES = 3  # of the lowest band's frequency in a run, so that it holds enough lines
_MOST = 9
_SPIKE = 4.0  # times noise (or the whole error) beyond which a sample is cut: no line of a spectrum
_HANN = 1.94  # equivalent lines that a Hann window joins, in variance (Welch 1967)


@dataclass(frozen=True)
class Band:
    """One octave: `low`, `high` Hz; `z` the residual's RMS over that of the noise in it.

    `rms` the residual's in the unit of the output; `share` of all power beyond the noise; `p` the
    chance of such a `z` under a true model; `coherence` in 0 .. 1 with the predicted output: near 1
    a linear correction of the model would carry it.
    """

    low: float
    high: float
    z: float
    rms: float
    share: float
    p: float
    coherence: float


@dataclass(frozen=True)
class Spectrum:
    """Power spectral densities (k,) over `frequency` (k,) Hz, in unit^2/Hz; and the bands."""

    frequency: Array
    residual: Array
    noise: Array
    measured: Array
    bands: tuple[Band, ...]


def spectrum(predictions: Sequence[RunPrediction]) -> Spectrum:
    """Return the spectrum of residual, expected noise and measured output over all runs.

    Runs of different rates share the lines up to half the lowest rate. What a faster run holds
    beyond is left out.
    """
    limit = _SPIKE * max(1.0, z_scale(np.concatenate([one.normalised for one in predictions])))
    errors = [_whole(one, limit) for one in predictions]
    total = sum(len(one.residual) for one in predictions)
    slowest = max(one.dt for one in predictions)
    span = min(1024 * slowest, *(len(one.residual) * one.dt for one in predictions))
    lines = np.fft.rfftfreq(round(span / slowest), slowest).astype(np.float64)
    sums = np.zeros((4, len(lines)))
    cross = np.zeros(len(lines), dtype=complex)
    for one, error in zip(predictions, errors, strict=True):
        weight = len(error) / total
        powers, joint = _powers(one, error, span, lines)
        sums += weight * powers
        cross += weight * joint
    with np.errstate(invalid="ignore", divide="ignore"):
        coherence = np.nan_to_num(np.abs(cross) ** 2 / (sums[0] * sums[3]))
    bands = _bands(predictions, errors, 1.0 / slowest, lines, coherence, sums[0])
    return Spectrum(lines, sums[0], sums[1], sums[2], bands)


def _whole(one: RunPrediction, limit: float) -> Array:
    """Return a run's residual (n,), spikes cut; its power is that of a run judged throughout.

    Where a sample does not count the residual is 0.
    """
    error = np.clip(one.normalised, -limit, limit) * one.sigma[one.skip :]
    return np.asarray(error / np.sqrt(max(float(np.mean(one.judged)), 1e-12)))


def _powers(
    one: RunPrediction, error: Array, span: float, lines: Array
) -> tuple[Array, NDArray[np.complex128]]:
    """Return the power of error, noise, measured and predicted output, and the cross power.

    Parameters
    ----------
    one : the run
    error : (n,) its residual, spikes cut
    span : s, the length of a segment: it sets one frequency resolution for all runs
    lines : (k,) Hz, where the powers are asked for

    Returns
    -------
    powers : (4, k) unit^2/Hz
    joint : (k,) unit^2/Hz, of error and predicted output
    """
    from scipy.signal import csd, welch

    options = {"fs": 1.0 / one.dt, "nperseg": min(round(span / one.dt), len(error))}
    predicted, measured = one.predicted[one.skip :], one.measured[one.skip :]
    own, power = welch(error, **options)
    noise = 2.0 * one.noise**2 * one.dt + np.mean(welch(one.carried, **options)[1], axis=0)
    seen, model = welch(measured, **options)[1], welch(predicted, **options)[1]
    joint = csd(error, predicted, **options)[1]
    powers = np.array([np.interp(lines, own, each) for each in (power, noise, seen, model)])
    return powers, np.interp(lines, own, joint)


def edges(rate: float, duration: float) -> Array:
    """Return the edges [Hz] of octaves from where runs hold some cycles to half the rate."""
    lowest = 2.0 ** np.ceil(np.log2(_CYCLES / duration))
    inner: list[float] = []
    f = lowest
    while f < 0.4 * rate and len(inner) < _MOST - 1:
        inner.append(f)
        f *= 2.0
    return np.array([0.0, *inner, 0.5 * rate])


def _bands(
    predictions: Sequence[RunPrediction],
    errors: Sequence[Array],
    rate: float,
    lines: Array,
    coherence: Array,
    power: Array,
) -> tuple[Band, ...]:
    """Return the bands, from one tapered periodogram per run: its lines are nearly independent."""
    from scipy.stats import chi2

    cuts = edges(rate, min(len(one.residual) * one.dt for one in predictions))
    found, expected, freedom = (np.zeros(len(cuts) - 1) for _ in range(3))
    for one, error in zip(predictions, errors, strict=True):
        f, mine = _periodogram(error, one.dt)
        inside = f <= cuts[-1] * (1.0 + 1e-6)  # a faster run holds more than all runs share
        f, mine = f[inside], mine[inside]
        white = np.full(len(f), 2.0 * one.noise**2 * one.dt)
        carried = [_periodogram(d, one.dt)[1][inside] for d in one.carried]
        noise = white + np.mean(carried, axis=0)
        width = f[1] - f[0]
        weight = len(one.residual) / sum(len(other.residual) for other in predictions)
        label = np.clip(np.searchsorted(cuts, f, side="right") - 1, 0, len(cuts) - 2)
        found += weight * np.bincount(label, weights=mine, minlength=len(cuts) - 1) * width
        expected += weight * np.bincount(label, weights=noise, minlength=len(cuts) - 1) * width
        # A band whose noise sits in few lines has few degrees of freedom (Satterthwaite 1946).
        top = np.bincount(label, weights=noise, minlength=len(cuts) - 1) ** 2
        under = np.bincount(label, weights=noise**2, minlength=len(cuts) - 1)
        freedom += 2.0 * top / np.maximum(under, 1e-300) / _HANN
    excess = np.maximum(found - expected, 0.0)
    ratio = found / np.maximum(expected, 1e-300)
    p = chi2.sf(ratio * freedom, np.maximum(freedom, 1.0))
    out = []
    for i, (low, high) in enumerate(itertools.pairwise(cuts)):
        within = (lines >= low) & (lines < high)
        weights = power[within]
        shared = float(np.average(coherence[within], weights=weights)) if weights.sum() else 0.0
        out.append(
            Band(
                float(low), float(high), float(np.sqrt(ratio[i])), float(np.sqrt(found[i])),
                float(excess[i] / max(excess.sum(), 1e-300)), float(p[i]), shared,
            )
        )  # fmt: skip
    return tuple(out)


def _periodogram(y: Array, dt: float) -> tuple[Array, Array]:
    from scipy.signal import periodogram

    f, power = periodogram(y, fs=1.0 / dt, window="hann", detrend=False)
    return np.asarray(f), np.asarray(power)

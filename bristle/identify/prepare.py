"""From a measurement to a run that a model can be held against."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..records.measurement import Measurement
from .fit import Run
from .smooth import posterior_draws, smooth

Array = NDArray[np.float64]

SHORTEST = 200
"""Fewest samples of a run that a fit makes sense of."""

_WINDOW = 10  # samples on either side in which a jump of the voltage shows


def prepare(measurement: Measurement, draws: int = 12, seed: int = 0) -> Run:
    """Return a bench measurement as a run: one smoothed motion, its uncertainty, the force.

    Parameters
    ----------
    measurement : Measurement
        With the force, and displacement or velocity or both. Voltage may be missing (taken as 0),
        or stand in as current; both are smoothed, steps kept.
    draws : int
        How many draws of the motion's and the voltage's error to keep.

    Raises
    ------
    RecordError
        If a channel that is needed is missing, or there are fewer than `SHORTEST` samples.
    """
    if not measurement.has("force"):
        raise RecordError(f"{measurement.name}: no force was measured; a bench run needs one.")
    if not (measurement.has("displacement") or measurement.has("velocity")):
        raise RecordError(f"{measurement.name}: neither displacement nor velocity was measured.")
    n, dt = len(measurement.time), measurement.step
    if n < SHORTEST:
        raise RecordError(f"{measurement.name}: {n} samples; a fit needs {SHORTEST} or more.")
    x = measurement.channels.get("displacement")
    v = measurement.channels.get("velocity")
    noise = (measurement.noise.get("displacement", 0.0), measurement.noise.get("velocity", 0.0))
    have = (x is not None, v is not None)
    motion = smooth(x, v, dt, noise)
    drive = next((c for c in ("voltage", "current") if measurement.has(c)), None)
    V = measurement[drive] if drive else np.zeros(n)
    V_noise = measurement.noise.get(drive, 0.0) if drive else 0.0
    V, left = smooth_steps(V, V_noise)
    error = np.zeros((draws, n, 4))
    error[:, :, :3] = posterior_draws(n, dt, noise, motion.jerk, have, draws, seed)
    generator = np.random.default_rng(seed + 1)
    error[:, :, 3] = generator.standard_normal((draws, 1)) * left
    return Run(
        measurement.name, dt, motion.x, motion.v, motion.a, V, measurement["force"],
        measurement.noise["force"], error,
    )  # fmt: skip


def smooth_steps(V: Array, noise: float) -> tuple[Array, float]:
    """Return a drive signal without its noise but with its steps, and the noise that is left.

    Between jumps the signal is the mean where that fits within the noise, else a local line.

    Parameters
    ----------
    V : (n,) V or A
    noise : standard deviation in the same unit
    """
    spread = float(np.ptp(V))
    if noise <= 1e-4 * max(spread, 1e-12) or len(V) < 4 * _WINDOW:
        return V.copy(), noise
    edges = [0, *_jumps(V, noise), len(V)]
    out = np.empty_like(V)
    left = 0.0
    for begin, end in pairwise(edges):
        piece = V[begin:end]
        if len(piece) < 4 or np.std(piece) < 1.3 * noise:
            out[begin:end] = piece.mean()
        else:
            out[begin:end] = _local_line(piece, _WINDOW)
            left = noise / np.sqrt(2.0 * _WINDOW + 1.0)
    return out, left


def _jumps(V: Array, noise: float) -> list[int]:
    """Return the samples at which the signal jumps: means on both sides differ, sharply."""
    w = _WINDOW
    total = np.concatenate([[0.0], np.cumsum(V)])
    k = np.arange(w, len(V) - w)
    after = (total[k + w] - total[k]) / w
    before = (total[k] - total[k - w]) / w
    height = np.abs(after - before)
    sharp = np.abs(V[k] - V[k - 1])
    jumps: list[int] = []
    for i in np.argsort(-height):
        if height[i] < 6.0 * noise * np.sqrt(2.0 / w):
            break
        if sharp[i] > max(0.5 * height[i], 4.0 * noise) and all(abs(k[i] - j) > w for j in jumps):
            jumps.append(int(k[i]))
    return sorted(jumps)


def _local_line(y: Array, w: int) -> Array:
    """Return the centred value of lines fitted over 2 w + 1 samples, quadratic at the ends."""
    from scipy.signal import savgol_filter

    length = min(2 * w + 1, len(y) - (len(y) + 1) % 2)
    return np.asarray(savgol_filter(y, length, min(2, length - 1)), dtype=float)

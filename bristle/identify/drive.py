"""A voltage or current without its noise but with its steps, and what that leaves uncertain.

Laboratories drive a damper by steps or by smooth signals. Steps are found as changes of the mean
(binary segmentation: Scott & Knott 1974, Biometrics 30(3), 507-512) and averaged between; what is
not flat between its jumps goes through the smoother of the motion.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .smooth import posterior_draws, smooth

Array = NDArray[np.float64]

_WINDOW = 10  # samples on either side in which a jump of the signal shows
_PIECE = 15  # samples that levels last at least, on average; shorter ones are no steps
_CHANCE = 30.0  # gain of a change of mean, in variances of the noise, that chance does not reach


def smooth_drive(V: Array, noise: float, dt: float, draws: int, seed: int) -> tuple[Array, Array]:
    """Return a drive signal (n,) smoothed, and draws (draws, n) of the error that is left.

    Parameters
    ----------
    V : (n,) V or A
    noise : standard deviation in the same unit
    dt : sampling step [s]
    draws, seed : how many draws of the error, and their seed
    """
    generator = np.random.default_rng(seed)
    error = np.zeros((draws, len(V)))
    if noise <= 1e-4 * max(float(np.ptp(V)), 1e-12) or len(V) < 4 * _WINDOW:
        return V.copy(), error
    edges = _levels(V, noise)
    stepped = edges is not None
    edges = edges if edges is not None else [0, *_jumps(V, noise), len(V)]
    out = np.empty_like(V)
    for begin, end in pairwise(edges):
        piece, part = V[begin:end], slice(begin, end)
        if stepped or end - begin < 4 or np.std(piece) < 1.1 * noise:
            out[part] = piece.mean()
            left = noise / np.sqrt(end - begin)
            error[:, part] = left * generator.standard_normal((draws, 1))
        elif end - begin < 4 * _WINDOW:
            out[part] = _local_line(piece, _WINDOW)
            error[:, part] = 0.4 * noise * generator.standard_normal((draws, 1))
        else:
            found = smooth(piece, None, dt, (noise, 1.0))
            out[part] = found.x
            own = (noise, 1.0), found.jerk, (True, False), draws, seed + begin, found
            error[:, part] = posterior_draws(end - begin, dt, *own)[:, :, 0]
    return out, error


def smooth_steps(V: Array, noise: float, dt: float = 0.002) -> tuple[Array, float]:
    """Return a drive signal (n,) smoothed and the RMS of the error that is left."""
    out, error = smooth_drive(V, noise, dt, 8, 0)
    return out, float(np.sqrt(np.mean(error**2)))


def _levels(V: Array, noise: float) -> list[int] | None:
    """Return the edges between levels, the ends included; None where they do not make the signal.

    They do if what is left is no more than the noise, and levels last.
    """
    total = np.concatenate([[0.0], np.cumsum(V - V.mean())])
    edges, open_parts = [0, len(V)], [(0, len(V))]
    while open_parts:
        begin, end = open_parts.pop()
        at, gain = _best_split(total, begin, end)
        if gain > _CHANCE * noise * noise:
            edges.append(at)
            open_parts += [(begin, at), (at, end)]
            if len(edges) > len(V) // _PIECE:
                return None
    edges.sort()
    for _ in range(2):  # the first splits were made before their neighbours were known
        for i in range(1, len(edges) - 1):
            edges[i] = _best_split(total, edges[i - 1], edges[i + 1])[0]
    level = np.concatenate([np.full(e - b, V[b:e].mean()) for b, e in pairwise(edges)])
    return edges if np.std(V - level) <= 1.1 * noise else None


def _best_split(total: Array, begin: int, end: int) -> tuple[int, float]:
    """Return where two means explain a part best, and by how much the sum of squares falls."""
    n = end - begin
    if n < 4:
        return begin + n // 2, 0.0
    k = np.arange(1, n)
    apart = total[begin + 1 : end] - total[begin] - k / n * (total[end] - total[begin])
    gain = apart**2 * n / (k * (n - k))
    best = int(np.argmax(gain))
    return begin + 1 + best, float(gain[best])


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

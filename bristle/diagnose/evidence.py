"""Significance that accounts for correlation: blocks, not samples, are what is independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""


def z_of(loss: Array) -> float:
    """Return RMS(residual)/noise from the mean robust loss: 1 for Gaussian noise of that size."""
    return float(np.sqrt(np.mean(loss) / HUBER_AT_ONE))


@dataclass(frozen=True)
class Difference:
    """A paired difference of losses on held-out runs: its mean and the interval of that mean."""

    mean: float
    low: float
    high: float

    @property
    def certain(self) -> bool:
        """Whether zero lies outside the interval."""
        return self.low > 0.0 or self.high < 0.0


def paired(
    first: Array, second: Array, block: int = 250, draws: int = 400, seed: int = 0
) -> Difference:
    """Return the mean of first - second per sample with its 99 % interval by block bootstrap.

    Parameters
    ----------
    first, second : (n,) losses of two models on the same samples
    block : samples per block, longer than the residuals' correlation
    """
    difference = first - second
    blocks = np.array(
        [part.mean() for part in np.array_split(difference, max(4, len(difference) // block))]
    )
    generator = np.random.default_rng(seed)
    picks = generator.integers(0, len(blocks), (draws, len(blocks)))
    means = blocks[picks].mean(axis=1)
    low, high = np.quantile(means, [0.005, 0.995])
    return Difference(float(blocks.mean()), float(low), float(high))


def organised(
    residual: Array, coordinate: Array, bins: int = 16, shifts: int = 60, seed: int = 0
) -> tuple[float, float]:
    """Return how much of a residual a coordinate organises, and the most that chance would.

    The share is the root of the explained variance of the means in bins of equal count; chance is
    its 99 % quantile over circular shifts of the residual, which keep its own correlation.
    """
    order = np.argsort(coordinate, kind="stable")
    label = np.empty(len(order), dtype=np.int64)
    label[order] = np.arange(len(order)) * bins // len(order)
    counts = np.bincount(label, minlength=bins)
    centred = np.clip(residual, -8.0, 8.0)
    centred = centred - centred.mean()
    total = float(np.sum(centred**2)) or 1.0

    def share(values: Array) -> float:
        sums = np.bincount(label, weights=values, minlength=bins)
        return float(np.sqrt(np.sum(sums**2 / np.maximum(counts, 1)) / total))

    generator = np.random.default_rng(seed)
    lags = generator.integers(len(residual) // 20, len(residual) - len(residual) // 20, shifts)
    chance = [share(np.roll(centred, int(lag))) for lag in lags]
    return share(centred), float(np.quantile(chance, 0.99))

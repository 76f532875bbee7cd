"""Significance that accounts for correlation: blocks, not samples, are what is independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .rule import BENCH

Array = NDArray[np.float64]


BLOCK = 250
"""Samples per block, longer than the residuals' correlation."""


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


def parts_of(losses: Array, block: int = BLOCK) -> list[Array]:
    """Return losses (n,) in blocks of about so many samples, four at least."""
    return np.array_split(losses, max(4, len(losses) // block))


def paired(
    first: Array,
    second: Array,
    chance: float = BENCH.chance,
    block: int = BLOCK,
    draws: int = 400,
    seed: int = 0,
) -> Difference:
    """Return the mean of first - second per sample with its interval by block bootstrap.

    Parameters
    ----------
    first, second : (n,) losses of two models on the same samples
    chance : probability left outside the interval, half on either side
    block : samples per block, longer than the residuals' correlation
    draws, seed : how many resamplings of the blocks, and their seed
    """
    difference = first - second
    blocks = np.array([part.mean() for part in parts_of(difference, block)])
    generator = np.random.default_rng(seed)
    picks = generator.integers(0, len(blocks), (draws, len(blocks)))
    means = blocks[picks].mean(axis=1)
    low, high = np.quantile(means, [0.5 * chance, 1.0 - 0.5 * chance])
    return Difference(float(blocks.mean()), float(low), float(high))

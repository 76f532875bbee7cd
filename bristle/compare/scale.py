"""The size of an error in units of the noise, by a scale that a few large errors do not carry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import huber

Array = NDArray[np.float64]

HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""


def z_of(loss: Array) -> float:
    """Return RMS(residual)/noise from robust losses (n,): 1 for Gaussian noise of that size."""
    return float(np.sqrt(np.mean(loss) / HUBER_AT_ONE))


def z_scale(normalised: Array) -> float:
    """Return z of residuals (n,) over their expected noise.

    Huber's loss with k = 2 (Huber 1964, Ann. Math. Statist. 35, 73-101): the errors of a sign law
    near v = 0 are not Gaussian, and a plain RMS reads 2 for the truth.
    """
    return z_of(huber(normalised))


def rms(values: Array) -> float:
    """Return the root of the mean square, 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0

"""The residual of a model on measured runs, in units of the noise that a true model would show.

Fits minimise it, comparisons look for patterns in it, diagnoses decide by it: so it is written
once, here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .model import Model, Problem
from .search import z_scale

Array = NDArray[np.float64]
Expected = list[tuple[Array, Array, Array]]
"""Per run: bias (n,) and noise (n,) expected of a true model's residual, and draws (d, n) of it."""

FINITE = 1e6
"""What counts as the normalised residual where a prediction is not finite."""


def over_noise(error: Array, sigma: Array) -> Array:
    """Return an error (n,) over the noise expected of a true model (n,), always finite."""
    return np.asarray(np.nan_to_num(error / sigma, nan=FINITE, posinf=FINITE, neginf=-FINITE))


def errors(problem: Problem, model: Model, expected: Expected) -> list[Array]:
    """Return per run the error (n - skip,) [N]: measured less predicted, less the expected bias."""
    return [
        (run.force - problem.predict(model, run) - bias)[run.skip :]
        for run, (bias, _, _) in zip(problem.runs, expected, strict=True)
    ]


def residuals(problem: Problem, model: Model, expected: Expected) -> Array:
    """Return the normalised residuals (n,) of all runs, one run after the other."""
    parts = [
        over_noise(error, sigma[run.skip :])
        for error, run, (_, sigma, _) in zip(
            errors(problem, model, expected), problem.runs, expected, strict=True
        )
    ]
    return np.concatenate(parts)


def robust_z(problem: Problem, model: Model, draws: int = 12) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model."""
    return z_scale(residuals(problem, model, problem.expectation(model, draws)))

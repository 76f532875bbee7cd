"""How far a model's residual exceeds the noise that a true model would show."""

from __future__ import annotations

import numpy as np

from ..identify.fit import Model, Problem, huber

_HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""


def robust_z(problem: Problem, model: Model) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model."""
    parts = []
    for run, (bias, sigma, _) in zip(problem.runs, problem.expectation(model), strict=True):
        parts.append(((run.force - problem.predict(model, run) - bias) / sigma)[run.skip :])
    loss = float(np.mean(huber(np.nan_to_num(np.concatenate(parts), nan=1e6))))
    return float(np.sqrt(loss / _HUBER_AT_ONE))

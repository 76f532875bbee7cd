"""How far a model's residual exceeds the noise that a true model would show."""

from __future__ import annotations

import numpy as np

from ..identify.fit import Model, Problem
from ..identify.search import z_scale


def robust_z(problem: Problem, model: Model, draws: int = 12) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model."""
    parts = []
    for run, (bias, sigma, _) in zip(problem.runs, problem.expectation(model, draws), strict=True):
        z = (run.force - problem.predict(model, run) - bias) / sigma
        parts.append(np.nan_to_num(z[run.skip :], nan=1e6, posinf=1e6, neginf=-1e6))
    return z_scale(np.concatenate(parts))

"""How far a model's residual exceeds the noise that a true model would show."""

from __future__ import annotations

import numpy as np

from ..identify.fit import Model, Problem, huber


def robust_z(problem: Problem, model: Model, draws: int = 12) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model.

    Near rest the error of a law with a sign is far from Gaussian. So the mean loss is divided by
    that of the drawn noise, not by what Gaussian noise would give.
    """
    generator = np.random.default_rng(0)
    found = drawn = 0.0
    for run, (bias, sigma, spread) in zip(
        problem.runs, problem.expectation(model, draws), strict=True
    ):
        s = slice(run.skip, None)
        z = ((run.force - problem.predict(model, run) - bias) / sigma)[s]
        found += float(np.sum(huber(np.nan_to_num(z, nan=1e6))))
        own = run.noise * generator.standard_normal(spread.shape)
        drawn += float(np.sum(huber(((spread + own) / sigma)[:, s]))) / len(spread)
    return float(np.sqrt(found / drawn))

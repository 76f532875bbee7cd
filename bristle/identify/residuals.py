"""The residual of a model on measured runs, in units of the noise that a true model would show.

Fits minimise it, comparisons look for patterns in it, diagnoses decide by it: so it is written
once, here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..physics.effect import EFFECTS
from .model import Model, Problem
from .search import HUBER, z_scale

Array = NDArray[np.float64]
Expected = list[tuple[Array, Array, Array]]
"""Per run: bias (n,) and noise (n,) expected of a true model's residual, and draws (d, n) of it."""

BLOCK = 250
"""Samples, longer than a residual's correlation."""

PASSES = 5
"""Weighted means until the constant of a residual has settled."""

EXPLAINS = 1.2
"""z up to which a model explains the runs: what it leaves counts as noise."""

FAR = 10.0
"""Robust standard deviations up to which errors count in the variance of what a model misses."""

FINITE = 1e6
"""What counts as the normalised residual where a prediction is not finite."""


def over_noise(error: Array, sigma: Array) -> Array:
    """Return an error (n,) over the noise expected of a true model (n,), always finite."""
    z: Array = error / sigma
    if np.isfinite(z).all():  # the rule, and the rest takes five times as long
        return z
    return np.asarray(np.nan_to_num(z, nan=FINITE, posinf=FINITE, neginf=-FINITE))


def errors(problem: Problem, model: Model, expected: Expected) -> list[Array]:
    """Return per run the error (n - skip,) [N]: measured less predicted, less the expected bias.

    Where the force's zero is fitted along, less that zero as well; a model with an effect that has
    a constant force of its own has none besides.
    """
    found = [
        (run.force - problem.predict(model, run) - bias)[run.skip :]
        for run, (bias, _, _) in zip(problem.runs, expected, strict=True)
    ]
    if not problem.free_zero or has_offset(model):
        return found
    zero = _constant(problem, found, expected)
    return [error - zero for error in found]


def has_offset(model: Model) -> bool:
    """Return whether an effect of a model has a constant force of its own that a fit moves."""
    return any(
        EFFECTS[name].offset and f"{name}.{EFFECTS[name].offset}" not in model.fixed
        for name in model.effects
    )


def zero_of(problem: Problem, model: Model) -> tuple[float, float]:
    """Return the constant [N] by which the force is above a model's, and its standard deviation.

    It is that of Huber's loss over all runs; the deviation is from the scatter of blocks.
    """
    expected = problem.expectation(model)
    found = [
        (run.force - problem.predict(model, run) - bias)[run.skip :]
        for run, (bias, _, _) in zip(problem.runs, expected, strict=True)
    ]
    zero = _constant(problem, found, expected)
    sigma = [e[1][run.skip :] for run, e in zip(problem.runs, expected, strict=True)]
    weight = np.concatenate(sigma) ** -2.0
    left = (np.concatenate(found) - zero) * weight
    edges = np.arange(0, len(left), min(BLOCK, max(1, len(left) // 20)))
    return zero, float(np.sqrt(np.sum(np.add.reduceat(left, edges) ** 2)) / weight.sum())


def _constant(problem: Problem, found: list[Array], expected: Expected) -> float:
    """Return the constant of errors per run (n - skip,) [N] by weighted Huber means."""
    error = np.concatenate(found)
    sigma = np.concatenate(
        [e[1][run.skip :] for run, e in zip(problem.runs, expected, strict=True)]
    )
    finite = np.isfinite(error)
    error, base = error[finite], sigma[finite] ** -2.0
    if not len(error):
        return 0.0
    zero, weight = 0.0, base
    for turn in range(PASSES):
        zero = float(np.dot(weight, error) / weight.sum())
        z = np.abs(error - zero) * np.sqrt(base)
        if turn == 0:  # held from then on, so that the constant is smooth in the parameters
            spread = max(1.0, float(np.median(z)) / 0.6745)
        weight = base * np.minimum(1.0, HUBER * spread / np.maximum(z, 1e-300))
    return zero


def residuals(problem: Problem, model: Model, expected: Expected) -> Array:
    """Return the normalised residuals (n,) of all runs, one run after the other.

    That of a sample that was not measured is 0.
    """
    parts = []
    for error, run, (_, sigma, _) in zip(
        errors(problem, model, expected), problem.runs, expected, strict=True
    ):
        z = over_noise(error, sigma[run.skip :])
        parts.append(z if run.measured is None else np.where(run.judged, z, 0.0))
    return np.concatenate(parts)


def robust_z(problem: Problem, model: Model, draws: int = 12) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model."""
    expected = problem.expectation(model, draws)
    return z_scale(in_noises(problem, residuals(problem, model, expected), expected))


def told_z(problem: Problem, model: Model) -> float:
    """Return z of a model, NaN where the noise is not known and z says nothing."""
    return robust_z(problem, model) if problem.noise_known else float("nan")


@np.errstate(invalid="ignore")  # of a force that is not finite nothing is
def in_noises(problem: Problem, r: Array, expected: Expected) -> Array:
    """Return normalised residuals (n,) over the noise alone, without the problem's excess.

    Parameters
    ----------
    problem : the runs
    r : normalised residuals (n,) of a model on them
    expected : what they were divided by
    """
    if not problem.excess:
        return r
    pairs = zip(problem.runs, expected, strict=True)
    sigma = np.concatenate([e[1][run.skip :] for run, e in pairs])
    return np.asarray(r * sigma / np.sqrt(sigma**2 - problem.excess))


def excess_of(problem: Problem, model: Model) -> float:
    """Return the variance [N2] of what a fitted model misses, beside the noise; 0 up to `EXPLAINS`.

    Noise says how much a sample tells of a true model. Of a model that misses many times the noise
    it says nothing: a fit by noise alone follows the quiet samples and runs, and counts all others
    by their absolute error. The variance is that of the error, those far out bounded; it grows from
    0 with z.
    """
    expected = problem.expectation(model)
    z = z_scale(in_noises(problem, residuals(problem, model, expected), expected))
    if not z > EXPLAINS:
        return 0.0
    pairs = zip(errors(problem, model, expected), problem.runs, strict=True)
    left = np.abs(np.concatenate([error[run.judged] for error, run in pairs]))
    most = FAR * float(np.median(left)) / 0.6745
    return float((1.0 - (EXPLAINS / z) ** 2) * np.mean(np.minimum(left, most) ** 2))


def drawn_noise(problem: Problem, expected: Expected) -> tuple[Array, Array]:
    """Return a true model's noise as residuals have it, divided by what is expected of it.

    Parameters
    ----------
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`

    Returns
    -------
    (n,) standard deviation of the force's own noise; (d, n) draws of the motion's
    """
    pairs = list(zip(problem.runs, expected, strict=True))
    own = np.concatenate([run.noise / e[1][run.skip :] for run, e in pairs])
    count = min(len(spread) for _, _, spread in expected)
    drawn = [
        np.concatenate([e[2][d][run.skip :] / e[1][run.skip :] for run, e in pairs])
        for d in range(count)
    ]
    return own, np.array(drawn).reshape(count, len(own))

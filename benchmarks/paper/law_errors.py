"""Errors of laws as Shirazi et al. (2012), section III-C, judge them.

The quadratic error of the force, measured and predicted force low-passed alike, is minimised from
several starting points; standard laws lack the exponential. The low-pass leaves little above its
cut-off, so the searches from the starts take a part of the samples. What they end at is fitted
once more to all samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bristle.core.arrays import Array
from bristle.identification.error import ForceError, force_error
from bristle.identification.fit import Search
from bristle.identification.low_passed import CUTOFF, error_rms, filtered_errors, force_rms
from bristle.identification.problem import Problem, steady, without
from bristle.identification.search import descend, in_threads
from bristle.identification.starts import start_models
from bristle.model.model import Model
from bristle.physics.laws import base_and_variant

REST = 1e-3
"""Speed [m/s] below which a law with a sign is not valid: the damper may be stuck there."""

THINNED = 8.0
"""Samples per period of the cut-off that searches from the starts keep, at the least."""

ENOUGH = 3000
"""Samples of all runs together that they keep, at the least."""

_ALIKE = 1e-3
_FIRST, _LAST = 1e-3, 1e-4  # relative gain at which a search on a part of the samples, on all, ends
_QUADRATIC = 1e3  # residuals divided by this stay where the search's loss is quadratic


@dataclass(frozen=True)
class LawError:
    """The error of one law, fitted to the training runs.

    `error` that on the runs that decide: held out, else for training. Of the low-passed force:
    `train` the RMS error [N] on the training runs, `moving` on samples that decide faster than
    `REST`. `starts`, `agreed` how many starts were tried and how many came to the same end.
    """

    law: str
    model: Model
    error: ForceError
    train: float
    moving: float
    starts: int
    agreed: int


def law_errors(
    train: Problem,
    holdout: Problem | None,
    cutoff: float = CUTOFF,
    *,
    laws: tuple[str, ...],
    starts: int = 4,
) -> list[LawError]:
    """Return the errors of laws, in the order asked for.

    Parameters
    ----------
    train, holdout : the runs that laws are fitted to, and those they are judged on, if any
    cutoff : Hz, of the low-pass on measured and predicted force; 0 for none
    laws : names of laws and of their variants
    starts : how many starting points are tried for each
    """
    return [_law_error(train, holdout, cutoff, law, starts) for law in laws]


def _law_error(
    train: Problem, holdout: Problem | None, cutoff: float, law: str, starts: int
) -> LawError:
    base, variant = base_and_variant(law)
    model = Model(base.name, (), dict(variant.values))
    if steady(train):
        model = without(model, base.driven())
    few = _thinned(train, cutoff) if base.exact() else train
    begins = start_models(few, model, starts)
    ends = in_threads(lambda one: _fit_filtered(few, one, cutoff, few is train), begins)
    ends = sorted(ends, key=lambda end: end[1])
    tried, agreed = len(ends), sum(end[1] <= ends[0][1] * (1.0 + _ALIKE) for end in ends)
    if few is not train:
        # Of those that agree the first stands for all; the next one may still overtake it.
        leading = (ends[0], *ends[agreed:][:1])
        ends = in_threads(lambda end: _fit_filtered(train, end[0], cutoff), leading)
    best, _ = min(ends, key=lambda end: end[1])
    deciding = holdout if holdout is not None and holdout.runs else train
    errors = filtered_errors(deciding, best, cutoff)
    moving = np.concatenate([
        e[(np.abs(run.v[run.skip :]) >= REST) & run.judged]
        for e, run in zip(errors, deciding.runs, strict=True)
    ])  # fmt: skip
    return LawError(
        law, best, force_error([(deciding, best)]), error_rms(train, best, cutoff),
        float(np.sqrt(np.mean(moving**2))), tried, agreed,
    )  # fmt: skip


def _thinned(problem: Problem, cutoff: float) -> Problem:
    """Return the runs with as few of their samples as tell a low-passed force."""
    samples = sum(len(run.force) for run in problem.runs)
    runs = []
    for run in problem.runs:
        every = int(1.0 / (THINNED * cutoff * run.dt)) if cutoff else 1
        every = max(1, min(every, samples // ENOUGH))
        runs.append(run.every(every))
    fewer = any(len(a.force) < len(b.force) for a, b in zip(runs, problem.runs, strict=True))
    return problem.of(runs) if fewer else problem


def _fit_filtered(
    problem: Problem, model: Model, cutoff: float, whole: bool = True
) -> tuple[Model, float]:
    """Return the least-squares fit of the low-passed force from one start, and its RMS error.

    Parameters
    ----------
    problem : the runs
    model : where the search begins
    cutoff : Hz
    whole : whether the problem has all samples, not a part of them
    """
    none = [(np.zeros(1), np.ones(1), np.zeros((1, 1))) for _ in problem.runs]
    scaled = Search(problem, model, none, model.free(), logarithms=False)
    unit = _QUADRATIC * force_rms(problem.runs, cutoff)

    def residuals(theta: Array) -> Array:
        errors = filtered_errors(problem, scaled.at(theta), cutoff)
        return np.nan_to_num(np.concatenate(errors) / unit, nan=1e3, posinf=1e3, neginf=-1e3)

    tolerance = _LAST if whole else _FIRST
    found = descend(residuals, scaled.start, scaled.low, scaled.high, 12, tolerance)
    best = scaled.at(found.theta)
    return replace(best, values=dict(best.values)), error_rms(problem, best, cutoff)

"""Effects that improve the prediction and are not proven: folds of the training runs choose them.

A verdict names an effect where held-out runs prove it. Where they prove none, several effects
together may still predict better. What is taken is what lowers the error on the training runs left
out of the fit; the held-out runs only judge it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import Array
from ..diagnosis.prepared import Prepared
from ..diagnosis.trials import LONG, SECONDS, Trial, missed_by, try_all
from ..identification.problem import Problem
from ..identification.search import in_threads
from ..identification.start_grid import refine
from ..learning.closure import errors_of, lowers
from ..model.model import Model
from ..physics.effect import EFFECTS

FOLDS = 3
"""Parts of the training runs that are left out in turn: whole runs, of a single one stretches."""

TRIED = 3
"""Effects, those that fit the training runs best, that folds compare at each step."""

SWEEPS = 4
"""Jacobians of the fit to a fold's runs, which begins at the values of all."""

GAIN = 0.03
"""Share of the error on the runs left out that an effect takes at least."""


def unproven(prepared: Prepared, trials: Sequence[Trial], most: int) -> Model:
    """Return the model with the effects that lower its error on runs left out, itself if none do.

    Parameters
    ----------
    prepared : the runs, and the model that effects join
    trials : of that model with one effect more each, as far as they are known
    most : how many effects a model has at the most
    """
    missed = missed_by(prepared.before, prepared.searched)
    data = prepared.with_excess(missed) if missed > 0.0 else prepared
    problem = data.searched
    best = refine(prepared.before.model, problem, SWEEPS)
    errors = left_out_errors(best, problem)
    while len(best.effects) < most:
        able = [one for one in trials if _joins(one, best)]
        if not able:
            able = try_all(best, problem, data.held_out, shown=data.shown, most=SECONDS)
        models = [one.model for one in sorted(able, key=lambda one: one.train)[:TRIED]]
        found = in_threads(lambda model: left_out_errors(model, problem), models)
        better = [
            (_mean_square(one), k) for k, one in enumerate(found) if lowers(errors, one, GAIN)
        ]
        if not better:
            break
        _, k = min(better)
        best, errors = refine(models[k], problem, LONG), found[k]
    return best


def _joins(trial: Trial, model: Model) -> bool:
    """Return whether a trial is of a model with one effect more, that is known still."""
    new = {*trial.effects} - {*model.effects}
    added = len(new) == 1 and len(trial.effects) == len(model.effects) + 1
    return trial.model.law == model.law and added and new <= {*EFFECTS}


def _mean_square(errors: Sequence[Array]) -> float:
    return float(np.mean(np.concatenate([*errors]) ** 2))


def left_out_errors(model: Model, problem: Problem) -> list[Array]:
    """Return the errors [N] of a model on each fold, fitted to the others."""
    return [
        error
        for others, own in folds(problem)
        for error in errors_of(refine(model, others, SWEEPS), own)
    ]


def folds(problem: Problem) -> Iterator[tuple[Problem, Problem]]:
    """Yield the runs without each fold, and that fold."""
    runs = problem.runs
    for k in range(FOLDS):
        if len(runs) == 1:
            run, n = runs[0], len(runs[0].force)
            own = np.arange(n) * FOLDS // n == k
            without, alone = (
                [replace(run, left_out={**run.left_out, "fold": out})] for out in (own, ~own)
            )
        else:
            without = [run for j, run in enumerate(runs) if j % FOLDS != k]
            alone = [run for j, run in enumerate(runs) if j % FOLDS == k]
        if without and alone:
            yield problem.of(without), problem.of(alone)

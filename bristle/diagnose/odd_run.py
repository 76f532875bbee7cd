"""The one run whose force was recorded with another zero or gain than in all others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data.checks.differing_runs import is_covered
from ..data.corrections import LEFT_OUT
from ..identify.fit import Model, Problem, fit
from ..identify.residuals import in_noises, residuals, robust_z
from ..identify.search import z_scale
from ..quantity import plain
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

FEWEST = 4
"""Runs from which one that differs is told: three others must agree."""

TINY = 1e-300
"""In place of a sum of squares of a model that shows no force."""

SUSPECTS = 3
"""Runs whose force is farthest from that of the others, each of which is left out of a fit."""


def odd_run(
    model: Model,
    train: Problem,
    held_out: Problem,
    rule: DecisionRule = BENCH,
    called: str = "One model",
) -> str:
    """Return, in words, the one run whose zero or gain is another one; "" where none is.

    For a model that the runs do not agree with: fitted to all runs but one it must explain each of
    them, and that one but for its zero or gain. Others must have moved as fast, at the same
    command; else the run may show what the model lacks.

    Parameters
    ----------
    model : law and effects; it is refitted without each run in question
    train, held_out : the runs
    rule : the numbers that decide
    called : what the sentence calls the model
    """
    runs = [*train.runs, *held_out.runs]
    if len(runs) < FEWEST:
        return ""
    apart = np.array([
        _amount(model, train.of([run]), train.predict(model, run))[0] for run in runs
    ])  # fmt: skip
    farthest = np.argsort(-np.abs(apart - np.median(apart)))
    for k in farthest[:SUSPECTS].tolist():
        run, others = runs[k], [*runs[:k], *runs[k + 1 :]]
        if not is_covered([(one.v, one.V) for one in (run, *others)], 1):
            continue
        fitted = fit(train.of(others), model, with_std=False).model
        if max(robust_z(train.of([one]), fitted) for one in others) > rule.misfit:
            continue
        one = train.of([run])
        if robust_z(one, fitted) <= rule.misfit:
            continue
        if told := other_zero(fitted, one, rule) or other_gain(fitted, one, rule):
            return f"{called} explains all runs but {run.name}. {told} Else {LEFT_OUT}."
    return ""


def _amount(model: Model, one: Problem, shape: Array) -> tuple[float, float]:
    """Return how much of a shape a run's force shows beyond a model, and z of what then remains.

    Parameters
    ----------
    model : as fitted to the runs
    one : the run
    shape : (n,) N
    """
    (run,), expected = one.runs, one.expectation(model)
    normalised = shape[run.skip :] / expected[0][1][run.skip :]
    left = residuals(one, model, expected)
    amount = float(left @ normalised) / max(float(normalised @ normalised), TINY)
    return amount, z_scale(in_noises(one, left - amount * normalised, expected))


def other_zero(model: Model, one: Problem, rule: DecisionRule) -> str:
    """Return the sentence about another zero of a run's force, "" where more than that is wrong.

    Parameters
    ----------
    model : as fitted to the runs
    one : the run
    rule : the numbers that decide
    """
    (run,) = one.runs
    zero, remaining = _amount(model, one, np.ones(len(run.force)))
    if remaining > rule.misfit:
        return ""
    way = "more" if zero > 0.0 else "less"
    return (
        f"In {run.name} the force shows {plain(abs(zero), 3)} N {way} throughout its "
        f"{len(run.force):,} samples, and nothing else is wrong there: its zero is another one. "
        "Set it right in study.toml: correct = "
        f'[{{channel = "force", fault = "bias", value = {zero:.3g}}}].'
    )


def other_gain(model: Model, one: Problem, rule: DecisionRule) -> str:
    """Return the sentence about another gain of a run's force, "" where more than that is wrong.

    Parameters
    ----------
    model, one, rule : as in `other_zero`
    """
    (run,) = one.runs
    more, remaining = _amount(model, one, one.predict(model, run))
    gain = 1.0 + more
    if gain <= 0.0 or remaining > rule.misfit:
        return ""
    return (
        f"In {run.name} the force is {plain(gain, 3)} times what the model says throughout its "
        f"{len(run.force):,} samples, and nothing else is wrong there: another range of the load "
        "cell, or another temperature. If the range was another one, set it right in study.toml: "
        f'correct = [{{channel = "force", fault = "gain", value = {gain:.4g}}}].'
    )

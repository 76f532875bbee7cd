"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ..data.checks.differing_runs import is_covered
from ..data.corrections import LEFT_OUT
from ..identify.fit import Model, Problem, fit, identify
from ..identify.model import Run
from ..identify.rig import DAMPER
from ..identify.search import z_scale
from ..identify.search_context import residuals
from ..identify.structure import StructureProblem
from ..quantity import plain
from .candidates import Trial
from .decision import OTHER_FORM, Z
from .finding import Finding
from .opening import Opening
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

FEWEST = 4
"""Runs from which one that differs is told: three others must agree."""

TINY = 1e-300
"""In place of a sum of squares of a model that shows no force."""

SUSPECTS = 3
"""Runs whose force is farthest from that of the others, each of which is left out of a fit."""

HELD_OUT_DIFFER = (
    "The model explains the training runs. The held-out runs differ from them in something that "
    "no channel shows."
)


def contradicted(found: Finding, opened: Opening) -> Finding:
    """Return a finding, insufficient where the runs contradict each other, with the reason.

    Parameters
    ----------
    found : what a site's trials lead to
    opened : the site's runs and its model
    """
    assert found.after is not None
    odd = _but_for_a_run(found, opened)
    if odd is not found:
        return odd
    before, rule, at_damper = opened.before, opened.rule, found.site == DAMPER
    kind = kind_of(found.kind, before, found.after, rule)
    runs = opened.searched, opened.held_out, rule
    if found.kind == kind == "unknown":
        told = groups(before.model, *runs, opened.scope.restart)
        return replace(found, kind="insufficient", reasons=(told,)) if told else found
    if found.kind == "unknown":
        worst = inconsistent_runs(before.model, *runs, at_damper)
        told = " ".join(filter(None, [*found.reasons, HELD_OUT_DIFFER, worst]))
        return replace(found, kind=kind, reasons=(told,))
    if kind == found.kind:
        return found
    told = inconsistent_runs(found.after.model, opened.problem, *runs[1:], at_damper)
    return replace(found, kind=kind, reasons=(told,))


def _but_for_a_run(found: Finding, opened: Opening) -> Finding:
    """Return a finding that names the run whose zero or gain is another one, if there is one.

    Where a model explains all other runs, what they leave together is no other form of an effect,
    and no further effect. If that model has fewer effects than the finding's, the run is to be set
    right first.

    Parameters
    ----------
    found, opened : as in `contradicted`
    """
    after, rule, problem = found.after, opened.rule, opened.problem
    assert after is not None
    by_equilibrium = isinstance(problem, StructureProblem) and problem.reconstructed
    if found.site != DAMPER or by_equilibrium or max(after.train, after.z) <= rule.misfit:
        return found
    simplest_first = (opened.before, *found.trials[:1], after)
    for effects, trial in {one.model.effects: one for one in simplest_first}.items():
        added = [name for name in effects if name not in opened.before.model.effects]
        called = f"The model with {' and '.join(added)}" if added else "One model"
        told = odd_run(trial.model, opened.searched, opened.held_out, rule, called)
        if told and effects == after.model.effects and found.effects:
            kept = (one for one in found.reasons if one != OTHER_FORM)
            return replace(found, reasons=(*kept, told))
        if told:
            return replace(found, kind="insufficient", effects=(), reasons=(told,))
    return found


def kind_of(kind: str, before: Trial, best: Trial, rule: DecisionRule = BENCH) -> str:
    """Return the kind of a verdict: a decision's, unless the runs contradict each other.

    Parameters
    ----------
    kind : the decision's
    before, best : the trial of the present model, and the one that goes with the decision
    rule : the numbers that decide
    """
    if kind == "unknown" and before.train <= rule.trained:
        return "insufficient"
    if kind == "none" and best.train > rule.misfit:
        return "insufficient"
    return kind


def inconsistent_runs(
    model: Model, train: Problem, held_out: Problem, rule: DecisionRule = BENCH, zeros: bool = True
) -> str:
    """Return, in words, which runs a model leaves unexplained and which it explains.

    For a model that the held-out runs do not contradict, while those that it was fitted to do: two
    rigs mixed, a setting changed between runs, or an effect that acts in some of them alone.

    Parameters
    ----------
    model : the model as fitted to `train`
    train, held_out : runs that it was fitted to, and the others
    rule : the numbers that decide
    zeros : whether the force is a measured one, whose zero or gain may be another one in a run

    Returns
    -------
    str
        "" where the model explains all runs.
    """
    z = {
        run.name: _z(model, problem.of([run]))
        for problem in (train, held_out)
        for run in problem.runs
    }
    bad = [name for name, size in z.items() if size > rule.misfit]
    good = [name for name in z if name not in bad]
    if not bad:
        return ""
    worst = ", ".join(f"{name} ({z[name]:.3g})" for name in bad)
    shifted = [
        _zero(model, problem.of([run]), rule) or _gain(model, problem.of([run]), rule)
        for problem in (train, held_out)
        for run in problem.runs
        if zeros and run.name in bad
    ]
    return " ".join([
        f"One model does not explain all runs: its {Z} is largest in {worst}, while it explains "
        f"{_list(good)}.",
        *filter(None, shifted),
        "Were they taken on one rig, with one setting? If a run does not belong, "
        f"{LEFT_OUT}.",
    ])  # fmt: skip


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
    return amount, z_scale(left - amount * normalised)


def _zero(model: Model, one: Problem, rule: DecisionRule) -> str:
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
        f"In {run.name} the force shows {plain(abs(zero), 3)} N {way} throughout, and nothing else "
        "is wrong there: its zero is another one. Set it right in study.toml: correct = "
        f'[{{channel = "force", fault = "bias", value = {zero:.3g}}}].'
    )


def _gain(model: Model, one: Problem, rule: DecisionRule) -> str:
    """Return the sentence about another gain of a run's force, "" where more than that is wrong.

    Parameters
    ----------
    model, one, rule : as in `_zero`
    """
    (run,) = one.runs
    more, remaining = _amount(model, one, one.predict(model, run))
    gain = 1.0 + more
    if gain <= 0.0 or remaining > rule.misfit:
        return ""
    return (
        f"In {run.name} the force is {plain(gain, 3)} times what the model says throughout, and "
        "nothing else is wrong there: another range of the load cell, or another temperature. If "
        "the range was another one, set it right in study.toml: "
        f'correct = [{{channel = "force", fault = "gain", value = {gain:.4g}}}].'
    )


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
        if max(_z(fitted, train.of([one])) for one in others) > rule.misfit:
            continue
        one = train.of([run])
        if _z(fitted, one) <= rule.misfit:
            continue
        if told := _zero(fitted, one, rule) or _gain(fitted, one, rule):
            return f"{called} explains all runs but {run.name}. {told} Else {LEFT_OUT}."
    return ""


def groups(
    model: Model,
    train: Problem,
    held_out: Problem,
    rule: DecisionRule = BENCH,
    restart: bool = True,
) -> str:
    """Return, in words, the groups of runs that each have values of their own, "" where not so.

    For a model that leaves the runs unexplained together: where it explains each of two or three
    groups by itself, two rigs were mixed or a setting was changed, and no effect is missing.

    Parameters
    ----------
    model : law and effects; it is refitted to each group
    train, held_out : the runs to group, in this order
    rule : the numbers that decide
    restart : whether a group's fit begins from several starts too, not from the values at hand
        alone: rigs may differ in size
    """
    found: list[list[Run]] = []
    for run in chain(train.runs, held_out.runs):
        for group in found:
            if _explains(model, train, [*group, run], rule, restart):
                group.append(run)
                break
        else:
            if len(found) == rule.most_groups or not _explains(model, train, [run], rule, restart):
                return ""
            found.append([run])
    if len(found) < 2 or min(len(group) for group in found) < 2:
        return ""
    named = "; ".join(_list([run.name for run in group]) for group in found)
    return (
        "One model does not explain all runs together. With separate values it explains "
        f"each of these groups: {named}. Were they taken on one rig, with one setting? If a run "
        f"does not belong, {LEFT_OUT}."
    )


def _explains(
    model: Model, problem: Problem, runs: list[Run], rule: DecisionRule, restart: bool
) -> bool:
    """Return whether a model that is fitted to these runs alone leaves noise."""
    part = problem.of(runs)
    if _z(fit(part, model, with_std=False).model, part) <= rule.misfit:
        return True
    if not restart:
        return False
    own = identify(
        part, model.law, model.effects, 2, fixed=model.fixed,
        values={name: model.value(name) for name in model.fixed}, limits=model.limits,
    )  # fmt: skip
    return _z(own.model, part) <= rule.misfit


def _z(model: Model, problem: Problem) -> float:
    return z_scale(residuals(problem, model, problem.expectation(model)))


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"

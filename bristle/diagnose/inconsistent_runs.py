"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

from ..identify.fit import Model, Problem, fit, identify
from ..identify.model import Run
from ..identify.search import z_scale
from ..identify.search_context import residuals
from .rule import BENCH, DecisionRule


def inconsistent_runs(
    model: Model, train: Problem, held_out: Problem, rule: DecisionRule = BENCH
) -> str:
    """Return, in words, which runs a model leaves unexplained and which it explains.

    For a model that the held-out runs do not contradict, while those that it was fitted to do: two
    rigs mixed, a setting changed between runs, or an effect that acts in some of them alone.

    Parameters
    ----------
    model : the model as fitted to `train`
    train, held_out : runs that it was fitted to, and the others
    rule : the numbers that decide

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
    return (
        f"One model does not explain all runs: its error in times the noise is largest in {worst}, "
        f"while {_list(good)} it explains. Were they taken on one rig, with one setting?"
    )


def groups(model: Model, train: Problem, held_out: Problem, rule: DecisionRule = BENCH) -> str:
    """Return, in words, the groups of runs that each have values of their own, "" where not so.

    For a model that leaves the runs unexplained together: where it explains each of two or three
    groups by itself, two rigs were mixed or a setting was changed, and no effect is missing.

    Parameters
    ----------
    model : law and effects; it is refitted to each group
    train, held_out : the runs to group, in this order
    rule : the numbers that decide
    """
    found: list[list[Run]] = []
    for run in chain(train.runs, held_out.runs):
        for group in found:
            if _explains(model, train, [*group, run], rule):
                group.append(run)
                break
        else:
            if len(found) == rule.most_groups or not _explains(model, train, [run], rule):
                return ""
            found.append([run])
    if len(found) < 2 or min(len(group) for group in found) < 2:
        return ""
    named = "; ".join(_list([run.name for run in group]) for group in found)
    return (
        "One model does not explain all runs together, but with values of their own it explains "
        f"each of these groups: {named}. Were they taken on one rig, with one setting?"
    )


def _explains(model: Model, problem: Problem, runs: list[Run], rule: DecisionRule) -> bool:
    """Return whether a model that is fitted to these runs alone leaves noise.

    From the values of all runs, and from the runs' own: rigs may differ in size.
    """
    part = problem.of(runs)
    if _z(fit(part, model, with_std=False).model, part) <= rule.misfit:
        return True
    own = identify(
        part, model.law, model.effects, 2, held=model.held,
        values={name: model.value(name) for name in model.held}, limits=model.limits,
    )  # fmt: skip
    return _z(own.model, part) <= rule.misfit


def _z(model: Model, problem: Problem) -> float:
    return z_scale(residuals(problem, model, problem.expectation(model)))


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"

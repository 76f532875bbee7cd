"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from ..data.corrections import LEFT_OUT
from ..identify.fit import Model, Problem, fit, identify
from ..identify.model import Run
from ..identify.rig import DAMPER
from ..identify.search import z_scale
from ..identify.search_context import residuals
from ..quantity import plain
from .candidates import Trial
from .decision import Z
from .finding import Finding
from .opening import Opening
from .rule import BENCH, DecisionRule

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
    before, rule = opened.before, opened.rule
    kind = kind_of(found.kind, before, found.after, rule)
    if kind == found.kind == "unknown":
        restart = opened.scope.restart
        mixed = groups(before.model, opened.searched, opened.held_out, rule, restart)
        return replace(found, kind="insufficient", reasons=(mixed,)) if mixed else found
    if kind == found.kind:
        return found
    if found.kind == "unknown":
        reasons = (*found.reasons, HELD_OUT_DIFFER)
    else:
        told = inconsistent_runs(
            found.after.model, opened.problem, opened.held_out, rule, found.site == DAMPER
        )
        reasons = (told,)
    return replace(found, kind=kind, reasons=reasons)


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
    zeros : whether the force is a measured one, whose zero may be another one in a run

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
        _zero(model, problem.of([run]), rule)
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


def _zero(model: Model, one: Problem, rule: DecisionRule) -> str:
    """Return the sentence about another zero of a run's force, "" where more than that is wrong.

    Parameters
    ----------
    model : as fitted to the runs
    one : the run
    rule : the numbers that decide
    """
    (run,), expected = one.runs, one.expectation(model)
    per_newton = 1.0 / expected[0][1][run.skip :]
    left = residuals(one, model, expected)
    zero = float(left @ per_newton / (per_newton @ per_newton))
    if z_scale(left - zero * per_newton) > rule.misfit:
        return ""
    way = "more" if zero > 0.0 else "less"
    return (
        f"In {run.name} the force shows {plain(abs(zero), 3)} N {way} throughout, and nothing else "
        "is wrong there: its zero is another one. Set it right in study.toml: correct = "
        f'[{{channel = "force", fault = "bias", value = {zero:.3g}}}].'
    )


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

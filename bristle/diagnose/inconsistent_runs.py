"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data.corrections import LEFT_OUT
from ..identify.fit import Model, Problem, fit, identify
from ..identify.model import Run
from ..identify.residuals import robust_z
from ..identify.rig import DAMPER
from ..identify.structure import StructureProblem
from .candidates import Trial
from .clocks import clock_faults
from .decision import OTHER_FORM, Z, force_in
from .finding import Finding
from .odd_run import odd_run, other_gain, other_zero
from .opening import Opening
from .rule import BENCH, DecisionRule

HELD_OUT_DIFFER = (
    "The model explains the training runs. Held out, {force} differs from them in something that "
    "no channel shows. Note in study.toml what was changed between them, or train on some of them: "
    'role = "train" in their [[runs]].'
)


def contradicted(found: Finding, opened: Opening) -> Finding:
    """Return a finding, insufficient where the runs contradict each other, with the reason.

    Parameters
    ----------
    found : what a site's trials lead to
    opened : the site's runs and its model
    """
    assert found.after is not None
    if not found.noise_known:
        return found  # of no run can be said what its error is over noise
    opened = opened.with_excess(0.0)  # whether noise is all that a model leaves of some of the runs
    for apart in (_but_for_a_run, _but_for_clocks):
        odd = apart(found, opened)
        if odd is not found:
            return odd
    before, rule, at_damper = opened.before, opened.rule, found.site == DAMPER
    kind = kind_of(found.kind, before, found.after, rule)
    runs = opened.searched, opened.held_out, rule
    if found.kind == kind == "unknown":
        told = groups(before.model, *runs, opened.scope.restart)
        return replace(found, kind="insufficient", reasons=(told,)) if told else found
    if found.kind == "unknown":
        differ = HELD_OUT_DIFFER.format(force=force_in(opened.held_out, found.site))
        worst = inconsistent_runs(before.model, *runs, at_damper)
        told = " ".join(filter(None, [*found.reasons, differ, worst]))
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
    for trial, added in _to_be_explained(found, opened):
        called = f"The model with {' and '.join(added)}" if added else "One model"
        told = odd_run(trial.model, opened.searched, opened.held_out, opened.rule, called)
        if told:
            return _with_reason(found, trial, told)
    return found


def _but_for_clocks(found: Finding, opened: Opening) -> Finding:
    """Return a finding that names the runs whose loggers began apart, if that explains the rest.

    Beside a missing effect it shows only in what the effect leaves: clocks are looked at for the
    present model before.

    Parameters
    ----------
    found, opened : as in `contradicted`
    """
    for trial, added in _to_be_explained(found, opened):
        clocks = clock_faults(trial, opened.problem, opened.held_out) if added else None
        if clocks is not None:
            told = " ".join(fault.words for fault in clocks.faults)
            seen = f"Told from {force_in(opened.problem)}."
            return _with_reason(found, trial, f"With {' and '.join(added)}: {told} {seen}")
    return found


def _to_be_explained(found: Finding, opened: Opening) -> list[tuple[Trial, list[str]]]:
    """Return trials that leave more than noise, with the effects that they add, simplest first.

    None where the force is no measured one.
    """
    after, problem = found.after, opened.problem
    assert after is not None
    by_equilibrium = isinstance(problem, StructureProblem) and problem.reconstructed
    if found.site != DAMPER or by_equilibrium or max(after.train, after.z) <= opened.rule.misfit:
        return []
    own = opened.before.model.effects
    trials = {one.model.effects: one for one in (opened.before, *found.trials[:1], after)}
    return [(one, [name for name in one.effects if name not in own]) for one in trials.values()]


def _with_reason(found: Finding, trial: Trial, told: str) -> Finding:
    """Return a finding with what is wrong in a run, which is to be set right first.

    Where the trial has the effects of the finding, they stand: what remains is no other form.
    """
    assert found.after is not None
    if trial.effects == found.after.effects and found.effects:
        kept = (one for one in found.reasons if one != OTHER_FORM)
        return replace(found, reasons=(*kept, told))
    return replace(found, kind="insufficient", effects=(), reasons=(told,))


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
        run.name: robust_z(problem.of([run]), model)
        for problem in (train, held_out)
        for run in problem.runs
    }
    bad = [name for name, size in z.items() if size > rule.misfit]
    good = [name for name in z if name not in bad]
    if not bad:
        return ""
    count = {run.name: len(run.force) for one in (train, held_out) for run in one.runs}
    worst = ", ".join(f"{name} ({z[name]:.3g}, {count[name]:,} samples)" for name in bad)
    shifted = [
        other_zero(model, problem.of([run]), rule) or other_gain(model, problem.of([run]), rule)
        for problem in (train, held_out)
        for run in problem.runs
        if zeros and run.name in bad
    ]
    return " ".join([
        f"One model does not explain the force of all runs: its {Z} is largest in {worst}, while "
        f"it explains {_list(good)}.",
        *filter(None, shifted),
        "Were they taken on one rig, with one setting? If a run does not belong, "
        f"{LEFT_OUT}.",
    ])  # fmt: skip


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
    runs = [*train.runs, *held_out.runs]
    for run in runs:
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
        f"One model does not explain all runs together, {force_in(train.of(runs))}. With separate "
        f"values it explains each of these groups: {named}. Were they taken on one rig, with one "
        f"setting? If a run does not belong, {LEFT_OUT}."
    )


def _explains(
    model: Model, problem: Problem, runs: list[Run], rule: DecisionRule, restart: bool
) -> bool:
    """Return whether a model that is fitted to these runs alone leaves noise."""
    part = problem.of(runs)
    if robust_z(part, fit(part, model, with_std=False).model) <= rule.misfit:
        return True
    if not restart:
        return False
    own = identify(
        part, model.law, model.effects, 2, fixed=model.fixed,
        values={name: model.value(name) for name in model.fixed}, limits=model.limits,
    )  # fmt: skip
    return robust_z(part, own.model) <= rule.misfit


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"

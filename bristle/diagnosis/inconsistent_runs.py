"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import Array
from ..core.text import plain
from ..data.checks.differing_runs import is_covered
from ..data.corrections import LEFT_OUT
from ..identification.building_sites import StructureProblem
from ..identification.fit import fit
from ..identification.histories import counted, left
from ..identification.problem import Expected, Problem, Run, in_noises, residuals, robust_z
from ..identification.rig import DAMPER
from ..identification.search import z_scale
from ..identification.starts import start_models
from ..model.model import Model
from .clocks import clock_faults
from .decision import OTHER_FORM, force_in
from .prepared import Prepared
from .rule import BENCH, DecisionRule
from .site_diagnosis import SiteDiagnosis
from .trials import Trial

# The one run whose force was recorded with another zero or gain than in all others.


FEWEST = 4
"""Runs from which one that differs is told: three others must agree."""

TINY = 1e-300
"""In place of a sum of squares of a model that shows no force."""

SUSPECTS = 3
"""Runs whose force is farthest from that of the others, each of which is left out of a fit."""

STANDS_OUT = 3.0
"""Times the error that others show, at the most, that is asked of a run without which they would
have none: least squares leave the one of n runs n - 1 times as much as each of the others."""

OF_FEW = 0.25
"""Share of these n - 1 times that is asked where it is less."""

SMALL_ZERO = 0.01
"""Share of the force's RMS up to which the zero of a run counts for nothing."""

QUICK = 3
"""Jacobians of a first fit without a run, which shows where others are unexplained without it too;
of one to a group of runs and one more."""

NEAR = 2.0
"""Multiple of the largest z of a model that explains, up to which such a fit is gone on with."""

STARTS = 2
"""Starts of a fit to one run, where the values at hand lead to none that explains it."""

MOST_SPENT = 100e6
"""Steps of dampers' forces, see `Effort`, from which on no further run, clock or group of runs is
looked at."""

LOOK = 100
"""Simulations of all runs, about, that a look at one run or at clocks takes."""


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
    expected = train.of(runs).expectation(model)
    apart = np.array([
        _amount(model, train.of([run]), train.predict(model, run), [own])[0]
        for run, own in zip(runs, expected, strict=True)
    ])  # fmt: skip
    farthest = np.argsort(-np.abs(apart - np.median(apart)))
    z = _z_of_runs(model, train.of(runs), expected)
    asked = max(1.0, min(OF_FEW * (len(runs) - 1), STANDS_OUT))
    for k in farthest[:SUSPECTS].tolist():
        run, others = runs[k], [*runs[:k], *runs[k + 1 :]]
        if not is_covered([(one.v, one.V) for one in (run, *others)], 1):
            continue
        usual = float(np.median(np.delete(z, k)))
        if usual > rule.misfit and z[k] < asked * usual:
            continue
        theirs = [*expected[:k], *expected[k + 1 :]]
        if _unexplained(model, train.of(others), theirs, rule):
            continue
        fitted = fit(train.of(others), model, with_std=False).model
        if max(robust_z(train.of([one]), fitted) for one in others) > rule.misfit:
            continue
        one = train.of([run])
        if robust_z(one, fitted) <= rule.misfit:
            continue
        if text := other_zero(fitted, one, rule) or other_gain(fitted, one, rule):
            return f"{called} explains all runs but {run.name}. {text} Else {LEFT_OUT}."
    return ""


def _unexplained(model: Model, others: Problem, expected: Expected, rule: DecisionRule) -> bool:
    """Return whether a quick fit to runs leaves half of them unexplained.

    One run among those that a model was fitted to bends it little, so that a fit without it comes
    near at once.
    """
    quick = fit(others, model, expectation=expected, max_evaluations=QUICK, with_std=False).model
    return float(np.median(_z_of_runs(quick, others, expected))) > rule.misfit


def _z_of_runs(model: Model, problem: Problem, expected: Expected) -> Array:
    """Return z of each run (k,)."""
    return np.array([z_scale(part) for part in problem.by_run(residuals(problem, model, expected))])


def _amount(
    model: Model, one: Problem, shape: Array, expected: Expected | None = None
) -> tuple[float, float]:
    """Return how much of a shape a run's force shows beyond a model, and z of what then remains.

    Parameters
    ----------
    model : as fitted to the runs
    one : the run
    shape : (n,) N
    expected : what a true model would show on it; None draws it for this model
    """
    (run,), expected = one.runs, expected or one.expectation(model)
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
    if remaining > rule.misfit or abs(zero) <= SMALL_ZERO * rms_of(run):
        return ""
    way = "more" if zero > 0.0 else "less"
    return (
        f"In {run.name} the force shows {plain(abs(zero), 3)} N {way} throughout its "
        f"{len(run.force):,} samples, and nothing else is wrong there: its zero is another one. "
        "Set it right in study.toml: correct = "
        f'[{{channel = "force", fault = "bias", value = {zero:.3g}}}].'
    )


def rms_of(run: Run) -> float:
    """Return the RMS [N] of a run's force."""
    return float(np.sqrt(np.mean(run.force**2)))


def small_zeros(model: Model, problems: Sequence[Problem], rule: DecisionRule) -> str:
    """Return the sentence about zeros too small to count, "" where more than that is wrong.

    Parameters
    ----------
    model : as fitted
    problems : runs that it was fitted to, and the others
    rule : the numbers that decide
    """
    share, largest = 0.0, ""
    for one in (problem.of([run]) for problem in problems for run in problem.runs):
        if robust_z(one, model) <= rule.misfit:
            continue
        (run,) = one.runs
        zero, remaining = _amount(model, one, np.ones(len(run.force)))
        if remaining > rule.misfit or abs(zero) > SMALL_ZERO * rms_of(run):
            return ""
        if abs(zero) / rms_of(run) >= share:
            share = abs(zero) / rms_of(run)
            largest = f"{plain(zero, 3)} N in {run.name}"
    return (
        f"The zero of the force is not quite the same in all runs ({largest}, {100 * share:.2g} % "
        "of it): too little to count."
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


HELD_OUT_DIFFER = (
    "The model explains the training runs. Held out, {force} differs from them in something that "
    "no channel shows. Note in study.toml what was changed between them, or train on some of them: "
    'role = "train" in their [[runs]].'
)


def contradicted(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding, insufficient where the runs contradict each other, with the reason.

    Parameters
    ----------
    found : what a site's trials lead to
    prepared : the site's runs and its model
    """
    assert found.after is not None
    if not found.noise_known:
        return found  # of no run can be said what its error is over noise
    # Whether noise is all that a model leaves of some of the runs.
    prepared = prepared.with_excess(0.0)
    with counted(MOST_SPENT):
        for train, apart in (
            (prepared.searched, _but_for_a_run), (prepared.problem, _but_for_clocks),
        ):  # fmt: skip
            runs = train, prepared.held_out
            for trial, added in _to_be_explained(found, prepared):
                if added and not _affordable(trial.model, runs):
                    break
                if text := apart(trial, added, runs, prepared.rule):
                    return _with_reason(found, trial, text)
    before, rule, at_damper = prepared.before, prepared.rule, found.site == DAMPER
    kind = kind_of(found.kind, before, found.after, rule)
    of_runs = prepared.searched, prepared.held_out, rule
    if found.kind == kind == "unknown":
        text = groups(before.model, *of_runs, prepared.bench)
        return replace(found, kind="insufficient", reasons=(text,)) if text else found
    if found.kind == "unknown":
        differ = HELD_OUT_DIFFER.format(force=force_in(prepared.held_out, found.site))
        worst = inconsistent_runs(before.model, *of_runs, at_damper)
        text = " ".join(filter(None, [*found.reasons, differ, worst]))
        return replace(found, kind=kind, reasons=(text,))
    if kind == found.kind:
        return found
    best = found.after.model
    if at_damper and (text := small_zeros(best, (prepared.problem, prepared.held_out), rule)):
        return replace(found, reasons=(*found.reasons, text))
    text = inconsistent_runs(best, prepared.problem, *of_runs[1:], at_damper)
    return replace(found, kind=kind, reasons=(text,))


def _but_for_a_run(
    trial: Trial, added: Sequence[str], runs: tuple[Problem, Problem], rule: DecisionRule
) -> str:
    """Return, in words, the run whose zero or gain is another one, "" where there is none.

    Where a model explains all other runs, what they leave together is no other form of an effect,
    and no further effect. If that model has fewer effects than the finding's, the run is to be set
    right first. With effects no model is looked at that would take more than may still be spent.

    Parameters
    ----------
    trial, added : of `_to_be_explained`
    runs : to fit to, and those that decide
    rule : the numbers that decide
    """
    called = f"The model with {' and '.join(added)}" if added else "One model"
    return odd_run(trial.model, *runs, rule, called)


def _but_for_clocks(
    trial: Trial, added: Sequence[str], runs: tuple[Problem, Problem], _: DecisionRule
) -> str:
    """Return, in words, the runs whose loggers began apart, "" if that does not explain the rest.

    Beside a missing effect it shows only in what the effect leaves: clocks are looked at for the
    present model before. Takes what `_but_for_a_run` takes.
    """
    clocks = clock_faults(trial, *runs) if added else None
    if clocks is None:
        return ""
    text = " ".join(fault.text for fault in clocks.faults)
    return f"With {' and '.join(added)}: {text} Told from {force_in(runs[0])}."


def _affordable(model: Model, runs: tuple[Problem, Problem]) -> bool:
    """Return whether a look at runs with a model takes no more than may still be spent."""
    return LOOK * sum(problem.steps_of(model) for problem in runs) <= left()


def _to_be_explained(
    found: SiteDiagnosis, prepared: Prepared
) -> list[tuple[Trial, tuple[str, ...]]]:
    """Return trials that leave more than noise, with the effects that they add, simplest first.

    None where the force is no measured one.
    """
    after, problem = found.after, prepared.problem
    assert after is not None
    by_equilibrium = isinstance(problem, StructureProblem) and problem.reconstructed
    if found.site != DAMPER or by_equilibrium or max(after.train, after.z) <= prepared.rule.misfit:
        return []
    trials = {one.effects: one for one in (prepared.before, *found.trials[:1], after)}
    return [(one, one.beyond(prepared.before)) for one in trials.values()]


def _with_reason(found: SiteDiagnosis, trial: Trial, text: str) -> SiteDiagnosis:
    """Return a finding with what is wrong in a run, which is to be set right first.

    Where the trial has the effects of the finding, they stand: what remains is no other form.
    """
    assert found.after is not None
    if trial.effects == found.after.effects and found.effects:
        kept = (one for one in found.reasons if one != OTHER_FORM)
        return replace(found, reasons=(*kept, text))
    return replace(found, kind="insufficient", effects=(), reasons=(text,))


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
    ones = {run.name: some.of([run]) for some in (train, held_out) for run in some.runs}
    z = {name: robust_z(one, model) for name, one in ones.items()}
    bad = [name for name, size in z.items() if size > rule.misfit]
    good = [name for name in z if name not in bad]
    if not bad:
        return ""
    count = {name: len(ones[name].runs[0].force) for name in bad}
    worst = ", ".join(f"{name} ({z[name]:.3g}, {count[name]:,} samples)" for name in bad)
    shifted = [
        other_zero(model, ones[name], rule) or other_gain(model, ones[name], rule)
        for name in (bad if zeros else ())
    ]
    return " ".join([
        f"One model does not explain the force of all runs: its error over the "
        f"noise (z) is largest in {worst}, "
        f"while it explains {_list(good)}.",
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
    restart : whether the fit to a run begins from several starts too, not from the values at hand
        alone: rigs may differ in size
    """
    runs = [*train.runs, *held_out.runs]
    with counted(MOST_SPENT):
        every = train.of(runs)
        z = _z_of_runs(model, every, every.expectation(model))
        own = dict.fromkeys(range(len(runs)), model)
        # What no values of its own explain is in no group: the worst run tells that soonest.
        for k in np.argsort(-z).tolist():
            if z[k] > rule.misfit:
                alone = _alone(model, train.of([runs[k]]), rule, restart)
                if alone is None:
                    return ""
                own[k] = alone
        found: list[list[Run]] = []
        fitted: list[Model] = []
        for k, run in enumerate(runs):
            for g, group in enumerate(found):
                together = _together(train.of([*group, run]), (fitted[g], own[k]), rule)
                if together is not None:
                    group.append(run)
                    fitted[g] = together
                    break
            else:
                if len(found) == rule.most_groups:
                    return ""
                found.append([run])
                fitted.append(own[k])
            if left() < 0.0:
                return ""
    if len(found) < 2 or min(len(group) for group in found) < 2:
        return ""
    named = "; ".join(_list([run.name for run in group]) for group in found)
    return (
        f"One model does not explain all runs together, {force_in(train.of(runs))}. With separate "
        f"values it explains each of these groups: {named}. Were they taken on one rig, with one "
        f"setting? If a run does not belong, {LEFT_OUT}."
    )


def _alone(model: Model, one: Problem, rule: DecisionRule, restart: bool) -> Model | None:
    """Return a model that is fitted to a run alone, None where it does not explain that."""
    fitted = fit(one, model, with_std=False).model
    if robust_z(one, fitted) <= rule.misfit:
        return fitted
    kept = {name: model.value(name) for name in model.fixed}
    starts = start_models(one, replace(model, values=kept), STARTS) if restart else []
    for start in starts:
        fitted = fit(one, start, with_std=False).model
        if robust_z(one, fitted) <= rule.misfit:
            return fitted
    return None


def _together(runs: Problem, starts: Sequence[Model], rule: DecisionRule) -> Model | None:
    """Return a model that is fitted to runs of one rig, None where it does not explain them.

    Parameters
    ----------
    runs : of a group, and one more
    starts : as fitted to the group, and to that run: of one rig each comes near at once
    rule : the numbers that decide
    """
    for start in starts:
        quick = fit(runs, start, max_evaluations=QUICK, with_std=False).model
        if robust_z(runs, quick) <= NEAR * rule.misfit:
            fitted = fit(runs, quick, with_std=False).model
            if robust_z(runs, fitted) <= rule.misfit:
                return fitted
    return None


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"

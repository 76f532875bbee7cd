"""What the law of a damper lacks, on a bench or inside a building."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..identify.fit import Model, multistart_refit
from ..identify.search_context import is_rough
from ..identify.site_fit import fit_damper
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS
from .candidates import Trial, judge
from .decision import Decision, decide
from .experiments import separating
from .finding import Finding, of_decision
from .inconsistent_runs import groups, inconsistent_runs
from .limits import detectable, untestable
from .opening import Opening, Progress, Trials, silent
from .remaining_residual import remaining_residual
from .rule import BENCH, SITE, DecisionRule
from .sites import better, equals
from .zero import free_zero, renewed_zero, zero_fault


def look_at_damper(opened: Opening, say: Progress = silent, rule: DecisionRule = BENCH) -> Finding:
    """Return what a damper's law lacks.

    Inside a building nothing is tried where noise is all there is, and an effect of the layer that
    acts in a few samples counts. On a bench the runs may contradict each other, and what the data
    could not show is told.
    """
    before, inside = opened.before, opened.brief is not None
    if inside and max(before.z, before.train) <= rule.quiet:
        return of_decision(decide(before, [], lambda _first: [], rule=rule), before)
    made, decision = _decided(opened, say, rule)
    sensors = renewed_zero(opened, decision)
    freed = free_zero(opened, decision)
    if freed is not None:
        say("the zero of the force is fitted along with every effect")
        again, other = _decided(freed, say, rule)
        zero = zero_fault(freed.problem, other)
        if zero is not None:
            opened, made, decision, sensors = freed, again, other, (zero,)
            before = opened.before
    if inside:
        if decision.kind in ("none", "unknown", "insufficient"):
            decision = _rare(before, made.single, rule) or decision
        return replace(of_decision(decision, before, tuple(made.single)), sensors=sensors)
    kind, reasons = _kind_and_reasons(decision, opened, rule)
    found = of_decision(decision, before, tuple(made.single))
    found = replace(found, kind=kind, reasons=tuple(reasons), sensors=sensors)
    say("intervals")
    return _with_intervals(_with_limits(found, opened, made, rule), opened)


def _decided(opened: Opening, say: Progress, rule: DecisionRule) -> tuple[Trials, Decision]:
    """Return the trials of effects at a damper, and the decision that they lead to."""
    made = Trials(opened, say)
    organised = False
    if opened.brief is None and made.patterns:
        first = made.patterns[0]
        organised = is_organised(first.share, first.p, rule)
    return made, decide(opened.before, made.single, made.grow, organised, made.reduce, rule)


def _with_limits(found: Finding, opened: Opening, made: Trials, rule: DecisionRule) -> Finding:
    """Return a finding with what the data could not show, and what would tell more."""
    problem, before = opened.problem, opened.before
    expected = problem.expectation(before.model)
    visible = detectable(problem, expected, rule)
    hidden = untestable(before.model, problem, expected, visible, rule)
    experiment, coordinate, patterns = None, "", made.patterns
    if found.kind == "class":
        members = [t.model for t in made.single if set(t.effects) & set(found.effects)]
        experiment = separating(members, problem)
    if found.kind == "unknown":
        coordinate, patterns = remaining_residual(
            before, made.single, patterns, opened.held_out, rule
        )
    return replace(
        found, detectable=visible, untestable=tuple(hidden), experiment=experiment,
        coordinate=coordinate, patterns=tuple(patterns),
    )  # fmt: skip


def is_organised(share: float, p: float, rule: DecisionRule = BENCH) -> bool:
    """Return whether a residual depends strongly on a coordinate, and beyond chance.

    `share` of its power lies along the coordinate; `p` is the probability that chance does that.
    """
    return p <= rule.chance and share > rule.organised


def kind_of(decision: Decision, before: Trial, rule: DecisionRule = BENCH) -> str:
    """Return the kind of a verdict: a decision's, unless the runs contradict each other."""
    if decision.kind == "unknown" and before.train <= rule.trained:
        return "insufficient"
    if decision.kind == "none" and decision.best.train > rule.misfit:
        return "insufficient"
    return decision.kind


def _kind_and_reasons(
    decision: Decision, opened: Opening, rule: DecisionRule
) -> tuple[str, list[str]]:
    """Return a decision's kind and reasons, or how the runs contradict each other."""
    before, problem, held_out = opened.before, opened.problem, opened.held_out
    kind, reasons = kind_of(decision, before, rule), list(decision.reasons)
    if kind == "insufficient" and decision.kind == "unknown":
        reasons.append(
            "The model fits the runs that it was fitted to: the others differ from them in "
            "something that no channel shows."
        )
    if kind == "insufficient" and decision.kind == "none":
        reasons = [inconsistent_runs(decision.best.model, problem, held_out, rule)]
    mixed = groups(before.model, problem, held_out, rule) if kind == "unknown" else ""
    return ("insufficient", [mixed]) if mixed else (kind, reasons)


def _with_intervals(found: Finding, opened: Opening) -> Finding:
    """Return a finding whose model is refitted where that does better, with standard deviations.

    Parameters that the data cannot identify have none.
    """
    after = found.after
    assert after is not None
    fitted = multistart_refit(opened.problem, after.model, 4)
    if is_rough(after.model):
        again = judge(fitted.model, opened.problem, opened.held_out)
        after = min(after, again, key=lambda one: one.z)
    identifiable = {n: s for n, s in fitted.std.items() if n not in fitted.unidentified}
    return replace(found, model=after.model, after=after, z_after=after.z, std=identifiable)


def excused_by_sensor(
    found: Finding, most: float, reason: str, rule: DecisionRule = BENCH
) -> Finding:
    """Return a damper's finding, not unknown where an instrument already known explains it.

    What an effect of the library lowers is not excused.

    Parameters
    ----------
    found : the finding at the damper, with its trial before
    most : z that the instrument accounts for
    reason : what the instrument does, as a sentence for the verdict
    rule : the numbers that decide
    """
    before = found.before
    assert before is not None
    gains = any(1.0 - trial.z / before.z >= rule.gain for trial in found.trials)
    if found.kind != "unknown" or gains or max(before.z, before.train) > most:
        return found
    why = f"{reason} z = {before.z:.2f} is no more than that."
    return replace(found, kind="none", reasons=(why,))


def left_by_filter(
    law: str, train: StructureProblem, held_out: StructureProblem, rule: DecisionRule = BENCH
) -> float:
    """Return the z that a late and rounded force may leave once our delay is in the model.

    As for any effect of another form: it must explain `rule.share` of the excess without.

    Parameters
    ----------
    law : name of the damper's law
    train, held_out : the damper's runs to fit to, and those that decide
    rule : the numbers that decide
    """
    bare = judge(fit_damper(train, Model(law)).model, train, held_out)
    return float(np.sqrt(1.0 + (1.0 - rule.share) * rule.excess(bare.z)))


def _rare(
    before: Trial, trials: list[Trial], rule: DecisionRule = BENCH, site: DecisionRule = SITE
) -> Decision | None:
    """Return the decision for an effect of the layer that acts in a few samples only, if any.

    A stop that is met once or twice is seen in no resampling of blocks; its likelihood tells, where
    the model with it is adequate.
    """
    best = trials[0]
    name = best.effects[-1]
    if EFFECTS[name].site != "structure" or best.z > site.clean:
        return None
    if 1.0 - best.z / before.z < rule.gain or not better(before, best, site):
        return None
    rivals = [other.effects[-1] for other in trials[1:] if equals(best, other, site)]
    explained = 1.0 - rule.excess(best.z) / rule.excess(before.z)
    reason = f"With {name} the error on runs not seen falls from {before.z:.2f} to {best.z:.2f}."
    kind = "class" if rivals else "effect"
    return Decision(kind, (name, *rivals)[: rule.largest_class], best, explained, (reason,))

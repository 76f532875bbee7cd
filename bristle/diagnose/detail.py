"""What is told of every site beside what is missing there.

Whether its runs contradict each other, what they could not show, along what the residual is
organised, how well parameters are known, and which run would distinguish alternatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..compare.labels import label_errors, label_sentence, with_levels
from ..compare.prediction import run_predictions
from ..data.labels import Labels, varying
from ..identify.fit import Run, intervals_of, multistart_refit
from ..identify.search_context import is_rough
from ..physics.effect import exclude
from .candidates import SHOWN, joinable, judge
from .effect_limits import EffectLimit, effect_limits
from .experiments import separating
from .finding import Finding
from .limits import detectable, untestable
from .opening import Opening, of_layer
from .profiled_limits import profiled
from .remaining_residual import patterns_of, remaining_residual
from .sites import joinable_at


def detailed(found: Finding, opened: Opening, *, profile: bool = False) -> Finding:
    """Return a site's finding with limits, patterns, intervals and, where asked for, a next run.

    Parameters
    ----------
    found : what the site lacks
    opened : its runs and its model
    profile : whether the model is fitted again at every limit, see `profiled_limits`
    """
    found = _with_limits(found, opened, profile)
    found = _with_intervals(_with_patterns(found, opened), opened)
    return _with_labels(found, opened)


def _with_labels(found: Finding, opened: Opening) -> Finding:
    """Return a finding that says on which runs the present model errs, where a label tells it."""
    runs = [*opened.problem.runs, *opened.held_out.runs]
    if found.kind == "none" or not found.noise_known or not varying(_known(runs)):
        return found
    predictions = run_predictions(opened.problem.of(runs), opened.before.model)
    told = label_sentence(label_errors(predictions))
    if not told:
        return found
    text = f"Of the present model: {told[:1].lower()}{told[1:]}"
    return replace(found, reasons=(*found.reasons, text))


def _known(runs: Sequence[Run]) -> list[Labels]:
    return with_levels(runs[0].drive, [run.V for run in runs], [run.labels for run in runs])


def _with_limits(found: Finding, opened: Opening, profile: bool) -> Finding:
    """Return a finding with what the data could not show, and what would tell more."""
    problem, model, rule = opened.searched, opened.before.model, opened.rule
    expected = problem.expectation(model)
    visible = detectable(problem, expected, rule, found.z_after)
    hidden = untestable(model, problem, expected, visible, rule, _able(found, opened))
    experiment = None
    if found.kind == "ambiguous" and opened.scope.choose_motion:
        members = [t.model for t in found.trials if set(t.effects) & set(found.effects)]
        experiment = separating(members, opened.problem)
    seen = visible if found.noise_known else float("nan")
    found = replace(found, detectable=seen, untestable=tuple(hidden), experiment=experiment)
    return replace(found, limits=_limits(found, opened, profile))


def _limits(found: Finding, opened: Opening, profile: bool) -> tuple[EffectLimit, ...]:
    """Return how large each further effect may be beside the model that a finding names."""
    if found.kind == "insufficient" or found.after is None or not found.noise_known:
        return ()
    model = (found.after if found.kind == "effect" else opened.before).model
    known = opened.known(model)
    able = [
        name
        for name in _able(found, opened)
        if not any(name == one or exclude(name, one) for one in model.effects)
    ]
    limits = effect_limits(known, able, found.untestable)
    return profiled(known, limits) if profile else limits


def _able(found: Finding, opened: Opening) -> list[str]:
    """Return the effects that can join the model at a site."""
    model = opened.before.model
    if model.law_class.site == "structure":
        return joinable_at(found.site, model)
    shown = tuple(channel for channel in SHOWN if channel in opened.shown)
    return [*joinable(model, shown), *of_layer(model, opened.problem)]


def _with_patterns(found: Finding, opened: Opening) -> Finding:
    """Return a finding with the coordinates that its residual depends on, where it has any."""
    if found.kind == "none" and not found.patterns:
        return found
    patterns = list(found.patterns) or patterns_of(opened.before, opened.held_out)
    if found.kind != "unknown":
        return replace(found, patterns=tuple(patterns))
    coordinate, patterns, beside = remaining_residual(
        opened.before, found.trials, patterns, opened.held_out, opened.rule
    )
    return replace(found, coordinate=coordinate, patterns=tuple(patterns), beside=beside)


def _with_intervals(found: Finding, opened: Opening) -> Finding:
    """Return a finding with standard deviations; its model refitted where `Scope.sweeps` asks so.

    Parameters that the data cannot identify have none.
    """
    after = found.after
    assert after is not None
    if not opened.scope.sweeps:
        fitted = intervals_of(opened.problem, after.model)
    else:
        fitted = multistart_refit(opened.problem, after.model, opened.scope.sweeps)
    if opened.scope.sweeps and is_rough(after.model):
        again = judge(fitted.model, opened.problem, opened.held_out)
        after = min(after, again, key=lambda one: one.z)
    identifiable = {n: s for n, s in fitted.std.items() if n not in fitted.unidentified}
    return replace(found, model=fitted.model, after=after, z_after=after.z, std=identifiable)

"""A diagnosis: from measurements to a verdict, with the evidence for every claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..comparison.conditions import label_errors, label_sentence, with_levels
from ..comparison.predictions import run_predictions
from ..data.channels import Labels, varying
from ..data.measurement import Measurement
from ..identification.building_sites import StructureProblem
from ..identification.fit import intervals_of, multistart_refit
from ..identification.problem import Model, Run
from ..identification.rig import DAMPER
from ..identification.start_grid import is_rough
from ..physics.building import Building
from ..physics.effect import exclude
from ..physics.laws import DEFAULT
from .conclusion import conclude
from .effect_limits import EffectLimit, detectable, effect_limits, profiled, untestable
from .experiments import separating
from .inconsistent_runs import contradicted
from .prepared import IN_BUILDING, Insufficient, Opening, Progress, of_layer, silent
from .remaining import patterns_of, remaining_residual
from .rig_runs import BenchRuns, BuildingRuns
from .rule import SITE
from .site import joinable_at, look_at, look_at_damper
from .site_diagnosis import SiteDiagnosis
from .trials import SHOWN, joinable, judge
from .verdict import Diagnosis

# What is told of every site beside what is missing there.
#
# Whether its runs contradict each other, what they could not show, along what the residual is
# organised, how well parameters are known, and which run would distinguish alternatives.


def detailed(found: SiteDiagnosis, opened: Opening, *, profile: bool = False) -> SiteDiagnosis:
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


def _with_labels(found: SiteDiagnosis, opened: Opening) -> SiteDiagnosis:
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


def _with_limits(found: SiteDiagnosis, opened: Opening, profile: bool) -> SiteDiagnosis:
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


def _limits(found: SiteDiagnosis, opened: Opening, profile: bool) -> tuple[EffectLimit, ...]:
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


def _able(found: SiteDiagnosis, opened: Opening) -> list[str]:
    """Return the effects that can join the model at a site."""
    model = opened.before.model
    if model.law_class.site == "structure":
        return joinable_at(found.site, model)
    shown = tuple(channel for channel in SHOWN if channel in opened.shown)
    return [*joinable(model, shown), *of_layer(model, opened.problem)]


def _with_patterns(found: SiteDiagnosis, opened: Opening) -> SiteDiagnosis:
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


def _with_intervals(found: SiteDiagnosis, opened: Opening) -> SiteDiagnosis:
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


def diagnose(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    *,
    law: str = DEFAULT,
    effects: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    fixed: Sequence[str] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Return which effect a damper's model misses on a test bench.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    law : a damper's law, such as "bingham"
    effects : the effects that the model has already
    values : its parameters where they were identified before, by name in SI; else they are
        identified here
    fixed, limits : parameters that stay as they are, and a user's bounds; see `identify.Model`
    progress : called with a sentence at each stage

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, or is too short for a fit.
    """
    present = Model(law, tuple(effects), dict(values or {}), tuple(fixed), dict(limits or {}))
    known = values is not None
    return diagnose_rig(train, holdout, present, identified=known, say=progress or silent)


def diagnose_rig(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None = None,
    *,
    identified: bool = False,
    profile: bool = False,
    say: Progress = silent,
) -> Diagnosis:
    """Return what a rig's model is missing, and at which of its sites.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is: the damper's law with the effects of all sites
    building : the building that the damper is in, None for a test bench; its masses are taken as
        known, stiffnesses and damping are fitted anew
    identified : whether the law was fitted on this bench before: it is then refined, not sought
        anew; in a building it always is
    profile : whether the model is fitted again at every limit of an effect
    say : called with a few words at each stage

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, is too short for a fit, or the building has other
        levels than were measured.
    """
    runs: BenchRuns | BuildingRuns
    if building is None:
        runs = BenchRuns(train, holdout, present, identified, say)
    else:
        runs = BuildingRuns(train, holdout, present, building, say)
        if runs.lacking is not None:
            return _insufficient(runs.lacking)
    findings = look_at_lines(runs, say, profile=profile)
    runs.correct(findings)
    opened = runs.open_damper()
    if isinstance(opened, Insufficient):
        return _insufficient(opened)
    if opened is not None:
        found, opened = look_at_damper(opened, say)
        if isinstance(runs, BuildingRuns) and runs.suited_to(found):
            again = runs.open_damper()
            assert again is not None
            found, opened = look_at_damper(again, say)
        excused = runs.excused(found, findings)
        say("intervals")
        # What an instrument explains contradicts nothing.
        settled = excused if excused is not found else contradicted(found, opened)
        findings[DAMPER] = detailed(
            runs.beside_other_laws(settled, opened), opened, profile=profile
        )
    return conclude(findings, runs.about())


def _insufficient(why: Insufficient) -> Diagnosis:
    return Diagnosis("insufficient", (), why.reasons, sensors=why.faults, noise=why.noise)


def look_at_lines(
    runs: BenchRuns | BuildingRuns, say: Progress = silent, *, profile: bool = False
) -> dict[str, SiteDiagnosis]:
    """Return what the isolation layer and the storeys show, by site; nothing on a bench."""
    findings: dict[str, SiteDiagnosis] = {}
    for name, pair in runs.lines().items():
        say(f"{name}: effects of the structure")
        findings[name] = _line(name, pair, runs.part(name), profile)
    return findings


def _line(
    name: str, pair: tuple[StructureProblem, StructureProblem], present: Model, profile: bool
) -> SiteDiagnosis:
    """Return what a layer or storey shows, on its runs for training and held out."""
    found = look_at(name, *pair, present)
    assert found.before is not None
    opened = Opening(found.before, *pair, rule=SITE, scope=IN_BUILDING)
    return detailed(contradicted(found, opened), opened, profile=profile)

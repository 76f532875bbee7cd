"""A diagnosis: from measurements to a verdict, with the evidence for every claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

from ..comparison.conditions import label_errors, label_sentence, with_levels
from ..comparison.predictions import run_predictions
from ..core.progress import tell
from ..data.channels import Labels, varying
from ..data.measurement import Measurement
from ..errors import RecordError
from ..identification.fit import intervals_of, is_rough, multistart_refit
from ..identification.histories import counted, left
from ..identification.problem import Run
from ..identification.rig import DAMPER
from ..model.model import Model
from ..physics.building import Building
from ..physics.effect import exclude
from .by_label import confirmed, with_labels
from .conclusion import conclude, insufficient
from .effect_limits import EffectLimit, detectable, effect_limits, untestable
from .experiments import separating
from .inconsistent_runs import contradicted
from .joint_search import law_and_effects
from .law_trials import OtherLaw, better_law, try_laws
from .prepared import Prepared, of_layer
from .remaining import patterns_of, remaining_residual
from .rig_runs import RigRuns, runs_of_rig
from .site import Trials, diagnose_damper, diagnose_line, joinable_at, noise_is_all
from .site_diagnosis import SiteDiagnosis
from .trials import SHOWN, KeptFits, Trial, joinable, judge
from .verdict import Diagnosis

MOST_SPENT = 60e6
"""Steps of dampers' forces, see `Effort`, from which on no two effects are tried beside those that
a model has: most is decided by then."""

SWEEPS = 4
"""Jacobians of the fit that gives the intervals of a bench."""

NO_PAIRS = "Two effects at once were not tried beside those that the model has."

NOT_THE_LAW = "No other law leaves a smaller error: it is not the form of the law."

# What is told of every site beside what is missing there.
#
# Whether its runs contradict each other, what they could not show, along what the residual is
# organised, how well parameters are known, and which run would distinguish alternatives.


def with_evidence(found: SiteDiagnosis, prepared: Prepared, adds: int = 0) -> SiteDiagnosis:
    """Return a site's finding with limits, patterns, intervals and, where asked for, a next run.

    Parameters
    ----------
    found : what the site lacks
    prepared : its runs and its model
    adds : how many effects that a finding names join the model at once: a finding on that model
        follows, and this one is told without limits
    """
    if not (found.kind == "effect" and len(found.effects) <= adds and left() >= 0.0):
        found = _with_limits(found, prepared)
    found = _with_intervals(_with_patterns(found, prepared), prepared)
    return _with_labels(found, prepared)


def _with_labels(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding that says on which runs the present model errs, where a label tells it."""
    runs = [*prepared.problem.runs, *prepared.held_out.runs]
    if found.kind == "none" or not found.noise_known or not varying(_known(runs)):
        return found
    predictions = run_predictions(prepared.problem.of(runs), prepared.before.model)
    sentence = label_sentence(label_errors(predictions))
    if not sentence:
        return found
    text = f"Of the present model: {sentence[:1].lower()}{sentence[1:]}"
    return replace(found, reasons=(*found.reasons, text))


def _known(runs: Sequence[Run]) -> list[Labels]:
    return with_levels(runs[0].drive, [run.V for run in runs], [run.labels for run in runs])


def _with_limits(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding with what the data could not show, and what would tell more."""
    problem, model, rule = prepared.searched, prepared.before.model, prepared.rule
    expected = problem.expectation(model)
    visible = detectable(problem, expected, rule, found.z_after)
    hidden = untestable(model, problem, expected, visible, rule, _able(found, prepared))
    experiment = None
    if found.kind == "ambiguous" and prepared.bench:
        members = [t.model for t in found.trials if set(t.effects) & set(found.effects)]
        experiment = separating(members, prepared.problem)
    least = visible if found.noise_known else float("nan")
    found = replace(found, detectable=least, untestable=tuple(hidden), experiment=experiment)
    return replace(found, limits=_limits(found, prepared))


def _limits(found: SiteDiagnosis, prepared: Prepared) -> tuple[EffectLimit, ...]:
    """Return how large each further effect may be beside the model that a finding names."""
    if found.kind == "insufficient" or found.after is None or not found.noise_known:
        return ()
    model = (found.after if found.kind == "effect" else prepared.before).model
    able = [
        name
        for name in _able(found, prepared)
        if not any(name == one or exclude(name, one) for one in model.effects)
    ]
    return effect_limits(prepared.known(model), able, found.untestable)


def _able(found: SiteDiagnosis, prepared: Prepared) -> list[str]:
    """Return the effects that can join the model at a site."""
    model = prepared.before.model
    if model.law_class.site == "structure":
        return joinable_at(found.site, model)
    shown = tuple(channel for channel in SHOWN if channel in prepared.shown)
    return [*joinable(model, shown), *of_layer(model, prepared.problem)]


def _with_patterns(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding with the coordinates that its residual depends on, where it has any."""
    if found.kind == "none" and not found.patterns:
        return found
    patterns = list(found.patterns) or patterns_of(prepared.before, prepared.held_out)
    if found.kind != "unknown":
        return replace(found, patterns=tuple(patterns))
    coordinate, patterns, beside = remaining_residual(prepared, found.trials, patterns)
    return replace(found, coordinate=coordinate, patterns=tuple(patterns), beside=beside)


def _with_intervals(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding with standard deviations; on a bench its model refitted.

    Parameters that the data cannot identify have none.
    """
    after = found.after
    assert after is not None
    if prepared.bench:
        fitted = multistart_refit(prepared.problem, after.model, SWEEPS)
    else:
        fitted = intervals_of(prepared.problem, after.model)
    model = fitted.model
    rough = is_rough(model)
    if prepared.bench and (rough or found.effects):
        again = judge(model, prepared.problem, prepared.held_out)
        if rough:
            after = min(after, again, key=lambda one: one.z)
            model = after.model
        else:  # the error is that of the values which are told
            after = replace(after, error=again.error)
    identifiable = {
        name: max(std, found.std.get(name, 0.0))  # that over runs, where runs were left out
        for name, std in fitted.std.items()
        if name not in fitted.unidentified
    }
    return replace(found, model=model, after=after, z_after=after.z, std=identifiable)


@with_labels
def diagnose_rig(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None = None,
    *,
    identified: bool = False,
    any_law: bool = False,
    named: str = "",
    kept: KeptFits | None = None,
    adds: int = 0,
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
    any_law : whether the law is sought together with its effects; laws have those of the present
        effects that can join them
    named : the present law with its variant, "" where nobody chose one
    kept : fits of laws that are known already, and where those that are made go
    adds : of the damper's finding on a bench, as in `with_evidence`

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, is too short for a fit, or the building has other
        levels than were measured; if a law is sought and no run shows a damper.
    """
    runs = runs_of_rig(train, holdout, present, building, identified=identified, any_law=any_law)
    if runs.lacking is not None:
        return insufficient(runs.lacking)
    shown = DAMPER in runs.sites()
    if any_law and not shown:
        raise RecordError(
            "no law of a damper can be sought: the runs have neither its force nor its command."
        )
    findings, laws = diagnose_lines(runs), None
    if any_law:
        found, prepared, laws = law_and_effects(runs, findings, named, kept)
    else:
        runs.correct(findings)
        if not shown:
            return conclude(findings, runs.context(None))
        found, prepared = _at_damper(runs)
    tell("whether runs contradict each other")
    found = settled(found, prepared, runs, findings)
    law = f"on {laws.name}, " if laws is not None else ""
    tell(f"verdict {law}{found.briefly}")
    if laws is None and prepared.bench:
        found = _beside_other_laws(found, prepared, runs.bends)
    findings[DAMPER] = with_evidence(found, prepared, adds if prepared.bench else 0)
    return replace(conclude(findings, runs.context(prepared)), laws=laws)


def _at_damper(runs: RigRuns) -> tuple[SiteDiagnosis, Prepared]:
    """Return what a damper lacks, beside the numbers of a building that its force follows from.

    They are adjusted beside the best single effect: what a second one does they may do as well.
    """
    prepared = runs.prepare(DAMPER)
    with counted(MOST_SPENT if prepared.before.model.effects else inf) as effort:
        made = None if noise_is_all(prepared) else Trials(prepared, effort=effort)
        suits = False
        if prepared.problem.reconstructed:
            single, _ = diagnose_damper(prepared, made, pairs=False, excess=0.0)
            suits = runs.suit(single)
        if not suits:
            found, prepared = diagnose_damper(prepared, made)
            if found.kind == "unknown" and effort.spent and made and not made.pairs:
                found = replace(found, reasons=(*found.reasons, NO_PAIRS))
    if suits:
        found, prepared = diagnose_damper(runs.prepare(DAMPER))
    return confirmed(found, prepared), prepared


def diagnose_lines(runs: RigRuns) -> dict[str, SiteDiagnosis]:
    """Return what the isolation layer and the storeys lack, by site; nothing on a bench."""
    findings: dict[str, SiteDiagnosis] = {}
    for site in runs.lines():
        tell(f"{site}: effects of the structure")
        prepared = runs.prepare(site)
        found = settled(diagnose_line(site, prepared), prepared, runs, findings)
        findings[site] = with_evidence(found, prepared)
    return findings


def settled(
    found: SiteDiagnosis,
    prepared: Prepared,
    runs: RigRuns,
    findings: Mapping[str, SiteDiagnosis],
) -> SiteDiagnosis:
    """Return a site's diagnosis, excused by an instrument or contradicted by its runs.

    What an instrument explains contradicts nothing.

    Parameters
    ----------
    found, prepared : what the site lacks, and what its diagnosis began with
    runs : of the rig
    findings : what the other sites lack, as far as they were diagnosed
    """
    excused = runs.excused(found, findings)
    return excused if excused is not found else contradicted(found, prepared)


def _beside_other_laws(found: SiteDiagnosis, prepared: Prepared, bends: bool) -> SiteDiagnosis:
    """Return a diagnosis that leaves an error with how much of it is the form of the law.

    Effects that leave an error are not named where another law explains the runs without them.
    """
    before, judged = found.before, found.before if found.kind == "unknown" else found.after
    if found.kind == "insufficient" or before is None or judged is None:
        return found
    if judged.z <= prepared.rule.clean or not found.noise_known:
        return found
    tell("trying every law")

    def better(than: Trial) -> OtherLaw | None:
        laws = try_laws(prepared.searched, prepared.held_out, than.model, bends=bends)
        return better_law(than, laws)

    def explains(one: OtherLaw | None) -> bool:
        return one is not None and one.z <= prepared.rule.adequate

    other = better(judged)
    if judged is not before and explains(other) and explains(alone := better(before)):
        other = alone
        found = replace(
            found, kind="unknown", effects=(), model=before.model, after=before, z_after=before.z
        )
    text = NOT_THE_LAW if other is None else other.sentence(added=found.kind != "unknown")
    return replace(found, other_law=other, reasons=(*found.reasons, text))

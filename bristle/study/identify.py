"""Identify the model of a study: fit it to the training runs, judge it on those held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.names import site_name
from ..core.progress import tell
from ..core.text import listed, percent, plural, short_z, unknown
from ..data.checks.motion import check_force, velocity_of_run
from ..data.cut_off import saturated_share
from ..data.measurement import Measurement
from ..diagnosis.by_label import extrapolated
from ..diagnosis.law_choice import rows_of
from ..diagnosis.law_trials import LawTrial
from ..errors import StudyError
from ..identification.error import ForceError, held_out_apart
from ..identification.fit import MISFIT, Fit
from ..identification.histories import compile_ahead
from ..identification.problem import Problem, robust_z, uncommanded
from ..identification.rig import DAMPER, Rig
from ..identification.rig_fit import (
    RigErrors,
    SiteModel,
    SiteModels,
    errors_of,
    fit_rig,
    site_models,
)
from ..identification.run_start import under_load_text
from ..model.model import Model
from ..physics.effect import AT, EFFECTS, exclude, laws_joined
from ..physics.forms import shown_law, split_form
from ..physics.laws import LAWS, base_and_variant, law_names
from ..user_code.load import waiting, why_left_out
from ..view import Viewable
from .forms import (
    FormError,
    all_laws,
    finite,
    form_of,
    forms_asked,
    in_form,
    left_out_notes,
    refuse_in_building,
)
from .history import Step
from .rig import rig_of
from .runs import Runs
from .study import Study, behind_data
from .study_file import ALL


def is_identified(model: Model) -> bool:
    """Return whether a value of a model comes from an identification."""
    return any(value.origin == "identified" for value in model.facts.values())


@dataclass(frozen=True, repr=False)
class Identified(Viewable):
    """What an identification found; `bristle.identify` returns it, and a notebook shows it.

    Attributes
    ----------
    model : Model
        The model with the values found; `model.values` are those in SI.
    fit : Fit
        Values and standard deviations in SI.
    errors_before, errors : RigErrors
        Errors of the model before and of this one; None before a first fit, whose start is no
        model of anybody.
    cutoff : float
        Low-pass [Hz] of those among them that are low-passed.
    notes : tuple of str
        What to know.
    step : Step or None
        The history's new step, None where nothing was written.
    forms : tuple of FormError
        Errors of the forms of the command, where several were asked for.
    laws : tuple of LawTrial
        How every law does, the best on held-out runs first, where all were asked for.
    at : SiteModel
        The site that a picture shows, with the part of the model that predicts its runs.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> v = 72e-3 * np.cos(9.0 * t)  # m/s
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> run = {"time": t, "velocity": v, "force": 5.0 * np.sign(v) + 90.0 * v + noise}  # s, m/s, N
    >>> found = bristle.identify(run, "bingham_standard")
    >>> found.model.law, found.unidentified
    ('bingham_standard', ())
    """

    fit: Fit
    cutoff: float
    errors_before: RigErrors | None
    errors: RigErrors
    notes: tuple[str, ...]
    step: Step | None
    at: SiteModel
    forms: tuple[FormError, ...] = ()
    laws: tuple[LawTrial, ...] = ()

    @property
    def model(self) -> Model:
        """The model with the values found."""
        return self.fit.model

    @property
    def before(self) -> dict[str, float]:
        """The numbers of `errors_before`, such as "z_holdout"; none before a first fit."""
        return self.errors_before.numbers if self.errors_before is not None else {}

    @property
    def after(self) -> dict[str, float]:
        """The numbers of `errors`, such as "z_holdout" and "error_holdout" [N]."""
        return self.errors.numbers

    @property
    def error(self) -> ForceError:
        """The error on held-out runs; on training runs where none is held out."""
        return self.errors.force.get("holdout", self.errors.force["train"])

    @property
    def train(self) -> Problem:
        """The runs at that site that the model was fitted to."""
        return self.at.site.train

    @property
    def holdout(self) -> Problem | None:
        """The runs at that site that the model was judged on, None where none is held out."""
        return self.at.site.holdout

    @property
    def z(self) -> float:
        """z on held-out runs; on training runs where none is held out."""
        return self.after.get("z_holdout", self.after["z_train"])

    def for_history(self) -> tuple[dict[str, float], dict[str, float]]:
        """Return the errors before and after with the low-pass of the `rms_` ones [Hz], for a step.

        None before where that model was not fitted.
        """
        own = {"cut_off": self.cutoff}
        before, after = (
            {name: value for name, value in errors.items() if value == value}
            for errors in (self.before, self.after)
        )
        return {**before, **own} if before else {}, {**after, **own}

    @property
    def idle(self) -> tuple[str, ...]:
        """Names of the parameters of a command, where nothing commands the damper: none is told."""
        at_damper = self.at.site.name == DAMPER
        return self.model.law_class.driven() if at_damper and uncommanded(self.train) else ()

    @property
    def unidentified(self) -> tuple[str, ...]:
        """Names of the parameters that the data do not identify."""
        return tuple(name for name in self.fit.unidentified if name not in self.idle)

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        rows = {row["name"]: row for row in self.parameters()}
        return {
            "schema": 1,
            "law": split_form(self.model.law)[0],
            "command": form_of(self.model),
            "command_knots": list(split_form(self.model.law)[2]),
            "effects": list(self.model.effects),
            "parameters": {
                name: {key: row[key] for key in row if key != "name"} for name, row in rows.items()
            },
            "unidentified": list(self.unidentified),
            "starts": self.fit.starts,
            "agreed": self.fit.agreed,
            "cut_off": self.cutoff,
            "before": finite(self.before),
            "after": finite(self.after),
            "noise_known": self.train.noise_known,
            "error": {role: one.as_dict() for role, one in self.errors.force.items()},
            "error_by_site": {
                role: {site: one.as_dict() for site, one in sites.items()}
                for role, sites in self.errors.at.items()
            },
            "forms": [row.as_dict() for row in self.forms],
            **({"laws": rows_of(self.laws)} if self.laws else {}),
            "notes": list(self.notes),
            "step": self.step.number if self.step else None,
        }

    def parameters(self) -> list[dict[str, Any]]:
        """Return one row per parameter: name, value, unit, half of its 95 % interval, how."""
        rows = []
        told = {n: value for n, value in self.model.written().items() if n not in self.idle}
        for name, value in told.items():
            if name in self.fit.unidentified:
                how = "not identified"
            elif name in self.fit.std:
                how = "identified"
            else:
                how = "held"
            half = 1.96 * value.std if value.std is not None and how == "identified" else None
            rows.append(
                {
                    "name": name, "value": value.value, "unit": value.unit, "interval95": half,
                    "how": how,
                }
            )  # fmt: skip
        return rows


# What there is to say of a fit: doubts about its runs, and how far its numbers can be trusted.

_SATURATED = 0.95  # share of samples at the extremes of a force above which it tells nothing else


def doubts(runs: list[Measurement]) -> list[str]:
    """Refuse a force that is nothing but its ends; return what weakens an identification.

    Raises
    ------
    StudyError
        If nearly all samples of a force are at its extremes.
    """
    notes = []
    for run in runs:
        share = saturated_share(run["force"])
        if share > _SATURATED:
            raise StudyError(
                f"{run.name}: {percent(share, 0)} of the force's samples are at its extremes: the "
                "load cell or its amplifier is saturated, or this is a friction without noise that "
                "nothing changes, and no law is told by it. Measure with a wider range or with "
                "other motions, or leave the run out in study.toml."
            )
        if share > 0.0:
            notes.append(
                f"{run.name}: {percent(share)} of the force's samples are at its extremes."
            )
    notes += driven(runs)
    doubtful: dict[str, int] = {}
    for run in runs:
        for channel, fact in run.noise_facts.items():
            if fact is not None and fact.colour in ("slow", "hidden", "rough", "blue"):
                doubtful[channel] = doubtful.get(channel, 0) + 1
    if doubtful:
        where = ", ".join(f"{c} ({n} of {len(runs)} runs)" for c, n in doubtful.items())
        notes.append(
            f"The noise is hard to separate from the signal: {where}. Give it in study.toml: z and "
            "intervals depend on it."
        )
    return notes


def driven(runs: Sequence[Measurement]) -> list[str]:
    """Return the sentence that names runs whose force drives the motion, [] where none does."""
    names = [
        run.name
        for run in runs
        if (velocity := velocity_of_run(run)) is not None
        and any(one.level == "error" for one in check_force(run, velocity))
    ]
    said = (
        f"The force drives the motion in {listed(names)}, as no damper does: its sign is wrong "
        "there. bristle study check shows how it is read right."
    )
    return [said] if names else []


def under_load(at: SiteModel) -> list[str]:
    """Return the sentence that tells which runs begin under a load that the model carries."""
    problems = (at.site.train, at.site.holdout)
    loads = {
        run.name: float(np.mean(problem.without_zero(run.force[: run.rest], at.model)))
        for problem in problems
        if problem is not None
        for run in problem.runs
        if run.rest and problem.carrying(at.model, run)
    }
    return [under_load_text(loads)] if loads else []


def by_site(models: SiteModels) -> list[str]:
    """Return the sentence that tells z by site.

    None where the one site goes without saying, or no run is held out.
    """
    problems = {at.site.shown: at.site.holdout for at in models.values()}
    if "" in problems:
        return []
    z = {n: robust_z(p, models[n].model) for n, p in problems.items() if p is not None}
    if not z:
        return []
    worst_first = sorted(z, key=lambda site: -z[site])
    text = ", ".join(f"{site_name(site)} {short_z(z[site])}" for site in worst_first)
    return [f"The errors are of all sites together, z is that of the worst; held-out runs: {text}."]


def weighing(z: float) -> list[str]:
    """Return what a model does to intervals whose z on training runs is more than that of noise."""
    if z <= MISFIT:
        return []
    lead = "The error exceeds the noise"
    if z != z:
        lead = "The noise of the force is not known, so that there is no z"
    return [
        f"{lead}. The intervals come from the error itself: they describe "
        "the best values of this model, not the constants of a damper."
    ]


def why(found: Identified) -> str:
    """Return what a step of the history says of an identification."""
    runs, held_out = len(found.train.runs), len(found.holdout.runs) if found.holdout else 0
    lost = ", ".join(found.unidentified)
    return (
        f"fit to {plural(runs, 'training run')}, tested on {held_out} held out; "
        f"{found.fit.agreed} of {found.fit.starts} starts agree"
        + (f"; the data do not identify {lost}" if lost else "")
    )


# Which effects may join a study's model.


def as_named_here(name: str, bench: bool) -> str:
    """Return the name that a study's model gives an effect: its site is told where it must be.

    NAME@SITE is an effect at another site than the one that its plain name means.
    """
    own, at, site = name.partition(AT)
    if not at or own not in EFFECTS or site not in EFFECTS[own].sites:
        return name
    if not bench:
        return EFFECTS[own].key(site)
    if site == "structure":
        raise StudyError(f"{name}: a test bench has no structure; {own} is that of the damper.")
    return own


def refuse_left_out(file: Path) -> None:
    """Refuse an effect or law of a user's own that was left out when its file was read.

    Raises
    ------
    TrustError
        If its code must not run yet.
    StudyError
        Saying what is wrong with the file, and where.
    """
    if untrusted := waiting(file):
        raise untrusted
    if why := why_left_out(file):
        raise StudyError(why)


def refuse_effect(model: Model, name: str, bench: bool) -> None:
    """Refuse an effect that is not known, is in a model already, or cannot join it.

    Parameters
    ----------
    model : what it is to join
    name : as the model would name it
    bench : whether the model is of a damper on a bench

    Raises
    ------
    StudyError
        Saying which of these it is, and what would be right.
    """
    if name not in EFFECTS:
        raise StudyError(unknown("effect", name, sorted(EFFECTS)))
    effect = EFFECTS[name]
    if name in model.effects:
        raise StudyError(f"{name} is in the model already.")
    if bench and effect.sites == ("structure",):
        raise StudyError(f"{name} acts in a structure, and on a test bench there is none.")
    at_damper = "damper" in effect.sites if bench else effect.site == "damper"
    if at_damper and not effect.joins(LAWS[model.base_law]):
        raise StudyError(
            f"{name} cannot join the law {model.law}; it joins {', '.join(laws_joined(effect))}."
        )
    for other in model.effects:
        if exclude(name, other):
            raise StudyError(f"{name} and {other} cannot be joined: undo the other one first.")


def identify_study(
    study: Study,
    *,
    law: str | None = None,
    command: str | Sequence[str] | None = None,
    model: Model | None = None,
    cutoff: float | None = None,
    starts: int = 4,
    write: bool = True,
    begin: Mapping[str, float] | None = None,
) -> Identified:
    """Identify the present model of a study on its training runs, its effects included.

    Parameters
    ----------
    study : the folder, opened
    law : another law to take than the model's; its effects stay where they can join it. With
        "all" the model keeps its law, and `laws` of the result tells how every law does
    command : the form in which the command enters, one of `physics.forms.FORMS`; several, or
        "all", are compared, and the model keeps its own if it is among them, else the first
    model : a model to take in place of the present one
    cutoff : Hz, of the low-pass for the low-passed errors; None takes the study's
    starts : how many starting points are tried
    write : whether to make the result the present model, as a step of the history
    begin : values in SI by name that a search has come to: one start is then tried beside them

    Raises
    ------
    StudyError
        If the law is not known, the data cannot carry an identification, the study cannot be
        written, or all laws are asked for in a building.
    RecordError
        If a file cannot be read, or a channel that is needed is missing.
    """
    if starts < 1:
        raise StudyError(f"starts = {starts}; 1 or more is right.")
    if cutoff is not None and not 0.0 <= cutoff < inf:
        raise StudyError(f"cut-off {cutoff:g} Hz; 0 for none, or a positive number is right.")
    refuse_in_building(law, study.settings.has_building)
    all_of_them, law = law == ALL, None if law == ALL else law
    if law is not None:
        refuse_left_out(study.laws_folder / f"{law}.py")
    present = study.model()
    model = _of_law(model or present, law)
    compile_ahead(model.law, model.effects)
    cutoff = study.settings.cut_off if cutoff is None else cutoff
    # Before is what the study had: at its defaults another law would be nobody's model.
    before = present if present.law != model.law else None
    task = FitTask(cutoff, 0 if begin else starts, before, begin or {}, command, all_of_them)
    found = identify_model(study, model, task)
    if not write:
        return found
    step = study.add_step(
        f"identify {shown_law(found.model.law)}" + "".join(f" + {e}" for e in found.model.effects),
        why(found), found.model, *found.for_history(),
    )  # fmt: skip
    return replace(found, step=step)


@dataclass(frozen=True)
class FitTask:
    """How a model is to be identified.

    `cutoff` [Hz] of the low-pass for the low-passed errors; `starts` how many starting points are
    tried, 0 for none beside `begin`; `present` the model whose errors are those before, None for
    the one that is identified; `command` the form or forms of the command, None for the model's;
    `laws` whether every law is tried as well; `begin` values in SI by name from which one more fit
    begins, the better one counts.
    """

    cutoff: float
    starts: int = 4
    present: Model | None = None
    begin: Mapping[str, float] = field(default_factory=dict)
    command: str | Sequence[str] | None = None
    laws: bool = False


def identify_model(study: Study, model: Model, task: FitTask) -> Identified:
    """Identify a model on a study's training runs; the study stays as it is.

    Raises
    ------
    StudyError, RecordError
        As `identify_study`.
    """
    left_out = tuple(f"Left out: {why}" for why in study.usable_effects())
    model = _with_choices(model, task.begin)
    runs, old = study.runs(), behind_data(study)
    # What the present model does not know of the data, this fit does.
    runs = replace(runs, notes=tuple(note for note in runs.notes if note != old))
    model = _with_labels(model, runs.train)
    found = identify_on_rig(rig_of(study, model, runs), runs, model, task)
    return replace(found, notes=(*found.notes, *left_out))


def identify_on_rig(rig: Rig, runs: Runs, model: Model, task: FitTask) -> Identified:
    """Identify a model on a rig: fit it at all sites, then judge it there.

    Parameters
    ----------
    rig : its sites with their runs
    runs : the measurements that the rig was made of, with what weakens their split
    model : where the fit begins
    task : how it is to be identified, and in which forms of the command

    Raises
    ------
    StudyError, RecordError
        As `identify_study`.
    """
    given, present = model, task.present or model
    others: dict[str, Model] = {}
    if task.command is not None:
        forms = forms_asked(task.command)
        own = form_of(model) if form_of(model) in forms else forms[0]
        others = {form: in_form(model, form, runs.train) for form in forms}
        model = others.pop(own)
    rig.prepare(model)
    notes = [*runs.notes, *doubts([run for run in runs.all if run.has("force")])]
    notes += extrapolated(model, runs.train, runs.holdout)
    tell("identifying")
    fits = fit_rig(rig, model, task.starts, task.begin)
    fit = fits.whole(model)
    models = site_models(rig, fit.model)
    old = site_models(rig, present)
    # The start of a first fit is nobody's model: its error is no step on the way.
    fitted_before = is_identified(present) or _lines_alone(old)
    before = errors_of(old, task.cutoff) if fitted_before else None
    after = errors_of(models, task.cutoff)
    at = models.get(DAMPER) or _worst(models)
    notes += [
        *(f"{site_name(site)}: {text}" for site, text in fits.notes().items()),
        *by_site(models),
        *weighing(after.numbers["z_train"]),
    ]
    if "error_share_holdout" in after.numbers:
        train, holdout = (after.numbers[f"error_share_{role}"] for role in ("train", "holdout"))
        notes += filter(None, [held_out_apart(train, holdout, holdout)])
    notes += [*rig.notes, *under_load(at)]
    found = Identified(fit, task.cutoff, before, after, tuple(notes), None, at)
    if others:
        alone = FitTask(task.cutoff, task.starts, present=present, begin=task.begin)
        in_forms = {own: found}
        for form, other in others.items():
            tell(f"identifying with the form {form} of the command")
            in_forms[form] = identify_on_rig(rig, runs, other, alone)
        rows = [(form, in_forms[form]) for form in forms]
        errors = tuple(FormError(f, one.model, one.after, len(one.fit.std)) for f, one in rows)
        found = replace(found, forms=errors)
    if task.laws:
        notes += left_out_notes(rig, given)
        found = replace(found, laws=all_laws(rig, runs, given), notes=tuple(notes))
    return found


def _lines_alone(models: SiteModels) -> bool:
    """Return whether a model is lines, which are fitted wherever it is judged, and nothing else."""
    return all(site.is_line and not model.effects for site, model in models.values())


def _worst(models: SiteModels) -> SiteModel:
    """Return the site where the model errs the most, on held-out runs if there are any."""

    def z(at: SiteModel) -> float:
        held_out = at.site.holdout
        return robust_z(at.site.train if held_out is None else held_out, at.model)

    return max(models.values(), key=z)


def _with_choices(model: Model, begin: Mapping[str, float]) -> Model:
    """Return the model with the choices of a form, such as a storey's number, that were found."""
    chosen = {n: v for n, v in begin.items() if n.endswith(".which") and n in model.values}
    return model.with_values(chosen, origin="assumed") if chosen else model


def _with_labels(model: Model, runs: Sequence[Measurement]) -> Model:
    """Return the model with what is known of runs at their mean, unless it was set by hand."""
    found = {}
    for name in model.effects:
        effect = EFFECTS[name]
        for own, label in {**effect.labels, **effect.label_means}.items():
            numbers = [y for run in runs if not isinstance(y := run.labels.get(label, ""), str)]
            parameter = f"{name}.{own}"
            left = model.values[parameter] == effect.parameters[own].value
            if left and len(numbers) == len(runs):
                found[parameter] = float(np.mean(numbers))
    return model.with_values(found, origin="measured") if found else model


def _of_law(model: Model, law: str | None) -> Model:
    """Return the model with another law, its effects kept where they can join."""
    if law is None or law == model.law:
        return model
    if law not in law_names():
        raise StudyError(f'law "{law}"; there are: {", ".join(law_names())}.')
    base, _ = base_and_variant(law)
    unfit = [
        name
        for name in model.effects
        if EFFECTS[name].site == base.site and not EFFECTS[name].joins(base)
    ]
    if unfit:
        raise StudyError(f'{", ".join(unfit)} cannot join the law "{law}": undo the step first.')
    return model.with_law(law, model.effects)

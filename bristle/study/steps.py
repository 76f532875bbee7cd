"""The steps on a study: create, compare, diagnose, add an effect, or all until it is enough."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.comparison import RigComparer
from ..comparison.misfit import run_error
from ..comparison.predictions import RunPrediction
from ..comparison.result import Comparison
from ..core.files import write_whole
from ..core.interrupt import keeps
from ..core.progress import tell
from ..core.text import command, percent, plain, unknown
from ..data.channels import ChannelSpec
from ..diagnosis import Diagnosis, diagnose_rig
from ..errors import StudyError
from ..identification.building_fit import (
    StructureFit,
    building_text,
    equilibrium,
    identify_structure,
)
from ..identification.histories import compile_ahead
from ..identification.rig_fit import force_errors, site_models
from ..model.model import Model
from ..physics.building import Building, frequencies
from ..physics.effect import EFFECTS, closures
from ..physics.forms import joined_form
from ..physics.laws import law_names
from ..trust import remember_made
from ..user_code.load import undefine
from ..view import Viewable
from .forms import LawFits, law_command, law_or_all, with_law
from .history import Step
from .identify import (
    FitTask,
    Identified,
    as_named_here,
    identify_model,
    identify_study,
    is_identified,
    refuse_effect,
    refuse_left_out,
)
from .new import NewStudy, make_folder
from .rig import building_of, rig_of
from .run_facts import RunChoices
from .runs import Runs, refuse_seen, usable
from .study import Note, Study, note, noted
from .study_file import ALL, TEST


def diagnose_study(
    study: Study, *, law: str | None = None, write: bool = True, adds: int = 0
) -> Diagnosis:
    """Return what the present model of a study is missing; write verdict.json.

    A closure is no effect of physics: what it carries is missing still, so the verdict is on the
    model without it.

    Parameters
    ----------
    study : the folder, opened
    law : "all" seeks the law together with its effects, the model's own keeps it; None seeks it
        where nobody chose one (`laws.law_or_all`)
    write : whether to write verdict.json
    adds : how many effects that the verdict names are added at once: it is told without limits

    Raises
    ------
    StudyError
        If the model was not identified before, the study cannot be written, or another law than
        the model's is asked for.
    RecordError
        If a file cannot be read, or a channel that is needed is missing.
    """
    law = law_or_all(study, law)
    for why in study.usable_effects():
        tell(f"left out: {why}")
    compile_ahead()
    model, runs = study.model(), study.runs()
    if law not in (None, ALL, model.law):
        if law not in law_names():
            raise StudyError(unknown("law", str(law), (*law_names(), ALL)))
        raise StudyError(
            f"the study's model has the law {model.law}. To take another one:  "
            f"{law_command(study.folder, str(law))} ; to compare all of them:  "
            f"{command('diagnose', study.folder, '--law', ALL)}"
        )
    networks = closures(model.effects)
    physics = model.only([one for one in model.effects if one not in networks])
    identified = is_identified(model)
    found = diagnose_rig(
        runs.train, runs.holdout, physics, building_of(study, model), any_law=law == ALL,
        identified=identified and not networks, named=model.law,
        kept=LawFits(study, physics) if write and law == ALL else None, adds=adds,
    )  # fmt: skip
    if identified:
        rig = rig_of(study, model, runs)
        found = replace(found, error=force_errors(site_models(rig, model)))
    if write:
        write_effects(study, found.written)
        study.write_verdict(verdict_of(study, found))
        keeps("The verdict is kept in verdict.json.")
    return found


def write_effects(study: Study, texts: Mapping[str, str]) -> None:
    """Keep effects that bristle made, by name, as files of the study's own."""
    for name, text in texts.items():
        file = study.effects_folder / f"{name}.py"
        write_whole(file, text)
        remember_made(file, text)
        undefine(name)  # the file's takes its place
    if texts:
        study.usable_effects()


def take_law(study: Study, found: Diagnosis) -> Identified | None:
    """Identify a study's model with the law of a verdict, as a step.

    None where it has that law, or the data carry no verdict.

    Parameters
    ----------
    study : the folder, opened
    found : a verdict on a law and its effects
    """
    model = study.model()
    if not found.law or (found.law == model.law and is_identified(model)):
        return None
    begin = found.laws.row.trial.model.values if found.laws is not None else {}
    return identify_study(study, model=with_law(model, found.law), begin=begin)


def _turned(study: Study) -> list[str]:
    """Return the sentences about channels whose sign the study turns: no fault, but a choice."""
    return [
        f"{name.capitalize()} has the other sign in its files; study.toml reverses it."
        for name, channel in study.settings.channels.items()
        if channel.sign < 0
    ]


def verdict_of(study: Study, found: Diagnosis) -> dict[str, Any]:
    """Return the content of verdict.json, with what weakens the split and what is left out."""
    verdict = found.as_dict()
    networks = closures(study.model(to_show=True).effects)
    notes = [
        *study.runs().notes, *_turned(study), *(f"Left out: {why}" for why in study.left_out()),
        *(f"The verdict is on the model without {one}: a closure is no effect of physics."
          for one in networks),
    ]  # fmt: skip
    return {**verdict, "notes": notes} if notes else verdict


NOT_PROVEN = "not proven"
"""How the reason ends of effects that improve the prediction and that no verdict names."""


@dataclass(frozen=True)
class Added:
    """What adding an effect did: the identification with it, and the step in the history.

    `other_law` the law that the verdict on the effects is about where the model has another one,
    else "".
    """

    effects: tuple[str, ...]
    identified: Identified
    step: Step
    other_law: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            **self.identified.as_dict(), "added": list(self.effects), "step": self.step.number,
            "other_law": self.other_law,
        }  # fmt: skip


def add_effects(
    study: Study,
    names: Sequence[str],
    *,
    why: str = "",
    found: Diagnosis | None = None,
) -> Added:
    """Add effects to a study's model, refit it, and write the step.

    Parameters
    ----------
    study : the folder, opened
    names : of the effects
    why : the reason for the history; else the verdict at hand, or "by hand"
    found : the diagnosis that named them: the fit then begins from its values

    Raises
    ------
    StudyError
        If an effect is not known, is there already, or cannot join the model.
    """
    identified = identify_with(study, names, found.values if found is not None else {})
    names = _named_here(study, names)
    verdict = study.verdict() or {}
    agreed = bool(verdict) and set(names) <= set(verdict.get("effects", []))
    why = why or (f"verdict: {verdict['kind']}" if agreed else "by hand")
    law = joined_form(verdict["law"], verdict["command"]) if agreed and "law" in verdict else ""
    other_law = law if law != identified.model.law else ""
    step = study.add_step(
        "add " + ", ".join(names), why, identified.model, *identified.for_history()
    )
    return Added(names, replace(identified, step=step), step, other_law)


SEEN = 0.01
"""Share of the error on held-out runs that what is not proven takes at least."""


def add_unproven(
    study: Study, law: str, names: Sequence[str], begin: Mapping[str, float], found: Diagnosis
) -> tuple[Step | None, str]:
    """Add what improves the prediction and is not proven; the verdict stays on the model before.

    Where the held-out runs do not err less with it no step is made: the text returned says so.

    Parameters
    ----------
    study : the folder, opened
    law : another law that is taken, "" for none
    names : of the effects
    begin : values in SI by name from which one more fit begins
    found : the verdict at hand
    """
    identified = identify_with(study, names, begin, law)
    parts = ([f"take {law}"] if law else []) + ([f"add {', '.join(names)}"] if names else [])
    errors = identified.before, identified.after
    fall = [one.get("error_share_holdout", inf) for one in errors]
    if fall[1] > (1.0 - SEEN) * fall[0]:
        how = "rises" if fall[1] > fall[0] else "hardly falls,"
        return None, (
            f"Not kept: {'; '.join(parts)}. It lowers the error on training runs left out of the "
            f"fit; on held-out runs the error {how} from {' to '.join(map(percent, fall))} of the "
            "force."
        )
    why = f"improves the prediction on training runs left out; {NOT_PROVEN}"
    what = f"{'; '.join(parts)} ({NOT_PROVEN})"
    step = study.add_step(what, why, identified.model, *identified.for_history())
    found = replace(found, error=identified.errors.at)  # of the model that the study now has
    study.write_verdict(verdict_of(study, found))
    return step, ""


def unproven_of(study: Study, step: Step) -> list[str]:
    """Return the effects that a step added and that no verdict names."""
    if not step.why.endswith(NOT_PROVEN):
        return []
    before, after = (study.model_of(n, to_show=True) for n in (step.number - 1, step.number))
    return [name for name in after.effects if name not in before.effects]


def identify_with(
    study: Study, names: Sequence[str], begin: Mapping[str, float], law: str = ""
) -> Identified:
    """Identify a study's model with effects added; the study stays as it is.

    Parameters
    ----------
    study : the folder, opened
    names : of the effects
    begin : values in SI by name from which one more fit begins
    law : another law that the model takes first, "" for none

    Raises
    ------
    StudyError
        If an effect is not known, is there already, or cannot join the model.
    """
    study.usable_effects()
    for name in names:
        refuse_left_out(study.effects_folder / f"{name}.py")
    tell("reading the runs")
    present = study.model()
    model = with_law(present, law) if law else present
    for name in _named_here(study, names):
        refuse_effect(model, name, not study.settings.has_building)
        model = model.with_effect(name)
    alone = bool(closures(names))  # trained beside the present values: no other start is near
    known = {**(present.values if alone else {}), **begin}
    start = {k: v for k, v in known.items() if k in model.values}
    # With the new effects at their defaults it would be nobody's model: before is the one without.
    starts = 0 if alone or begin else FitTask.starts
    task = FitTask(study.settings.cut_off, starts, present=present, begin=start)
    return identify_model(study, model, task)


def _named_here(study: Study, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names that a study's model gives effects."""
    return tuple(as_named_here(name, not study.settings.has_building) for name in names)


# The test runs of a study, which no choice sees, and how often they have been opened.

FILE = "test_openings.json"
"""Where a study counts."""


def runs_for_test(study: Study, runs: Runs) -> Runs:
    """Return the runs for training, and the test runs in place of those held out.

    Parameters
    ----------
    study : the study
    runs : its other runs, with none of which a test run may be identical

    Raises
    ------
    StudyError
        If the study has no test run, or one is among its other runs.
    RecordError
        If a file cannot be read.
    """
    if not study.files(TEST):
        raise StudyError(
            f'{study.folder / "study.toml"}: no run has role = "{TEST}". Give it to runs before '
            "they are compared with any model: bristle study new NAME --data 'lab/*.csv' --test "
            "'last_*.csv'"
        )
    found, idle = usable(study.read(TEST))
    refuse_seen(runs.all, found)
    return Runs(runs.train, found, idle)


def uses_of_test_set(study: Study) -> tuple[Note, ...]:
    """Return when the test runs were opened, the first time first.

    Raises
    ------
    StudyError
        If the file that counts is damaged.
    """
    damaged = (
        "it counts the openings of the test runs, and is damaged. Restore it from a copy of the "
        "study."
    )
    return noted(study.folder / FILE, "openings", damaged)


def count_test_set_use(study: Study) -> None:
    """Write down that the test runs are opened now, for the present model.

    Raises
    ------
    StudyError
        If the study cannot be written, or the file that counts is damaged.
    """
    with study.writing():
        note(study, study.folder / FILE, "openings", uses_of_test_set(study), ())


def opened_text(times: int) -> str:
    """Return the sentence that tells how often the test runs have been opened."""
    if times <= 1:
        return "No fit and no verdict has seen these runs; they are opened for the first time."
    return (
        f"These runs have been opened {times} times: their error is no longer that of unseen runs."
    )


# A study's model compared with its runs.


def comparer(study: Study, role: str = "holdout") -> RigComparer:
    """Return what compares models with the runs of one role, "holdout", "train" or "test".

    The runs are read and prepared once, so that several models can be compared with them. The study
    counts how often its test runs are opened here.

    Raises
    ------
    StudyError
        If an effect of the present model acts at no site of the rig, or there is no test run; if
        study.toml is another one than the study was opened with.
    RecordError
        If a run cannot be read or lacks a channel that is needed.
    """
    model = study.model()
    study.refuse_if_changed()  # where it was opened before others wrote in it
    runs = study.runs()
    if role == TEST:
        runs = runs_for_test(study, runs)
    tell("holding the model against the runs")
    made = RigComparer(rig_of(study, model, runs), role, model)
    if role == TEST:  # before anybody can have seen an error
        count_test_set_use(study)
    return made


def compare_study(study: Study, model: Model | None = None, *, role: str = "holdout") -> Comparison:
    """Compare a study's model, the present one by default, with its runs of one role.

    Of a building it tells all sites, and at length the one where the present model fails the most.

    Raises
    ------
    StudyError, RecordError
        As `comparer`, and if nothing tells what error is large.
    """
    found = comparer(study, role).compare(model or study.model())
    if role != TEST:
        return found
    said = opened_text(len(uses_of_test_set(study)))
    return replace(found, sentences=(*found.sentences, said))


# Two models of a study, without and with an effect: what the effect takes from the error.


@dataclass(frozen=True)
class BeforeAfter:
    """A model without and with effects.

    `step` is the number of the step of the history that added them, None where they are those that
    the present verdict's diagnosis refined, and not added.
    """

    effects: tuple[str, ...]
    before: Model
    after: Model
    step: int | None = None


@dataclass(frozen=True, eq=False)
class TwoPredictions:
    """The same held-out runs at the same site, predicted by the models of a `BeforeAfter`."""

    before: tuple[RunPrediction, ...]
    after: tuple[RunPrediction, ...]

    @property
    def z_before(self) -> float:
        """Error / noise over all runs without the effects."""
        return run_error("all runs", self.before).z

    @property
    def z_after(self) -> float:
        """Error / noise over all runs with them."""
        return run_error("all runs", self.after).z


def before_after(study: Study) -> BeforeAfter | None:
    """Return the effect that the present verdict refined, else the last one that was added.

    None where the verdict has none and no step of the history added one.

    Raises
    ------
    StudyError, TrustError
        If a model of the study cannot be read, or has an effect whose code must not run yet.
    """
    model, verdict = study.model(), study.verdict() or {}
    if any(one not in EFFECTS for one in (verdict.get("refined") or {}).get("effects", ())):
        study.usable_effects()  # one of the user's own, which no model has yet
    return _refined(model, verdict) or last_added(study)


def _refined(model: Model, verdict: Mapping[str, Any]) -> BeforeAfter | None:
    """Return the present model, and that which a diagnosis refined; None where there is none."""
    refined = verdict.get("refined") or {}
    effects = tuple(refined.get("effects", ()))
    unknown = any(one not in EFFECTS or one in model.effects for one in effects)
    other_law = verdict.get("laws") and model.law != joined_form(verdict["law"], verdict["command"])
    if not effects or unknown or other_law:
        return None
    after = model
    for one in effects:
        after = after.with_effect(one)
    known = {name: float(v) for name, v in refined["values"].items() if name in after.values}
    return BeforeAfter(effects, model, replace(after, values={**after.values, **known}))


def last_added(study: Study) -> BeforeAfter | None:
    """Return the models on both sides of the last step that added an effect; None without one."""
    numbers = [step.number for step in study.steps()]
    later: Model | None = None
    for number in reversed(numbers):
        model = study.model_of(number)
        new = () if later is None else tuple(n for n in later.effects if n not in model.effects)
        if later is not None and new:
            step = numbers[numbers.index(number) + 1]
            return BeforeAfter(new, model, later, step)
        later = model
    return None


def predictions(study: Study, pair: BeforeAfter) -> TwoPredictions:
    """Return the held-out runs predicted by both models, at the site that `bristle compare` shows.

    Raises
    ------
    StudyError, RecordError
        As `comparison.comparer`.
    """
    made = comparer(study)
    return TwoPredictions(tuple(made.predictions(pair.before)), tuple(made.predictions(pair.after)))


# The building of a study alone: its stiffnesses and damping ratios from its own response.


@dataclass(frozen=True, repr=False)
class IdentifiedBuilding(Viewable):
    """What the response said of the building.

    `given` as it was, `fit` as found on the training runs; `before`, `after` the worst level's z
    and share of its shear on training and held-out runs; `file` the building file that was
    written and `step` the history's new step, None where nothing was.
    """

    given: Building
    fit: StructureFit
    before: dict[str, float]
    after: dict[str, float]
    notes: tuple[str, ...]
    file: Path | None = None
    step: Step | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        fit = self.fit
        stiffness = zip(fit.building.levels(), fit.stiffnesses, fit.std_stiffnesses, strict=True)
        modes = zip(
            fit.frequencies, fit.std_frequencies, fit.damping_ratios, fit.std_damping_ratios,
            strict=True,
        )  # fmt: skip
        return {
            "schema": 1,
            "building": fit.building.name,
            "stiffnesses": [
                {"below": level, "value": float(k), "unit": "N/m", "interval95": _half(s)}
                for level, k, s in stiffness
            ],
            "modes": [
                {
                    "frequency": float(f), "unit": "Hz", "interval95": _half(s),
                    "damping_ratio": float(ratio), "damping_ratio_interval95": _half(spread),
                }
                for f, s, ratio, spread in modes
            ],
            "z": [None if np.isnan(z) else float(z) for z in fit.z],
            "unidentified": list(fit.unidentified),
            "before": self.before,
            "after": self.after,
            "notes": list(self.notes),
            "file": str(self.file.absolute()) if self.file else None,
            "step": self.step.number if self.step else None,
        }  # fmt: skip


def identify_building_alone(study: Study, *, write: bool = True) -> IdentifiedBuilding:
    """Identify the building of a study from its training runs, and judge it on those held out.

    Its masses are taken as given; from motion alone only ratios of stiffness to mass can be told.

    Parameters
    ----------
    write : whether the building found becomes that of the model, as a step of the history

    Raises
    ------
    StudyError
        If the study's rig is no structure, or the study cannot be written.
    RecordError
        If a file cannot be read, a channel is missing, or a stiffness comes out negative.
    """
    model = study.model()
    given = building_of(study, model)
    if given is None:
        raise StudyError(
            f'{study.folder}: rig = "{study.settings.rig}": there is no building in it. '
            "--structure needs a study made with  --rig structure --building FILE"
        )
    runs = study.runs()
    tell("identifying the building")
    fit = identify_structure(runs.train, given)
    tell("holding the building against the runs")
    before: dict[str, float] = {}
    after: dict[str, float] = {}
    for role, part in (("train", runs.train), ("holdout", runs.holdout)):
        for errors, building in ((before, given), (after, fit.building)):
            left = equilibrium(part, building)
            errors[f"z_equilibrium_{role}"] = float(np.nanmax(left.z))
            errors[f"share_equilibrium_{role}"] = float(np.nanmax(left.share))
    found = IdentifiedBuilding(given, fit, before, after, (*runs.notes, *fit.notes))
    if not write:
        return found
    names = study.history.numbers()
    path = study.folder / f"building_{names[-1] + 1 if names else 0}.toml"
    counted = f"{len(runs.train)} training run(s), tested on {len(runs.holdout)} held out"
    origin = (
        f"Identified from the response: {counted}.",
        f"Masses and start values: {model.building or 'the built-in building'}.",
        "Frequencies [Hz]: " + ", ".join(plain(f, 4) for f in frequencies(fit.building)),
        "Comments give half of the 95 % interval.",
    )
    with study.writing():
        write_whole(path, building_text(fit, origin))
    lost = f"; the data do not identify {', '.join(fit.unidentified)}" if fit.unidentified else ""
    step = study.add_step(
        "identify the building", f"its response in {counted}{lost}",
        replace(model, building=path.name), before, after,
    )  # fmt: skip
    return replace(found, file=path, step=step)


def _half(std: float) -> float | None:
    return 1.96 * float(std) if np.isfinite(std) else None


# A new study from files.


@dataclass(frozen=True, repr=False)
class Created(NewStudy, Viewable):
    """A study that was made, with what was guessed, what was left out, and what to know."""

    study: Study


def create_study(
    folder: Path | str,
    files: Sequence[Path | str],
    *,
    rig: str = "bench",
    building: Path | str | None = None,
    channels: Mapping[str, ChannelSpec] | None = None,
    title: str = "",
    law: str | None = None,
    runs: RunChoices | None = None,
    device: str | None = None,
    without: Sequence[str] = (),
) -> Created:
    """Make a study's folder from files; it appears when it is whole.

    Parameters
    ----------
    folder : path
        The folder to make; it must not exist.
    files : paths
        One run each, with the same columns.
    rig : {"bench", "structure"}
        Motion prescribed and force measured, or ground motion in and response out.
    building : path
        The data file of the structure.
    channels : mapping
        Channels that are known; the others are guessed from the first file.
    title : str
        Title of the study.
    law : str
        The law that its model begins with. None: "lugre", and on a test bench a diagnosis seeks the
        law together with its effects.
    runs : RunChoices
        What is known of whole runs, and how files hold them.
    device : str
        Of a building with several devices the one that the study is about. None: its only one, or
        the damper on the first level of a building without devices of its own.
    without : sequence of str
        Channels that are not read, though a column was guessed to hold them.

    Raises
    ------
    StudyError
        If the folder exists, a needed channel or its unit cannot be told, or files differ.
    PhysicsError
        If the building's file is wrong, or it is not clear which device is meant.
    RecordError
        If a file cannot be read.
    """
    made = make_folder(
        Path(folder), files, rig=rig, building=building, channels=channels, title=title, law=law,
        runs=runs, device=device, without=without,
    )  # fmt: skip
    return Created(**vars(made), study=Study(folder))

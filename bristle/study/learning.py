"""Learn what a study's model is missing: diagnose it, add an effect, or both until it is enough."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

from ..diagnose import Diagnosis, diagnose_rig
from ..diagnose.law_free import diagnose_laws
from ..errors import StudyError
from ..findings import command, unknown
from ..identify.bench import compile_ahead
from ..identify.rig_fit import force_errors, site_models
from ..interrupt import keeps
from ..physics.forms import joined_form
from ..physics.laws import law_names
from ..progress import tell, telling
from .history import Step
from .identification import FitTask, as_model, identify_model, identify_study
from .identified import Identified, is_identified
from .joining import as_named_here, refuse_effect, refuse_left_out
from .law_fits import LawFits
from .laws import law_command, law_or_all, with_law
from .rig import building_of, rig_of
from .settings import ALL
from .study import Study

Say = Callable[[str], None]


def diagnose_study(
    study: Study,
    *,
    law: str | None = None,
    profile: bool = False,
    write: bool = True,
    say: Say = tell,
) -> Diagnosis:
    """Return what the present model of a study is missing; write verdict.json.

    Parameters
    ----------
    study : the folder, opened
    law : "all" seeks the law together with its effects, the model's own keeps it; None seeks it
        where nobody chose one (`laws.law_or_all`)
    profile : whether the model is fitted again at every limit of an effect
    write : whether to write verdict.json
    say : called with a few words at each stage

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
        say(f"left out: {why}")
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
    known = runs.train, runs.holdout, as_model(model), building_of(study, model)
    with telling(say) if say is not tell else nullcontext():
        if law == ALL:
            kept = LawFits(study, model) if write else None
            found = diagnose_laws(*known, named=model.law, profile=profile, kept=kept, say=say)
        else:
            fitted = is_identified(model)
            found = diagnose_rig(*known, identified=fitted, profile=profile, say=say)
    if is_identified(model):
        rig = rig_of(study, model, runs)
        found = replace(found, error=force_errors(site_models(rig, as_model(model))))
    if write:
        study.write_verdict(verdict_of(study, found))
        keeps("The verdict is kept in verdict.json.")
    return found


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
    return identify_study(study, model=with_law(model, found.law), table=False)


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
    notes = [
        *study.runs().notes, *_turned(study), *(f"Left out: {why}" for why in study.left_out()),
    ]  # fmt: skip
    return {**verdict, "notes": notes} if notes else verdict


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
    identified: Identified | None = None,
) -> Added:
    """Add effects to a study's model, refit it, and write the step.

    Parameters
    ----------
    study : the folder, opened
    names : of the effects
    why : the reason for the history; else the verdict at hand, or "by hand"
    found : the diagnosis that named them: the fit then begins from its values
    identified : what `identify_with` found for these effects, where it was asked before

    Raises
    ------
    StudyError
        If an effect is not known, is there already, or cannot join the model.
    """
    if identified is None:
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


def identify_with(study: Study, names: Sequence[str], begin: Mapping[str, float]) -> Identified:
    """Identify a study's model with effects added; the study stays as it is.

    Parameters
    ----------
    study : the folder, opened
    names : of the effects
    begin : values in SI by name from which one more fit begins

    Raises
    ------
    StudyError
        If an effect is not known, is there already, or cannot join the model.
    """
    study.usable_effects()
    for name in names:
        refuse_left_out(study.effects_folder / f"{name}.py")
    tell("reading the runs")
    model = present = study.model()
    for name in _named_here(study, names):
        refuse_effect(model, name, not study.settings.has_building)
        model = model.with_effect(name)
    known = set(model.flat())
    start = {k: v for k, v in begin.items() if k in known}
    # With the new effects at their defaults it would be nobody's model: before is the one without.
    task = FitTask(study.settings.cut_off, table=False, present=present, begin=start)
    return identify_model(study, model, task)


def _named_here(study: Study, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names that a study's model gives effects."""
    return tuple(as_named_here(name, not study.settings.has_building) for name in names)

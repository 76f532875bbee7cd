"""Learn what a study's model is missing: diagnose it, add an effect, or both until it is enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

from ..data.model import StudyModel
from ..diagnose import Diagnosis, diagnose_rig
from ..diagnose.decision import missing
from ..diagnose.faults import SensorFault
from ..diagnose.law_free import diagnose_laws
from ..errors import StudyError
from ..findings import command, unknown
from ..identify.bench import compile_ahead
from ..physics.laws import law_names
from ..progress import tell, telling
from .added_runs import other_data
from .curves import LearnedEffect, learn_effect
from .history import Step
from .identification import FitTask, as_model, identify_model, identify_study
from .identified import Identified
from .joining import as_named_here, refuse_effect, refuse_left_out
from .laws import law_command, law_or_all, with_law
from .rig import building_of
from .settings import ALL
from .study import Study

Say = Callable[[str], None]

MOST_EFFECTS = 4
"""Effects that `complete` adds at the most: a model that asks for more is the wrong model."""


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
            found = diagnose_laws(*known, named=model.law, profile=profile, say=say)
        else:
            fitted = _is_identified(model)
            found = diagnose_rig(*known, identified=fitted, profile=profile, say=say)
    found = replace(found, sensors=(*found.sensors, *_turned(study)))
    if write:
        study.write_verdict(verdict_of(study, found))
    return found


def _is_identified(model: StudyModel) -> bool:
    return any(value.origin == "identified" for value in model.flat().values())


def take_law(study: Study, found: Diagnosis) -> Identified | None:
    """Identify a study's model with the law of a verdict, as a step.

    None where it has that law, or the data carry no verdict.

    Parameters
    ----------
    study : the folder, opened
    found : a verdict on a law and its effects
    """
    model = study.model()
    if not found.law or (found.law == model.law and _is_identified(model)):
        return None
    return identify_study(study, model=with_law(model, found.law), table=False)


def _with_law_taken(
    study: Study, found: Diagnosis, stepped: Callable[[Step | None], None]
) -> Diagnosis:
    """Take the law of a verdict; return the verdict as one on the model that the study then has."""
    taken = take_law(study, found)
    if taken is None or found.laws is None:
        return found
    stepped(taken.step)
    found = replace(found, laws=replace(found.laws, before=found.law))
    study.write_verdict(verdict_of(study, found))
    return found


def _turned(study: Study) -> list[SensorFault]:
    """Return the channels whose sign the study turns: their files have the other one."""
    return [
        SensorFault(
            name, "sign", -1.0, 0.0,
            f"{name.capitalize()} has the other sign in its files; study.toml reverses it.",
        )
        for name, channel in study.settings.channels.items()
        if channel.sign < 0
    ]  # fmt: skip


def verdict_of(study: Study, found: Diagnosis) -> dict[str, Any]:
    """Return the content of verdict.json, with what weakens the split and what is left out."""
    verdict = found.as_dict()
    notes = [*study.runs().notes, *(f"Left out: {why}" for why in study.left_out())]
    return {**verdict, "notes": notes} if notes else verdict


@dataclass(frozen=True)
class Added:
    """What adding an effect did: the identification with it, and the step in the history."""

    effects: tuple[str, ...]
    identified: Identified
    step: Step

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {**self.identified.as_dict(), "added": list(self.effects), "step": self.step.number}


def add_effects(
    study: Study, names: Sequence[str], *, why: str = "", found: Diagnosis | None = None
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
    study.usable_effects()
    for name in names:
        refuse_left_out(study.effects_folder / f"{name}.py")
    tell("reading the runs")
    model = present = study.model()
    bench = not study.settings.has_building
    names = tuple(as_named_here(name, bench) for name in names)
    for name in names:
        refuse_effect(model, name, bench)
        model = model.with_effect(name)
    known = set(model.flat())
    start = {k: v for k, v in found.values.items() if k in known} if found is not None else {}
    # With the new effects at their defaults it would be nobody's model: before is the one without.
    task = FitTask(study.settings.cut_off, table=False, present=present, begin=start)
    identified = identify_model(study, model, task)
    verdict = study.verdict()
    if not why:
        agreed = verdict is not None and set(names) <= set(verdict.get("effects", []))
        why = f"verdict: {verdict['kind']}" if agreed and verdict else "by hand"
    step = study.add_step(
        "add " + ", ".join(names), why, identified.model, identified.before, identified.after
    )
    return Added(tuple(names), replace(identified, step=step), step)


@dataclass(frozen=True)
class Completed:
    """What `complete` came to: the last diagnosis, and the steps that it made.

    `curves` are those learned where no effect of the library explained the error.
    """

    verdict: Diagnosis
    steps: tuple[Step, ...]
    curves: tuple[LearnedEffect, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "verdict": self.verdict.as_dict(),
            **({"learned": [one.as_dict() for one in self.curves]} if self.curves else {}),
            "steps": [
                {
                    "number": step.number, "what": step.what, "why": step.why,
                    "before": step.before, "after": step.after,
                }
                for step in self.steps
            ],
        }  # fmt: skip


def complete(
    study: Study,
    *,
    law: str | None = None,
    greedy: bool = False,
    curves: bool = False,
    say: Say = tell,
    on_step: Callable[[], None] | None = None,
) -> Completed:
    """Identify, diagnose and add until the verdict is none, ambiguous, unknown or insufficient.

    What was done is in the history already when this is interrupted: calling it again goes on.

    Parameters
    ----------
    study : the folder, opened
    law : "all" first seeks the law together with its effects; another name is taken first; None
        seeks it where nobody chose one (`laws.law_or_all`)
    greedy : whether to go on where the verdict is unknown, by the effect that lowers the held-out
        error most, as long as one does so by enough and beyond chance
    curves : whether to go on where the verdict is unknown, by learning a curve
    say : called with a few words at each stage
    on_step : called after each new step of the history
    """
    steps: list[Step] = []
    learned: list[LearnedEffect] = []

    def stepped(step: Step | None) -> None:
        if step is not None:
            steps.append(step)
            if on_step is not None:
                on_step()

    law = law_or_all(study, law)
    free = law == ALL
    other = None if law in (ALL, study.model().law) else law
    stale = bool(other_data(study)) or not _is_identified(study.model())
    if not free and (other or stale):
        say("identifying the model")
        stepped(identify_study(study, law=other, table=False).step)
    while True:
        found = diagnose_study(study, law=ALL if free else study.model().law, say=say)
        if free:
            found = _with_law_taken(study, found, stepped)
        free = False
        names = _best_effect(found) if greedy else _named(found)
        if found.kind == "unknown" and curves and not names:
            say("learning a curve")
            learned.append(learn_effect(study))
            names = (learned[-1].name,) if learned[-1].file is not None else ()
        if not names or len(study.model().effects) + len(names) > MOST_EFFECTS:
            return Completed(found, tuple(steps), tuple(learned))
        say("adding " + " and ".join(names))
        why = f"verdict: {found.kind}"
        stepped(add_effects(study, names, why=why, found=found).step)


def _named(found: Diagnosis) -> tuple[str, ...]:
    return found.effects if found.kind == "effect" else ()


def _best_effect(found: Diagnosis) -> tuple[str, ...]:
    """Return the effects named, else the one that lowers an unknown error most beyond chance."""
    before = found.before
    if found.kind != "unknown" or before is None:
        return _named(found)
    gaining = (trial.effects[-1] for trial in found.trials if missing(before, trial))
    return tuple(islice(gaining, 1))

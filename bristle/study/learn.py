"""A curve learned from a study's runs: its effect's file, its picture, and what is known of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date
from itertools import count
from keyword import iskeyword
from pathlib import Path

from ..core.files import write_whole
from ..core.progress import tell
from ..diagnosis.decision import noise_not_known
from ..diagnosis.prepared import Prepared
from ..diagnosis.rig_runs import RigRuns, runs_of_rig
from ..diagnosis.trials import judge
from ..errors import StudyError
from ..identification.rig import DAMPER
from ..learning.closed_forms import close, closed_forms
from ..learning.closure import (
    FEWEST_REVERSALS,
    LearnedClosure,
    learn_closure,
    promised,
    reversals,
)
from ..learning.closure_file import closure_text
from ..learning.curve import CurvePlace, refuse_elsewhere
from ..learning.effect_file import effect_text
from ..learning.fit import learn
from ..learning.result import LearnedEffect
from ..learning.view import curve_png
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..trust import remember_made
from ..user_code.load import flaw_of
from .identify import driven, is_identified
from .rig import building_of
from .study import Study


def learn_effect(
    study: Study,
    *,
    parts: Sequence[str] = (),
    along: Sequence[str] = (),
    at: str = "",
    name: str = "",
    table: bool = False,
    write: bool = True,
) -> LearnedEffect:
    """Learn what a study's model misses at one of its sites, as an effect of the study.

    Parameters
    ----------
    study : the folder, opened
    parts, along : on which parts of the model a curve may act and along which signals, by name;
        empty for all
    at : the site, "damper", "layer", "storey1" ...; else that where the verdict is unknown, or
        where the model errs most
    name : of the effect; else learned_1, learned_2 ...
    table : whether the effect keeps the curve's table where a formula does as well
    write : whether to write the effect's file and the picture

    Raises
    ------
    StudyError
        If the data carry no verdict, the runs do not show the site, no curve can have such a part
        or signal there, or the name is taken.
    """
    for why in study.usable_effects():
        tell(f"left out: {why}")
    given, name = name, _new_name(study, name, "learned")
    site, opened = opened_at(study, at)
    refuse_elsewhere(parts, along, CurvePlace(site), study.settings.beside)
    found = learn(opened, name, parts=parts, along=along)
    told = site if study.settings.has_building else ""
    if found.refused or found.best is None:
        return LearnedEffect(found, site=told)
    forms, closed = tuple(closed_forms(found.best.curve, found.best.std)), None
    if not table:
        closed = close(opened, name, found.best, forms)
    if closed is not None:  # the name that the effect's formula has
        forms = (closed.form, *(one for one in forms if one is not closed.form))
    learned = LearnedEffect(found, forms, closed, site=told)
    flaw = ""
    for one in [learned, replace(learned, closed=None)] if closed is not None else [learned]:
        flaw = flaw_of(name, _text(study, one, name))
        if not flaw:
            return _written(study, one, given) if write else one
    why = f"{found.best.curve.words().capitalize()} can be no effect: {flaw}"
    return replace(learned, closed=None, found=replace(found, refused=why))


def learn_study_closure(study: Study, *, name: str = "", write: bool = True) -> LearnedClosure:
    """Learn a closure of a study's model: a network for what no formula serves.

    Parameters
    ----------
    study : the folder, opened
    name : of its effect; else closure_1, closure_2 ...
    write : whether to write the effect's file and what the report says of it

    Raises
    ------
    StudyError
        If the study has one short run for training, the damper's force was not measured, the data
        carry no verdict, or the name is taken.
    """
    for why in study.usable_effects():
        tell(f"left out: {why}")
    given, name = name, _new_name(study, name, "closure")
    _, opened = opened_at(study, DAMPER, noise=False)
    if opened.problem.reconstructed:
        raise StudyError(
            f"{study.folder}: a closure is in parallel with the damper, whose force was not "
            "measured. Learn a curve at one of the building's sites:  bristle learn --at SITE."
        )
    runs = opened.problem.runs
    if len(runs) == 1 and reversals(runs[0]) < FEWEST_REVERSALS:
        raise StudyError(
            f"{study.folder}: one run is for training ({runs[0].name}), and its motion turns "
            f"{reversals(runs[0])} times. Folds choose a closure: whole runs, with different "
            f"amplitudes or commands, or parts of one that turns {FEWEST_REVERSALS} times. "
            "Add runs:  bristle study extend"
        )
    found = learn_closure(opened, name)
    if found.refused or found.closure is None:
        return found
    origin = f"learned from the runs of {study.name}, {date.today().year}"
    if flaw := flaw_of(name, closure_text(name, found.closure, origin)):
        return replace(found, refused=f"The network can be no effect: {flaw}")
    if not write:
        return found
    network = found.closure
    file = _write(study, given, "closure", lambda name: closure_text(name, network, origin))
    found = replace(found, name=file.stem, file=file)
    told = json.dumps(found.as_dict(), indent=2, ensure_ascii=False)
    study.write_report(f"{name}.json", told)
    return found


def promise_of(study: Study, opened: Prepared | None = None) -> float:
    """Return the error that a closure may leave, by the model's, as training folds tell it [1].

    Parameters
    ----------
    study : whose model was just identified
    opened : its runs, where they were opened for this model before
    """
    opened = opened or opened_at(study, "", study.model())[1]
    return promised(opened.problem, opened.before.model)


def _write(study: Study, given: str, begin: str, text_of: Callable[[str], str]) -> Path:
    """Write an effect's file by its name: the given one, or the next free one."""
    with study.writing():
        study.refuse_if_changed()
        # A fit takes minutes, in which another process may have taken the name.
        name = _new_name(study, given, begin)
        file, text = study.effects_folder / f"{name}.py", text_of(name)
        write_whole(file, text)
        remember_made(file, text)
    return file


def _text(study: Study, learned: LearnedEffect, name: str) -> str:
    """Return the text of a learned effect's file; its name may be another than in the fit."""
    best, closed = learned.found.best, learned.closed
    assert best is not None
    curve = best.curve
    if closed is not None:
        values = closed.trial.model.values  # of an effect that has no file yet
        memory = tuple((n, values[f"{learned.name}.{n}"]) for n, _ in curve.memory)
        curve = replace(curve, memory=memory)
    origin = f"learned from the runs of {study.name}, {date.today().year}"
    return effect_text(name, curve, origin, closed.formula if closed else None)


def _written(study: Study, learned: LearnedEffect, given: str) -> LearnedEffect:
    """Write a learned effect's file, its picture, and what the report says of it.

    Parameters
    ----------
    study : the folder, opened
    learned : the effect
    given : the name that its user gave it, "" for the next free one
    """
    file = _write(study, given, "learned", lambda name: _text(study, learned, name))
    name = file.stem
    learned = replace(learned, found=replace(learned.found, name=name))
    drawn = curve_png(learned)
    picture = study.write_report(f"{name}.png", drawn)
    told = json.dumps(learned.as_dict(), indent=2, ensure_ascii=False)
    study.write_report(f"{name}.json", told)
    return replace(learned, file=file, picture=picture)


def opened_at(
    study: Study, at: str, fitted: Model | None = None, *, noise: bool = True
) -> tuple[str, Prepared]:
    """Return the site of a study to learn at, "" for that where the model errs, and its runs.

    Parameters
    ----------
    study : the folder, opened
    at : a site, or ""
    fitted : the model of a test bench as these runs were fitted before, noise known or not; None
        for the study's, which is refined
    noise : whether the noise of the runs has to be known
    """
    rig, nothing = _rig(study), f"{study.folder}: nothing can be learned from these runs."
    if rig.lacking is not None:
        raise StudyError(f"{nothing} {' '.join(rig.lacking.reasons)}")
    there = rig.sites()
    if at and at not in there:
        raise StudyError(
            f"--at: these runs do not show the site {at}; they show {', '.join(there)}."
        )
    if fitted is not None:
        fitted = replace(fitted, law=fitted.base_law)  # its variant is among the values
        return DAMPER, rig.prepare(DAMPER, judge(fitted, *rig.damper))
    runs = study.runs()
    if wrong := driven([*runs.train, *runs.holdout]):
        raise StudyError(f"{nothing} {wrong[0]}")
    prepared = {site: rig.prepare(site) for site in ([at] if at else _wanted(study, there))}
    able = [pair for pair in prepared.items() if pair[1].held_out.noise_known or not noise]
    if not able:
        why = dict.fromkeys(noise_not_known(one.held_out) for one in prepared.values())
        raise StudyError(f"{nothing} {' '.join(why)}")
    return max(able, key=lambda pair: pair[1].before.z)


def _rig(study: Study) -> RigRuns:
    model, runs = study.model(), study.runs()
    return runs_of_rig(
        runs.train, runs.holdout, model, building_of(study, model),
        identified=is_identified(model),
    )  # fmt: skip


def _wanted(study: Study, there: Sequence[str]) -> list[str]:
    """Return the sites where the verdict on the present model is unknown; all where it is nowhere.

    Parameters
    ----------
    study : the folder, opened
    there : the sites that its runs show
    """
    findings = (study.verdict() or {}).get("findings") or []
    unknown = [one["site"] for one in findings if one["kind"] == "unknown"]
    return [site for site in there if site in unknown] or list(there)


def _new_name(study: Study, given: str, begin: str) -> str:
    """Return the name that was given, else the first of learned_1, learned_2 ... that is free."""
    if not given:
        return next(name for k in count(1) if not _is_taken(study, name := f"{begin}_{k}"))
    if not given.isidentifier() or iskeyword(given):
        raise StudyError(
            f'the name "{given}" is no word of letters, digits and _, as worn_bore is.'
        )
    if _is_taken(study, given):
        raise StudyError(f'an effect is named "{given}" already. Another name is right.')
    return given


def _is_taken(study: Study, name: str) -> bool:
    return name in EFFECTS or (study.effects_folder / f"{name}.py").exists()

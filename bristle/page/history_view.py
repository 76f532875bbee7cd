"""View 5, Add and watch the error fall: the staircase, and any two steps side by side."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import BristleError, TrustError
from ..physics.effect import EFFECTS
from ..report.reproduce import commands
from ..study.history import CLOSE, HistoryStep, Step, history_steps
from ..study.identify import as_named_here, refuse_effect
from ..study.study import Study
from .fit_view import rows_of


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 5 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError
        If a file of the study is wrong.
    """
    study = Study(folder)
    steps = study.steps()
    drawn = history_steps(steps)
    verdict = study.verdict() or {}
    named = verdict.get("effects", []) if verdict.get("kind") in ("effect", "ambiguous") else []
    return {
        "steps": [_step(study, step, one) for step, one in zip(steps, drawn, strict=True)],
        "floor": 1.0, "close": CLOSE,
        "named": list(named), "kind": verdict.get("kind", ""), "can_add": _can_join(study),
        "commands": _commands(study),
    }  # fmt: skip


def _step(study: Study, step: Step, one: HistoryStep) -> dict[str, Any]:
    parameters: list[dict[str, Any]] = []
    with suppress(TrustError):  # the model of a step may hold code that must not run yet
        model = study.model_of(step.number, to_show=True)
        parameters = rows_of(model, {})
    return {
        "number": step.number, "what": step.what, "why": step.why, "z": one.z, "train": one.z_train,
        "rms": one.rms, "share": one.share, "parameters": parameters,
        "below": study.settings.cut_off if one.cut_off is None else one.cut_off,
    }  # fmt: skip


def _can_join(study: Study) -> list[dict[str, str]]:
    """Return the effects that may be added to the present model."""
    model, bench = study.model(to_show=True), not study.settings.has_building
    if model.only_shown:
        return []
    found = []
    for name, effect in sorted(EFFECTS.items()):
        with suppress(BristleError):
            refuse_effect(model, as_named_here(name, bench), bench)
            found.append({"name": name, "about": effect.first_line()})
    return found


def _commands(study: Study) -> list[str]:
    """Return the commands that repeat the study; none where its model must not be read yet."""
    try:
        return commands(study)
    except TrustError:
        return []

"""View 2, Fit: the model with its parameters and intervals, the laws side by side."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.misfit import run_error
from ..comparison.names import effect_name, name_of, site_name
from ..comparison.patterns import ResidualPattern
from ..comparison.predictions import RunPrediction, shown
from ..comparison.result import Comparison
from ..core.files import read_json
from ..core.text import with_interval
from ..diagnosis.view import worst
from ..errors import BristleError, StudyError, TrustError
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS, base_and_variant
from ..planning.folder import read_plan
from ..report.study_page import commands
from ..study.history import CLOSE, HistoryStep, Step, history_steps
from ..study.identify import as_named_here, is_identified, refuse_effect
from ..study.steps import before_after, compare_study, predictions
from ..study.study import Study, other_data
from ..study.study_file import ROLES, TEST
from ..study.view import story_view
from ..view.html import page_data
from .data_views import thinned

ANSWER = "identify.json"
"""What `bristle identify` leaves in reports/."""


def fit_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 2 shows of a study.

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
    model = study.model(to_show=True)
    path = study.reports_folder / ANSWER
    found = read_json(path) if path.is_file() else {}
    numbers = study.history.numbers()
    fresh = bool(numbers) and found.get("step") == numbers[-1]
    hidden = set(model.only_shown)
    return {
        "law": model.law, "effects": list(model.effects), "building": model.building,
        "about": [] if hidden else _about(model), "waiting": sorted(hidden),
        "identified": is_identified(model),
        "parameters": rows_of(model, study.drive, found if fresh else {}),
        "answer": found if fresh else None, "laws": sorted(LAWS),
        "step": numbers[-1] if numbers else None, "other_data": other_data(study),
    }  # fmt: skip


def rows_of(model: Model, drive: str, found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row per parameter: value, half of its 95 % interval, how it is known, what it is.

    `shown` are value and half with the digits that the interval leaves.

    Parameters
    ----------
    model : of the study
    drive : "voltage", "current", or "" without a command
    found : what its identification found, empty where it is not known
    """
    rows = []
    for name, value in model.written_for(drive).items():
        own = (found.get("parameters") or {}).get(name, {})
        std = value.std
        how = own.get("how") or ("identified" if std is not None else value.origin)
        declared = model.declared(name)
        known = std if how == "identified" else None
        rows.append(
            {
                "name": name, "value": value.value, "unit": value.unit, "how": how,
                "half": 1.96 * known if known is not None else None,
                "shown": with_interval(value.value, known),
                "about": declared.text, "low": value.low, "high": value.high,
            }
        )  # fmt: skip
    return rows


def _about(model: Model) -> list[dict[str, str]]:
    """Return what law and effects are: the first paragraphs of their texts, formulas included."""
    law = base_and_variant(model.law)[0]
    own = [("law", law.name, law)] + [("effect", n, EFFECTS[n]) for n in model.effects]
    return [
        {"kind": kind, "name": name, "text": inspect.getdoc(one) or "", "source": one.source}
        for kind, name, one in own
    ]


# View 3, Where it fails: every sample of the compared runs; view 4: without and with an effect.


MOST = 250_000
"""Samples of all runs that are sent; of more every second, third ... is."""
PATTERNS = 5


def errors_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 3 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : `role` "holdout" or "train"; test runs are opened by a command alone

    Raises
    ------
    StudyError, RecordError, TrustError
        As `compare_study`.
    """
    role = arguments.get("role", "holdout")
    if role == TEST or role not in ROLES:
        raise StudyError(f'role "{role}"; "holdout" or "train" is right.')
    study = Study(folder)
    found = compare_study(study, role=role)
    return {
        "role": role, "sentences": list(found.sentences), "interval": list(found.z_interval),
        "right": found.right,
        **linked(found),
        "patterns": [_pattern(one, found) for one in found.patterns[:PATTERNS]],
        "spectrum": {
            "frequency": found.spectrum.frequency, "residual": found.spectrum.residual,
            "noise": found.spectrum.noise,
        },
        "sites": [
            {"name": site_name(one.site), "z": one.z, "fails": one.fails} for one in found.sites
        ],
    }  # fmt: skip


def linked(found: Comparison, most: int = MOST) -> dict[str, Any]:
    """Return what the linked pictures show of a comparison.

    Parameters
    ----------
    found : what is compared
    most : samples of all runs at the most
    """
    every = every_of(found.predictions, most)
    return {
        "z": found.z, "quantity": found.quantity, "unit": found.unit,
        "site": site_name(found.site) if found.site else "", "every": every,
        "drive": found.drive.name, "drive_unit": found.drive.unit,
        "runs": [_linked_run(one, found, every) for one in found.predictions],
    }  # fmt: skip


def every_of(predictions: Sequence[RunPrediction], most: int = MOST) -> int:
    """Return 1 where all samples are sent, 2 where every second is, and so on."""
    samples = sum(len(one.measured) for one in predictions)
    return max(1, -(-samples // most))


def _linked_run(one: RunPrediction, found: Comparison, every: int) -> dict[str, Any]:
    """Return a run's samples in SI: measured, predicted, the noise expected, and the motion."""
    error = next(run for run in found.runs if run.name == one.name)
    part = slice(one.skip, None, every)
    coordinates = {
        name: one.coordinates[name][part]
        for name in ("displacement", "velocity", one.drive)
        if name in one.coordinates
    }
    known = one.known[part] if one.known is not None else None
    return {
        "name": one.name, "z": error.z, "rms": error.rms, "noise": error.noise,
        "dt": one.dt * every, "time": one.time[part], "measured": one.measured[part],
        "predicted": one.predicted[part], "sigma": one.sigma[part],
        "normalised": one.normalised[::every],
        "known": None if known is None else known.astype(float), **coordinates,
    }  # fmt: skip


def _pattern(one: ResidualPattern, found: Comparison) -> dict[str, Any]:
    units = found.predictions[0].units
    factor, unit = shown(one.coordinate, units, float(np.max(np.abs(one.centre))))
    return {
        "name": name_of(one.coordinate, found.site), "unit": unit, "share": one.share, "p": one.p,
        "significant": one.significant, "turned": one.turned, "centre": factor * one.centre,
        "mean": one.mean, "std": one.std,
    }  # fmt: skip


def residual_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the residuals of the models of `before_after` on held-out runs, for view 4.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError, TrustError
        As `before_after` and `predictions`.
    """
    study = Study(folder)
    pair = before_after(study)
    if pair is None:
        return {"effects": []}
    found = predictions(study, pair)
    every = every_of(found.before)
    one = found.before[0]
    return {
        "effects": list(pair.effects), "step": pair.step,
        "kind": (study.verdict() or {}).get("kind", ""), "quantity": one.quantity, "unit": one.unit,
        "site": site_name(one.site) if one.site else "", "every": every,
        "before": found.z_before, "after": found.z_after,
        "runs": [_residuals(*both, every) for both in zip(found.before, found.after, strict=True)],
    }  # fmt: skip


def _residuals(before: RunPrediction, after: RunPrediction, every: int) -> dict[str, Any]:
    """Return a run's motion, and of both models residual and expected noise, in SI."""
    part = slice(before.skip, None, every)
    motion: dict[str, Any] = {
        name: before.coordinates[name][part]
        for name in ("displacement", "velocity")
        if name in before.coordinates
    }
    return {
        "name": before.name, "time": before.time[part], **motion,
        **{
            when: {
                "z": run_error(one.name, [one]).z, "residual": one.residual[::every],
                "sigma": one.sigma[part], "normalised": one.normalised[::every],
            }
            for when, one in (("before", before), ("after", after))
        },
    }  # fmt: skip


# View 4, What is missing: the verdict with its evidence, limits, and the next tests.


def verdict_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 4 shows of a study.

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
    verdict = study.verdict()
    told = {"verdict": None if verdict is None else shown_verdict(study, verdict)}
    return {
        **told, "learned": learned(study),
        "plans": [_plan(one) for one in sorted(folder.glob("plan*")) if one.is_dir()],
    }  # fmt: skip


def learned(study: Study) -> list[dict[str, Any]]:
    """Return the curves that were learned from a study's runs and whose effects it still has.

    Each with the half of its 95 % interval and the closed form nearest to it, as `bristle learn`
    left them in reports/; of a surface the rows of its levels. Without numbers where what was
    learned is neither.
    """
    found = []
    for file in sorted(study.reports_folder.glob("*.json")):
        if not (study.effects_folder / f"{file.stem}.py").is_file():
            continue
        told = read_json(file)
        one: dict[str, Any] = {"name": file.stem, "sentences": list(told.get("sentences") or [])}
        if told.get("forms"):
            nearest = told.get("nearest") or {}
            one |= {key: np.array(told[key], dtype=float) for key in ("knots", "values")}
            one |= {
                "half": 1.96 * np.array(told["std"], dtype=float), "along": told["along"],
                "unit": told["unit"], "along_unit": told["along_unit"],
                "form": told["forms"][0]["formula"],
                "nearest": {key: np.array(values) for key, values in nearest.items()},
            }  # fmt: skip
        elif told.get("levels"):  # a surface: a row of values for each level
            rows = np.array(told["values"], dtype=float).reshape(len(told["levels"]), -1)
            one |= {
                "rows": list(rows), "unit": told["unit"],
                **{key: told[key] for key in ("along", "along_unit", "across", "across_unit")},
                **{key: np.array(told[key], dtype=float) for key in ("knots", "levels")},
            }  # fmt: skip
        found.append(one)
    return found


def shown_verdict(study: Study, verdict: Mapping[str, Any]) -> dict[str, Any]:
    """Return a verdict as the page shows it: blocks, and the trials that it draws itself."""
    view, at = story_view(study, verdict), worst(verdict)
    return {
        "kind": verdict["kind"], "title": view.title, "answer": page_data(view.blocks),
        "details": page_data(view.details), "effects": list(verdict.get("effects") or []),
        "before": at.get("z_holdout_before"), "ranking": [
            {**row, "name": effect_name(row["effect"])} for row in verdict.get("ranking") or []
        ],
    }  # fmt: skip


def _plan(folder: Path) -> dict[str, Any]:
    """Return the tests of a plan: what each is, and its motion and command over time."""
    try:
        found = read_plan(folder)
    except BristleError as error:
        return {"name": folder.name, "error": str(error), "runs": []}
    runs = []
    for run in found.runs:
        rows = thinned(np.asarray(run.time), run.signals)
        runs.append(
            {
                "name": run.name, "role": run.role, "about": run.about, "time": run.time[rows],
                "channels": {name: values[rows] for name, values in run.signals.items()},
            }
        )  # fmt: skip
    return {"name": folder.name, "error": "", "runs": runs}


# View 5, Add and watch the error fall: the staircase, and any two steps side by side.


def history_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
        parameters = rows_of(model, study.drive, {})
    return {
        "number": step.number, "what": step.what, "why": step.why, "z": one.z, "train": one.z_train,
        "rms": one.rms, "share": one.share, "parameters": parameters,
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

"""View 4, What is missing: the verdict with its evidence, limits, and the next tests."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import read_json
from ..diagnosis.view import worst
from ..errors import BristleError
from ..planning.folder import read_plan
from ..study.study import Study
from ..study.view import story_view
from ..view.page_data import page_data
from .data_view import thinned


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
    told = {"verdict": None if verdict is None else shown(study, verdict)}
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


def shown(study: Study, verdict: Mapping[str, Any]) -> dict[str, Any]:
    """Return a verdict as the page shows it: blocks, and the trials that it draws itself."""
    view, at = story_view(study, verdict), worst(verdict)
    return {
        "kind": verdict["kind"], "title": view.title, "answer": page_data(view.blocks),
        "details": page_data(view.details), "effects": list(verdict.get("effects") or []),
        "before": at.get("z_holdout_before"), "ranking": verdict.get("ranking") or [],
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

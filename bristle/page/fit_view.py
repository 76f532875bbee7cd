"""View 2, Fit: the model with its parameters and intervals, the laws side by side."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.files import read_json
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS, base_and_variant
from ..study.changes import other_data
from ..study.identified import is_identified
from ..study.study import Study

ANSWER = "identify.json"
"""What `bristle identify` leaves in reports/."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
        "parameters": rows_of(model, found if fresh else {}),
        "answer": found if fresh else None, "laws": sorted(LAWS),
        "step": numbers[-1] if numbers else None, "other_data": other_data(study),
    }  # fmt: skip


def rows_of(model: Model, found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row per parameter: value, half of its 95 % interval, how it is known, what it is.

    Parameters
    ----------
    model : of the study
    found : what its identification found, empty where it is not known
    """
    rows = []
    for name, value in model.written().items():
        own = (found.get("parameters") or {}).get(name, {})
        std = value.std
        how = own.get("how") or ("identified" if std is not None else value.origin)
        declared = model.declared(name)
        rows.append(
            {
                "name": name, "value": value.value, "unit": value.unit, "how": how,
                "half": 1.96 * std if std is not None and how == "identified" else None,
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

"""The newest plan of a study in its report: the next tests, and what they will show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BristleError
from ..plan.folder import FILE, PlanFolder, read_plan
from ..plan.outcome import OUTCOMES
from ..plan.performed import shows
from ..view import html

if TYPE_CHECKING:
    from ..study.study import Study


def plan_section(study: Study) -> str:
    """Return the section of the newest plan in a study's folder, "" where there is none."""
    folders = sorted(study.folder.glob(f"plan*/{FILE}"), key=lambda file: file.stat().st_mtime)
    if not folders:
        return ""
    folder = folders[-1].parent
    try:
        plan = read_plan(folder)
        told = json.loads((folder / OUTCOMES).read_text(encoding="utf-8"))
        header, rows = told["header"], told["rows"]
    except (BristleError, OSError, ValueError, KeyError, TypeError) as error:
        return html.section("Next tests", html.paragraphs(f"{folder.name} cannot be read: {error}"))
    performed = _performed(study, plan, others=len(folders) > 1)
    lead = (
        f"The tests of {folder.name} are measured: their runs are in this study."
        if performed
        else f"{folder.name} holds tests for the rig's controller, one file each."
    )
    runs = [
        [run.name, "training" if run.role == "train" else "held out", run.about]
        for run in plan.runs
    ]
    return html.section(
        "Planned tests" if performed else "Next tests",
        html.paragraphs(lead, kind="lead"),
        html.table(["run", "for", "what"], runs),
        html.table(header, rows, numbers=(2, 3)),
        *(() if performed else _pictures(folder, plan)),
    )


def _performed(study: Study, plan: PlanFolder, others: bool) -> bool:
    """Return whether the runs of a plan are in a study.

    Where there are `others`, names are not enough: plans that are made before any is measured call
    their runs alike.
    """
    there = {Path(run.file).stem for run in study.settings.runs}
    if not all(run.name in there for run in plan.runs):
        return False
    if not others:
        return True
    measured = [(Path(run.source).stem, run) for run in study.read()]
    return all(
        any(name == planned.name and shows(run, planned, plan.motion) for name, run in measured)
        for planned in plan.runs
    )


def _pictures(folder: Path, plan: PlanFolder) -> list[str]:
    found = []
    for run in plan.runs:
        file = folder / f"{run.name}.png"
        if file.is_file():
            found.append(html.figure(file.read_bytes(), run.about, f"{run.name}: {run.about}."))
    return found

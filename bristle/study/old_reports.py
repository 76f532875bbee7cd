"""Reports of models that are no longer the present one: each step has a folder for its own."""

from __future__ import annotations

from math import inf
from pathlib import Path

OF_MODEL = (
    "identify.png", "identify.json", "force_budget.png", "compare.png", "diagnose.png",
    "report.html",
)  # fmt: skip
"""Reports that show a model: they are set aside when another becomes the present one."""


def keep_reports(reports: Path, number: int, before: float = inf) -> None:
    """Put the reports of a step's model into a folder of that step.

    Parameters
    ----------
    reports : the folder of a study's reports; the caller holds the lock
    number : of the step
    before : ns, a date of files: those that are not older stay
    """
    for name in OF_MODEL:
        old = reports / name
        if old.is_file() and old.stat().st_mtime_ns < before:
            kept = reports / f"step_{max(number, 0):03d}"
            kept.mkdir(exist_ok=True)
            old.replace(kept / name)


def make_room(reports: Path, number: int, undone: str) -> None:
    """Put the reports of a step that was undone aside, for another step has its number now.

    Parameters
    ----------
    reports : the folder of a study's reports; the caller holds the lock
    number : of the step
    undone : the name under which the history keeps the step that was undone
    """
    kept = reports / f"step_{number:03d}"
    if kept.is_dir():
        place = reports / "undone" / undone
        while place.exists():
            place = place.with_name(f"{place.name}_")
        place.parent.mkdir(exist_ok=True)
        kept.replace(place)

"""View 9, Compare controllers: what can be compared, and what the comparisons found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..campaign.best_constant import G
from ..core.files import read_json
from ..data import list_ground_motions
from ..errors import BristleError
from ..study.study import Study
from .orders import COMPARED_MOTIONS, COMPARED_PEAK, COMPARISONS, MEMBERS, names_of, numbers_of
from .orders import FOLDER as DESIGNS
from .simulate_view import library_controllers, records

ANSWER, REPORT = "answer.json", "report.html"
"""What `bristle controllers` leaves in its folder, beside tables."""
SHOWN = ("command", "verdict", "notes", "header", "tables", "footnotes", "seconds")


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 9 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError
        If a file of the study is wrong.
    """
    peaks = {one.name: one.peak / G for one in list_ground_motions()}
    numbers = numbers_of(folder)
    return {
        "records": [{"name": n, "peak": peaks.get(n)} for n in records(folder.parent)],
        "controllers": list(library_controllers()),
        "designs": [n for n in names_of(folder) if (folder / DESIGNS / f"{n}.json").is_file()],
        "buildings": _buildings(folder),
        "most": {"motions": COMPARED_MOTIONS, "members": MEMBERS, "peak": COMPARED_PEAK},
        "next": max(numbers, default=0) + 1,
        "comparisons": [found for number in numbers if (found := _comparison(folder, number))],
    }


def _comparison(folder: Path, number: int) -> dict[str, Any] | None:
    """Return a comparison with its files; None where it failed or was cancelled."""
    own = folder / COMPARISONS / str(number)
    file = own / ANSWER
    if not file.is_file():
        return None
    found = read_json(file)
    older = file.stat().st_mtime_ns < (folder / "model.toml").stat().st_mtime_ns
    files = [own / REPORT, *sorted(own.glob("*.csv"))]
    return {
        "number": number, "older": older, **{key: found[key] for key in SHOWN},
        "files": [one.relative_to(folder).as_posix() for one in files if one.is_file()],
    }  # fmt: skip


def _buildings(folder: Path) -> list[dict[str, str]]:
    """Return the buildings of the studies, that of this study first, with the damper's device."""
    others = [file.parent for file in sorted(folder.parent.glob("*/study.toml"))]
    found = []
    for one in (folder, *(other for other in others if other != folder)):
        if one.name.startswith("."):
            continue
        try:
            study = Study(one)
            building = study.model(to_show=True).building
        except BristleError:
            if one == folder:
                raise
            continue  # a study that cannot be read has no building; its own views say why
        if building:
            about = {"study": one.name, "device": study.settings.device}
            found.append({"file": f"{one.name}/{building}", **about})
    return found

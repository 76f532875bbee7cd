"""Other roles for the runs of a study: which runs are meant, and what must be left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..errors import StudyError
from .reading import names_of_runs
from .run_file import EXCLUDE, ROLES, RunFile
from .settings import Settings


def roles_by_place(
    path: Path, settings: Settings, roles: Mapping[str, str]
) -> dict[tuple[str, int], str]:
    """Return the new roles of runs by file and piece.

    Parameters
    ----------
    path : of study.toml, for messages
    settings : its content
    roles : role by the name or the file of a run

    Raises
    ------
    StudyError
        If there is no such run or role, or too few runs would be left for training or held out.
    """
    every = (*settings.runs, *settings.excluded)
    names = names_of_runs(settings)
    known: dict[str, RunFile] = {}
    for run in every:
        known |= {names[run.file, run.piece]: run, run.name: run}
    found: dict[tuple[str, int], str] = {}
    for name, role in roles.items():
        if role not in (*ROLES, EXCLUDE):
            raise StudyError(f'role "{role}" of {name}; there are {", ".join((*ROLES, EXCLUDE))}.')
        if name not in known:
            there = ", ".join(names.values())
            raise StudyError(f'{path}: no run is called "{name}"; there are {there}.')
        found[known[name].file, known[name].piece] = role
    _refuse_too_few(path, [found.get((run.file, run.piece), run.role) for run in every])
    return found


def _refuse_too_few(path: Path, roles: list[str]) -> None:
    """Refuse roles that leave nothing to fit to, or nothing to judge by."""
    fitted, judged = roles.count(ROLES[0]), roles.count(ROLES[1])
    if fitted + judged == 0:
        raise StudyError(f"{path}: no run would be left; some for training are needed.")
    if fitted + judged > 1 and 0 in (fitted, judged):
        lacking = "held out" if fitted else "for training"
        raise StudyError(
            f"{path}: no run would be {lacking}. A model is judged "
            "on runs that it was not fitted to, so that both are needed."
        )

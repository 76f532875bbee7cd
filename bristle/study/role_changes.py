"""Other roles for the runs of a study: which runs are meant, and what must be left."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from ..errors import StudyError
from ..findings import command, listed
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
            there = listed(names.values())
            raise StudyError(f'{path}: no run is called "{name}"; there are {there}.')
        found[known[name].file, known[name].piece] = role
    refuse_too_few(path, settings, found)
    return found


def refuse_too_few(path: Path, settings: Settings, found: Mapping[tuple[str, int], str]) -> None:
    """Refuse roles that leave nothing to fit to, or nothing to judge by.

    Parameters
    ----------
    path : of study.toml, for messages
    settings : its content
    found : the roles that change, by file and piece of a run

    Raises
    ------
    StudyError
        With the command that gives the missing role too.
    """
    every = (*settings.runs, *settings.excluded)
    roles = [found.get((run.file, run.piece), run.role) for run in every]
    fitted, judged = roles.count(ROLES[0]), roles.count(ROLES[1])
    if fitted + judged == 0:
        raise StudyError(f"{path}: no run would be left; some for training are needed.")
    if fitted + judged > 1 and 0 in (fitted, judged):
        lacking, other = ("held out", ROLES[1]) if fitted else ("for training", ROLES[0])
        names = names_of_runs(settings)
        there = listed(
            names[run.file, run.piece]
            for run, role in zip(every, roles, strict=True)
            if role in ROLES[:2]
        )
        order = command("study", "roles", path.parent, *_options(found, names), f"--{other}", "RUN")
        raise StudyError(
            f"{path}: no run would be {lacking}. A model is judged on runs that it was not fitted "
            f"to, so that both are needed. Nothing is written. With one of {there} as RUN this "
            f"does it: {order}"
        )


def _options(
    found: Mapping[tuple[str, int], str], names: Mapping[tuple[str, int], str]
) -> Iterator[str]:
    """Yield the options of `bristle study roles` that give runs these roles."""
    for role in (*ROLES, EXCLUDE):
        chosen = [names[place] for place, own in found.items() if own == role]
        yield from [f"--{role}", *chosen] if chosen else []

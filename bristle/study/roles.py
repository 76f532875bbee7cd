"""What the runs of a new study are for: training, to be held out, or the test at the end."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from ..core.text import command, listed
from ..errors import StudyError
from .run_facts import RunChoices, rows_of_table
from .runs import names_of_runs
from .study_file import EXCLUDE, ROLES, TEST, RunFile, Settings

_WORDS = {
    "train": "train training ident identification fit estimation est calibration cal",
    "holdout": "valid validation val vali test holdout hold check verify verification",
}
_TRAIN, _HOLDOUT = (frozenset(words.split()) for words in _WORDS.values())


def for_test(files: Sequence[Path], choices: RunChoices) -> list[bool]:
    """Return which files are test runs: those that a path, a pattern or the table names.

    Parameters
    ----------
    files : one run or more each
    choices : patterns and table that were given

    Raises
    ------
    StudyError
        If a pattern fits no name, all files are test runs, or the table cannot be read.
    """
    out = [False] * len(files)
    if choices.table is not None:
        out = [row.role == TEST for row in rows_of_table(choices.table, files)]
    for one in map(str, choices.test):
        found = [k for k, file in enumerate(files) if _is_chosen(file, one)]
        if not found:
            raise StudyError(
                f"test runs: no file of the data is {one}; there are "
                f"{', '.join(file.name for file in files)}."
            )
        for k in found:
            out[k] = True
    if all(out):
        raise StudyError(
            "test runs: all files are. Leave some for training, and one to be held out."
        )
    return out


def _is_chosen(file: Path, one: str) -> bool:
    return file == Path(one) or any(fnmatchcase(text, one) for text in (file.name, file.as_posix()))


def roles_of(names: list[str], closed: list[bool]) -> tuple[list[RunFile], list[str]]:
    """Return the runs with their roles, and the notes that tell why.

    Parameters
    ----------
    names : of the files in data/
    closed : which of them are test runs; see `_seen_roles` for the others
    """
    roles, notes = _seen_roles([n for n, is_test in zip(names, closed, strict=True) if not is_test])
    rest = iter(roles)
    every = [TEST if is_test else next(rest) for is_test in closed]
    test = listed(name for name, role in zip(names, every, strict=True) if role == TEST)
    if test:
        notes.append(f"test runs, which no fit and no verdict sees: {test}")
    return [RunFile(f"data/{n}", role) for n, role in zip(names, every, strict=True)], notes


def roles_added(names: list[str]) -> tuple[list[str], list[str]]:
    """Return the roles of runs that are added to others, and the notes that tell why.

    Parameters
    ----------
    names : of the files
    """
    found = [_role_in(name) for name in names]
    if any(found):
        roles, note = [role or "train" for role in found], "roles follow the names of the files"
    elif len(names) == 1:
        return ["train"], [f"{names[0]} is for training; --holdout '{names[0]}' holds it out"]
    else:
        roles, note = _every_third(names)
    return roles, [f"{note}. {_held_out(names, roles)}"]


def _seen_roles(names: list[str]) -> tuple[list[str], list[str]]:
    """Return roles and why: by the names of files, else every third is held out."""
    found = [_role_in(name) for name in names]
    if len(names) == 1:
        return ["train"], [
            "there is one run: its last 30 % are held out, which is weaker than a separate run"
        ]
    if (
        "holdout" in found
        and len(set(found) | {"train"}) == 2
        and found.count("holdout") < len(found)
    ):
        roles = [role or "train" for role in found]
        note = "roles follow the names of the files"
    else:
        roles, note = _every_third(names)
    return roles, [f"{note}. {_held_out(names, roles)}"]


def _role_in(name: str) -> str:
    """Return the role that a file's name tells, "" where it tells none."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    return "holdout" if words & _HOLDOUT else "train" if words & _TRAIN else ""


def _every_third(names: list[str]) -> tuple[list[str], str]:
    """Return roles of which every third is held out, and the note that says so."""
    return (
        ["holdout" if k % 3 == 1 else "train" for k in range(len(names))],
        "every third run is held out; bristle study roles changes that",
    )


def _held_out(names: list[str], roles: list[str]) -> str:
    """Return the words that tell which runs are held out."""
    held_out = [name for name, role in zip(names, roles, strict=True) if role == "holdout"]
    return f"Held out: {listed(held_out) or 'none'}"


# Other roles for the runs of a study: which runs are meant, and what must be left.


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

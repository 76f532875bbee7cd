"""What the runs of a new study are for: training, to be held out, or the test at the end."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from ..errors import StudyError
from ..findings import listed
from .run_facts import RunChoices, rows_of_table
from .run_file import TEST, RunFile

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

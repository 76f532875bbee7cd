"""What is new in the data of a study since its model was identified: runs, roles, corrections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from ..core.config import other_schema
from ..data.files import read_json, write_json
from ..data.run_names import names_of_files
from ..errors import StudyError
from ..findings import command, listed
from .data_digest import other_than

if TYPE_CHECKING:
    from .study import Study

FILE = "added_runs.json"
"""Where a study notes it."""


@dataclass(frozen=True)
class Addition:
    """Runs that were added at once: when (UTC), the step of the model then, files of the runs."""

    date: str
    step: int
    files: tuple[str, ...]


def additions(study: Study) -> tuple[Addition, ...]:
    """Return which runs were added, the first time first.

    Raises
    ------
    StudyError
        If the file that says so is damaged.
    """
    path = study.folder / FILE
    if not path.is_file():
        return ()
    data = read_json(path)
    if data.get("schema") != 1:
        raise StudyError(f"{path}: {other_schema(data.get('schema'))}")
    try:
        return tuple(
            Addition(str(one["date"]), int(one["step"]), tuple(map(str, one["files"])))
            for one in data["additions"]
        )
    except (KeyError, TypeError, ValueError):
        raise StudyError(
            f"{path}: it lists runs that were added, and is damaged. Remove it."
        ) from None


def note_addition(study: Study, files: Sequence[str]) -> None:
    """Write down that runs are added now, to the present model; the caller holds the lock."""
    numbers = study.history.numbers()
    now = datetime.now(UTC).isoformat(timespec="seconds")
    made = Addition(now, numbers[-1] if numbers else 0, tuple(files))
    every = [asdict(one) for one in (*additions(study), made)]
    write_json(study.folder / FILE, {"schema": 1, "additions": every})


def note_undone(study: Study, listed: Sequence[Addition], number: int) -> None:
    """Write down that a step is undone: the model before it does not know its later runs either.

    Parameters
    ----------
    study : the folder, opened; the caller holds the lock
    listed : the runs that were added
    number : of the step; another one may get it, which knows these runs
    """
    if any(one.step == number for one in listed):
        moved = [replace(one, step=min(one.step, number - 1)) for one in listed]
        every = [asdict(one) for one in moved]
        write_json(study.folder / FILE, {"schema": 1, "additions": every})


def unknown_to_model(study: Study) -> list[str]:
    """Return the files of the runs that were added since the present model was identified.

    None before the first identification.
    """
    numbers = study.history.numbers()
    last = numbers[-1] if numbers else 0
    there = {run.file for run in study.settings.runs}
    found = [file for one in additions(study) if one.step == last > 0 for file in one.files]
    return [file for file in dict.fromkeys(found) if file in there]


def behind_data(study: Study) -> str:
    """Return how the data are others than the present model knows, and what to do; "" if not."""
    other = other_data(study)
    return f"{other} Identify it again:  {command('identify', study.folder)}" if other else ""


def other_data(study: Study) -> str:
    """Return the sentence that tells how the data are others than the model knows, "" if not."""
    if files := unknown_to_model(study):
        every = list(dict.fromkeys(run.file for run in study.settings.runs))
        names = dict(zip(every, names_of_files(every), strict=True))
        what = "run was" if len(files) == 1 else "runs were"
        new = listed(names[file] for file in files)
        return f"{len(files)} {what} added after the present model was identified: {new}."
    numbers = study.history.numbers()
    known = study.history.data_of(numbers[-1]) if len(numbers) > 1 else ""
    other = other_than(known, study.data, study.settings) if known else ""
    if not other:
        return ""
    return (
        f"{other[:1].upper()}{other[1:]} are no longer those that the present model was "
        "identified with."
    )

"""What is new in the data of a study since its model was identified: runs, roles, corrections."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..core.config import other_schema, toml_content
from ..core.files import read_json, write_json
from ..core.text import command, listed
from ..data.measurement import names_of_files
from ..errors import StudyError
from .study_file import TEST, Settings, channel_as_toml

if TYPE_CHECKING:
    from .study import Study

T = TypeVar("T")


# A digest of what a fit and its judge see: by it a result on other data is known.
#
# It has three parts: what study.toml says, what the files of the runs hold, and the building.
# Content counts, and no date, so that a study that was copied or cloned stays as it is.

_KIND = "2"
"""How the digest begins; that of older studies, `Settings.data` alone, has no such beginning."""

_OTHER = (
    "runs, their roles, labels, corrections or channels in study.toml",
    "the contents of files in data/",
    "the numbers of the building",
)
"""What differs, by the part of the digest."""


def data_digest(folder: Path, settings: Settings, building: str) -> str:
    """Return the digest of a study's data; titles, the order of runs and test runs do not count.

    Parameters
    ----------
    folder : of the study
    settings : the content of its study.toml
    building : name of the building's file, "" for none
    """
    runs = [run for run in settings.runs if run.role != TEST]
    files = [[file, _of_file(folder / file)] for file in sorted({run.file for run in runs})]
    parts = (_of_settings(settings), _digest(files), _of_building(folder, building))
    return "-".join((_KIND, *parts))


def other_than(known: str, now: str, settings: Settings) -> str:
    """Return what is no longer as it was: "the numbers of the building"; "" where nothing is.

    Parameters
    ----------
    known : the digest that a result was made with, "" where it does not tell
    now : the present one
    settings : the present content of study.toml
    """
    if not known.startswith(f"{_KIND}-"):  # of an older study: what it does not hold is unknown
        return _OTHER[0] if known not in ("", settings.data) else ""
    pairs = zip(known.split("-")[1:], now.split("-")[1:], _OTHER, strict=False)
    return next((text for one, other, text in pairs if one != other), "")


def _of_settings(settings: Settings) -> str:
    """Return the part of the digest that follows from study.toml alone."""
    labels = sorted(
        [run.name, sorted(run.labels.items())] for run in settings.runs if run.role != TEST
    )
    extra = {name: channel_as_toml(spec) for name, spec in settings.extra.items()}
    return _digest([settings.data, labels, extra])


def _of_building(folder: Path, name: str) -> str:
    """Return the digest of a building's numbers: its comments and its spaces do not count."""
    found = toml_content(folder / name) if name else {}
    return _digest(found) if found else ""


def _of_file(path: Path) -> str:
    try:
        about = path.stat()
        return _of_content(path, about.st_mtime_ns, about.st_size)
    except OSError:
        return ""


@lru_cache(maxsize=4096)
def _of_content(path: Path, _changed: int, _size: int) -> str:
    """Return the digest of a file's content; it is read again where its date or size is another."""
    whole = sha256()
    with path.open("rb") as file:
        while part := file.read(1 << 20):
            # git may write other ends of lines into a clone.
            whole.update(part.replace(b"\r", b""))
    return whole.hexdigest()[:16]


def _digest(seen: dict[str, Any] | Sequence[Any]) -> str:
    text = json.dumps(seen, sort_keys=True, default=str)
    return sha256(text.encode()).hexdigest()[:16]


def noted(path: Path, key: str, make: Callable[[Any], T], damaged: str) -> tuple[T, ...]:
    """Return the entries of a file of notes, none where there is no file.

    Parameters
    ----------
    path, key : the file; where its entries are
    make : of an entry what is returned
    damaged : what is said of a file that cannot be read so
    """
    if not path.is_file():
        return ()
    data = read_json(path)
    if data.get("schema") != 1:
        raise StudyError(f"{path}: {other_schema(data.get('schema'))}")
    try:
        return tuple(map(make, data[key]))
    except (KeyError, TypeError, ValueError):
        raise StudyError(f"{path}: {damaged}") from None


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
    return noted(
        study.folder / FILE, "additions",
        lambda one: Addition(str(one["date"]), int(one["step"]), tuple(map(str, one["files"]))),
        "it lists runs that were added, and is damaged. Remove it.",
    )  # fmt: skip


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

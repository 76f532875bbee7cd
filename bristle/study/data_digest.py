"""A digest of what a fit and its judge see: by it a result on other data is known.

It has three parts: what study.toml says, what the files of the runs hold, and the building. Content
counts, and no date, so that a study that was copied or cloned stays as it is.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.config import toml_content
from .channel_file import channel_as_toml
from .run_file import TEST
from .settings import Settings

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


def building_in(model: Path) -> str:
    """Return the name of the building's file in a model.toml, "" for none.

    What is wrong with the model is told where it is asked for.
    """
    return str(toml_content(model).get("building", ""))


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

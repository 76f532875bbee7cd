"""By what a page sees that a study has changed: names, dates and sizes of the files it shows.

The server asks often, so that no file is read but study.toml and model.toml, and these once.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..core.config import toml_content
from .consent import own_files

DEPENDS = ("study.toml", "model.toml", "verdict.json", "reports/identify.json")
"""Files of a study that its views show."""

_FOLDERS = ("history", "history/undone", "reports", "export", "design", "comparisons")
_DESIGNED = ("design/passive/passive.json",)


def stamp(folder: Path) -> str:
    """Return a text that changes with a study's files, its data, its own code and its history.

    Parameters
    ----------
    folder : of the study
    """
    parts = []
    own = (file.relative_to(folder).as_posix() for file in own_files(folder))
    for name in dict.fromkeys((*DEPENDS, *_FOLDERS, *_DESIGNED, *_named(folder), *own)):
        with suppress(OSError, ValueError):
            about = (folder / name).stat()
            parts.append(f"{name}:{about.st_mtime_ns}:{about.st_size}")
    return " ".join(parts)


def _named(folder: Path) -> Iterator[str]:
    """Return the files that study.toml and model.toml name: data of runs, and the building."""
    runs = _toml(folder / "study.toml").get("runs")
    for run in runs if isinstance(runs, list) else ():
        if isinstance(run, dict) and run.get("file"):
            yield str(run["file"])
    if building := _toml(folder / "model.toml").get("building"):
        yield str(building)


def _toml(path: Path) -> dict[str, Any]:
    """Return what a file holds; what is wrong with it is told by the view that needs it."""
    with suppress(OSError):
        about = path.stat()
        return _content(path, about.st_mtime_ns, about.st_size)
    return {}


@lru_cache(maxsize=64)
def _content(path: Path, _changed: int, _size: int) -> dict[str, Any]:
    return toml_content(path)

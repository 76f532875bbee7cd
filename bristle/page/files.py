"""The files of a study that are handed on: what the commands wrote, and the data."""

from __future__ import annotations

import mimetypes
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SAFE = {
    ".csv": "text/csv", ".json": "application/json", ".png": "image/png",
    ".toml": "text/plain", ".md": "text/plain", ".py": "text/plain", ".txt": "text/plain",
}  # fmt: skip
"""Types that a browser may be told; all else is bytes."""
OWN = ("study.toml", "model.toml", "verdict.json", "README.md")
FOLDERS = ("reports", "export", "design", "comparisons", "data", "effects", "laws")


def _given(folder: Path) -> Iterator[Path]:
    """Yield the files that may be downloaded: no links, nothing hidden, no sealed answer."""
    yield from (folder / name for name in OWN)
    plans = sorted(one.name for one in folder.glob("plan*") if one.is_dir())
    for name in (*FOLDERS, *plans):
        yield from sorted((folder / name).rglob("*"))


def is_given(folder: Path, name: str) -> bool:
    """Return whether a study has a file of this name, relative to it, that may be downloaded."""
    return any(one["name"] == name for one in files_of(folder))


def files_of(folder: Path) -> list[dict[str, Any]]:
    """Return the files that may be downloaded: name relative to the study, bytes, when written."""
    found = []
    whole = folder.resolve()
    for path in _given(folder):
        parts = path.relative_to(folder).parts
        if any(part.startswith(".") or part == "__pycache__" for part in parts):
            continue
        if not path.is_file() or not path.resolve().is_relative_to(whole):
            continue
        about = path.stat()
        name = path.relative_to(folder).as_posix()
        found.append({"name": name, "bytes": about.st_size, "written": about.st_mtime})
    return found


def kind_of(path: Path) -> str:
    """Return the type of a file as HTTP calls it; a page of HTML is bytes: it is never shown."""
    if path.suffix.lower() in SAFE:
        return SAFE[path.suffix.lower()]
    guessed = mimetypes.guess_type(path.name)[0] or ""
    return guessed if guessed.startswith("image/") and "svg" not in guessed else (
        "application/octet-stream"
    )  # fmt: skip

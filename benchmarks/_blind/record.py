"""Finished cases, one JSON line each: whatever is killed, what is finished stays."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .cases import folder


def path_of(seed: int) -> Path:
    """Return the file that a seed's finished cases are appended to."""
    return folder().parent / f"record-{seed}.jsonl"


def newest() -> int | None:
    """Return the seed of the record that was last written to, None if there is none."""
    files = sorted(folder().parent.glob("record-*.jsonl"), key=lambda path: path.stat().st_mtime)
    return int(files[-1].stem.split("-", 1)[1]) if files else None


def append(path: Path, line: dict[str, Any]) -> None:
    """Add one finished part of a case."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value)} has no place in a record")


def lines(path: Path) -> Iterator[dict[str, Any]]:
    """Yield all whole lines; a line that a killed process left half is passed over."""
    if not path.exists():
        return
    for text in path.read_text(encoding="utf-8").splitlines():
        try:
            yield json.loads(text)
        except json.JSONDecodeError:
            continue


def finished(path: Path, digests: dict[str, str]) -> dict[str, dict[str, dict[str, Any]]]:
    """Return part -> key -> line of what was finished by the code of these digests.

    `digests` part -> digest; a line of another digest is older code's and does not count.
    """
    found: dict[str, dict[str, dict[str, Any]]] = {part: {} for part in digests}
    for line in lines(path):
        if digests.get(line["part"]) == line["digest"]:
            found[line["part"]][line["key"]] = line
    return found

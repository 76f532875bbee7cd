"""What a long computation has come to so far, as data: for a program that draws it on the way.

Texts go to `progress.tell`; a snapshot is a dict that JSON can hold. A command writes each of them
on stderr where the program that started it asks for them (`wanted`), as one line that begins with
the record separator: a JSON text sequence (RFC 7464), which no line of text begins with.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

VARIABLE = "BRISTLE_SNAPSHOTS"
"""The environment variable by which a program that starts a command asks for snapshots: `lines`."""

SEPARATOR = "\x1e"
"""What a line with a snapshot begins with."""

Watcher = Callable[[Mapping[str, Any]], None]

_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


def watcher() -> Watcher | None:
    """Return who takes the snapshots of this context, None where nobody does."""
    return _watcher.get()


@contextmanager
def watched_by(take: Watcher | None) -> Iterator[None]:
    """Give the snapshots of this context to a function; None leaves them out."""
    before = _watcher.set(take)
    try:
        yield
    finally:
        _watcher.reset(before)


def wanted() -> bool:
    """Return whether a program that started this one reads snapshots."""
    return os.environ.get(VARIABLE) == "lines"


def write(snapshot: Mapping[str, Any]) -> None:
    """Write a snapshot on stderr, as a line of its own."""
    sys.stderr.write(f"{SEPARATOR}{json.dumps(snapshot, allow_nan=False)}\n")
    sys.stderr.flush()


def read(line: str) -> dict[str, Any] | None:
    """Return the snapshot that a line holds, None where it holds none."""
    if not line.startswith(SEPARATOR):
        return None
    try:
        found = json.loads(line[1:])
    except ValueError:
        return None
    return found if isinstance(found, dict) else None

"""ViewCache of views: asked of the worker, kept as long as the study's files are the same."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from http import HTTPStatus
from pathlib import Path
from typing import Any

from ..core.config import toml_content
from ..errors import BristleError
from .requests import own_files

# By what a page sees that a study has changed: names, dates and sizes of the files it shows.
#
# The server asks often, so that no file is read but study.toml and model.toml, and these once.

DEPENDS = ("study.toml", "model.toml", "verdict.json", "reports/identify.json")
"""Files of a study that its views show."""

_FOLDERS = ("history", "history/undone", "reports", "export", "design", "comparisons")


def fingerprint(folder: Path) -> str:
    """Return a text that changes with a study's files, its data, its own code and its history.

    Parameters
    ----------
    folder : of the study
    """
    parts = []
    own = (file.relative_to(folder).as_posix() for file in own_files(folder))
    for name in dict.fromkeys((*DEPENDS, *_FOLDERS, *_named(folder), *own)):
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


LONGEST = 600.0
"""Seconds that an answer may take: a scenario's first run compiles all laws, a minute or more."""
LARGEST = 1024**3
"""Memory [bytes] beyond which a worker is replaced after its answer."""
KEPT = 64 * 1024**2
"""Bytes of answers that are kept."""


class ViewError(BristleError):
    """A view that cannot be shown; `told` is what the worker said."""

    status = HTTPStatus.UNPROCESSABLE_ENTITY

    def __init__(self, told: Mapping[str, Any]) -> None:
        super().__init__(str(told["error"]))
        self.told = {key: told[key] for key in ("error", "kind", "file", "text") if key in told}


class ViewCache:
    """Asks a worker process, one question at a time; starts it, and replaces it where needed."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._worker: subprocess.Popen[bytes] | None = None
        self._kept: OrderedDict[tuple[str, ...], bytes] = OrderedDict()
        self._closed = False

    def start(self) -> None:
        """Start the worker before it is asked: it then imports what it needs."""
        with self._lock:
            self._running()

    def get(
        self, view: str, folder: Path, arguments: Mapping[str, Any], keep: bool = True
    ) -> bytes:
        """Return a packed answer.

        Parameters
        ----------
        view : one of `worker.VIEWS`
        folder : of the study
        arguments : what the page asks for
        keep : whether the same question has the same answer as long as the study is the same

        Raises
        ------
        ViewError
            If the worker cannot answer, or takes longer than `LONGEST`.
        """
        asked = json.dumps({"view": view, "folder": str(folder), "arguments": dict(arguments)})
        key = (asked, fingerprint(folder))
        if keep and (known := self._known(key)) is not None:
            return known
        with self._lock:
            if keep and (known := self._known(key)) is not None:
                return known  # another page has asked the same meanwhile
            found = self._ask(asked)
            if keep:
                self._keep(key, found)
        return found

    def close(self) -> None:
        """End the worker."""
        self._closed = True
        self._end()

    def _running(self) -> subprocess.Popen[bytes]:
        if self._worker is None or self._worker.poll() is not None:
            # Ctrl-C in the server's terminal is the server's: it ends the worker.
            group = {} if sys.platform == "win32" else {"start_new_session": True}
            self._worker = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.worker"], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, **group,  # type: ignore[call-overload]
            )  # fmt: skip
        return self._worker

    def _ask(self, asked: str) -> bytes:
        if self._closed:
            raise ViewError({"error": "the page's server has ended.", "kind": "ended"})
        worker = self._running()
        assert worker.stdin is not None
        assert worker.stdout is not None
        limit = threading.Timer(LONGEST, worker.kill)
        limit.start()
        began = time.monotonic()
        try:
            worker.stdin.write(asked.encode() + b"\n")
            worker.stdin.flush()
            line = worker.stdout.readline()
            told = json.loads(line) if line else None
            body = worker.stdout.read(told["bytes"]) if told else b""
        except OSError:
            told, body = None, b""
        finally:
            limit.cancel()
        if told is None or len(body) < told["bytes"]:
            self._end()
            took = time.monotonic() - began
            why = f"it took longer than {LONGEST:.0f} s" if took >= LONGEST else "its process ended"
            raise ViewError({"error": f"this view cannot be shown: {why}.", "kind": "ended"})
        if told["memory"] > LARGEST:
            self._end()
        if not told["ok"]:
            raise ViewError(told)
        return body

    def _end(self) -> None:
        """End the worker; the next question starts another."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.kill()
            with suppress(BrokenPipeError), worker:
                pass  # its pipes are closed, and it is waited for

    def _known(self, key: tuple[str, ...]) -> bytes | None:
        found = self._kept.get(key)
        if found is not None:
            with suppress(KeyError):
                self._kept.move_to_end(key)
        return found

    def _keep(self, key: tuple[str, ...], found: bytes) -> None:
        self._kept[key] = found
        while sum(map(len, self._kept.values())) > KEPT and len(self._kept) > 1:
            self._kept.popitem(last=False)

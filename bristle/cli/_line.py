"""Progress on stderr: one line that is overwritten; in a pipe, a few plain ones."""

from __future__ import annotations

import os
import shutil
import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self, TextIO, cast

from ..core.progress import SOON, wants_lines

_PLAIN_AFTER = 5.0
"""Seconds without a word after which a plain line is due."""
_AGAIN = 30.0
"""Seconds after which a plain line is told again, with how long it takes."""


class ProgressLine:
    """Shows texts on stderr: overwritten on a terminal; in a pipe only after some silence.

    A context; the terminal's line is cleared at its end, and before anything is printed there. What
    takes long is told with its seconds, so that nobody takes it for dead.

    Parameters
    ----------
    title : str
        What a terminal shows from the first second on, until something is said.
    """

    def __init__(self, title: str = "") -> None:
        self._title = title
        self._every = wants_lines()
        self._live = sys.stderr.isatty() and not self._every
        self._stdout, self._stderr = sys.stdout, sys.stderr
        self._process = os.getpid()
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._ticking: threading.Thread | None = None
        self._text = ""
        self._since = self._last = time.monotonic()  # of the text, and of the last plain line
        self._shown = ""

    def __enter__(self) -> Self:
        if self._live:
            sys.stderr = cast("TextIO", _Clearing(self._stderr, self.clear))
        if self._live and self._stdout.isatty():
            sys.stdout = cast("TextIO", _Clearing(self._stdout, self.clear))
        if self._live and self._title:
            self._text = self._title
            self._start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        sys.stdout, sys.stderr = self._stdout, self._stderr
        self._over.set()
        if self._ticking is not None:
            self._ticking.join()
        self.clear()

    def clear(self) -> None:
        """Take the terminal's line away, where one is shown."""
        if self._live and self._shown:
            print("\r\033[2K", end="", file=self._stderr, flush=True)
            self._shown = ""

    def say(self, text: str) -> None:
        """Show a text, if it is time for one."""
        if os.getpid() != self._process:
            return  # a forked process: the first one tells
        with self._lock:
            if text != self._text:
                self._text, self._since = text, time.monotonic()
            self._show()
        self._start()

    def _start(self) -> None:
        if self._ticking is None:
            self._ticking = threading.Thread(target=self._tick, name="bristle-line", daemon=True)
            self._ticking.start()

    def _tick(self) -> None:
        while not self._over.wait(1.0):
            with self._lock:
                self._show()

    def _show(self) -> None:
        if not self._text:
            self.clear()
            return
        now = time.monotonic()
        spent = int(now - self._since)
        if self._live:
            text = f"{self._text}, {spent} s" if spent >= SOON else self._text
            if text != self._shown:
                width = max(20, shutil.get_terminal_size().columns - 5)
                print(f"\r\033[2K{text[:width]} ...\r", end="", file=self._stderr, flush=True)
                self._shown = text
            return
        same = self._text == self._shown
        due = now - self._last >= (_AGAIN if same else _PLAIN_AFTER)
        if due or (self._every and not same):
            text = f"{self._text}, {spent} s" if same else self._text
            print(f"{text} ...", file=self._stderr, flush=True)
            self._shown, self._last = self._text, now


class _Clearing:
    """The terminal's output, before which something is called."""

    def __init__(self, stream: TextIO, before: Callable[[], None]) -> None:
        self._stream, self._before = stream, before

    def write(self, text: str) -> int:
        """Write a text."""
        self._before()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

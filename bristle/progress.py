"""What a command is at, on stderr: one line that is overwritten; in a pipe, a few plain ones.

Whoever works calls `tell`; the command decides where that goes (`telling`). Without one nothing is
told: a library is silent.
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO, TypeVar, cast

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

Item = TypeVar("Item")

_PATIENCE = 0.3
"""Seconds after which something that is not yet done gets a bar."""
_PLAIN_AFTER = 5.0
"""Seconds without a word after which a plain line is due."""
_AGAIN = 30.0
"""Seconds after which a plain line is told again, with how long it takes."""
_SOON = 3.0
"""Seconds, left or spent, below which none are told."""

LINES = "BRISTLE_PROGRESS"
"""The environment variable by which a program that starts a command asks for every text as a line
of its own, at once: `lines`."""

_teller: ContextVar[Callable[[str], None] | None] = ContextVar("teller", default=None)


def tell(text: str) -> None:
    """Tell what is being done, in a few words, to whom `telling` has named."""
    teller = _teller.get()
    if teller is not None:
        teller(text)


@contextmanager
def telling(teller: Callable[[str], None] | None) -> Iterator[None]:
    """Send what `tell` is given in this context to a function; None silences it."""
    before = _teller.set(teller)
    try:
        yield
    finally:
        _teller.reset(before)


def wants_lines() -> bool:
    """Return whether a program reads what is told, and wants all of it."""
    return os.environ.get(LINES) == "lines"


class Line:
    """Shows texts on stderr: overwritten on a terminal; in a pipe only after some silence.

    A context; the terminal's line is cleared at its end, and before anything is printed there. What
    takes long is told with its seconds, so that nobody takes it for dead.
    """

    def __init__(self) -> None:
        self._every = wants_lines()
        self._live = sys.stderr.isatty() and not self._every
        self._stdout = sys.stdout
        self._process = os.getpid()
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._ticking: threading.Thread | None = None
        self._text = ""
        self._since = self._last = time.monotonic()  # of the text, and of the last plain line
        self._shown = ""

    def __enter__(self) -> Self:
        if self._live and self._stdout.isatty():
            sys.stdout = cast("TextIO", _Clearing(self._stdout, self.clear))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        sys.stdout = self._stdout
        self._over.set()
        if self._ticking is not None:
            self._ticking.join()
        self.clear()

    def clear(self) -> None:
        """Take the terminal's line away, where one is shown."""
        if self._live and self._shown:
            print("\r\033[2K", end="", file=sys.stderr, flush=True)
            self._shown = ""

    def say(self, text: str) -> None:
        """Show a text, if it is time for one."""
        if os.getpid() != self._process:
            return  # a forked process: the first one tells
        with self._lock:
            if text != self._text:
                self._text, self._since = text, time.monotonic()
            self._show()
        if self._ticking is None:
            self._ticking = threading.Thread(target=self._tick, name="bristle-line", daemon=True)
            self._ticking.start()

    def _tick(self) -> None:
        while not self._over.wait(1.0):
            with self._lock:
                self._show()

    def _show(self) -> None:
        now = time.monotonic()
        spent = int(now - self._since)
        if self._live:
            text = f"{self._text}, {spent} s" if spent >= _SOON else self._text
            if text != self._shown:
                width = max(20, shutil.get_terminal_size().columns - 5)
                print(f"\r\033[2K{text[:width]} ...\r", end="", file=sys.stderr, flush=True)
                self._shown = text
            return
        same = self._text == self._shown
        due = now - self._last >= (_AGAIN if same else _PLAIN_AFTER)
        if due or (self._every and not same):
            text = f"{self._text}, {spent} s" if same else self._text
            print(f"{text} ...", file=sys.stderr, flush=True)
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


class Count:
    """Tells how many of several things are done: "effect 7 of 15, coil_lag; about 20 s left".

    Parameters
    ----------
    what : str
        What is counted, in the singular.
    total : int
        How many there are.

    Notes
    -----
    `done` may be called from any thread; whom to tell is asked where this is made.
    """

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total, self._done = what, total, 0
        self._teller = _teller.get()
        self._first = 0.0
        self._lock = threading.Lock()

    def done(self, name: str = "", note: str = "") -> None:
        """Tell that one more is done: its name, and what else there is to know."""
        if self._teller is None:
            return
        with self._lock:
            self._done += 1
            now = time.monotonic()
            self._first = self._first or now  # the first one compiles: it says nothing of the rest
            left = (now - self._first) / max(1, self._done - 1) * (self._total - self._done)
            text = f"{self._what} {self._done} of {self._total}"
            text += f", {name}" if name else ""
            text += f"; {note}" if note else ""
            text += f"; about {_round(left)} s left" if left >= _SOON else ""
            self._teller(text)


def counted(items: Sequence[Item], what: str) -> Iterator[Item]:
    """Yield items, telling which of them is at work: "start 2 of 4"."""
    for number, item in enumerate(items, 1):
        tell(f"{what} {number} of {len(items)}")
        yield item


def _round(seconds: float) -> int:
    """Return seconds as one says them: to 5 s, beyond a minute to 10 s."""
    step = 1 if seconds < 10.0 else 5 if seconds < 60.0 else 10
    return max(1, step * round(seconds / step))


class Progress:
    """Shows how far something is: a bar on a terminal, nothing for what is done in a moment.

    Parameters
    ----------
    title : str
        What is on its way.
    total : int
        The number of steps.
    wanted : bool
        False shows nothing.

    Notes
    -----
    In a pipe it tells now and then. What is told meanwhile (`tell`) stands before the bar.
    """

    def __init__(self, title: str, total: int, wanted: bool) -> None:
        self._title = title
        self._total = total
        self._wanted = wanted
        self._live = wanted and sys.stderr.isatty()
        self._began = time.perf_counter()
        self._bar: Bar | None = None
        self._telling = telling(self._tell if self._live else _teller.get())

    def __enter__(self) -> Self:
        self._telling.__enter__()
        if self._wanted and not self._live:
            tell(self._title)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._telling.__exit__(kind, error, trace)
        if self._bar:
            self._bar.stop()

    def show(self, done: int) -> None:
        """Show that `done` of the steps are done."""
        if not self._wanted:
            return
        spent = time.perf_counter() - self._began
        if not self._live:
            left = spent / max(1, done) * (self._total - done)
            soon = f", about {_round(left)} s left" if done and left >= _SOON else ""
            tell(f"{self._title}: {100 * done // max(1, self._total)} %{soon}")
            return
        if self._bar is None and spent > _PATIENCE:
            self._bar = self._start()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done, description=self._title)

    def _tell(self, text: str) -> None:
        if self._bar is None:
            self._bar = self._start()
        self._bar.update(self._bar.task_ids[0], description=f"{self._title}: {text}")

    def _start(self) -> Bar:
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
        bar = Bar(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True)
        bar.add_task(self._title, total=self._total)
        bar.start()
        return bar

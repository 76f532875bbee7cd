"""Progress of long work: messages, time left, the state of a search.

Whoever works calls `tell`; the command decides where that goes (`telling`). Without one nothing is
told: a library is silent.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from math import nan
from typing import TYPE_CHECKING, Any, Self, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress as Bar


Item = TypeVar("Item")

_PATIENCE = 0.3
"""Seconds after which something that is not yet done gets a bar."""
SOON = 3.0
"""Seconds, left or spent, below which none are told."""
_MINUTES = 150.0
"""Seconds left from which on they are told in minutes."""

LINES = "BRISTLE_PROGRESS"
"""The environment variable by which a program that starts a command asks for every text as a line
of its own, at once: `lines`."""


def _nobody(text: str) -> None:
    """Take what is told where no command listens; a bar that is asked for is shown all the same."""


_teller: ContextVar[Callable[[str], None] | None] = ContextVar("teller", default=_nobody)


def tell(text: str) -> None:
    """Tell what is being done, in a few words, to whom `telling` has named; "": nothing any more.

    What asks on the terminal, or waits there for something else, tells "" first.
    """
    teller = _teller.get()
    if teller is not None:
        teller(text)


@contextmanager
def telling(teller: Callable[[str], None] | None) -> Iterator[None]:
    """Send what `tell` is given in this context to a function; None silences it, and bars."""
    before = _teller.set(teller)
    try:
        yield
    finally:
        _teller.reset(before)


def wants_lines() -> bool:
    """Return whether a program reads what is told, and wants all of it."""
    return os.environ.get(LINES) == "lines"


class _Pace:
    """What is left of a work, by what was measured of it: nothing as long as nothing was."""

    def __init__(self) -> None:
        self._first: tuple[float, int] | None = None

    def left(self, done: int, total: int) -> str:
        """Return the time left where `done` of `total` are done, "" where there is none to tell.

        It counts from what was done at the first call: the first of them compiles, or was kept from
        before, and says nothing of the rest.
        """
        now = time.monotonic()
        if self._first is None:
            self._first = now, done
        began, before = self._first
        return _in_words((now - began) / (done - before) * (total - done)) if done > before else ""


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
    `done` may be called from any thread; whom to tell is asked where this is made. Where each takes
    long, `begins` tells which one is at work, in place of `done`.
    """

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total, self._done = what, total, 0
        self._teller = _teller.get()
        self._pace = _Pace()
        self._lock = threading.Lock()

    def done(self, name: str = "", note: str = "") -> None:
        """Tell that one more is done: its name, and what else there is to know."""
        with self._lock:
            self._done += 1
            self._tell(self._done, name, note)

    def begins(self, name: str = "") -> None:
        """Tell that the next one begins, and so that those before it are done."""
        with self._lock:
            self._done += 1
            self._tell(self._done - 1, name, "")

    def _tell(self, done: int, name: str, note: str) -> None:
        left = self._pace.left(done, self._total) if done else ""
        if self._teller is not None:
            text = f"{self._what} {self._done} of {self._total}"
            text += f", {name}" if name else ""
            self._teller("; ".join(filter(None, (text, note, left))))


class Stages:
    """Tells which of several things of several kinds is at work: "case 3 of 12, Skyhook".

    The time left is told once one of each kind that is left was measured.

    Parameters
    ----------
    what : str
        What is counted, in the singular.
    kinds : mapping
        Kind to how many there are of it; those of a kind take about as long as each other.
    """

    def __init__(self, what: str, kinds: Mapping[str, int]) -> None:
        self._what, self._total, self._left = what, sum(kinds.values()), dict(kinds)
        self._spent: dict[str, list[float]] = {kind: [] for kind in kinds}
        self._at: tuple[str, float] | None = None

    def begins(self, kind: str, name: str) -> None:
        """Tell that the next one begins, by its kind and name, and so that the last one is done."""
        now = time.monotonic()
        if self._at is not None:
            self._spent[self._at[0]].append(now - self._at[1])
        self._at = kind, now
        seconds = 0.0
        for each, left in self._left.items():
            # The first one of a kind may compile: it counts as long as there is no other.
            spent = self._spent[each][1:] or self._spent[each] or [nan]
            seconds += left * sum(spent) / len(spent) if left else 0.0
        number = self._total - sum(self._left.values()) + 1
        self._left[kind] -= 1
        text = f"{self._what} {number} of {self._total}, {name}"
        tell("; ".join(filter(None, (text, _in_words(seconds)))))


def _in_words(seconds: float) -> str:
    """Return a time left as it is told, "" for a short or unknown one."""
    if not seconds >= SOON:
        return ""
    if seconds >= _MINUTES:
        return f"about {round(seconds / 60.0)} min left"
    return f"about {_round(seconds)} s left"


def listening() -> bool:
    """Return whether somebody listens to what is told: a command does, a library's caller may."""
    return _teller.get() not in (None, _nobody)


def counted(items: Sequence[Item], what: str) -> Iterator[Item]:
    """Yield items, telling which of them is at work: "start 2 of 4"."""
    count = Count(what, len(items))
    for item in items:
        count.begins()
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
        self._live = wanted and sys.stderr.isatty() and _teller.get() is not None
        self._began = time.perf_counter()
        self._pace = _Pace()
        self._bar: Bar | None = None
        self._outer = _teller.get()
        self._telling = telling(self._tell if self._live else self._outer)

    def __enter__(self) -> Self:
        if self._wanted:
            tell(self._title)
        self._telling.__enter__()
        return self

    def __exit__(self, *raised: Any) -> None:
        self._telling.__exit__(*raised)
        if self._bar:
            self._bar.stop()

    def show(self, done: int) -> None:
        """Show that `done` of the steps are done."""
        if not self._wanted:
            return
        spent = time.perf_counter() - self._began
        if not self._live:
            left = self._pace.left(done, self._total) if done else ""
            share = f"{self._title}: {100 * done // max(1, self._total)} %"
            tell(", ".join(filter(None, (share, left))))
            return
        if self._bar is None and spent > _PATIENCE:
            self._bar = self._start()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done, description=self._title)

    def _tell(self, text: str) -> None:
        if self._bar is None:
            self._bar = self._start()
        description = f"{self._title}: {text}" if text else self._title
        self._bar.update(self._bar.task_ids[0], description=description)

    def _start(self) -> Bar:
        if self._outer is not None:
            self._outer("")  # the bar stands where its line was
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn()
        bar = Bar(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True)
        bar.add_task(self._title, total=self._total)
        bar.start()
        return bar

"""A progress bar on a terminal, nothing in a pipe, nothing for what is done in a moment."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

_PATIENCE = 0.3
"""Seconds after which something that is not yet done gets a bar."""


class Progress:
    """Shows how far something is.

    Parameters
    ----------
    title : str
        What is on its way.
    total : int
        The number of steps.
    wanted : bool
        False shows nothing.
    """

    def __init__(self, title: str, total: int, wanted: bool) -> None:
        self._title = title
        self._total = total
        self._wanted = wanted and sys.stderr.isatty()
        self._began = time.perf_counter()
        self._bar: Bar | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar:
            self._bar.stop()

    def show(self, done: int) -> None:
        """Show that `done` of the steps are done."""
        if not self._wanted:
            return
        if self._bar is None and time.perf_counter() - self._began > _PATIENCE:
            self._bar = self._start()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done)

    def _start(self) -> Bar:
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
        bar = Bar(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True)
        bar.add_task(self._title, total=self._total)
        bar.start()
        return bar

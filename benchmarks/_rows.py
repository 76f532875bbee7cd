"""What a benchmark returns: one row per figure, and helpers to measure it fairly."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Row:
    """One figure: its name, what was measured, the goal in words, and how near it is.

    `ratio` is measured / goal, so 1 or less is reached; None where there is no goal.
    """

    name: str
    measured: str
    goal: str = ""
    ratio: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Times:
    """Seconds of repetitions."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The median, which a busy machine moves least."""
        return statistics.median(self.seconds)

    def __str__(self) -> str:
        low, high = min(self.seconds), max(self.seconds)
        return f"{self.median:.3f} s ({low:.3f} to {high:.3f}, n = {len(self.seconds)})"


def interleave(jobs: Mapping[str, Callable[[], float]], repetitions: int) -> dict[str, Times]:
    """Run the jobs in turn, again and again, so that a busy moment hits all of them.

    A job returns the seconds that count, or 0 to be timed as a whole.
    """
    found: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repetitions):
        for name, job in jobs.items():
            before = time.perf_counter()
            inner = job()
            found[name].append(inner or time.perf_counter() - before)
    return {name: Times(tuple(seconds)) for name, seconds in found.items()}


def ratio_of(one: Times, other: Times) -> float:
    """Return the median over repetitions of the ratio of neighbours in time."""
    return statistics.median(a / b for a, b in zip(one.seconds, other.seconds, strict=True))


def least_times(
    jobs: Mapping[Any, Callable[[int], None]], amount: int, slices: int
) -> dict[Any, float]:
    """Return the least processor time [s] of a slice of each job; slices of all take turns.

    Parameters
    ----------
    jobs : name to what does so much of it at a call
    amount : of a slice
    slices : of each job
    """
    least = dict.fromkeys(jobs, float("inf"))
    for _ in range(slices):
        for name, job in jobs.items():
            before = time.process_time()
            job(amount)
            least[name] = min(least[name], time.process_time() - before)
    return least


def show(rows: list[Row]) -> None:
    """Print figures with a goal as a table, where `ratio` is measured / goal; then the others."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in ("figure", "measured", "goal"):
        table.add_column(column, overflow="fold")
    table.add_column("ratio", justify="right")
    table.add_column("")
    lines = []
    for row in rows:
        if row.ratio is None:
            lines.append(f"{row.name}: {row.measured}")
        else:
            verdict = "reached" if row.ratio <= 1 else "missed"
            table.add_row(row.name, row.measured, row.goal, f"{row.ratio:.3f}", verdict)
        if row.note:
            lines.append(f"{row.name}: {row.note}")
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = 150  # a pipe or a file has no edge to fold at
    if table.row_count:
        console.print(table)
    if lines:
        console.print("", "Reported beside:", *lines, sep="\n")


def write_between(page: Path, begin: str, end: str, text: str) -> None:
    """Write a text between two marks of a page.

    Raises
    ------
    ValueError
        If the page has no such marks.
    """
    whole = page.read_text(encoding="utf-8")
    if begin not in whole or end not in whole:
        raise ValueError(f"{page}: no {begin} and {end} are there to write between.")
    before, after = whole.split(begin)[0], whole.split(end)[1]
    page.write_text(f"{before}{begin}\n\n{text}\n\n{end}{after}", encoding="utf-8")

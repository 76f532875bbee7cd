"""What a benchmark returns: one row per figure, and helpers to measure it fairly."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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

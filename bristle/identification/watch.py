"""What a fit has come to so far, for who watches it: error, parameters, loops of the force.

Searches are watched inside of a `series` alone, and there only where a `snapshots.watcher` is: else
a fit does not know of it. A search is told of, never asked: its result is the same to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from math import isfinite
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..core.arrays import Array, Flags
from ..core.progress import Watcher, watcher
from ..data.cycles import by_level, cycles
from ..model.model import Model, parameter
from ..physics.drive import DRIVES
from .building_sites import StructureRun
from .error import force_error
from .problem import Expected, Problem, Run, in_noises
from .search import Accepted, z_of, z_scale

MODEL, LAW = "model", "law"
"""Kinds of series: the fits of the model, one after the other; one law of several side by side."""

EVERY = 0.25
"""Seconds between two snapshots of a search; its end is always told."""

CYCLES = 3
"""Cycles that are drawn, at different levels of the command."""

POINTS = 100
"""Samples of each of them at the most."""

MOST = 50_000
"""Samples of all runs among which cycles are sought."""

SEARCHES = 12
"""Searches of a series whose errors are kept."""

_series: ContextVar[_Series | None] = ContextVar("series", default=None)


@contextmanager
def series(kind: str, name: str = "") -> Iterator[None]:
    """Let the searches of this context be watched, as one series.

    Parameters
    ----------
    kind : `MODEL` or `LAW`
    name : of the site of a building, or of the law
    """
    take = watcher()
    present = None if take is None else _Series(take, kind, name)
    before = _series.set(present)
    try:
        yield
    finally:
        _series.reset(before)
    if present is not None:
        present.end()


@contextmanager
def watched(
    problem: Problem,
    at: Callable[[Array], Model],
    share: Callable[[Array], float] | None = None,
    last: bool = True,
    *,
    expected: Expected | None = None,
) -> Iterator[Accepted | None]:
    """Give what `search.descend` tells its accepted steps to, None where nobody watches.

    Parameters
    ----------
    problem : the runs of the fit
    at : theta (p,) of the search to the model there
    share : its residuals (n,) to what it minimises, over the RMS of the force; None where they
        are over the noise, so that its cost tells z
    last : whether its end may be what comes of the series; not that of a search on a part of the
        samples, whose errors are not those of all
    expected : what a true model would show on each run, where that has an excess: z is without
    """
    present = _series.get()
    if present is None:
        yield None
        return
    search = _Search(present, problem, at, (share, expected), last)
    yield search
    search.end()


def _measured(run: Run) -> Flags:
    return np.ones(len(run.force), dtype=bool) if run.measured is None else run.measured


class _Snapshot(NamedTuple):
    """What the watcher was given of a step of a search."""

    model: Model
    problem: Problem
    told: Mapping[str, Any]
    cost: float


class _Series:
    """Searches one after the other, and the errors that each of them went through."""

    def __init__(self, take: Watcher, kind: str, name: str) -> None:
        self._take, self.kind, self.name = take, kind, name
        self._errors: list[list[float]] = []
        self._count = 0
        self._last = float("-inf")
        self._told: _Snapshot | None = None
        self._best: _Snapshot | None = None

    def start(self) -> tuple[int, list[float]]:
        """Return the number of a new search, and where it notes its errors."""
        errors: list[float] = []
        self._errors = [*self._errors[1 - SEARCHES :], errors]
        self._count += 1
        return self._count, errors

    @property
    def due(self) -> bool:
        """Whether it is time for another snapshot."""
        return time.monotonic() - self._last >= EVERY

    def give(
        self, model: Model, problem: Problem, told: Mapping[str, Any], last: bool, cost: float
    ) -> None:
        """Give a snapshot of a model that a search came to at a cost; `last` as in `watched`."""
        shown = _cycles_of(problem)
        runs = {one.run for one in shown}
        forces = {run: problem.predict(model, problem.runs[run]) for run in runs}
        values = [
            [name, model.value(name), parameter(model.law, name).unit] for name in model.free()
        ]
        loops = [{**one.told, "model": _short(forces[one.run][one.rows])} for one in shown]
        self._take(
            {
                "series": f"{self.kind} {self.name}".strip(), "kind": self.kind,
                "name": self.name, "law": model.law, "effects": list(model.effects),
                "errors": [[*one] for one in self._errors], "parameters": values, "loops": loops,
                **told,
            }
        )  # fmt: skip
        self._last = time.monotonic()
        self._told = _Snapshot(model, problem, told, cost)
        better = self._best is None or cost < self._best.cost
        if last and told["z"] is None and better:
            self._best = self._told

    def end(self) -> None:
        """Give the best of searches for the least RMS error once more: it is what comes of them."""
        if self._best is not None and self._best is not self._told:
            best = self._best
            self.give(best.model, best.problem, best.told, last=True, cost=best.cost)


class _Search:
    """A search that is watched: takes its accepted steps."""

    def __init__(
        self, series: _Series, problem: Problem, at: Callable[[Array], Model],
        judged_by: tuple[Callable[[Array], float] | None, Expected | None], last: bool,
    ) -> None:  # fmt: skip
        self._series, self._problem, self._at = series, problem, at
        (self._share, self._expected), self._is_last = judged_by, last
        self._number, self._errors = series.start()
        self._left: tuple[Array, float | None] | None = None  # what was not told yet

    def __call__(self, theta: Array, r: Array, cost: float) -> None:
        told = self._z(r, cost) if self._share is None else self._share(r)
        self._errors.append(told)
        self._left = theta.copy(), told if self._share is None else None
        if self._series.due:
            self.end()

    def _z(self, r: Array, cost: float) -> float:
        if not self._problem.excess or self._expected is None:
            return z_of(cost)
        return z_scale(in_noises(self._problem, r, self._expected))

    def end(self) -> None:
        """Tell the last step, unless it was told."""
        if self._left is None:
            return
        (theta, z), self._left = self._left, None
        model = self._at(theta)
        told = {
            "search": self._number, "step": len(self._errors) - 1,
            "share": force_error([(self._problem, model)]).headline[1], "z": z,
        }  # fmt: skip
        self._series.give(model, self._problem, told, self._is_last, self._errors[-1])


class _Cycle:
    """Samples of a run that are drawn, and what is the same of them for every model."""

    def __init__(self, number: int, run: Run, part: slice, level: float) -> None:
        rows = np.arange(len(run.force))[part]
        self.run, self.rows = number, rows[:: max(1, -(-len(rows) // POINTS))]
        self.told = {
            "run": run.name, "level": float(f"{level:.5g}"), "unit": DRIVES[run.drive].unit,
            "displacement": _short(run.x[self.rows]), "velocity": _short(run.v[self.rows]),
            "measured": _short(run.force[self.rows]),
        }  # fmt: skip


def _cycles_of(problem: Problem) -> list[_Cycle]:
    """Return what is drawn of a problem, chosen once."""
    if problem not in _chosen:
        _chosen[problem] = _choose(problem.runs)
    return _chosen[problem]


def _choose(runs: Sequence[Run]) -> list[_Cycle]:
    """Return the largest cycles at different levels of the command, whole ones.

    Of long measurements the first part; where there is no cycle, as in noise alone, the first run.
    """
    part = slice(0, MOST // len(runs))
    motions = [(run.x[part], run.v[part], run.V[part]) for run in runs]
    found = cycles(motions, max(run.skip for run in runs))
    whole = [one for one in found if _whole(runs[one.run], one.part)]
    if not whole:
        return [_Cycle(0, runs[0], slice(runs[0].skip, None), float(np.median(runs[0].V)))]
    return [_Cycle(one.run, runs[one.run], one.part, one.level) for one in by_level(whole, CYCLES)]


def _whole(run: Run, part: slice) -> bool:
    """Return whether all samples of a part were measured, one after the other."""
    apart = isinstance(run, StructureRun) and bool(np.any(np.diff(run.keep[part]) != 1))
    return bool(np.all(_measured(run)[part])) and not apart


def _short(values: Array) -> list[float | None]:
    """Return numbers (n,) to five digits, None for a force that is not finite."""
    return [float(f"{value:.5g}") if isfinite(value) else None for value in values.tolist()]


_chosen: WeakKeyDictionary[Problem, list[_Cycle]] = WeakKeyDictionary()

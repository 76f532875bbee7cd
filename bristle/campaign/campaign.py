"""One system, many variations of it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Generator, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import isfinite
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple, Protocol

from ..engine import Engine
from ..engine.results import Array, RunTable, statistic_of
from ..errors import BristleError, ScenarioError
from ..fmu.description import Value
from ..system.model import Signal, System
from ..system.overrides import FILES
from ..system.scenario import load_scenario

STATISTICS = ("peak", "rms", "max", "min", "mean", "last")
"""What `statistic_of` knows."""


@dataclass(frozen=True)
class Statistic:
    """One number that is kept of each run: a statistic of a column; "peak" is of its size."""

    column: str
    statistic: str
    unit: str = ""

    @property
    def name(self) -> str:
        """The output's name in tables: "peak damper.force"."""
        return f"{self.statistic} {self.column}"

    def of(self, values: Array) -> float:
        """Return the statistic of a column (n,)."""
        return statistic_of(values, self.statistic)


class Variation(NamedTuple):
    """What takes the place of a system's values, by "component.name" as in `System.with_values`.

    Names that a scenario must be read anew for (records, FMUs, steps) are those of overrides.
    """

    values: Mapping[str, Value | Signal]


class Draws(Protocol):
    """Gives each run its values, from its number alone."""

    def values(self, run: int) -> Mapping[str, Value]:
        """Return the values of a run."""


@dataclass(frozen=True)
class RunOutcome:
    """What became of a run: the kept `numbers`, all rows in a `table`, or why there are none.

    `reason` is "" for a run that is done.
    """

    run: int = 0
    numbers: tuple[float, ...] = ()
    reason: str = ""
    table: RunTable | None = None


SYSTEMS_KEPT = 64
"""Systems that a campaign keeps: one per combination of records, steps and the like."""


@dataclass(frozen=True)
class Campaign:
    """One system and the engine that runs its variations.

    `keep` is what is kept of each run; None keeps all rows. `draws` give runs of a number their
    values.
    """

    system: System
    engine: Engine
    keep: tuple[Statistic, ...] | None = None
    draws: Draws | None = None
    _read: dict[tuple[tuple[str, object], ...], System] = field(
        default_factory=dict, init=False, repr=False
    )
    _known: dict[tuple[tuple[str, object], ...], RunOutcome] = field(
        default_factory=dict, init=False, repr=False
    )

    @property
    def runs(self) -> int:
        """How many runs `run` has made whose numbers are kept."""
        return len(self._known)

    def run(self, one: Variation) -> RunOutcome:
        """Return what a variation gives, run once for the same values where numbers are kept.

        Raises
        ------
        ScenarioError, PhysicsError, RecordError
            If a value is out of bounds or does not fit.
        RunError
            If the run fails.
        """
        if self.keep is None:
            return RunOutcome(table=self.engine.run(self.varied(one.values)))
        key = tuple(one.values.items())
        if key not in self._known:
            self._known[key] = RunOutcome(numbers=self._numbers(one.values))
        return self._known[key]

    def prepare(self) -> None:
        """Do once what all runs share, compiling above all; best before processes are forked.

        Raises
        ------
        ScenarioError
            If the engine cannot run the system.
        """
        if why := self.engine.refuses(self.system):
            raise ScenarioError(why)
        if self.engine.name == "compiled":
            self.engine.run(replace(self.system, stop=self.system.step))

    def varied(self, values: Mapping[str, Value | Signal]) -> System:
        """Return the system with values in place of its own."""
        given = [(n, v) for n, v in values.items() if not isinstance(v, Signal)]
        anew = tuple((n, v) for n, v in given if is_read_anew(self.system, n))
        if anew and anew not in self._read:
            if len(self._read) >= SYSTEMS_KEPT:
                self._read.clear()
            self._read[anew] = load_scenario(self.system, dict(anew))
        base = self._read[anew] if anew else self.system
        names = dict(anew)
        return base.with_values({n: v for n, v in values.items() if n not in names})

    def outcome(self, run: int) -> RunOutcome:
        """Return what became of a run of the draws; a failure is an outcome as well."""
        assert self.draws is not None
        try:
            numbers = self._numbers(self.draws.values(run))
        except BristleError as error:
            return RunOutcome(run, reason=_one_line(error))
        except Exception as error:  # whatever a user's effect or a foreign FMU raises, runs go on
            return RunOutcome(run, reason=f"{type(error).__name__}: {_one_line(error)}")
        if wrong := self._not_finite(numbers):
            return RunOutcome(run, reason=f"RunError: {wrong}.")
        return RunOutcome(run, numbers)

    def _numbers(self, values: Mapping[str, Value | Signal]) -> tuple[float, ...]:
        table = self.engine.run(self.varied(values))
        return tuple(one.of(table[one.column]) for one in self.keep or ())

    def _not_finite(self, numbers: tuple[float, ...]) -> str:
        pairs = zip(self.keep or (), numbers, strict=True)
        return next((f"{one.name} is not finite" for one, x in pairs if not isfinite(x)), "")


def is_read_anew(system: System, name: str) -> bool:
    """Return whether a scenario must be read anew for a value: of a record, an FMU, a step."""
    component, own = system.part(name)
    if component is None or own in FILES:
        return True
    return own not in component.description.variables and not own.startswith("building.")


def _one_line(error: Exception) -> str:
    kind = f"{type(error).__name__}: " if isinstance(error, BristleError) else ""
    return kind + " ".join(str(error).split())


# Runs on the cores of this machine, one process each.

AHEAD = 2
"""Runs that a process has been given and not yet answered: it never waits for the next."""
TRIES = 2
"""How often a run is begun whose process dies."""


@dataclass
class _Process:
    """A process, this side of its pipe, and the runs that it has, the one it is at first."""

    process: BaseProcess
    pipe: Connection
    given: deque[int] = field(default_factory=deque)


def run_local(
    campaign: Campaign, runs: Iterable[int], workers: int
) -> Generator[RunOutcome, None, None]:
    """Yield what becomes of runs as they end, in whatever order.

    Parameters
    ----------
    campaign : Campaign
        `prepare` has been called: forked processes have what it compiled.
    runs : iterable of int
    workers : int
        Number of processes.
    """
    waiting = deque(runs)
    died: dict[int, int] = {}
    processes: list[_Process] = []
    try:
        while waiting or any(p.given for p in processes):
            while waiting and len(processes) < workers:
                processes.append(_start(campaign, processes))
            for p in processes:
                _feed(p, waiting)
            ready = wait([p.pipe for p in processes if p.given])
            for p in [p for p in processes if p.pipe in ready]:
                try:
                    outcome: RunOutcome = p.pipe.recv()
                except (EOFError, OSError):
                    processes.remove(p)
                    failed = _bury(p, waiting, died)
                    if failed is not None:
                        yield failed
                else:
                    p.given.remove(outcome.run)
                    yield outcome
    finally:
        _end(processes)


def _feed(p: _Process, waiting: deque[int]) -> None:
    while waiting and len(p.given) < AHEAD:
        try:
            p.pipe.send(waiting[0])
        except OSError:  # it has died, which is seen when its pipe is read
            if not p.given:
                p.given.append(waiting.popleft())
            return
        p.given.append(waiting.popleft())


def _bury(p: _Process, waiting: deque[int], died: dict[int, int]) -> RunOutcome | None:
    """Take back a dead process's runs; return the failure of one that has killed twice."""
    p.process.join()
    p.pipe.close()
    at = p.given.popleft()
    waiting.extendleft(reversed(p.given))
    died[at] = died.get(at, 0) + 1
    if died[at] < TRIES:
        waiting.appendleft(at)
        return None
    code = p.process.exitcode or 0
    how = f"by signal {-code}" if code < 0 else f"with exit code {code}"
    return RunOutcome(at, reason=f"RunError: its process ended {how}, {TRIES} times.")


def _start(campaign: Campaign, others: list[_Process]) -> _Process:
    # Forked processes have the compiled code and the loaded scenario at once; the library's threads
    # (of BLAS, of a progress bar) hold no lock that a run takes.
    forks = sys.platform == "linux"
    context: Any = multiprocessing.get_context("fork" if forks else "spawn")
    ours, theirs = context.Pipe()
    inherited = [ours, *(p.pipe for p in others)] if forks else []
    process = context.Process(target=_run_members, args=(campaign, theirs, inherited), daemon=True)
    process.start()
    theirs.close()
    return _Process(process, ours)


def _run_members(campaign: Campaign, pipe: Connection, inherited: list[Connection]) -> None:
    """Answer run numbers with outcomes until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all; the parent decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for connection in inherited:  # else nobody would notice that the parent is gone
        connection.close()
    campaign.prepare()
    with suppress(EOFError, OSError):
        while True:
            pipe.send(campaign.outcome(pipe.recv()))
    os._exit(0)  # at once: taking down compiled code takes a second


def _end(processes: list[_Process]) -> None:
    for p in processes:
        p.pipe.close()
        if p.given:  # its runs are not wanted any more
            p.process.terminate()
    for p in processes:
        p.process.join()

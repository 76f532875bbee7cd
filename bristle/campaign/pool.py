"""Runs on the cores of this machine, one process each; a process that dies costs no finished run.

Each process has a pipe of its own, so it is known which run it was at when it died: that run is
given to another process once, and then counts as failed. A process whose parent is gone ends.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Generator, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from .campaign import Campaign, RunOutcome

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

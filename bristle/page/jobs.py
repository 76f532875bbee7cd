"""Long work: processes of bristle's commands, whose progress is read and which Ctrl-C ends.

A job belongs to the server and not to a page: closing the page, or opening it twice, changes
nothing. What a command did is in the study's folder, whoever started it.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from http import HTTPStatus
from itertools import count
from pathlib import Path
from typing import IO, Any

from ..core import progress
from ..core.interrupt import INTERRUPTED
from ..core.progress import LINES
from .orders import Order
from .requests import RequestError

KEPT_LINES = 500
"""Lines of progress that are kept of a job."""
KEPT_JOBS = 50
KEPT_SERIES = 60
"""Series of snapshots of a job; there are some ten laws, and as many sites of a building."""
LONGEST_ANSWER = 32 * 1024**2
"""Bytes of a command's output that are kept."""
AGAIN = 3.0
"""Seconds after Ctrl-C until it is sent again: one that comes amid an import may be lost."""
PATIENCE = 10.0
"""Seconds after Ctrl-C until a command that does not end is ended."""
ENDED = {0: "done", INTERRUPTED: "cancelled", -signal.SIGINT: "cancelled"}
"""Exit codes of commands that did not fail."""


@dataclass
class Job:
    """A command at work, or what came of it.

    `state` is "running", "cancelling", "done", "failed" or "cancelled"; `lines` what it told on its
    way, `first` the number of the oldest that is kept; `error` why it failed, `output` its answer.
    `fits` holds the last snapshot of each series of fits, with a number that grows from one to the
    next of all jobs; none is kept of a job that is done, or was before another one of its study.
    """

    number: int
    order: Order
    process: subprocess.Popen[bytes] = field(repr=False)
    began: float
    state: str = "running"
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT_LINES))
    first: int = 0
    ended: float | None = None
    error: str = ""
    output: bytes = b""
    fits: dict[str, tuple[int, dict[str, Any]]] = field(default_factory=dict, repr=False)
    watching: threading.Thread | None = field(default=None, repr=False)

    @property
    def at_work(self) -> bool:
        """Whether its process has not ended."""
        return self.ended is None

    def told(self, text: str) -> None:
        """Keep a line that the command told."""
        self.first += len(self.lines) == KEPT_LINES
        self.lines.append(text)

    def showed(self, snapshot: dict[str, Any], number: int) -> None:
        """Keep a snapshot of a fit in place of the one before of its series."""
        name = str(snapshot.get("series", ""))
        if name in self.fits or len(self.fits) < KEPT_SERIES:
            self.fits[name] = number, snapshot

    def as_dict(self, since: int = 0, after: int = 0) -> dict[str, Any]:
        """Return what a page shows of it.

        Parameters
        ----------
        since : the lines from this number on are among it
        after : so are the snapshots of fits that are later than this one
        """
        lines = list(self.lines)
        fits = [{**one, "number": number} for number, one in list(self.fits.values())]
        end = self.ended or time.monotonic()
        return {
            "number": self.number, "study": self.order.study, "what": self.order.what,
            "command": self.order.shown, "state": self.state, "error": self.error,
            "seconds": round(end - self.began, 1), "next": self.first + len(lines),
            "lines": lines[max(0, since - self.first) :], "now": lines[-1] if lines else "",
            "fits": [one for one in fits if one["number"] > after],
        }  # fmt: skip

    def answer(self) -> Any:
        """Return what the command printed, read as JSON where it is that, else its text."""
        text = self.output.decode(errors="replace")
        try:
            return json.loads(text)
        except ValueError:
            return text


class Jobs:
    """The jobs of a server.

    Parameters
    ----------
    folder : path
        Where the commands run: the folder that holds the studies.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._jobs: dict[int, Job] = {}
        self._lock = threading.Lock()
        self._count = 0
        self._snapshots = count(1)

    def start(self, order: Order) -> Job:
        """Start a command; return its job.

        Raises
        ------
        RequestError
            If another one of the same study is at work, or the server is about to end.
        """
        with self._lock:
            for one in self._jobs.values():
                if one.at_work and one.order.study == order.study:
                    raise RequestError(
                        f"{order.study}: `{one.order.shown}` is at work. Wait for it, or cancel "
                        "it.", HTTPStatus.CONFLICT,
                    )  # fmt: skip
                if one.order.study == order.study:
                    one.fits = {}
            self._count += 1
            process = subprocess.Popen(
                program(order), cwd=self._folder, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                env={**os.environ, LINES: "lines", progress.VARIABLE: "lines"}, **_own_group(),
            )  # fmt: skip
            job = Job(self._count, order, process, time.monotonic())
            self._jobs[job.number] = job
            for old in [n for n, one in self._jobs.items() if not one.at_work][:-KEPT_JOBS]:
                del self._jobs[old]
        job.watching = threading.Thread(target=self._watch, args=(job,), daemon=True)
        job.watching.start()
        return job

    def get(self, number: int) -> Job:
        """Return a job; RequestError if there is none of that number."""
        with self._lock:
            if number not in self._jobs:
                raise RequestError(f"there is no job {number}.", HTTPStatus.NOT_FOUND)
            return self._jobs[number]

    def all(self) -> list[Job]:
        """Return the jobs, the newest last."""
        with self._lock:
            return list(self._jobs.values())

    def cancel(self, number: int) -> Job:
        """Send Ctrl-C to a job's command; return the job."""
        job = self.get(number)
        with self._lock:
            if not job.at_work or job.state == "cancelling":
                return job
            job.state = "cancelling"
        _interrupt(job.process)
        threading.Thread(target=_insist, args=(job.process,), daemon=True).start()
        return job

    def close(self) -> None:
        """Cancel what is at work, and wait for it."""
        working = [self.cancel(one.number) for one in self.all() if one.at_work]
        for job in working:
            if job.watching is not None:
                job.watching.join(PATIENCE + 1.0)

    def _watch(self, job: Job) -> None:
        """Read what a command tells and prints until it ends."""
        assert job.process.stdout is not None
        assert job.process.stderr is not None
        wrong: list[str] = []
        told = threading.Thread(
            target=_each_line, daemon=True,
            args=(job.process.stderr, lambda text: self._sort(text, job, wrong)),
        )  # fmt: skip
        told.start()
        output = job.process.stdout.read(LONGEST_ANSWER)
        while job.process.stdout.read(1024**2):
            pass  # so that it does not wait for a reader
        code = job.process.wait()
        told.join()
        job.process.stdout.close()
        job.process.stderr.close()
        with self._lock:
            job.output, job.ended = output, time.monotonic()
            # A command that ended before Ctrl-C reached it has done its work; one that it reached
            # while Python was still starting may end with any code.
            asked = job.state == "cancelling" and code != 0
            job.state = "cancelled" if asked else ENDED.get(code, "failed")
            if job.state == "failed":
                job.error = "\n".join(wrong) or f"the process ended with code {code}."
            if job.state == "done":
                job.fits = {}

    def _sort(self, text: str, job: Job, wrong: list[str]) -> None:
        """Keep snapshots, and progress, which ends in dots, apart from what is wrong."""
        if (snapshot := progress.read(text)) is not None:
            job.showed(snapshot, next(self._snapshots))
        elif text.endswith(" ..."):
            job.told(text.removesuffix(" ..."))
        elif text.strip():
            wrong.append(text)


def program(order: Order) -> list[str]:
    """Return the words of the process that runs a command."""
    return [sys.executable, "-m", "bristle.cli", *order.words]


def _each_line(stream: IO[bytes], take: Callable[[str], None]) -> None:
    lines: Iterable[bytes] = iter(stream.readline, b"")
    for line in lines:
        take(line.decode(errors="replace").rstrip())


def _own_group() -> dict[str, Any]:
    """Return what keeps Ctrl-C in the server's terminal from the commands: they get their own."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def _interrupt(process: subprocess.Popen[bytes]) -> None:
    if sys.platform == "win32":
        process.send_signal(signal.CTRL_BREAK_EVENT)
    else:
        process.send_signal(signal.SIGINT)


def _insist(process: subprocess.Popen[bytes]) -> None:
    """Send Ctrl-C again to a process that lost the first one, and end one that does not end."""
    try:
        process.wait(AGAIN)
        return
    except subprocess.TimeoutExpired:
        _interrupt(process)
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()

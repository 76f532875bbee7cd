"""Processes for probes: each in one of its own, ended when a call takes too long.

On Linux a process that has imported the probes, and never an FMU, forks one child per probe:
starting Python anew each time would take most of the time of a judgement. Elsewhere, and where
a probe asks for it, Python starts anew.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from ..errors import FmuError

# The child takes the package's folder off its path again, and the package out of its modules, so
# that an FMU cannot lean on the bristle that judges it.
_BOOT = (
    "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); "
    "from bristle.conformance._probe import forget_ourselves, main, serve; "
    "sys.path.remove(sys.argv[1]); forget_ourselves(); "
    "main(Path(sys.argv[2]), sys.argv[3]) if sys.argv[3:] else serve(Path(sys.argv[2]))"
)
_PACKAGES = str(Path(__file__).parents[2])


class Subprocesses:
    """Starts a process per probe; used as a context, it leaves none behind."""

    def __init__(self, work: Path) -> None:
        self._work = work
        self._count = 0
        self._living: list[int] = []
        self._mother: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Subprocesses:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for pid in self._living:
            _kill(pid)
        if self._mother is not None:
            _kill(self._mother.pid)
            self._mother.communicate()

    def run(
        self, probe: str, timeout: float, calls: Callable[[], int], *, anew: bool, bare: bool
    ) -> int | None:
        """Return how a probe's process ended: its exit code, None if it had to be killed.

        As in subprocess, an exit code is positive and a signal negative.

        Parameters
        ----------
        probe : name of the probe
        timeout : time limit of one call [s]
        calls : returns how many calls there were
        anew, bare : whether Python starts anew for it; whether without site-packages, anew as well

        Raises
        ------
        FmuError
            If the process that starts the probes has ended.
        """
        self._count += 1
        folder = self._work / f"cwd{self._count}"
        folder.mkdir()
        if anew or bare or sys.platform != "linux":
            return self._start(probe, folder, timeout, calls, bare)
        return self._fork(probe, folder, timeout, calls)

    def _command(self, bare: bool, *arguments: str) -> list[str]:
        flags = ["-I", "-S"] if bare else ["-P"]
        return [sys.executable, *flags, "-c", _BOOT, _PACKAGES, str(self._work), *arguments]

    def _start(
        self, probe: str, folder: Path, timeout: float, calls: Callable[[], int], bare: bool
    ) -> int | None:
        process = subprocess.Popen(
            self._command(bare, probe),
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        # Popen.wait(timeout) would poll every 50 ms.
        waiter = threading.Thread(target=process.wait, daemon=True)
        try:
            waiter.start()

            def over(seconds: float) -> bool:
                waiter.join(seconds)
                return not waiter.is_alive()

            ended = _ends(over, timeout, calls)
        finally:
            _kill(process.pid)
            code = process.wait()
        return code if ended else None

    def _fork(
        self, probe: str, folder: Path, timeout: float, calls: Callable[[], int]
    ) -> int | None:
        if self._mother is None:
            self._mother = subprocess.Popen(
                self._command(False),
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        request, answer = self._mother.stdin, self._mother.stdout
        assert request is not None
        assert answer is not None
        request.write(f"{probe}\t{folder}\n".encode())
        pid = _number(answer.readline())
        self._living.append(pid)
        ended = _ends(
            lambda seconds: bool(select.select([answer], [], [], seconds)[0]), timeout, calls
        )
        _kill(pid)
        code = _number(answer.readline())
        self._living.remove(pid)
        return code if ended else None


def _ends(over: Callable[[float], bool], timeout: float, calls: Callable[[], int]) -> bool:
    """Wait for the end of a process; return False if one call takes longer than its time [s]."""
    last, since = calls(), time.monotonic()
    while not over(timeout / 10):
        if (now := calls()) != last:
            last, since = now, time.monotonic()
        elif time.monotonic() - since >= timeout:
            return False
    return True


def _number(line: bytes) -> int:
    if not line:
        raise FmuError("the process that starts the probes has ended unexpectedly.")
    return int(line)


def _kill(pid: int) -> None:
    """Kill a process and whatever has been started in its session."""
    with suppress(ProcessLookupError, PermissionError):  # all have ended by themselves
        if sys.platform == "win32":
            os.kill(pid, signal.SIGTERM)
        else:
            os.killpg(pid, signal.SIGKILL)
    with suppress(ProcessLookupError, PermissionError):  # it had no session of its own yet
        os.kill(pid, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)

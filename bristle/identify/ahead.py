"""Compiles what fits and diagnoses need in a process of its own, while the data are read.

numba compiles under one lock, so a second thread would not help. What the process keeps on disk is
read here once it is there.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

from ..progress import tell

_CODE = "import sys; from bristle.identify.bench import keep; keep(sys.argv[1:])"


class Ahead:
    """A process that compiles functions one after the other, and says when each is kept on disk.

    Parameters
    ----------
    digests : of the functions by name, in the order in which they are needed; where the process
        finds another one, as beside a user's own effect, it ends without compiling
    """

    def __init__(self, digests: Mapping[str, str]) -> None:
        self._due = set(digests)
        self._lock = Lock()
        folder = str(Path(__file__).resolve().parents[2])
        paths = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
        asked = [f"{name}={digest}" for name, digest in digests.items()]
        # A session of its own: what is compiled serves the next command too, after a Ctrl-C here.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CODE, *asked], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, "PYTHONPATH": paths}, start_new_session=True,
        )  # fmt: skip

    @property
    def at_work(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def wait(self, name: str) -> None:
        """Wait until a function is kept, or the process has ended without it."""
        with self._lock:
            if name not in self._due:
                return
            tell("compiling the laws, once")
            assert self._process.stdout is not None
            while name in self._due:
                line = self._process.stdout.readline()
                if line:
                    self._due.discard(line.strip())
                else:  # whoever asks compiles it then
                    self._due.clear()
            if not self._due:
                self._process.stdout.close()
                self._process.wait()


def begun(digests: Mapping[str, str]) -> Ahead | None:
    """Return a process that compiles functions, or None where none can be begun."""
    try:
        return Ahead(digests)
    except OSError:
        return None

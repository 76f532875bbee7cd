"""Compiles what fits and diagnoses need in processes of their own, while the data are read.

numba compiles under one lock, so threads would not help. What a process keeps on disk is read here
once it is there.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from threading import Lock

from ..progress import tell

_CODE = "import sys; from bristle.identify.bench import keep; keep(*sys.argv[1:])"


class Ahead:
    """A process that compiles a function, and says when it is kept on disk.

    Parameters
    ----------
    name, digest : of the function; where the process finds another digest, as beside a user's own
        effect, it ends without compiling
    """

    def __init__(self, name: str, digest: str) -> None:
        self._done = False
        self._lock = Lock()
        folder = str(Path(__file__).resolve().parents[2])
        paths = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
        # A session of its own: what is compiled serves the next command too, after a Ctrl-C here.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CODE, name, digest], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, "PYTHONPATH": paths}, start_new_session=True,
        )  # fmt: skip

    @property
    def at_work(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Wait until the function is kept, or the process has ended without it."""
        with self._lock:
            if self._done:
                return
            tell("compiling the laws, once")
            assert self._process.stdout is not None
            self._process.stdout.readline()  # empty where it has ended: whoever asks compiles then
            self._process.stdout.close()
            self._process.wait()
            self._done = True


def begun(name: str, digest: str) -> Ahead | None:
    """Return a process that compiles a function, or None where none can be begun."""
    try:
        return Ahead(name, digest)
    except OSError:
        return None

"""Ctrl-C as a request to stop between two steps.

A KeyboardInterrupt that broke into an FMU written in Python would reach its binary, which
answers Fatal and must not be called again. So while FMUs run, Ctrl-C only asks. A component
that hangs never gets to the end of its step: then a thread ends the process in its stead.
"""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Self

PATIENCE = 3.0
"""Seconds that a component may take to finish its step after Ctrl-C."""


class Interrupt:
    """A context in which `asked` tells whether Ctrl-C was pressed.

    Parameters
    ----------
    on_hang : callable, optional
        Called from a thread when the context is not left within `PATIENCE` after Ctrl-C.

    Notes
    -----
    Signals reach only the main thread of a process; in any other this context does nothing.
    """

    def __init__(self, on_hang: Callable[[], None] | None = None) -> None:
        self.asked = False
        self._on_hang = on_hang
        self._restore: list[Callable[[], Any]] = []

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            before = signal.signal(signal.SIGINT, self._ask)
            self._restore.append(lambda: signal.signal(signal.SIGINT, before))
            if self._on_hang is not None:
                self._watch(self._on_hang)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        while self._restore:
            self._restore.pop()()

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True

    def _watch(self, on_hang: Callable[[], None]) -> None:
        """Start a thread that the C part of signal handling wakes, whatever the main one does."""
        ours, theirs = socket.socketpair()
        theirs.setblocking(False)
        before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
        left = threading.Event()

        def wait() -> None:
            while received := ours.recv(1):
                if received[0] == signal.SIGINT and not left.wait(PATIENCE):
                    on_hang()

        watcher = threading.Thread(target=wait, name="bristle-interrupt", daemon=True)
        watcher.start()

        def restore() -> None:
            signal.set_wakeup_fd(before)
            left.set()
            theirs.close()
            watcher.join()
            ours.close()

        self._restore.append(restore)

"""Ctrl-C as a request to stop between two steps.

A KeyboardInterrupt that broke into an FMU written in Python would reach its binary, which
answers Fatal and must not be called again. So while FMUs run, Ctrl-C only asks. A component
that hangs never gets to the end of its step: then a thread ends the process in its stead.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn, Self

PATIENCE = 1.5
"""Seconds that a component may take to finish its step after Ctrl-C."""
HURRY = 1.0
"""Seconds that a command may take to end after Ctrl-C."""
INTERRUPTED = 130
"""The exit code of a command that Ctrl-C ended."""


_kept = ""


def keeps(text: str) -> None:
    """Say what is kept where Ctrl-C comes from now on, and how to go on: sentences, "" for none."""
    global _kept  # one for the process, for a thread may tell it
    _kept = text


def message() -> str:
    """Return the line that a command tells which Ctrl-C ended."""
    return f"interrupted. {_kept}" if _kept else "interrupted"


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
                self._restore.append(_watch(self._on_hang, PATIENCE))
        return self

    def __exit__(self, *_: object) -> None:
        while self._restore:
            self._restore.pop()()

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True


@contextmanager
def deferred() -> Iterator[None]:
    """A context that Ctrl-C does not break off: it raises KeyboardInterrupt behind it."""
    with Interrupt() as interrupt:
        yield
    if interrupt.asked:
        raise KeyboardInterrupt


class Hurry:
    """A context that ends the process when Ctrl-C is not answered within `HURRY`.

    Ctrl-C raises KeyboardInterrupt between two lines of Python, and compiled code has none: a
    kernel or a solver at work would keep the user waiting. What is written is written whole, so
    nothing is lost by ending. The exit code is 130.
    """

    def __enter__(self) -> Self:
        self._restore: Callable[[], None] | None = None
        self._hook = sys.unraisablehook
        if threading.current_thread() is threading.main_thread():
            self._restore = _watch(_end_process, HURRY)
            sys.unraisablehook = self._unraisable
        return self

    def _unraisable(self, lost: sys.UnraisableHookArgs) -> None:
        """Keep quiet of a Ctrl-C that went into a callback of a library and was lost there."""
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            self._hook(lost)

    def __exit__(self, *_: object) -> None:
        if self._restore is not None:
            self._restore()
            sys.unraisablehook = self._hook


def leave(code: int) -> NoReturn:
    """End this process and its workers at once; what was told is passed on first.

    Taking down a process with compiled code in it takes a second, and nobody waits for that after
    Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # the reader of a pipe has gone
            stream.flush()
    _end_workers()
    os._exit(code)


def _end_workers() -> None:
    if "multiprocessing" in sys.modules:  # else there are none, and importing it takes time
        import multiprocessing

        for child in multiprocessing.active_children():
            child.kill()


def _end_process() -> None:
    """End this process and its workers at once, with the exit code of an interrupted one."""
    _end_workers()
    shown = "\r\033[2K\033[?25h" if os.isatty(2) else ""  # no line or bar, and the cursor is back
    os.write(2, f"{shown}{message()}\n".encode())
    os._exit(INTERRUPTED)


def _watch(on_hang: Callable[[], None], patience: float) -> Callable[[], None]:
    """Start a thread that the C part of signal handling wakes, whatever the main one does.

    Returns what ends the thread; `on_hang` is called when that comes later than `patience` s after
    Ctrl-C.
    """
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    left = threading.Event()

    def wait() -> None:
        while received := ours.recv(1):
            if received[0] == signal.SIGINT and not left.wait(patience):
                on_hang()

    watcher = threading.Thread(target=wait, name="bristle-interrupt", daemon=True)
    watcher.start()

    def restore() -> None:
        signal.set_wakeup_fd(before)
        left.set()
        theirs.shutdown(socket.SHUT_WR)  # forked processes may hold its end open
        theirs.close()
        watcher.join()
        ours.close()

    return restore

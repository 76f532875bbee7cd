"""Modules that a command needs later, imported while compiled code is at work."""

from __future__ import annotations

import importlib
import threading
from contextlib import suppress


def import_ahead(*names: str) -> None:
    """Import modules in a thread of their own; what cannot be imported is told where it is needed.

    Parameters
    ----------
    names : whole names, as in "bristle.draw.style"
    """

    def bring() -> None:
        for name in names:
            with suppress(Exception):
                importlib.import_module(name)

    # No daemon: an end of the process in the middle of an import would bring it down.
    threading.Thread(target=bring, name="bristle-imports").start()

"""Modules that FMUs in Python bring into this interpreter: threads come and go one at a time.

An import takes its module out of `sys.modules` for a moment and fails if it is gone meanwhile. So
who instantiates an FMU, or removes what one has left, holds the lock.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from threading import RLock

LOCK = RLock()


def forget(left: Callable[[str, object], bool]) -> None:
    """Remove modules from this interpreter, once no other thread imports any.

    Parameters
    ----------
    left : callable
        Name and module to whether it goes.
    """
    with LOCK:
        for name, module in list(sys.modules.items()):
            if left(name, module):
                sys.modules.pop(name, None)

"""The same work on several things at once: compiled forces leave Python's lock while they run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from os import cpu_count
from typing import TypeVar

Given = TypeVar("Given")
Found = TypeVar("Found")


def in_threads(work: Callable[[Given], Found], items: Sequence[Given]) -> list[Found]:
    """Return what a function makes of each item, in their order, on as many threads as cores.

    Each thread tells and is watched as the one that calls.

    Parameters
    ----------
    work : called with an item; results must not depend on which of them is done first
    items : what it is called with
    """
    with ThreadPoolExecutor(cpu_count()) as pool:
        at_work = [pool.submit(copy_context().run, work, item) for item in items]
        return [one.result() for one in at_work]

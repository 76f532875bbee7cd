"""Compiles plain functions with everything that they call, and keeps the machine code.

numba asks for callees that are compiled themselves. Here the globals of a function are walked and
every plain function among them is compiled, so that the laws stay free of any decorator. numba's
own cache checks one source file only and would keep an edited effect's old force: so the folder of
the cache is named by the digest of all laws and effects.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import numba
import numpy as np

from ..physics.effect import EFFECTS
from ..resources import cache_folder

_PACKAGE = Path(__file__).resolve().parent.parent


def compiled(function: Callable[..., Any]) -> Any:
    """Return the function compiled by numba, together with all that it calls, cached on disk."""
    folder = cache_folder() / "numba" / digest()
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        return numba.njit(cache=True, error_model="numpy")(_closed(function, {}))
    finally:
        numba.config.CACHE_DIR = before


@cache
def _library() -> bytes:
    content = hashlib.sha256()
    for text in (numba.__version__, np.__version__):
        content.update(text.encode())
    for folder in ("physics", "control", "compiled"):
        for path in sorted((_PACKAGE / folder).rglob("*.py")):
            content.update(path.read_bytes())
    return content.digest()


def digest() -> str:
    """Return the digest of everything that decides the machine code, 16 hexadecimal digits."""
    content = hashlib.sha256(_library())
    for name, effect in sorted(EFFECTS.items()):
        content.update(name.encode())
        content.update(Path(inspect.getfile(effect)).read_bytes())
    return content.hexdigest()[:16]


def _closed(function: Any, done: dict[int, Any]) -> FunctionType:
    """Return a copy of a function in whose globals every plain function is compiled."""
    namespace = dict(function.__globals__)
    for name in _names(function.__code__):
        value = namespace.get(name)
        if isinstance(value, FunctionType):
            if id(value) not in done:
                done[id(value)] = numba.njit(error_model="numpy")(_closed(value, done))
            namespace[name] = done[id(value)]
    copy = FunctionType(
        function.__code__, namespace, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__module__ = function.__module__
    copy.__qualname__ = function.__qualname__
    return copy


def _names(code: CodeType) -> set[str]:
    nested = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*(_names(inner) for inner in nested))

"""Compiles plain functions with everything that they call, and keeps the machine code.

numba asks for callees that are compiled themselves. Here the globals of a function are walked and
every plain function among them is compiled, so that the laws stay free of any decorator. numba's
own cache checks one source file only and would keep an edited effect's old force: so the folder of
the cache is named by the digest of all functions that are compiled together.

Machine code that is read from disk finds its callees by their names, in whatever code is there
already. numba tells namesakes apart by a number that counts anew in each process: after a new
effect, code from another process called the functions of the library without it. So every name
ends in that digest.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from threading import Lock
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from ..physics.generate import with_globals
from .files import cache_folder
from .interrupt import deferred
from .progress import tell

with deferred():  # an import of numba that Ctrl-C breaks off is never made good in this process
    import numba
    from numba import _dynfunc
    from numba.core import event, ir, types
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import CompilerBase, DefaultPassBuilder
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.compiler_machinery import register_pass
    from numba.core.errors import NumbaError
    from numba.core.registry import cpu_target
    from numba.core.typed_passes import NativeLowering
    from numba.core.untyped_passes import InlineInlinables
    from numba.extending import intrinsic


@contextmanager
def _scopes_kept() -> Iterator[None]:
    """Let copies of code keep the scope of its variables.

    Each block of a callee that becomes part of its caller is copied by itself, and with it, each
    time, the scope that all its blocks have in common, of which nothing is used: that was a third
    of the time that the coupled engine takes to compile.
    """
    there = hasattr(ir.Scope, "__deepcopy__")
    if not there:
        ir.Scope.__deepcopy__ = lambda scope, memo: scope
    try:
        yield
    finally:
        if not there:
            del ir.Scope.__deepcopy__


@register_pass(mutates_CFG=True, analysis_only=False)
class _Inline(InlineInlinables):  # type: ignore[misc]
    """Puts callees into their callers, as numba does."""

    _name = "bristle_inline"

    def run_pass(self, state: Any) -> Any:
        with _scopes_kept():
            return super().run_pass(state)


class _Linked(JITCodeLibrary):  # type: ignore[misc]
    """Code that callers take in: it is optimised there, and becomes machine code there alone."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lower(NativeLowering):  # type: ignore[misc]
    """Makes code of a function as numba does, but of a callee none that could be called by itself.

    That was a sixth of the time, and was never run.
    """

    _name = "bristle_lower"

    def run_pass(self, state: Any) -> Any:
        if state.flags.no_cpython_wrapper:
            state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
            state.flags.no_compile = True
        done = super().run_pass(state)
        if state.flags.no_compile:
            state.library.finalize()
            made, held = state["cr"], (state.library,)
            name = made.fndesc.qualname
            key = _dynfunc.make_function(made.fndesc.lookup_module(), name, "", 0, made.env, held)
            state.targetctx.insert_user_function(key, made.fndesc, held)
            state["cr"] = made._replace(cfunc=key)
        return done


_OURS = {InlineInlinables: _Inline, NativeLowering: _Lower}


class _Compiler(CompilerBase):  # type: ignore[misc]
    """numba's compiler, with passes of our own."""

    def define_pipelines(self) -> list[Any]:
        found = DefaultPassBuilder.define_nopython_pipeline(self.state)
        found.passes = [(_OURS.get(one, one), text) for one, text in found.passes]
        found.finalize()
        return [found]


# Python's arrays outlive every call, so compiled code need not count references to them.
_OPTIONS = {"error_model": "numpy", "_nrt": False, "pipeline_class": _Compiler}

# Callees are never called from Python.
_CALLEE = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}

NAMING = "names end in the digest"
"""How functions are named in machine code: what was named otherwise is not read."""

_NUMBERS = (bool, int, float, str, tuple)


_MAKES_TUPLE = tuple.__new__


@intrinsic  # type: ignore[untyped-decorator]
def _record(typing: Any, kind: Any, values: Any) -> Any:
    """Make a named tuple from a tuple, as tuple.__new__ does in Python: both lie alike."""
    made = types.containers.BaseTuple.from_types(values.types, kind.instance_class)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return arguments[1]

    return made(kind, values), code


class _CompileEvents(event.Listener):  # type: ignore[misc]
    """Tells that numba compiles, which may take a minute; what it finds on disk it only reads."""

    def on_start(self, event: Any) -> None:
        tell("compiling, once")

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _CompileEvents())

# numba asks for the folder of its cache in a global of its own, more than once per function.
_FOLDER = Lock()

_compiled: dict[tuple[str, tuple[str, ...], Path | None], Any] = {}


def compiled(
    function: Callable[..., Any], inline: tuple[str, ...] = (), *, keep: bool = True
) -> Any:
    """Return the function compiled by numba, together with all that it calls, cached on disk.

    Parameters
    ----------
    function : callable
        It and its callees take arrays and make none.
    inline : tuple of str
        Callees that become part of their callers, each as MODULE.NAME with the module's last name:
        best for short ones and for those with one caller, which would otherwise be translated by
        themselves and with it again.
    keep : bool
        Whether to keep the machine code on disk.

    Returns
    -------
    callable
        The same one for the same digest; the function itself under `BRISTLE_JIT=off`.
    """
    if os.environ.get("BRISTLE_JIT") == "off":
        return function
    _import_the_rest()
    name = digest(function)
    folder = _folder(name) if keep else None
    with _FOLDER:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(folder or "")
        try:
            if (name, inline, folder) not in _compiled:
                root = _closed(function, {}, inline, name)
                made = numba.njit(cache=folder is not None, nogil=True, **_OPTIONS)(root)
                _compiled[name, inline, folder] = made
            return _compiled[name, inline, folder]
        finally:
            numba.config.CACHE_DIR = before


@cache
def _import_the_rest() -> None:
    """Import what numba imports as it first compiles or reads machine code, two hundred modules.

    One thread at a time, and none beside one that compiles: both take from the same generators.
    """
    with deferred(), global_compiler_lock:
        cpu_target.typing_context.refresh()
        cpu_target.target_context.refresh()


class RefusedError(Exception):
    """A function that numba cannot compile; the text is numba's."""


def library_text(
    function: Callable[..., Any], examples: Sequence[Any], inline: tuple[str, ...] = ()
) -> tuple[str, str]:
    """Return LLVM's text of a function with all that it calls, and the function's name there.

    Parameters
    ----------
    function, inline
        As in `compiled`.
    examples : sequence
        Arguments of the types that it is compiled for.

    Raises
    ------
    RefusedError
        If numba cannot compile it.
    """
    _import_the_rest()
    kinds = tuple(numba.typeof(one) for one in examples)
    try:
        dispatcher = numba.njit(**_CALLEE)(_closed(function, {}, inline))
        dispatcher.compile(kinds)
    except NumbaError as error:
        raise RefusedError(str(error)) from error
    found = dispatcher.overloads[kinds]
    return found.library.get_llvm_str(), found.fndesc.llvm_func_name


def kept(function: Callable[..., Any]) -> bool:
    """Return whether machine code of a function is on disk, or cannot be kept there."""
    folder = _folder(digest(function))
    return folder is None or any(folder.rglob("*.nbi"))


def _folder(name: str) -> Path | None:
    """Return where machine code of a digest is kept, or None where nothing can be written."""
    folder = cache_folder() / "numba" / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def digest(function: Callable[..., Any]) -> str:
    """Return the digest of a function and all that it calls, 16 hexadecimal digits."""
    content = hashlib.sha256()
    for text in (NAMING, numba.__version__, np.__version__, sys.version):
        content.update(text.encode())
    for reached in _reached(function, set()):
        # numba's files name the modules of their functions and cannot be read without them.
        content.update(reached.__module__.encode())
        for part in _parts(reached.__code__):
            content.update(part)
        for name in sorted(_names(reached.__code__)):
            value = reached.__globals__.get(name)
            if isinstance(value, _NUMBERS):
                content.update(f"{name}={value!r}".encode())
            elif isinstance(value, type):  # a named tuple: its fields decide where numbers are
                content.update(f"{name}={getattr(value, '_fields', '')!r}".encode())
    return content.hexdigest()[:16]


def _reached(function: Any, seen: set[int]) -> Iterator[FunctionType]:
    """Yield a function and every plain function among the globals that it names, each once."""
    seen.add(id(function))
    yield function
    for name in sorted(_names(function.__code__)):
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType) and id(value) not in seen:
            yield from _reached(value, seen)


def _parts(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield repr((code.co_names, code.co_varnames)).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _parts(constant)
        else:
            yield repr(constant).encode()


def _closed(
    function: Any, done: dict[int, Any], inline: tuple[str, ...], end: str = ""
) -> FunctionType:
    """Return a copy of a function in whose globals every plain function is compiled.

    Parameters
    ----------
    function : what is copied
    done : compiled functions by the `id` of the plain one, filled
    inline : as in `compiled`
    end : of the names of the copies in machine code
    """
    changed: dict[str, Any] = {}
    for name in _names(function.__code__):
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType):
            if id(value) not in done:
                short = f"{value.__module__.rpartition('.')[2]}.{value.__qualname__}"
                how = "always" if short in inline else "never"
                done[id(value)] = numba.njit(inline=how, **_CALLEE)(
                    _closed(value, done, inline, end)
                )
            changed[name] = done[id(value)]
        elif value is _MAKES_TUPLE:
            changed[name] = _record
    copy = with_globals(function, changed)
    copy.__qualname__ = f"{function.__qualname__}_{end}" if end else function.__qualname__
    return copy


def _names(code: CodeType) -> set[str]:
    nested = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*(_names(inner) for inner in nested))

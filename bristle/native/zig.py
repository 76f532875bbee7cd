"""Runs zig, which brings a C compiler and the C libraries of every platform, from PyPI."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from ..errors import BuildError
from ..resources import cache_folder
from .platforms import WEB, Platform

_OPTIONS = (
    "-O2", "-g0", "-std=c11", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-Wall",
    "-Wextra", "-Wno-unused-parameter",
)  # fmt: skip
_OPTIONS_WEB = (
    "-O2", "-fno-unroll-loops", "-mexec-model=reactor", "-s", "-Wl,--export=__heap_base",
)  # fmt: skip
"""Unrolled loops make functions that browsers run a fifth slower."""


@cache
def version() -> str:
    """Return the version of zig.

    Raises
    ------
    BuildError
        If it is not installed.
    """
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError(
            "what runs without Python, a native FMU or a page with sliders, is compiled by zig, "
            "which is not installed: `pip install bristle[native]` is right."
        )
    return importlib.metadata.version("ziglang")


def tools() -> str:
    """Return what decides the bytes that a source becomes: compiler and options."""
    return f"zig {version()} {' '.join(_OPTIONS)}"


def tools_web() -> str:
    """Return what decides the bytes of a WebAssembly module: compiler and options."""
    return f"{tools()} {' '.join(_OPTIONS_WEB)}"


def folder() -> Path:
    """Return where compiled parts are kept, made if missing.

    Raises
    ------
    BuildError
        If nothing can be written there.
    """
    found = cache_folder() / "native"
    try:
        found.mkdir(parents=True, exist_ok=True)
        writable = os.access(found, os.W_OK)
    except OSError as error:
        raise BuildError(_not_writable(found, error.strerror or str(error))) from None
    if not writable:
        raise BuildError(_not_writable(found, "read-only"))
    return found


def _not_writable(where: Path, why: str) -> str:
    return (
        f"{where}: cannot be written ({why}); compilers need room. "
        "BRISTLE_CACHE=FOLDER chooses another one."
    )


def compile_object(source: Path, target: Path, platform: Platform) -> None:
    """Compile one source into an object file.

    Raises
    ------
    BuildError
        Naming the platform, with what the compiler says.
    """
    _run(["-c", str(source), "-o", str(target)], platform)


def link(sources: Sequence[Path], headers: Path, target: Path, platform: Platform) -> None:
    """Compile and link sources and objects into a shared library.

    Parameters
    ----------
    sources : sequence of Path
    headers : Path
        Folder with what they include.
    target : Path
        The library.
    platform : Platform

    Raises
    ------
    BuildError
        Naming the platform, with what the compiler says.
    """
    libraries = [f"-l{name}" for name in platform.libraries]
    name = ["-Wl,-install_name,@rpath/" + target.name] if platform.suffix == ".dylib" else []
    given = ["-shared", "-s", *name, f"-I{headers}", *map(str, sources), *libraries]
    _run([*given, "-o", str(target)], platform)


def link_web(sources: Sequence[Path], macros: Sequence[str], target: Path) -> None:
    """Compile and link sources into a WebAssembly module that a page calls as it likes.

    Parameters
    ----------
    sources : sequence of Path
        C.
    macros : sequence of str
        Options of the compiler that define what the C asks for.
    target : Path

    Raises
    ------
    BuildError
        With what the compiler says.
    """
    _run([*_OPTIONS_WEB, *macros, *map(str, sources), "-o", str(target)], WEB)


def _run(arguments: Sequence[str], platform: Platform) -> None:
    version()
    kept = str(folder() / "zig")
    environment = {**os.environ, "ZIG_GLOBAL_CACHE_DIR": kept, "ZIG_LOCAL_CACHE_DIR": kept}
    command = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target, *_OPTIONS]
    child = subprocess.run(
        [*command, *arguments], env=environment, capture_output=True, text=True, check=False
    )
    if child.returncode != 0:
        said = [line for line in child.stderr.splitlines() if "error" in line] or [child.stderr]
        raise BuildError(f"{platform.name}: zig cannot compile this: {said[0].strip()[:500]}")

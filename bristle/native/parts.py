"""The compiled parts of native FMUs, kept by the digest of what they are made of."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..fmu.plan import Plan
from ..progress import Count, tell
from . import zig
from .platforms import Platform
from .prepare import compile_functions

SHIM = Path(__file__).resolve().parent / "shim"
"""Folder with the C that all native FMUs share."""


def shim_files(fmi: int = 2) -> list[Path]:
    """Return the files of the C that all native FMUs of FMI 2.0, or all of FMI 3.0, share."""
    others = tuple(f"fmi{one}" for one in (2, 3) if one != fmi)
    return [path for path in sorted(SHIM.iterdir()) if not path.name.startswith(others)]


def shim_sources(fmi: int = 2) -> list[Path]:
    """Return those of these files that are compiled, not included by others."""
    return [path for path in shim_files(fmi) if path.suffix == ".c"]


def shim_digest(fmi: int = 2) -> str:
    """Return the digest of the C that native FMUs of a version share, and of what compiles it."""
    content = hashlib.sha256(zig.tools().encode())
    for path in shim_files(fmi):
        content.update(path.name.encode() + path.read_bytes())
    return content.hexdigest()


def functions_text(what: Plan, functions: str) -> Path:
    """Return the file with the C of a component's functions, compiled if need be.

    Parameters
    ----------
    what : Plan
    functions : str
        Their digest.

    Raises
    ------
    BuildError
        If the compiler refuses a function; if the cache cannot be written.
    """
    from filelock import FileLock

    kept = zig.folder() / f"{functions}.c"
    if kept.is_file():
        return kept
    with FileLock(kept.with_suffix(".lock")):  # two who need it do not both compile it

        def compile_text(path: Path) -> None:
            tell(f"compiling the functions of {what.name}, once")
            compile_functions(what, functions, path)

        return keep(kept, compile_text)


def library(name: str, text: Path, table: str, platform: Platform, fmi: int = 2) -> bytes:
    """Return the bytes of a component's library for a platform.

    Parameters
    ----------
    name : str
        Of the FMU.
    text : Path
        The C of its functions.
    table : str
        C source of its tables.
    platform : Platform
    fmi : int
        2 or 3: the version of FMI whose functions it exports.

    Raises
    ------
    BuildError
        If it cannot be compiled; if the cache cannot be written.
    """
    content = hashlib.sha256()
    for part in (zig.tools(), platform.target, text.stem, name, table, shim_digest(fmi)):
        content.update(part.encode())
    kept = zig.folder() / f"{content.hexdigest()[:24]}{platform.suffix}"
    if kept.is_file():
        return kept.read_bytes()
    functions = keep(
        zig.folder() / f"{_object_digest(text, platform)}.o",
        lambda path: zig.compile_object(text, path, platform),
    )

    def link(path: Path) -> None:
        source = path.parent / "tables.c"
        source.write_text(table, encoding="utf-8")
        own = path.parent / f"{name}{platform.suffix}"
        sources = [*shim_sources(fmi), source, functions]
        zig.link(sources, SHIM, own, platform)
        own.replace(path)

    return keep(kept, link).read_bytes()


def _object_digest(text: Path, platform: Platform) -> str:
    return hashlib.sha256(f"{zig.tools()} {platform.target} {text.stem}".encode()).hexdigest()[:24]


def keep(path: Path, make: Callable[[Path], None]) -> Path:
    """Return a file of the cache; if it is not there, `make` writes it into a folder of its own."""
    if not path.is_file():
        with tempfile.TemporaryDirectory(dir=path.parent) as temporary:
            part = Path(temporary) / path.name
            make(part)
            part.replace(path)
    return path


def libraries(
    name: str, text: Path, table: str, platforms: Sequence[Platform], fmi: int = 2
) -> dict[Platform, bytes]:
    """Return the libraries of a component for several platforms, compiled side by side.

    Parameters
    ----------
    name, text, table, fmi
        As in `library`.
    platforms : sequence of Platform

    Raises
    ------
    BuildError
        What is wrong with the first platform that fails, once all are done.
    """
    tell(f"compiling {name} for {len(platforms)} platform(s)")
    count = Count(f"{name}: library", len(platforms))

    def counted(one: Platform) -> bytes:
        made = library(name, text, table, one, fmi)
        count.done(one.name)
        return made

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        runs = [pool.submit(counted, one) for one in platforms]
    return {one: run.result() for one, run in zip(platforms, runs, strict=True)}

"""The C compiler and its platforms: zig, from PyPI."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import platform
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..core.files import cache_folder
from ..core.text import install
from ..errors import BuildError


@dataclass(frozen=True)
class Platform:
    """A platform of native FMUs.

    Attributes
    ----------
    name
        As users name it.
    target
        As the compiler names it.
    folder
        Folder in the archive of an FMU of FMI 2.0. That standard names none for ARM: on macOS both
        processors share one folder and one library, on Linux it is called as in FMI 3.0.
    folder_fmi3
        Folder in the archive of an FMU of FMI 3.0.
    suffix
        Ending of a shared library.
    libraries
        What the library is linked with, besides the C library.
    """

    name: str
    target: str
    folder: str
    folder_fmi3: str
    suffix: str
    libraries: tuple[str, ...] = ()

    def place(self, identifier: str, fmi: int) -> str:
        """Return where an FMU of FMI 2.0 or 3.0 keeps its library for this platform."""
        folder = self.folder_fmi3 if fmi == 3 else self.folder
        return f"binaries/{folder}/{identifier}{self.suffix}"


PLATFORMS = {
    one.name: one
    for one in (
        Platform("linux64", "x86_64-linux-gnu.2.17", "linux64", "x86_64-linux", ".so", ("m",)),
        Platform("win64", "x86_64-windows-gnu", "win64", "x86_64-windows", ".dll"),
        Platform("darwin64", "x86_64-macos", "darwin64", "x86_64-darwin", ".dylib"),
        Platform(
            "aarch64-linux", "aarch64-linux-gnu.2.17", "aarch64-linux", "aarch64-linux", ".so",
            ("m",),
        ),
        Platform("aarch64-darwin", "aarch64-macos", "darwin64", "aarch64-darwin", ".dylib"),
    )
}  # fmt: skip
"""The platforms by name."""
_HERE = {
    ("linux", "x86_64"): "linux64",
    ("linux", "aarch64"): "aarch64-linux",
    ("win32", "x86_64"): "win64",
    ("darwin", "x86_64"): "darwin64",
    ("darwin", "aarch64"): "aarch64-darwin",
}


def here() -> Platform:
    """Return the platform that this process runs on.

    Raises
    ------
    BuildError
        If there are no native FMUs for it.
    """
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    name = _HERE.get((sys.platform, machine))
    if name is None:
        raise BuildError(
            f"native FMUs do not run on {machine} under {sys.platform}; Python FMUs may."
        )
    return PLATFORMS[name]


WEB = Platform("web", "wasm32-wasi", "", "", ".wasm")
"""What a page of the web runs; no FMU is made for it."""


def chosen(names: Iterable[str]) -> tuple[Platform, ...]:
    """Return the platforms of these names, all of them if there are none.

    Raises
    ------
    BuildError
        Naming one that is not known.
    """
    wanted = list(dict.fromkeys(name for given in names for name in given.split(",") if name))
    for name in wanted:
        if name not in PLATFORMS:
            raise BuildError(f'no platform is named "{name}". There are: {", ".join(PLATFORMS)}.')
    return tuple(PLATFORMS[name] for name in wanted or PLATFORMS)


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
            f"which is not installed:  {install('native')}"
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

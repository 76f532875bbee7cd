"""The platforms that native FMUs are built for."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterable
from dataclasses import dataclass

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

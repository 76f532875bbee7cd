"""Options of the commands that write FMUs: those that need no Python, and for which platforms."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..fmu.build import Plan


def add_native(parser: argparse.ArgumentParser) -> None:
    """Add --native and --platform."""
    text = "FMUs that need no Python: compiled, with a library for each platform"
    parser.add_argument("--native", action="store_true", help=text)
    parser.add_argument(
        "--platform",
        dest="platforms",
        action="append",
        default=[],
        metavar="NAME",
        help="with --native: linux64, win64, darwin64, aarch64-linux or aarch64-darwin, several "
        "with commas between; else all of them",
    )


def builder(arguments: argparse.Namespace) -> Callable[[Plan, Path], Path]:
    """Return what builds a planned FMU into a folder.

    Raises
    ------
    BuildError
        If a platform is not known, or is named without --native.
    """
    from ..errors import BuildError

    if arguments.native:
        from ..native.build import build as build_native
        from ..native.platforms import chosen

        return partial(build_native, platforms=chosen(arguments.platforms))
    if arguments.platforms:
        raise BuildError("--platform goes with --native: FMUs in Python hold all that they can.")
    from ..fmu.build import build

    return build

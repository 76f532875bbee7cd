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
    """Add --native, --platform and --fmi."""
    text = "FMUs that need no Python: compiled, with a library for each platform"
    parser.add_argument("--native", action="store_true", help=text)
    parser.add_argument(
        "--platform",
        dest="platforms",
        action="append",
        default=[],
        metavar="NAME",
        help="with --native: linux64, win64, darwin64, aarch64-linux or aarch64-darwin, several "
        "separated by commas; else all",
    )
    text = "with --native: include the C sources in the FMU, for hosts that compile them"
    parser.add_argument("--sources", action="store_true", help=text)
    text = "version of FMI; 3 needs --native (default: 2)"
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=2, help=text)


def builder(arguments: argparse.Namespace) -> Callable[[Plan, Path], Path]:
    """Return what builds a planned FMU into a folder.

    Raises
    ------
    BuildError
        If a platform is not known; if what belongs to --native is asked for without it.
    """
    from ..errors import BuildError

    if arguments.native:
        from ..native.build import build as build_native
        from ..native.platforms import chosen

        return partial(
            build_native,
            platforms=chosen(arguments.platforms),
            fmi=arguments.fmi,
            sources=arguments.sources,
        )
    if arguments.platforms:
        raise BuildError("--platform goes with --native: FMUs in Python hold all that they can.")
    if arguments.sources:
        raise BuildError("--sources goes with --native: FMUs in Python are their own sources.")
    if arguments.fmi != 2:
        raise BuildError("--fmi 3 goes with --native: FMUs in Python follow FMI 2.0.")
    from ..fmu.build import build

    return build

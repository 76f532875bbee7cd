"""Write a scenario as an SSP package for other tools, and estimate their coupling error.

OMSimulator, libcosim, Ecos and others run it without bristle. They hold inputs over a step, which
causes a coupling error: the command prints its size, and a step that keeps it below 0.5 %.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ._options import Parser, builder, print_json

if TYPE_CHECKING:
    from ..engine.coupling_error import Expected
    from ..system.ssp_write import ExportedPackage

HELP = "write a scenario as an SSP package for other tools"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle export-ssp`."""
    text = "scenario file, or name of a stock scenario"
    parser.add_argument("scenario", metavar="SCENARIO", help=text)
    text = "file of the package; an older one is replaced; else NAME.ssp in the current folder"
    parser.add_out(text, "FILE.ssp")
    parser.add_overrides()
    text = "do not estimate the coupling error in other tools (runs nothing)"
    parser.flag("--no-coupling-error", text)
    parser.add_native()
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Export; print the file, what is otherwise elsewhere, and the error to expect there."""
    from ..system.library import run_name
    from ..system.overrides import parse_overrides
    from ..system.scenario import load_scenario, resolve_scenario
    from ..system.ssp_write import export_ssp

    overrides = parse_overrides(arguments.overrides)
    file = resolve_scenario(arguments.scenario)
    scenario = load_scenario(file, overrides)
    target = arguments.out or Path(f"{run_name(file, overrides)}.ssp")
    exported = export_ssp(scenario, target, builder(arguments))
    if not arguments.json:  # at once: the error below takes a while
        print("\n".join([str(exported.file), *exported.notes]), flush=True)
    expected: tuple[Expected, ...] = ()
    if not arguments.no_coupling_error:
        from ..core.progress import tell
        from ..engine.cosimulation import Cosimulation, ignore
        from ..engine.coupling_error import again_by, expect

        tell("estimating the coupling error in other tools (--no-coupling-error leaves it out)")
        expected = expect(scenario, again_by(Cosimulation(listen=ignore, progress=True)))
    if arguments.json:
        _print_json(exported, expected)
    elif expected:
        print(f"Coupling error to expect at {1e3 * scenario.step:g} ms:")
        for one in expected:
            print(f"  {one}")
    return 0


def _print_json(exported: ExportedPackage, expected: tuple[Expected, ...]) -> None:
    from dataclasses import asdict

    answer = {
        "files": [str(exported.file.absolute())],
        "notes": list(exported.notes),
        "coupling_error": [asdict(one) for one in expected],
    }
    print_json(answer)

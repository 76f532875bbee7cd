"""Write a study's present model as an FMU, its values baked in, and a scenario that uses it."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..findings import command
from ._consent import add_trust
from ._native import add_native, builder

HELP = "write a study's model as an FMU and a scenario that uses it"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle export`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where to write; else export/ in the study"
    )
    add_native(parser)
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Export; say what was written, and what was left out."""
    from ..bridge.export import export_study
    from ..study.study import Study

    found = export_study(Study(arguments.folder), arguments.out, builder(arguments))
    if arguments.json:
        import json

        answer = {
            "fmu": str(found.fmu.absolute()),
            "scenario": str(found.scenario.absolute()),
            "files": [str(file.absolute()) for file in found.files],
            "run": found.run,
            "notes": list(found.notes),
        }
        print(json.dumps(answer, indent=2))
        return 0
    print(f"{found.fmu}: the damper with the model's values.")
    print(f"{found.scenario}: applies the motion of {found.run} to it.")
    print(f"Run it:  {command('run', found.scenario)}")
    for note in found.notes:
        print(f"{note[:1].upper()}{note[1:]}")
    return 0

"""Convert an SSP package of another tool to a scenario, with its FMUs beside it.

`bristle run FILE.ssp` runs a package directly; you can change, check and extend a scenario.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..findings import command

HELP = "convert an SSP package of another tool to a scenario"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle import-ssp`."""
    parser.add_argument("package", type=Path, metavar="FILE.ssp", help="SSP 1.0 or 2.0")
    text = "folder of scenario and FMUs; else NAME/ in the current folder"
    parser.add_argument("-o", "--out", type=Path, metavar="FOLDER", help=text)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Import; print the files, and what was taken to be or left aside."""
    from ..scenario.import_ssp import import_ssp

    made = import_ssp(arguments.package, arguments.out or Path(arguments.package.stem))
    if arguments.json:
        import json

        answer = {
            "scenario": str(made.scenario.absolute()),
            "fmus": [str(file.absolute()) for file in made.fmus],
            "notes": list(made.notes),
        }
        print(json.dumps(answer, indent=2))
        return 0
    print(f"{made.scenario}: a scenario of {len(made.fmus)} FMUs.")
    for note in made.notes:
        print(note)
    print(f"Run it:  {command('run', made.scenario)}")
    return 0

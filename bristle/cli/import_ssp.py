"""Convert an SSP package of another tool to a scenario, with its FMUs beside it.

`bristle run FILE.ssp` runs a package directly; you can change, check and extend a scenario.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.text import command, cut_short
from ._options import Parser, print_json

HELP = "convert an SSP package of another tool to a scenario"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle import-ssp`."""
    parser.add_argument("package", type=Path, metavar="FILE.ssp", help="SSP 1.0 or 2.0")
    text = "folder of scenario and FMUs; else NAME/ in the current folder"
    parser.add_out(text)
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Import; print the files, what was taken to be or left aside, and what a check finds.

    Return 0, or 2 where the scenario cannot run as it is.
    """
    from ..system.scenario import check_scenario
    from ..system.ssp_import import import_ssp
    from .check import print_findings

    made = import_ssp(arguments.package, arguments.out or Path(arguments.package.stem))
    findings = check_scenario(made.scenario)
    wrong = any(finding.level == "error" for finding in findings)
    if arguments.json:
        answer = {
            "scenario": str(made.scenario.absolute()),
            "fmus": [str(file.absolute()) for file in made.fmus],
            "notes": [note.text for note in made.notes],
            "findings": [finding.as_dict("line", "level", "text") for finding in findings],
        }
        print_json(answer)
        return 2 if wrong else 0
    begin = f"{made.scenario}: a scenario of {len(made.fmus)} FMUs."
    end = "" if wrong else f"Run it:  {command('run', made.scenario)}"
    room = [" " * 100] * 4 if findings else []  # what a check finds keeps four lines
    notes = cut_short("\n".join(note.text for note in made.notes), [begin, end, *room], "--json")
    around = [begin, *notes.splitlines(), *([end] if end else [])]
    print("\n".join(around[: len(around) - bool(end)]))
    if findings:
        print_findings(str(made.scenario), findings, around)
    if end:
        print(end)
    return 2 if wrong else 0

"""Check any FMU of FMI 2.0 or 3.0: the tests, their results, and the rules of the standard."""

from __future__ import annotations

import argparse

from ._options import Parser

HELP = "check an FMU against FMI 2.0 or 3.0 co-simulation"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle conform`."""
    parser.epilog = (
        "Exit codes: 0 no rule is broken (a lack of robustness is reported; it counts with "
        "--strict), 1 a rule is broken, "
        "2 the file cannot be opened, or is not safe to open. The FMU's code runs on this machine: "
        "in separate processes, with a time limit, with your rights."
    )
    parser.add_argument("fmu", metavar="FILE.fmu", help="an FMU of any tool")
    parser.add_details()
    parser.add_json("print the table as JSON")
    parser.flag("--strict", "exit with 1 for a lack of robustness as well")
    text = "time limit of one call in s (default: %(default)g)"
    parser.option("--timeout", "S", text, type=float, default=20.0)
    text = "try this probe only; may be repeated"
    parser.add_argument("--only", action="append", metavar="PROBE", help=text)
    parser.option("--beside", "OTHER.fmu", "another FMU to load into the same process")


def main(arguments: argparse.Namespace) -> int:
    """Judge one FMU; return 0 if it conforms, 1 if it breaks a rule."""
    from ..conformance import conform
    from ..view import terminal

    report = conform(arguments.fmu, arguments.timeout, only=arguments.only, beside=arguments.beside)
    if arguments.json:
        print(report.to_json())
    else:
        print(terminal.text(report.view(), details=arguments.details))
    return 0 if (report.ok if arguments.strict else report.conforms) else 1

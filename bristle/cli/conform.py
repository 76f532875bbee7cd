"""Check any FMU of FMI 2.0 or 3.0: the tests, their results, and the rules of the standard."""

from __future__ import annotations

import argparse

from ._options import add_details, add_json

HELP = "check an FMU against FMI 2.0 or 3.0 co-simulation"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle conform`."""
    parser.epilog = (
        "Exit codes: 0 no rule is broken (a lack of robustness is reported; it counts with "
        "--strict), 1 a rule is broken, "
        "2 the file cannot be opened, or is not safe to open. The FMU's code runs on this machine: "
        "in separate processes, with a time limit, with your rights."
    )
    parser.add_argument("fmu", metavar="FILE.fmu", help="an FMU of any tool")
    add_details(parser)
    add_json(parser, "print the table as JSON")
    text = "exit with 1 for a lack of robustness as well"
    parser.add_argument("--strict", action="store_true", help=text)
    text = "time limit of one call in s (default: %(default)g)"
    parser.add_argument("--timeout", type=float, default=20.0, metavar="S", help=text)
    text = "try this probe only; may be repeated"
    parser.add_argument("--only", action="append", metavar="PROBE", help=text)
    text = "another FMU to load into the same process"
    parser.add_argument("--beside", metavar="OTHER.fmu", help=text)


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

"""The paper's figures and its comparison of controllers: `python -m benchmarks paper --help`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bristle.errors import BristleError
from bristle.view.style import FORMATS

from .figures import make, paper_figures

if TYPE_CHECKING:
    from .comparison.make import Report


def main(given: Sequence[str]) -> int:
    """Run one of the two commands; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks paper", description="Repeat Shirazi et al. (2012)."
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    figures = commands.add_parser("figures", help="draw its figures, each with its numbers as CSV")
    figures.add_argument(
        "name", nargs="?", choices=[*paper_figures(), "all"], metavar="NAME",
        help="a figure, or all; else a list",
    )  # fmt: skip
    figures.add_argument("--engine", choices=("compiled", "fmu"), default="compiled")
    figures.add_argument("--format", choices=FORMATS, default="png", help="of the images")
    figures.set_defaults(main=_figures)
    compared = commands.add_parser(
        "controllers", help="compare its controllers: Tables IV and V, figures, a list of claims"
    )
    compared.add_argument(
        "--newhall",
        type=Path,
        metavar="FILE.AT2",
        help="record of Newhall Fire Station 360 deg, Northridge 1994; no package contains it",
    )
    compared.set_defaults(main=_controllers)
    for name, command in (("figures", figures), ("controllers", compared)):
        command.add_argument(
            "--out", type=Path, default=Path("results", name), metavar="FOLDER",
            help=f"folder of what is written; older files are replaced; else results/{name}/",
        )  # fmt: skip
    arguments = parser.parse_args(given)
    try:
        arguments.main(arguments)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _figures(arguments: argparse.Namespace) -> None:
    """List the figures, or draw one of them or all."""
    known = paper_figures()
    if arguments.name is None:
        for figure in known.values():
            print(f"{figure.name:16}  {figure.number:9}  {figure.about}")
        print("Draw one with  python -m benchmarks paper figures NAME , all of them with  all .")
        return
    for name in known if arguments.name == "all" else [arguments.name]:
        files = make(
            name, arguments.out, engine=arguments.engine, format=arguments.format, progress=True
        )
        print(f"{name}: {known[name].about}")
        for file in files:
            print(f"  {file.absolute()}")


def _controllers(arguments: argparse.Namespace) -> None:
    """Design, run, judge, draw and write; print the verdicts."""
    from .comparison.make import make

    show(make(arguments.out, arguments.newhall, progress=True))


def show(report: Report) -> None:
    """Print what leaves the stroke and the verdict of each statement; the files have the tables."""
    from .comparison.page import stroke_lines, stroke_text

    beyond = stroke_text(report.comparison)
    if beyond:
        print(beyond)
        print("".join(f"  {line}\n" for line in stroke_lines(report.comparison)))
    if report.comparison.left_out:
        print(f"Left out. {report.comparison.left_out}\n")
    print("The paper's statements")
    for statement, verdict in report.ledger:
        print(f"{statement.number:3}  {verdict.verdict:14}  {statement.text}")
        print(f"{'':21}{verdict.measured}")
    print(f"\n{report.seconds:.0f} s; {len(report.files)} files in {report.folder}")
    print(f"  {report.files[0]}")

"""The paper's figures and its comparison of controllers: `python -m benchmarks paper --help`."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bristle.errors import BristleError
from bristle.view.style import FORMATS

if TYPE_CHECKING:
    import pandas as pd

    from .comparison.make import Report

_WIDTH = 14
"""Of a column of numbers."""


def main(given: Sequence[str]) -> int:
    """Run one of the two commands; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks paper", description="Repeat Shirazi et al. (2012)."
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    figures = commands.add_parser("figures", help="draw its figures, each with its numbers as CSV")
    figures.add_argument("name", nargs="?", metavar="NAME", help="a figure, or all; else a list")
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
        command.add_argument("--json", action="store_true", help="print the answer as JSON")
    arguments = parser.parse_args(given)
    try:
        code: int = arguments.main(arguments)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return error.exit_code
    return code


def _figures(arguments: argparse.Namespace) -> int:
    """List the figures, or draw one of them or all."""
    from .figures import find_figure, make, paper_figures

    known = paper_figures()
    if arguments.name is None:
        if arguments.json:
            rows = [{"name": f.name, "paper": f.number, "about": f.about} for f in known.values()]
            print(json.dumps(rows, indent=2))
            return 0
        for figure in known.values():
            print(f"{figure.name:16}  {figure.number:9}  {figure.about}")
        print("Draw one with  python -m benchmarks paper figures NAME , all of them with  all .")
        return 0
    written = {}
    for name in known if arguments.name == "all" else [arguments.name]:
        find_figure(name)
        files = make(
            name, arguments.out, engine=arguments.engine, format=arguments.format, progress=True
        )
        written[name] = [str(file.absolute()) for file in files]
        if not arguments.json:
            print(f"{name}: {known[name].about}")
            for file in files:
                print(f"  {file}")
    if arguments.json:
        print(json.dumps({"engine": arguments.engine, "written": written}, indent=2))
    return 0


def _controllers(arguments: argparse.Namespace) -> int:
    """Design, run, judge, draw and write; print tables and verdicts."""
    from .comparison.make import make

    report = make(arguments.out, arguments.newhall, progress=True)
    if arguments.json:
        print(json.dumps(answer(report), indent=2, allow_nan=False))
    else:
        show(report)
    return 0


def answer(report: Report) -> dict[str, Any]:
    return {
        "seconds": round(report.seconds, 1),
        "left_out": report.comparison.left_out,
        "beyond_stroke": _beyond_stroke(report),
        "tables": {
            name: table.to_dict(orient="records") for name, table in report.tables.items()
        },
        "ledger": [
            {
                "number": s.number, "section": s.section, "statement": s.text,
                "verdict": v.verdict, "measured": v.measured, "decided_by": s.rule, "why": v.why,
            }
            for s, v in report.ledger
        ],
        "files": [str(path.absolute()) for path in report.files],
    }  # fmt: skip


def _beyond_stroke(report: Report) -> list[dict[str, Any]]:
    """Return the runs in which the base leaves the damper's stroke, with the drift [mm]."""
    from .comparison.experiment import BEYOND
    from .comparison.page import beyond_stroke

    names = ["motion", "intensity [g]", "law", "peak base drift [mm]", BEYOND]
    rows: Any = beyond_stroke(report.comparison)[names].to_dict(orient="records")
    return list(rows)


def show(report: Report) -> None:
    from .comparison.page import stroke_lines, stroke_text

    for name, table in report.tables.items():
        _print_table(name, table)
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


def _print_table(name: str, table: pd.DataFrame) -> None:
    """Print Table IV or V; drifts beyond the damper's stroke are marked."""
    from .comparison.experiment import BEYOND
    from .comparison.page import MARK, TABLES, columns, shown

    kind, title = TABLES[name]
    window = ", over the record as published" if kind == "rms" else ""
    marked = f"; {MARK} beyond the damper's stroke" if kind == "peak" else ""
    print(f"{title}{window}{marked}")
    listed = columns(kind)
    wrapped = [textwrap.wrap(heading, _WIDTH - 2) for heading, _ in listed]
    for line in zip_longest(*wrapped, fillvalue=""):
        print(f"{'':25}" + "".join(f"{text:>{_WIDTH}}" for text in line))
    groups: Any = table.groupby(["motion", "intensity [g]"], sort=False)
    for (motion, g), group in groups:
        print(f"{motion} {g:g} g")
        for _, row in group.iterrows():
            texts = [shown(row[column], column) for _, column in listed]
            # The mark stands beside the column, so that the digits stay below each other.
            first = texts[0] + (MARK if row.get(BEYOND, 0.0) > 0.0 else " ")
            print(f"  {row['law']:23}{first:>{_WIDTH + 1}}{texts[1]:>{_WIDTH - 1}}"
                  + "".join(f"{text:>{_WIDTH}}" for text in texts[2:]))  # fmt: skip
    print()

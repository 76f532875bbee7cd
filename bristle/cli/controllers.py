"""Compare controllers: those of the paper, or your own on your building and ground motions.

Without options the command runs the paper's comparison: Tables IV and V, figures, a list of its
claims. With --motions and --controller it compares any controllers and constant voltages on any
building and damper: tables, a report, and a scenario of each case.
"""

from __future__ import annotations

import argparse
import textwrap
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _controllers

if TYPE_CHECKING:
    import pandas as pd

    from ..paper.comparison.make import Report

HELP = "compare controllers: those of the paper, or any on your building and ground motions"

_WIDTH = 14
"""Of a column of numbers."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle controllers`."""
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="folder of report, tables and figures; older ones are replaced; else "
        "results/controllers/, or results/comparison/BUILDING/ for your own",
    )
    parser.add_argument(
        "--newhall",
        type=Path,
        metavar="FILE.AT2",
        help="record of Newhall Fire Station 360 deg, Northridge 1994; no package contains it",
    )
    _controllers.add_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Design, run, judge, draw and write; print tables and verdicts."""
    if _controllers.asked(arguments):
        return _controllers.main(arguments)
    from ..interrupt import keeps
    from ..paper.comparison.make import make

    keeps("No report was written. The same command begins anew.")
    folder = arguments.out or Path("results", "controllers")
    report = make(folder, arguments.newhall, progress=True)
    if arguments.json:
        import json

        print(json.dumps(_answer(report), indent=2, allow_nan=False))
    else:
        _print(report)
    return 0


def _answer(report: Report) -> dict[str, Any]:
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
    from ..paper.comparison.experiment import BEYOND
    from ..paper.comparison.tables import beyond_stroke

    names = ["motion", "intensity [g]", "law", "peak base drift [mm]", BEYOND]
    rows: Any = beyond_stroke(report.comparison)[names].to_dict(orient="records")
    return list(rows)


def _print(report: Report) -> None:
    from ..paper.comparison.tables import stroke_lines, stroke_text

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
    from ..paper.comparison.experiment import BEYOND
    from ..paper.comparison.tables import MARK, TABLES, columns, shown

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

"""Run the paper's comparison of controllers: Tables IV and V, figures, a ledger of its claims."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

    from ..paper.comparison.make import Report

HELP = "run the paper's comparison of controllers and judge its statements"

_COLUMNS = (
    ("base drift [mm]", "{:.1f}/{:.2f}"),
    ("floor 1 acceleration [m/s2]", "{:.2f}/{:.3f}"),
    ("floor 2 acceleration [m/s2]", "{:.2f}/{:.3f}"),
    ("damper force [N]", "{:.2f}/{:.2f}"),
    ("voltage [V]", "{:.1f}/{:.2f}"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle controllers`."""
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("results", "controllers"),
        metavar="FOLDER",
        help="where report, tables and figures go, in place of older ones; else "
        "results/controllers/",
    )
    parser.add_argument(
        "--newhall",
        type=Path,
        metavar="FILE.AT2",
        help="record of Newhall Fire Station 360 deg, Northridge 1994; no package has it",
    )
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Design, run, judge, draw and write; print tables and verdicts."""
    from ..paper.comparison.make import make

    report = make(arguments.out, arguments.newhall, progress=not arguments.json)
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


def _print(report: Report) -> None:
    for title, table in zip(
        ("Table IV: El Centro", "Table V: Northridge"), report.tables.values(), strict=False
    ):
        _print_table(title, table)
    if report.comparison.left_out:
        print(f"Left out. {report.comparison.left_out}\n")
    print("The paper's statements")
    for statement, verdict in report.ledger:
        print(f"{statement.number:3}  {verdict.verdict:14}  {statement.text}")
        print(f"{'':21}{verdict.measured}")
    print(f"\n{report.seconds:.0f} s; {len(report.files)} files in {report.folder}")
    print(f"  {report.files[0]}")


def _print_table(title: str, table: pd.DataFrame) -> None:
    """Print a table, peak/RMS of each quantity."""
    print(f"{title}; peak/RMS, over the record as published")
    head = "".join(f"{name:>29}" for name, _ in _COLUMNS)
    groups: Any = table.groupby(["motion", "intensity [g]"], sort=False)
    for (motion, g), group in groups:
        print(f"{f'{motion} {g:g} g':23}{head}")
        for _, row in group.iterrows():
            cells = "".join(
                f"{form.format(row[f'peak {name}'], row[f'rms {name}']):>29}"
                for name, form in _COLUMNS
            )
            print(f"  {row['law']:21}{cells}")
    print()

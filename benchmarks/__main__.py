"""Measure every figure and print one table: `python -m benchmarks [NAME ...] [--json]`.

A benchmark is a module of this folder with `run() -> list[Row]`; names choose among them. `blind`
named first has options of its own (`python -m benchmarks blind --help`): it takes hours, and the
table here shows what its last run found. So have `compatibility`, `cost`, `exits`, `honest`,
`instruments`, `lab`, `labels`, `law_free`, `learned`, `limits`, `native`, `plan`, `prediction` and
`calibrate`, whose own table shows what each value of the rule trades. `paper` and `train` are
commands of their own: they repeat the paper that bristle follows, and train the stock policy.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from dataclasses import asdict

from . import __path__ as folder
from ._rows import Row

COUNTED = (
    "compatibility", "cost", "exits", "honest", "instruments", "lab", "labels", "law_free",
    "learned", "limits", "native", "plan", "prediction", "stated",
)  # fmt: skip
"""Benchmarks whose own options say how many cases are made, or where."""


def main() -> int:
    """Print the table; return 0 whatever is reached, for times depend on the machine."""
    if sys.argv[1:2] == ["blind"] and len(sys.argv) > 2:
        from .blind import main as blind

        return blind(sys.argv[2:])
    if sys.argv[1:2] == ["paper"]:
        from .paper.command import main as paper

        return paper(sys.argv[2:])
    if sys.argv[1:2] == ["train"]:
        from .training.train import main as train

        return train(sys.argv[2:])
    if sys.argv[1:2] == ["characterise"] and len(sys.argv) > 2:
        from .characterise import main as characterise

        return characterise(sys.argv[2:])
    if sys.argv[1:2] == ["calibrate"] and all(one[:1] == "-" for one in sys.argv[2:3]):
        from .calibrate import main as calibrate

        return calibrate(sys.argv[2:])
    if sys.argv[1:2] == ["laws"] and len(sys.argv) > 2:
        from .laws import main as laws

        show(laws(sys.argv[2:]))
        return 0
    if sys.argv[1:2] and sys.argv[1] in COUNTED and len(sys.argv) > 2:
        asked: int = importlib.import_module(f"benchmarks.{sys.argv[1]}").main(sys.argv[2:])
        return asked
    found = pkgutil.iter_modules(folder)
    names = [m.name for m in found if not (m.ispkg or m.name.startswith("_"))]
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(names))
    if unknown:
        parser.error(f"no benchmark is named {', '.join(unknown)}; there are: {', '.join(names)}")
    rows: list[Row] = []
    for name in arguments.names or names:
        print(f"{name} ...", file=sys.stderr)
        rows += importlib.import_module(f"benchmarks.{name}").run()
    if arguments.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
    else:
        show(rows)
    return 0


def show(rows: list[Row]) -> None:
    """Print figures with a goal as a table, where `ratio` is measured / goal; then the others."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in ("figure", "measured", "goal"):
        table.add_column(column, overflow="fold")
    table.add_column("ratio", justify="right")
    table.add_column("")
    lines = []
    for row in rows:
        if row.ratio is None:
            lines.append(f"{row.name}: {row.measured}")
        else:
            verdict = "reached" if row.ratio <= 1 else "missed"
            table.add_row(row.name, row.measured, row.goal, f"{row.ratio:.3f}", verdict)
        if row.note:
            lines.append(f"{row.name}: {row.note}")
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = 150  # a pipe or a file has no edge to fold at
    if table.row_count:
        console.print(table)
    if lines:
        console.print("", "Reported beside:", *lines, sep="\n")


if __name__ == "__main__":
    sys.exit(main())

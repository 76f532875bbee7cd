"""Measure every figure and print one table: `python -m benchmarks [NAME ...] [--json]`.

A benchmark is a module of this folder with `run() -> list[Row]`; names choose among them. Some have
options of their own, told by `python -m benchmarks NAME --help`: what takes hours is made by them,
and the table here shows what their last run found. `calibrate` alone prints its own table, of what
each value of the rule trades. `paper` and `train` are commands of their own: they repeat the paper
that bristle follows, and train the stock policy.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from dataclasses import asdict

from . import __path__ as folder
from ._rows import Row, show

COMMANDS = {"paper": "paper.command", "train": "training.train"}
"""What has no row, and where its `main` is."""


def main() -> int:
    """Print the table; return 0 whatever is reached, for times depend on the machine."""
    found = pkgutil.iter_modules(folder)
    names = [m.name for m in found if not (m.ispkg or m.name.startswith("_"))]
    first, *others = sys.argv[1:] or [""]
    if first in COMMANDS or (first in names and [*others] not in ([], ["--json"])):
        module = importlib.import_module(f"benchmarks.{COMMANDS.get(first, first)}")
        if hasattr(module, "main"):
            code: int = module.main(others)
            return code
    if [first, *others] == ["calibrate"]:
        from .calibrate import main as calibrate

        return calibrate([])
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


if __name__ == "__main__":
    sys.exit(main())

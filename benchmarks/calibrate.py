"""What each value of the decision rule trades: `python -m benchmarks calibrate --help`.

Makes the trials of cases whose seeds no reported figure uses, keeps them in the cache folder, and
decides them anew with each value of the rule moved, one at a time. Started again, it continues;
deciding anew fits nothing and takes seconds.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks._calibrate import page, trials
from benchmarks._calibrate.trials import Stored
from benchmarks._rows import Row, write_between

CASES = 240
BUILDINGS = 40
PAGE = Path(__file__).resolve().parents[1] / "docs" / "decision_rule.md"


def options() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks calibrate", description=__doc__)
    parser.add_argument("--cases", type=int, default=0, help=f"how many to make ({CASES}: an hour)")
    parser.add_argument(
        "--structure", type=int, default=0, metavar="N", help=f"how many buildings ({BUILDINGS})"
    )
    parser.add_argument("--seed", type=int, help="of the plan; else that of the last cases, or 0")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--afresh", action="store_true", help="make again what other code made")
    parser.add_argument("--docs", action="store_true", help=f"write the table into {PAGE.name}")
    return parser


def main(given: Sequence[str] | None = None) -> int:
    """Make what is missing, decide all that is stored, print the table; 130 if interrupted."""
    arguments = options().parse_args(given)
    last = _last()
    seed = int(last["seed"]) if arguments.seed is None else int(arguments.seed)
    same = seed == int(last["seed"])
    bench = max(arguments.cases, int(last["cases"]) * same)
    structure = max(arguments.structure, int(last["structure"]) * same)
    tasks = trials.make_plan(seed, bench, structure)
    code = 0
    try:
        if arguments.cases or arguments.structure or arguments.afresh:
            _remember(seed, bench, structure)
            for line in trials.make_missing(tasks, arguments.workers, arguments.afresh):
                print(line, file=sys.stderr)
    except KeyboardInterrupt:
        code = 130
    cases = trials.stored_of(tasks)
    if not cases:
        print("No trials are stored: python -m benchmarks calibrate --cases 48", file=sys.stderr)
        return 1
    block = page.text(page.both(cases), cases, seed)
    print(block)
    if arguments.docs:
        write_between(PAGE, page.BEGIN, page.END, block)
    return code


def _last() -> dict[str, int]:
    """Return seed and sizes of the plan that was last made."""
    path = trials.folder() / "last.json"
    none = {"seed": 0, "cases": 0, "structure": 0}
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else none


def _remember(seed: int, cases: int, structure: int) -> None:
    path = trials.folder() / "last.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"seed": seed, "cases": cases, "structure": structure})
    path.write_text(text, encoding="utf-8")


def run() -> list[Row]:
    """Return what today's rule does on the stored trials; it makes none."""
    last = _last()
    tasks = trials.make_plan(last["seed"], last["cases"], last["structure"])
    cases: list[Stored] = trials.stored_of(tasks)
    if not cases:
        return [Row("decision rule", "not calibrated: python -m benchmarks calibrate --cases 48")]
    rows = []
    for name, found in page.both(cases).items():
        rule = page.RULES[name]
        today = next(row for row in found if row.value == getattr(rule, row.field))
        counts = ", ".join(
            f"{what} {of(today)[0]}/{of(today)[1]}" for what, of in page.COLUMNS.items()
        )
        rows.append(Row(f"decision rule, {name}", counts))
    return rows


if __name__ == "__main__":
    sys.exit(main())

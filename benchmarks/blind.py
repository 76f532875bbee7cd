"""Hidden effects found by the package and by its peers: `python benchmarks/blind.py --help`.

Prints one table from cases that an independent generator makes from a fresh seed, with Wilson
intervals. Every finished case is appended to a record in the cache folder at once; started again,
the run continues there. Cases of an older version of the diagnoser are asked again.
"""

from __future__ import annotations

import argparse
import os
import secrets
import sys
import time
from collections.abc import Sequence
from pathlib import Path

if __package__ in (None, ""):  # `python benchmarks/blind.py` finds only this folder
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks import peers
from benchmarks._blind import plan, record, table, work
from benchmarks._blind.plan import CASES
from benchmarks._rows import Row, show

BUILDINGS = 40
SHARED = 40


def options() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(prog="python benchmarks/blind.py", description=__doc__)
    parser.add_argument("--cases", type=int, default=CASES, help=f"how many ({CASES}; 40 is quick)")
    parser.add_argument(
        "--structure", type=int, metavar="N", default=BUILDINGS,
        help=f"how many on buildings, on top ({BUILDINGS}; every second without a load cell)",
    )  # fmt: skip
    parser.add_argument(
        "--shared", type=int, metavar="N", default=SHARED,
        help=f"how many with an end stop in the damper of a bench, on top ({SHARED})",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, help="of the plan; else that of the last run")
    parser.add_argument("--fresh", action="store_true", help="draw a seed that nobody has seen")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--only", choices=plan.KINDS, default="", help="cases of one kind")
    parser.add_argument("--part", choices=work.PARTS, action="append", help="default: both")
    parser.add_argument("--times", action="store_true", help="also time fresh processes")
    parser.add_argument("--report", action="store_true", help="count what is finished; run nothing")
    return parser


def seed_of(arguments: argparse.Namespace) -> int:
    """Return the seed to run: given, or of the last record, or fresh from the system."""
    if arguments.seed is not None:
        if not 0 <= arguments.seed < plan.RESERVED:
            raise SystemExit(
                f"--seed {arguments.seed}: from {plan.RESERVED} on seeds are calibration's; from 0 "
                "to that is right."
            )
        return int(arguments.seed)
    last = None if arguments.fresh else record.newest()
    return secrets.randbelow(plan.RESERVED) if last is None else last


def chosen(
    seed: int, cases: int, buildings: int, only: str = "", shared: int = 0
) -> list[plan.Task]:
    """Return the tasks of the bench's plan and, on top, those of the plans of their own.

    Parameters
    ----------
    seed : of all plans
    cases, buildings, shared : how many on the bench, on buildings, and of the kind "shared"
    only : one of `plan.KINDS`, or "" for all
    """
    apart = only in ("structure", "shared")  # which have numbers of cases of their own
    tasks = [] if apart else plan.make_plan(seed, cases, only)
    if only in ("", "structure"):
        tasks = tasks + plan.make_structure_plan(seed, buildings)
    return tasks + (plan.make_shared_plan(seed, shared) if only in ("", "shared") else [])


def main(given: Sequence[str] | None = None) -> int:
    """Run what is not finished and print the table; 130 if interrupted, with all that is kept."""
    arguments = options().parse_args(given)
    seed = seed_of(arguments)
    tasks = chosen(seed, arguments.cases, arguments.structure, arguments.only, arguments.shared)
    path = record.path_of(seed)
    print(f"seed {seed}, {len(tasks)} cases, record {path}", file=sys.stderr)
    code = 0
    if not arguments.report:
        try:
            advance(tasks, path, arguments)
        except KeyboardInterrupt:
            code = 130
    times = _times(path, measure=arguments.times)
    rows = table.figures(work.finished(path, tasks, "diagnosis"), times)
    rows += peers.figures(work.finished(path, tasks, "peers"))
    show([one.row() for one in rows])
    return code


def advance(tasks: list[plan.Task], path: Path, arguments: argparse.Namespace) -> None:
    """Do the parts of cases that are not in the record yet, and say how far it is."""
    digests = {p: d for p, d in work.digests().items() if p in (arguments.part or work.PARTS)}
    done = record.finished(path, digests)
    jobs = [
        (part, task, digest)
        for task in tasks
        for part, digest in digests.items()
        if task.key not in done[part] and part in work.parts_of(task)
    ]
    begun = time.monotonic()
    for number, line in enumerate(work.local(jobs, arguments.workers), 1):
        record.append(path, line)
        left = (time.monotonic() - begun) / number * (len(jobs) - number)
        if sys.stderr.isatty():
            print(f"\r{number}/{len(jobs)}, {left / 60:.0f} min left  ", end="", file=sys.stderr)


def _times(path: Path, measure: bool) -> dict[str, float]:
    """Return the times of fresh processes, kept in the record with the diagnoser's digest."""
    digest = work.digests()["diagnosis"]
    if measure:
        from benchmarks._blind import clock

        record.append(
            path, {"part": "times", "key": "", "digest": digest, "times": clock.measure()}
        )
    kept = record.finished(path, {"times": digest})["times"]
    return dict(kept[""]["times"]) if "" in kept else {}


def run() -> list[Row]:
    """Return the rows of the last record for `python -m benchmarks`; it runs nothing, for hours."""
    seed = record.newest()
    if seed is None:
        return [Row("hidden effects found", "not run yet: python benchmarks/blind.py")]
    tasks = chosen(seed, CASES, BUILDINGS, shared=SHARED)
    path = record.path_of(seed)
    lines = work.finished(path, tasks, "diagnosis")
    rows = table.figures(lines, _times(path, measure=False))
    return [one.row() for one in rows if one.group == "main" and one.value is not None]


if __name__ == "__main__":
    sys.exit(main())

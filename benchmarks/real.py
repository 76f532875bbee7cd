"""Measurements that others published: `python benchmarks/real.py --data ../shared/data`.

Prints what the package finds on them, held-out errors before and after, the reference numbers that
come with the data; and on the sets that measured a force, what models without physics and the best
law of the literature leave on the same held-out runs. The data are read where they are; a set that
is not there is a row that says so. What was found is kept, by the digest of the package's code.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # `python benchmarks/real.py` finds only this folder
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks import _measured, _reach
from benchmarks._answers import Answers
from benchmarks._measured import LAWS, Row
from benchmarks._rows import Row as Figure

CASES: tuple[tuple[str, Callable[[Path, str], Row], str, tuple[str, ...]], ...] = (
    ("MR damper on a crank (UTFPR)", _measured.utfpr, "mr_damper_utfpr", LAWS),
    ("MR damper, velocity to force", _measured.velocity_force, "mr_damper_mathworks", LAWS),
    ("friction rig", _measured.friction, "friction_tribometer", LAWS),
    (
        "building on a shake table", _measured.shake_table, "shake_table_base_isolated",
        ("linear",),
    ),
)  # fmt: skip

VERSION = 2
"""Raised where `_measured` finds other numbers or words: answers of before are then none."""


def rows(data: Path, only: str = "") -> list[Row]:
    """Return the rows of all sets, or of those whose folder's name holds `only`."""
    makers = {folder: make for _, make, folder, _ in CASES}

    def answer(folder: str, law: str, _version: int) -> dict[str, object]:
        return asdict(makers[folder](data / folder, law))

    chosen = [one for one in _cases() if only in f"{one[1]}/{one[2]}"]
    there = [(folder, law, VERSION) for _, folder, law in chosen if (data / folder).is_dir()]
    found = Answers("real").complete(there, answer)
    out = []
    for title, folder, law in chosen:
        if (data / folder).is_dir():
            out.append(Row(**found[json.dumps([folder, law, VERSION])]))
        else:
            out.append(Row(title, law, skipped=f"not run: there is no {folder}"))
    return out


def _cases() -> Iterator[tuple[str, str, str]]:
    """Yield title, folder and law of every row."""
    return ((title, folder, law) for title, _, folder, laws in CASES for law in laws)


def markdown(found: Sequence[Row], beside: Sequence[_reach.Beside] = ()) -> str:
    """Return the tables, and below them what each row says in words."""
    lines = [
        "| data | law | error before | z | error after | z | with | verdict |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in found:
        if row.skipped:
            lines.append(f"| {row.data} | {row.law} | {row.skipped} | | | | | |")
            continue
        lines.append(
            f"| {row.data} | {row.law} | {row.before:.1%} | {row.z_before:.3g} | {row.after:.1%} | "
            f"{row.z_after:.3g} | {row.after_with} | {row.verdict} |"
        )
    if beside:
        lines += ["", *_reach.markdown(beside)]
    for row in found:
        if row.skipped:
            continue
        lines += ["", f"### {row.data}, {row.law}", ""]
        lines.append(f"Fitted to {row.fitted}; held out: {row.held_out}. {row.seconds:.0f} s.")
        if np.isfinite(row.least_squares):
            lines.append(
                f"The bare law by least squares leaves {row.least_squares:.1%}. The force's noise, "
                f"as estimated: {row.noise}."
            )
        lines += ["", f"- **Verdict**: {row.words}", f"- **Reference**: {row.reference}."]
    return "\n".join([*lines, ""])


def run() -> list[Figure]:
    """Return the ratios to the floor, as far as this code's answers are there."""
    return _reach.figures(_reach.beside(_reach.kept(), kept()))


def kept() -> list[Row]:
    """Return the rows of the laws given, as far as this code's answers are there."""
    done = Answers("real").kept()
    keys = (json.dumps([folder, law, VERSION]) for _, folder, law in _cases())
    return [Row(**done[key]) for key in keys if key in done]


def main(given: Sequence[str] | None = None) -> int:
    """Run the sets that are there and print the tables."""
    parser = argparse.ArgumentParser(prog="python benchmarks/real.py", description=__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"), help="their folder")
    parser.add_argument("--only", default="", metavar="TEXT", help="sets or laws whose name has it")
    parser.add_argument("--kept", action="store_true", help="draw what is kept, and fit nothing")
    arguments = parser.parse_args(given)
    found = kept() if arguments.kept else rows(arguments.data, arguments.only)
    made = _reach.kept() if arguments.kept else _reach.answers(arguments.data, arguments.only)
    print(markdown(found, _reach.beside(made, found)))
    return 0


if __name__ == "__main__":
    sys.exit(main())

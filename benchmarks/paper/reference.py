"""Writes the controllers of the reference design: `python -m benchmarks.paper.reference --out DIR`.

The controllers that the FMUs carry unless told otherwise are these, with a coarser table: `--rows
121 --out bristle/component/data` is a fifth of the size and, on El Centro at nominal 0.2 and 0.6 g,
moves peaks of acceleration and force by less than 0.2 %, of drift by 0.5 % at most.

A solver's matrices are not unique, and a switching law feels their last digits. So tests that
compare runs use these files, made once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from bristle.component.controller_file import KINDS
from bristle.errors import BristleError, DesignError
from bristle.synthesis import design
from bristle.synthesis.task import Scheduling, Task

TITLE = "reference design of the base-isolated two-storey model"


def write(folder: Path, rows: int | None = None, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Design and write hinf.json, lpv.json and lqg.json, or those of `kinds`; return their paths.

    Parameters
    ----------
    folder : Path
        Where they go; made if need be.
    rows : int, optional
        Rows of the LPV controller's table; else the design's own.
    kinds : sequence of str
        What is designed.

    Raises
    ------
    DesignError
        If a design fails or a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DesignError(f"{folder}: cannot be made ({error.strerror}).") from error
    paths = []
    for kind in kinds:
        path = folder / f"{kind}.json"
        scheduling = Scheduling() if rows is None else Scheduling(rows=rows)
        design(Task(kind, title=TITLE, scheduling=scheduling)).controller.save(path)
        paths.append(path)
    return paths


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper.reference", description=TITLE)
    parser.add_argument("--out", type=Path, required=True, help="folder of the controller files")
    parser.add_argument("--rows", type=int, help="rows of the LPV controller's table")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=KINDS, help="what is designed")
    given = parser.parse_args(arguments)
    try:
        for path in write(given.out, given.rows, given.only):
            print(path)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

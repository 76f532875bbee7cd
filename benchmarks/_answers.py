"""Answers of a benchmark that takes long: kept line by line, by the digest of the code."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from bristle.core.files import cache_folder

from ._blind import work
from ._blind.cases import ROOT, digest_of
from ._rows import Row, show

Answer = dict[str, Any]

TOGETHER = 4
"""Cases that share a process: machine code stays in it, some 36 MB for each curve that is tried."""


Rows = Callable[[dict[str, Answer]], list[Row]]
Commands = tuple[Callable[[], list[Row]], Callable[[Sequence[str]], int]]


def asked(
    name: str, text: str | None, kinds: Sequence[str], answer: Callable[..., Answer], rows: Rows,
    also: Sequence[str] = (), together: int = TOGETHER,
    of: Mapping[str, Sequence[str]] | None = None,
) -> Commands:  # fmt: skip
    """Return `run` and `main` of a benchmark whose cases take long.

    `run` returns the rows of what has been made so far; `main` makes what is missing and shows
    them.

    Parameters
    ----------
    name, text : of the benchmark, and what it says of itself
    kinds : of cases; `--KIND CASES` says how many there should be
    answer : called with kind and number of a case in another process; returns what is found
    rows : returns the figures of all answers
    also : packages of bristle that the answers rest on, beside those of a diagnosis
    together : cases that share a process
    of : the kinds that one option stands for
    """
    answers = Answers(name, also)

    def run() -> list[Row]:
        return rows(answers.kept())

    def main(given: Sequence[str]) -> int:
        parser = argparse.ArgumentParser(prog=f"python -m benchmarks {name}", description=text)
        for kind in kinds:
            parser.add_argument(f"--{kind}", type=int, default=0, metavar="CASES")
        chosen = vars(parser.parse_args(given))
        jobs = (
            (one, k)
            for kind in kinds
            for k in range(chosen[kind.replace("-", "_")])
            for one in (of or {}).get(kind, (kind,))
        )
        with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=together) as pool:
            show(rows(answers.complete(jobs, lambda *job: pool.submit(answer, *job).result())))
        return 0

    return run, main


class Answers:
    """The record of one benchmark in the cache folder; answers of other code are not in it."""

    def __init__(self, name: str, also: Sequence[str] = ()) -> None:
        self.name, self.also = name, also

    def path(self) -> Path:
        """Return the file of this code's answers."""
        folder = cache_folder() / self.name
        folder.mkdir(parents=True, exist_ok=True)
        files = [path for one in self.also for path in (ROOT / "bristle" / one).rglob("*.py")]
        more = digest_of(files)[:12] if files else ""
        return folder / f"{work.digests()['diagnosis']}{more}.jsonl"

    def kept(self) -> dict[str, Answer]:
        """Return the answers that are there, by key."""
        path = self.path()
        lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
        return {one.pop("key"): one for one in map(json.loads, lines)}

    def complete(
        self, jobs: Iterable[tuple[Any, ...]], answer: Callable[..., Answer]
    ) -> dict[str, Answer]:
        """Return the answers to all jobs; those that are missing are made, told and kept.

        Parameters
        ----------
        jobs : a job is what `answer` is called with, and what JSON can hold
        answer : returns what is found
        """
        done = self.kept()
        for job in jobs:
            key = json.dumps(job)
            if key not in done:
                done[key] = found = answer(*job)
                with self.path().open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"key": key, **found}) + "\n")
                print(key, found, file=sys.stderr)
        return done

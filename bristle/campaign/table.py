"""The table of runs: whole lines, so that a kill leaves what there was; quantiles, failures.

A CSV file whose head holds the ensemble's digest. While runs go on, lines stand in the order in
which they ended; once all are there, the file is replaced by one in the order of the runs.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.files import replaced_by, writing
from ..errors import EnsembleError, RunError
from .campaign import RunOutcome
from .ensemble_file import EnsemblePlan

if TYPE_CHECKING:
    import pandas as pd


NAME = "runs.csv"
_KIND = "# bristle ensemble"
_DIGEST = "# digest: "
DONE, FAILED = "done", "failed"


class RunsTable:
    """The file of an ensemble's runs, open for appending; with None as path it is kept in memory.

    Attributes
    ----------
    outcomes : dict
        Run number to what became of it, those of an earlier start included.
    """

    def __init__(self, plan: EnsemblePlan, path: Path | None, fresh: bool = False) -> None:
        self.plan = plan
        self.path = path
        self.outcomes: dict[int, RunOutcome] = {}
        self._file = -1
        if path is None:
            return
        with writing(path, EnsembleError):
            if path.exists() and not fresh:
                self.outcomes = _read(plan, path)
                self._rewrite()  # without a line cut short
            else:
                replaced_by(path, lambda new: new.write_bytes(_head(plan)))
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND)

    @property
    def left(self) -> list[int]:
        """The runs of the plan that are still to be made."""
        return [run for run in range(self.plan.runs) if run not in self.outcomes]

    def forget_failures(self) -> None:
        """Take runs that failed as not yet run."""
        kept = (one for one in self.outcomes.values() if not one.reason)
        self.outcomes = {one.run: one for one in kept}
        self._rewrite()

    def add(self, outcome: RunOutcome) -> None:
        """Keep what became of a run; it is on disk when this returns.

        Raises
        ------
        RunError
            If it cannot be written; what was before is kept.
        """
        self.outcomes[outcome.run] = outcome
        if self._file < 0:
            return
        line = memoryview(_line(self.plan, outcome))
        end = os.fstat(self._file).st_size
        try:
            while line:
                line = line[os.write(self._file, line) :]
        except OSError as error:
            os.ftruncate(self._file, end)
            raise RunError(
                f"{self.path}: cannot be written on ({error.strerror or error}); "
                f"{len(self.outcomes) - 1} runs are in it."
            ) from error

    def close(self, complete: bool) -> None:
        """Close the file; a complete one is put in the order of the runs."""
        if self._file < 0:
            return
        os.close(self._file)
        self._file = -1
        if complete:
            self._rewrite()

    def frame(self) -> pd.DataFrame:
        """Return the table: index run, columns status, reason, varied values, outputs."""
        import pandas as pd

        runs = sorted(self.outcomes)
        rows = [_row(self.plan, self.outcomes[run])[1:] for run in runs]
        index = pd.Index(runs, name="run")
        frame = pd.DataFrame(rows, index=index, columns=columns(self.plan)[1:])
        for name in (output.name for output in self.plan.outputs):
            frame[name] = frame[name].astype("float64")
        frame.attrs["units"] = _units(self.plan)
        return frame

    def _rewrite(self) -> None:
        if self.path is not None:
            lines = b"".join(_line(self.plan, self.outcomes[k]) for k in sorted(self.outcomes))
            was_open, self._file = self._file, -1
            if was_open >= 0:
                os.close(was_open)
            replaced_by(self.path, lambda new: new.write_bytes(_head(self.plan) + lines))
            if was_open >= 0:
                self._file = os.open(self.path, os.O_WRONLY | os.O_APPEND)


def columns(plan: EnsemblePlan) -> list[str]:
    """Return the names of the table's columns."""
    varied = [one.name for one in plan.varied]
    return ["run", "status", "reason", *varied, *(output.name for output in plan.outputs)]


def _units(plan: EnsemblePlan) -> dict[str, str]:
    """Return the unit of each number that is kept."""
    return {output.name: output.unit for output in plan.outputs}


def _row(plan: EnsemblePlan, outcome: RunOutcome) -> list[Any]:
    status = FAILED if outcome.reason else DONE
    numbers = outcome.numbers or (None,) * len(plan.outputs)
    return [outcome.run, status, outcome.reason, *plan.values(outcome.run).values(), *numbers]


def _line(plan: EnsemblePlan, outcome: RunOutcome) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(
        ["" if value is None else repr(value) if isinstance(value, float) else value
         for value in _row(plan, outcome)]
    )  # fmt: skip
    return text.getvalue().encode()


def _head(plan: EnsemblePlan) -> bytes:
    names = columns(plan)
    units = [_units(plan).get(name, "") for name in names]
    titles = io.StringIO()
    csv.writer(titles, lineterminator="\n").writerow(
        [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
    )
    title = json.dumps(plan.title, ensure_ascii=False)
    return f"{_KIND}\n{_DIGEST}{plan.digest()}\n# title: {title}\n{titles.getvalue()}".encode()


def _read(plan: EnsemblePlan, path: Path) -> dict[int, RunOutcome]:
    """Return the outcomes in a file; a last line that was cut short is left out.

    Raises
    ------
    EnsembleError
        If the file is of another ensemble, or damaged.
    """
    data = path.read_bytes()
    head = data.split(b"\n", 2)
    if head[0].decode(errors="replace") != _KIND or len(head) < 3:
        raise EnsembleError(f"{path}: is no runs table of bristle; another folder is right.")
    if head[1].decode(errors="replace") != _DIGEST + plan.digest():
        raise EnsembleError(
            f"{path}: its runs belong to another ensemble: {plan.file.name}, its scenario, "
            "a record or bristle itself has changed since. Use --fresh to start again, or another "
            "folder."
        )
    body = data[: data.rindex(b"\n") + 1].decode()
    rows = csv.reader(line for line in io.StringIO(body, newline="") if line[0] != "#")
    next(rows, None)
    outcomes = {}
    try:
        for row in rows:
            run, status, reason = int(row[0]), row[1], row[2]
            numbers = row[len(row) - len(plan.outputs) :]
            if status == FAILED:
                outcomes[run] = RunOutcome(run, reason=reason)
            else:
                outcomes[run] = RunOutcome(run, tuple(map(float, numbers)))
    except (ValueError, IndexError, csv.Error) as error:
        raise EnsembleError(
            f"{path}: damaged ({error}). Use --fresh to start again, or another folder."
        ) from None
    return outcomes


# What an ensemble says: quantiles of each output, and failures by their reason.


"""What the ensemble draws, beside effects that are left open."""
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Failure:
    """Failed runs of one kind: how many, the first one's number, and its reason in full."""

    count: int
    run: int
    reason: str


def quantiles(plan: EnsemblePlan, frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per output: unit, quantiles of the runs that are done, their number.

    Quantiles are linear between order statistics; without a run they are NaN.
    """
    import pandas as pd

    done = frame[frame["status"] == "done"]
    rows = []
    for output in plan.outputs:
        values = done[output.name].to_numpy()
        found = np.quantile(values, LEVELS) if len(values) else np.full(len(LEVELS), np.nan)
        rows.append([output.unit, *map(float, found), len(values), len(frame) - len(values)])
    titles = ["unit", *(f"{100 * level:g} %" for level in LEVELS), "done", "failed"]
    index = pd.Index([output.name for output in plan.outputs], name="output")
    return pd.DataFrame(rows, index=index, columns=titles)


def failures(outcomes: Iterable[RunOutcome]) -> list[Failure]:
    """Return the failures, most frequent first; reasons that differ in numbers alone are one."""
    found: dict[str, list[RunOutcome]] = {}
    for outcome in sorted(outcomes, key=lambda one: one.run):
        if outcome.reason:
            found.setdefault(_NUMBER.sub("#", outcome.reason), []).append(outcome)
    return sorted(
        (Failure(len(same), same[0].run, same[0].reason) for same in found.values()),
        key=lambda failure: (-failure.count, failure.run),
    )

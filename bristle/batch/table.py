"""The runs table: one line per finished run, appended whole, so that a kill leaves what there was.

A CSV file whose head holds the ensemble's digest. While runs go on, lines stand in the order in
which they ended; once all are there, the file is replaced by one in the order of the runs.
"""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import EnsembleError, RunError
from .plan import Outcome, Plan

if TYPE_CHECKING:
    import pandas as pd

NAME = "runs.csv"
_KIND = "# bristle ensemble"
_DIGEST = "# digest: "
DONE, FAILED = "done", "failed"
EFFECT = ("effect left open", "its size over the limit")
"""Columns of the effect that joins a run the second time it is made."""


class RunsTable:
    """The file of an ensemble's runs, open for appending; with None as path it is kept in memory.

    Attributes
    ----------
    outcomes : dict
        Run number to what became of it, those of an earlier start included.
    """

    def __init__(self, plan: Plan, path: Path | None, fresh: bool = False) -> None:
        self.plan = plan
        self.path = path
        self.outcomes: dict[int, Outcome] = {}
        self._file = -1
        if path is None:
            return
        try:
            if path.exists() and not fresh:
                self.outcomes = _read(plan, path)
                self._rewrite()  # without a line cut short
            else:
                self._replace(_head(plan))
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND)
        except OSError as error:
            raise EnsembleError(f"{path}: cannot be written ({error.strerror or error}).") from None

    def forget_failures(self) -> None:
        """Take runs that failed, alone or with an effect, as not yet run."""
        kept = (one for one in self.outcomes.values() if not (one.reason or one.lost))
        self.outcomes = {one.run: one for one in kept}
        self._rewrite()

    def add(self, outcome: Outcome) -> None:
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
        for name in self.plan.columns:
            frame[name] = frame[name].astype("float64")
        frame.attrs["units"] = _units(self.plan)
        return frame

    def _rewrite(self) -> None:
        if self.path is not None:
            lines = b"".join(_line(self.plan, self.outcomes[k]) for k in sorted(self.outcomes))
            was_open, self._file = self._file, -1
            if was_open >= 0:
                os.close(was_open)
            self._replace(_head(self.plan) + lines)
            if was_open >= 0:
                self._file = os.open(self.path, os.O_WRONLY | os.O_APPEND)

    def _replace(self, content: bytes) -> None:
        assert self.path is not None
        new = self.path.with_name(self.path.name + ".new")
        try:
            new.write_bytes(content)
            new.replace(self.path)
        finally:
            new.unlink(missing_ok=True)


def columns(plan: Plan) -> list[str]:
    """Return the names of the table's columns."""
    varied = [one.name for one in plan.varied]
    return ["run", "status", "reason", *varied, *(EFFECT if plan.left else ()), *plan.columns]


def _units(plan: Plan) -> dict[str, str]:
    """Return the unit of each number that is kept."""
    own = [output.unit for output in plan.outputs]
    return dict(zip(plan.columns, 2 * own if plan.left else own, strict=True))


def _row(plan: Plan, outcome: Outcome) -> list[Any]:
    status = FAILED if outcome.reason else DONE
    numbers = outcome.numbers or (None,) * len(plan.columns)
    drawn = [*plan.values(outcome.run).values(), *(plan.effect(outcome.run) if plan.left else ())]
    return [outcome.run, status, outcome.reason or outcome.lost, *drawn, *numbers]


def _line(plan: Plan, outcome: Outcome) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(
        ["" if value is None else repr(value) if isinstance(value, float) else value
         for value in _row(plan, outcome)]
    )  # fmt: skip
    return text.getvalue().encode()


def _head(plan: Plan) -> bytes:
    names = columns(plan)
    units = [_units(plan).get(name, "") for name in names]
    titles = io.StringIO()
    csv.writer(titles, lineterminator="\n").writerow(
        [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
    )
    title = json.dumps(plan.title, ensure_ascii=False)
    return f"{_KIND}\n{_DIGEST}{plan.digest()}\n# title: {title}\n{titles.getvalue()}".encode()


def _read(plan: Plan, path: Path) -> dict[int, Outcome]:
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
            numbers = row[len(row) - len(plan.columns) :]
            if status == FAILED:
                outcomes[run] = Outcome(run, reason=reason)
            else:
                outcomes[run] = Outcome(run, tuple(map(float, numbers)), lost=reason)
    except (ValueError, IndexError, csv.Error) as error:
        raise EnsembleError(
            f"{path}: damaged ({error}). Use --fresh to start again, or another folder."
        ) from None
    return outcomes

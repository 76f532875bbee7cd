"""Run a scenario: from a file to a pandas frame with units, and to files that survive a crash."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..component.damper import RANGE, beyond, half_way, larger_end
from ..core.progress import listening
from ..core.text import percent, quantity, written
from ..errors import RunError, not_usable
from ..fmu.component import OUTSIDE
from ..physics.drive import DRIVES
from ..system.model import System
from ..system.scenario import load_scenario
from ..system.toml import scenario_text
from ..version import __version__
from . import Engine, Interrupted, StoppedError
from .cosimulation import Cosimulation, ignore
from .coupling_error import Again, again_by, as_data, estimate
from .results import CsvWriter, Results, RunTable, cannot_write, to_frame, write_parquet

if TYPE_CHECKING:
    import pandas as pd

    from .instance import Message


# The folder of a run: results.csv or results.parquet, figure.png, spectrum.csv and log.

FORMATS = ("csv", "parquet")
_OURS = ("results.csv", "results.parquet", "figure.png", "spectrum.csv", "log")


class Output:
    """Where a run's files go; None as the folder means that nothing is written.

    Raises
    ------
    RunError
        The folder cannot be made or written to, exit code 2.
    """

    def __init__(self, folder: Path | None, format: str = "csv") -> None:
        if format not in FORMATS:
            raise not_usable(f'format "{format}" is not known; there are: {", ".join(FORMATS)}.')
        self.folder = folder
        self.format = format
        self.begun = False
        self._made: list[Path] = []
        self._writer: CsvWriter | None = None
        self._log: TextIO | None = None
        self._told: set[str] = set()
        self.failed: RunError | None = None
        if folder is not None:
            self._prepare(folder)

    @property
    def results(self) -> Path | None:
        """The results file, None if nothing is written."""
        return self.folder / f"results.{self.format}" if self.folder else None

    @property
    def written(self) -> int:
        """The number of rows that are on disk."""
        return self._writer.rows if self._writer else 0

    def begin(self, table: RunTable, made: Mapping[str, Any], remarks: Iterable[str] = ()) -> None:
        """Write the first rows and log remarks; from now on there is a file that can be read."""
        self.begun = True
        if self.folder is None:
            return
        for name in _OURS[:4]:
            if name != "results.csv" or self.format != "csv":  # that one is replaced at once
                try:
                    (self.folder / name).unlink(missing_ok=True)
                except OSError as error:
                    raise cannot_write(self.folder / name, error, 0) from error
        if self.format == "csv":
            self._writer = CsvWriter(self.folder / "results.csv", table, made)
        for line in remarks:
            self.log(line)

    def write(self, table: RunTable) -> None:
        """Append rows to a CSV file; a Parquet file is written whole at the end."""
        if self._writer:
            self._writer.write(table)
        if self.failed:
            raise self.failed

    def finish(self, frame: pd.DataFrame) -> None:
        """Mark the file as complete or incomplete; a Parquet file is written now."""
        if self._writer:
            self._writer.finish(frame.attrs["complete"], frame.attrs["made"]["wall_time"])
        elif self.folder is not None:
            write_parquet(frame, self.folder / "results.parquet")
        if self.failed:
            raise self.failed

    def warn(self, line: str) -> None:
        """Write a line to the log and show it, once, on stderr."""
        self.log(f"warning: {line}")
        if line not in self._told:
            self._told.add(line)
            logging.getLogger("bristle").warning(line)

    def log(self, line: str) -> None:
        """Write a line to the log at once: what comes next may end the process.

        A log that cannot be written fails the next `write` or `finish`, not the FMU that spoke.
        """
        if self.folder is None:
            return
        path = self.folder / "log"
        try:
            if self._log is None:
                self._log = path.open("w", encoding="utf-8", buffering=1)
            self._log.write(line + "\n")
        except OSError as error:
            self.failed = cannot_write(path, error, self.written)

    def close(self) -> None:
        """Close the files; folders that were made for nothing are removed."""
        if self._log:
            with suppress(OSError):  # what could not be written has been reported
                self._log.close()
        if self._writer:
            self._writer.close()
        for folder in reversed(self._made):
            if any(folder.iterdir()):
                break
            folder.rmdir()

    def _prepare(self, folder: Path) -> None:
        missing = [part for part in (folder, *folder.parents) if not part.exists()]
        self._made = missing[::-1]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except FileExistsError:
            raise not_usable(f"{folder}: is a file; results go into a folder.") from None
        except OSError as error:
            raise not_usable(
                f"{folder}: results cannot be written there: {error.strerror or error}."
            ) from error


# A run: whatever ends it, and how, the rows before are kept.

ENGINES = ("fmu", "compiled")
MOST_WARNINGS = 9
"""Outputs with a doubtful coupling error that are named on a terminal."""


def engine_of(name: str, fmus: str = "python") -> Engine:
    """Return the engine of a name: "fmu", which steps FMUs of a form, or "compiled".

    Raises
    ------
    RunError
        If there is none, or no such form; if native FMUs are asked for where none is stepped.
    """
    engine = Cosimulation(fmus)
    if name == engine.name:
        return engine
    if name not in ENGINES:
        raise not_usable(f'engine "{name}" is not known; there are: {", ".join(ENGINES)}.')
    if fmus != "python":
        raise not_usable(f'native FMUs: engine "{name}" steps no FMUs; "fmu" does.')
    from .coupled import Coupled

    return Coupled()


class IncompleteRunError(RunError):
    """A run that failed on its way; `frame` holds the rows before."""

    def __init__(self, text: str, frame: Results) -> None:
        super().__init__(text)
        self.frame = frame


class RunInterrupted(KeyboardInterrupt):
    """A run that Ctrl-C has stopped between two steps; `frame` holds the rows before."""

    def __init__(self, text: str, frame: Results) -> None:
        super().__init__(text)
        self.frame = frame


def run(
    scenario: str | Path | System,
    overrides: Mapping[str, object] | None = None,
    *,
    engine: str = "fmu",
    fmus: str = "python",
    out: str | Path | None = None,
    format: str = "csv",
    progress: bool = False,
    coupling_error: bool = False,
    end_process: bool = False,
) -> Results:
    """Run a scenario and return every output at every step.

    Parameters
    ----------
    scenario : path or System
        A scenario file, the name of a stock scenario, or a loaded scenario.
    overrides : mapping, optional
        Values that take the place of the file's: `{"damper.f_c": 2.0, "run.stop": 10.0}`; those
        that a loaded scenario has stay beside them.
    engine : str
        "fmu" steps FMUs; "compiled" solves built-in components together, without coupling error.
    fmus : str
        Which FMUs of built-in components are stepped: "python", or "native", which are compiled on
        first use and need bristle[native]. The rows are the same.
    out : path, optional
        Folder for results, log and, on the command line, a figure; without it nothing is written.
    format : str
        "csv" grows with the run; "parquet" is written whole at the end.
    progress : bool
        Show a progress bar, on a terminal only.
    coupling_error : bool
        Estimate the error that the exchange of values at steps causes, by runs besides: one at half
        the step and one of the coupled engine, or those at a half and a quarter of the step.
    end_process : bool
        Whether a component that hangs after Ctrl-C costs the process, not the results.

    Returns
    -------
    Results
        A pandas frame: columns "damper.force", index "time" [s], row k at t_k, t = 0 included.
        `attrs["units"]` maps columns to units, `attrs["made"]` says how the results were made,
        `attrs["complete"]` is True. `attrs["coupling_error"]` maps outputs to the error `along` the
        run, of `peak` and `rms` as shares, the `order` seen and whether that is `worth` anything.
        `plot()` returns its figure; a notebook shows it.

    Raises
    ------
    ScenarioError, FmuError, BuildError, RecordError
        The input is wrong; nothing was run.
    RunError
        The run failed on its way (IncompleteRunError: its `frame` holds the rows before), or the
        results cannot be written.
    KeyboardInterrupt
        Ctrl-C (RunInterrupted: its `frame` holds the rows before).

    Examples
    --------
    >>> import bristle
    >>> results = bristle.run("bench_sine_bingham", {"run.stop": 0.5})
    >>> round(float(results["damper.force"].abs().max()), 1), results.attrs["units"]["damper.force"]
    (5.9, 'N')
    """
    _refuse_types(scenario, overrides, out)
    chosen = engine_of(engine, fmus)
    if coupling_error and not isinstance(chosen, Cosimulation):
        raise not_usable(f'engine "{engine}" makes no coupling error; "fmu" does.')
    output = Output(None if out is None else Path(out), format)
    try:
        system = load_scenario(scenario, overrides)
        if not isinstance(chosen, Cosimulation):
            return _kept(system, chosen, output)
        hang = partial(_end_process, output) if end_process else None
        heard = replace(chosen, listen=partial(_listen, output), progress=progress, on_hang=hang)
        frame = _kept(system, heard, output)
        if coupling_error:
            _add_error(
                system,
                frame,
                output,
                again_by(replace(chosen, listen=ignore, progress=listening())),
            )
        return frame
    finally:
        output.close()


def _refuse_types(scenario: object, overrides: object, out: object) -> None:
    """Refuse arguments of run of a type that it does not take: exit code 2."""
    if not isinstance(scenario, str | Path | System):
        raise not_usable(
            f"run: the scenario is {written(scenario)}; a file, the name of a stock scenario or a "
            "loaded System is right."
        )
    if overrides is not None and not isinstance(overrides, Mapping):
        raise not_usable(
            f'run: overrides is {written(overrides)}; a mapping such as {{"damper.f_c": 2.0}} is '
            "right."
        )
    if out is not None and not isinstance(out, str | Path):
        raise not_usable(f"run: out is {written(out)}; a folder is right.")


def _kept(system: System, engine: Engine, output: Output) -> Results:
    """Run a system and keep what there is, whatever happens."""
    began = time.perf_counter()
    made: dict[str, Any] = {
        "version": __version__,
        "title": system.title,
        "file": system.where,
        "overrides": dict(system.overrides),
        "algorithm": system.algorithm if isinstance(engine, Cosimulation) else "coupled",
        "engine": engine.name,
        "step": system.step,
        "stop": system.stop,
        "fmus": {},
        "scenario": scenario_text(system),
    }

    def keep(rows: RunTable) -> None:
        if output.begun:
            output.write(rows)
        else:
            output.begin(rows, {**made, **rows.made}, system.remarks())

    stopped: StoppedError | Interrupted | None = None
    try:
        table = engine.run(system, keep)
    except (StoppedError, Interrupted) as error:
        stopped, table = error, error.table
    if isinstance(stopped, StoppedError):
        output.log(f"error: {stopped}")
    complete = stopped is None or (isinstance(stopped, Interrupted) and stopped.whole)
    made |= {**table.made, "wall_time": round(time.perf_counter() - began, 3)}
    for column in table.columns:
        if column.name.endswith(".stroke_ratio"):
            _judge_stroke(column.name, table, output)
    for name in system.components:
        if left := left_data(system, name, table):
            output.warn(f"{name}: {left}")
    frame = to_frame(table, made, complete)
    output.log(
        f"{'complete' if complete else 'incomplete'}: {len(table.time)} rows up to "
        f"t = {table.time[-1]:.9g} s in {made['wall_time']} s"
    )
    output.finish(frame)
    if stopped is None:
        return frame
    kept = "Rows up to t = {:.9g} s are kept in {}, marked incomplete.".format(
        table.time[(output.written or len(table.time)) - 1],
        output.results or "the frame of this error",
    )
    if isinstance(stopped, StoppedError):
        raise IncompleteRunError(f"{stopped}\n  {kept}", frame) from stopped
    if stopped.whole:  # a caller that makes many runs is to stop as well
        raise RunInterrupted("interrupted after the last step; every row is kept.", frame)
    raise RunInterrupted(f"interrupted. {kept}", frame)


def _judge_stroke(name: str, table: RunTable, output: Output) -> None:
    ratio = table[name]
    if ratio.max() > 1:
        first = table.time[(ratio > 1).argmax()]
        output.warn(
            f"{name.rpartition('.')[0]}: the displacement leaves the stroke: stroke_ratio "
            f"is above 1 from t = {first:.9g} s on, at most {ratio.max():.4g}"
        )


TOLD = 0.05
"""Share of the range of a damper's data beyond which a run is said to leave it."""


def left_data(system: System, name: str, table: RunTable) -> str:
    """Return by how much a run leaves the data of a damper, "" where it stays within `TOLD`.

    Parameters
    ----------
    system : what was run
    name : of a component
    table : its rows
    """
    component = system.components[name]
    known = component.description.variables
    if not {OUTSIDE, *RANGE} <= {*known}:
        return ""
    share = table[f"{name}.{OUTSIDE}"]
    if not share.max() > TOLD:
        return ""
    wires = {wire.input: wire for wire in system.wires if wire.target == name}

    def number(of: str) -> float:
        return float(component.value(of) or 0.0)

    low, high, speed, least, most = map(number, RANGE)
    ends = {
        "displacement": ("m", low, high, half_way(low, high, number("stroke"))),
        "velocity": ("m/s", -speed, speed, speed),
    }
    for one in DRIVES.values():
        if one.name in known:
            size = larger_end(least, most, number(one.limit))
            ends[one.name] = one.unit, least, most, size
    worst = 0.0, ""
    for port, (unit, lower, upper, size) in ends.items():
        seen = [number(port)]
        if (wire := wires.get(port)) is not None:
            column = table[f"{wire.source}.{wire.output}"]
            seen = [wire.given(float(column.min())), wire.given(float(column.max()))]
        for value in seen:
            over = beyond(value, lower, upper, size)
            worst = max(worst, (over, f"{port} {quantity(value, unit)}"))
    first = table.time[(share > 0.0).argmax()]
    return (
        f"{worst[1]}, {percent(share.max(), 0)} beyond the data that its model is from; outside "
        f"of them from t = {first:.4g} s"
    )


def _listen(output: Output, message: Message, at: float) -> None:
    if message.status == "OK":
        output.log(f"t = {at:.9g} s: {message.shown}")
    else:
        output.warn(message.shown)


def _end_process(output: Output, until: float | None) -> None:
    """Leave: the main thread is in a component that hangs; rows were kept up to a time [s]."""
    kept = "Nothing was kept."
    if until is not None:
        kept = f"Rows up to t = {until:.9g} s are kept in {output.results}."
    print(f"interrupted; a component does not end its step. {kept}", file=sys.stderr)
    sys.stderr.flush()
    os._exit(130)


def _add_error(system: System, frame: Results, output: Output, again: Again) -> None:
    """Estimate the coupling error of a run, keep it with the results and tell it."""
    try:
        how, found = estimate(system, frame, again)
    except RunError as error:  # the run itself is whole
        output.warn(f"the coupling error cannot be estimated: {error}")
        return
    frame.attrs["coupling_error"] = as_data(found)
    frame.attrs["coupling_error_by"] = how
    for name, one in found.items():
        if one.some:
            output.log(f"coupling error of {name}, by {how}: {one}")
    doubtful = [f"{name}: {one.doubt()}" for name, one in found.items() if not one.worth]
    for line in doubtful[:MOST_WARNINGS]:
        output.warn(f"{line}: the estimate is worth nothing")
    for line in doubtful[MOST_WARNINGS:]:
        output.log(f"warning: {line}: the estimate is worth nothing")
    if len(doubtful) > MOST_WARNINGS:
        more = len(doubtful) - MOST_WARNINGS
        output.warn(f"and {more} more outputs: their estimates are worth nothing")

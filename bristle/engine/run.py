"""Run a scenario: from a file to a pandas frame with units, and to files that survive a crash."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..core.interrupt import Interrupt, deferred
from ..core.progress import Progress, listening, tell
from ..core.text import LINES, command, written
from ..errors import RunError, not_usable
from ..fmu.description import Description, read_description
from ..system.scenario import Scenario, fmu_parameters, loaded_with
from ..system.toml import scenario_text
from ..version import __version__
from .coupling_error import as_data, estimate
from .results import CsvWriter, Table, cannot_write, make_columns, times, to_frame, write_parquet

if TYPE_CHECKING:
    import pandas as pd

    from .cosimulation import Master
    from .instance import Message
    from .results import Results


# The two forms of the built-in components' FMUs: in Python, or native, which a compiler makes.

FORMS = ("python", "native")


def ensure_of(form: str, engine: str) -> Callable[..., Path]:
    """Return what gives a built-in component's FMU of a form: `ensure` of fmu or of native.

    Parameters
    ----------
    form : str
        Of `FORMS`.
    engine : str
        "fmu", or "compiled", which steps none.

    Raises
    ------
    BristleError
        If there is no such form; if native FMUs are asked for where none is stepped.
    KeyboardInterrupt
        Ctrl-C while what makes native FMUs was imported, raised once that is whole.
    """
    if form not in FORMS:
        raise not_usable(f'fmus "{form}" is not known; there are: {", ".join(FORMS)}.')
    if form == "python":
        from ..fmu.build import ensure

        return ensure
    if engine != "fmu":
        raise not_usable(f'native FMUs: engine "{engine}" steps no FMUs; "fmu" does.')
    with deferred():  # an import of llvmlite that Ctrl-C breaks off is never made good
        from ..native.build import ensure as ensure_native
    return ensure_native


# The folder of a run: results.csv or results.parquet, figure.png, spectrum.csv and log.

FORMATS = ("csv", "parquet")
_OURS = ("results.csv", "results.parquet", "figure.png", "spectrum.csv", "log")


class Output:
    """Where a run's files go; None as the folder means that nothing is written.

    `show` gets the warnings and notes of the scenario's check before the run; by default they are
    in the log alone. `quiet` keeps the warnings of the run itself off stderr.

    Raises
    ------
    RunError
        The folder cannot be made or written to, exit code 2.
    """

    def __init__(
        self,
        folder: Path | None,
        format: str = "csv",
        show: Callable[[str], None] = lambda line: None,
        quiet: bool = False,
    ) -> None:
        if format not in FORMATS:
            raise not_usable(f'format "{format}" is not known; there are: {", ".join(FORMATS)}.')
        self.folder = folder
        self.format = format
        self.show = show
        self.quiet = quiet
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

    def begin(self, table: Table, made: Mapping[str, Any], remarks: Iterable[str] = ()) -> None:
        """Write the first rows and log remarks; from now on there is a file that can be read."""
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

    def write(self, table: Table) -> None:
        """Append rows to a CSV file; a Parquet file is written whole at the end."""
        if self._writer:
            self._writer.write(table)
        if self.failed:
            raise self.failed

    def finish(self, frame: pd.DataFrame) -> None:
        """Mark the file as complete or incomplete; a Parquet file is written now."""
        if self._writer:
            made = frame.attrs["made"]
            self._writer.finish(
                frame.attrs["complete"], made["wall_time"], made.get("energy_residual")
            )
        elif self.folder is not None:
            write_parquet(frame, self.folder / "results.parquet")
        if self.failed:
            raise self.failed

    def warn(self, line: str) -> None:
        """Write a line to the log and show it, once, on stderr."""
        self.log(f"warning: {line}")
        if line not in self._told and not self.quiet:
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
FLUSH = 1.0
"""Seconds between two writes of a running results file."""
BLOCK = 0.1
"""Seconds of steps between two looks at Ctrl-C, progress and clock."""
MOST_WARNINGS = 9
"""Outputs with a doubtful coupling error that are named on a terminal."""


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
    scenario: str | Path | Scenario,
    overrides: Mapping[str, object] | None = None,
    *,
    engine: str = "fmu",
    fmus: str = "python",
    out: str | Path | None = None,
    format: str = "csv",
    progress: bool = False,
    coupling_error: bool = False,
) -> Results:
    """Run a scenario and return every output at every step.

    Parameters
    ----------
    scenario : path or Scenario
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
    output = Output(None if out is None else Path(out), format)
    return execute(
        scenario, overrides, engine, output, progress, coupling_error=coupling_error, fmus=fmus
    )


def _refuse_types(scenario: object, overrides: object, out: object) -> None:
    """Refuse arguments of run of a type that it does not take: exit code 2."""
    if not isinstance(scenario, str | Path | Scenario):
        raise not_usable(
            f"run: the scenario is {written(scenario)}; a file, the name of a stock scenario or a "
            "loaded Scenario is right."
        )
    if overrides is not None and not isinstance(overrides, Mapping):
        raise not_usable(
            f'run: overrides is {written(overrides)}; a mapping such as {{"damper.f_c": 2.0}} is '
            "right."
        )
    if out is not None and not isinstance(out, str | Path):
        raise not_usable(f"run: out is {written(out)}; a folder is right.")


def execute(
    scenario: str | Path | Scenario,
    overrides: Mapping[str, object] | None,
    engine: str,
    output: Output,
    progress: bool,
    end_process: bool = False,
    coupling_error: bool = False,
    reference: bool = False,
    fmus: str = "python",
) -> Results:
    """Run a scenario as `run` does, into an output that is closed afterwards.

    Parameters
    ----------
    scenario, overrides, engine, progress, fmus
        As in `run`, and what is returned and raised too.
    output : Output
        What takes results and log.
    end_process : bool
        Whether a component that hangs after Ctrl-C costs the process, not the results.
    coupling_error : bool
        Whether to estimate the coupling error as well.
    reference : bool
        Whether the coupled engine takes the substeps of one that tells the errors of other runs.
    """
    try:
        if engine not in ENGINES:
            raise not_usable(f'engine "{engine}" is not known; there are: {", ".join(ENGINES)}.')
        ensure = ensure_of(fmus, engine)
        scenario = loaded_with(scenario, overrides)
        remarks = scenario.remarks()
        for line in remarks[: LINES - 1]:
            output.show(line)
        if len(remarks) >= LINES:
            name = scenario.package
            again = ["import-ssp", name] if name else ["check", scenario.file]
            output.show(f"and {len(remarks) - LINES + 1} more; all:  {command(*again, '--json')}")
        job = _Job(scenario, engine, output, ensure)
        if engine == "compiled":
            if coupling_error:
                raise not_usable('engine "compiled" makes no coupling error; "fmu" does.')
            return job.solve(reference)
        frame = job.step(progress, end_process)
        if coupling_error:
            _add_error(scenario, frame, output, partial(run_quietly, fmus=fmus))
        return frame
    finally:
        output.close()


def _add_error(
    scenario: Scenario, frame: Results, output: Output, again: Callable[[Scenario, str], Results]
) -> None:
    """Estimate the coupling error of a run, keep it with the results and tell it."""
    try:
        how, found = estimate(scenario, frame, again)
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


def run_quietly(scenario: Scenario, engine: str, fmus: str = "python") -> Results:
    """Run a scenario for its numbers alone: nothing is written, and what it warns of is known.

    Parameters
    ----------
    scenario : Scenario
    engine : str
        As in `run`; "compiled" with substeps short enough to tell the errors of other runs.
    fmus : str
        As in `run`, for the engine "fmu".
    """
    form, shown = fmus if engine == "fmu" else "python", False
    if engine == "fmu":
        shown = listening()
    else:
        tell(f"{scenario.title}: the coupled engine")
    return execute(
        scenario, None, engine, Output(None, quiet=True), shown, reference=True, fmus=form
    )


class _Job:
    """One run on its way: what it is made of, what it has so far, how it ends."""

    def __init__(
        self, scenario: Scenario, engine: str, output: Output, ensure: Callable[..., Path]
    ) -> None:
        self.scenario = scenario
        self.ensure = ensure
        self.output = output
        self.began = time.perf_counter()
        self.made: dict[str, Any] = {
            "version": __version__,
            "title": scenario.title,
            "file": str(scenario.file),
            "overrides": dict(scenario.overrides),
            "algorithm": scenario.algorithm if engine == "fmu" else "coupled",
            "engine": engine,
            "step": scenario.step,
            "stop": scenario.stop,
            "fmus": {},
            "scenario": scenario_text(scenario),
        }

    def solve(self, reference: bool = False) -> Results:
        """Solve the scenario with the compiled laws."""
        from .coupled import LONGEST_SUBSTEP, REFERENCE_SUBSTEP, StoppedError, simulate

        stopped: RunError | None = None
        try:
            values = simulate(self.scenario, REFERENCE_SUBSTEP if reference else LONGEST_SUBSTEP)
        except StoppedError as error:
            stopped, values = error, error.columns
        columns = make_columns(self.scenario)
        time = times(0, len(values["time"]), self.scenario.step)
        table = Table(time, columns, {c.name: values[c.name].astype(c.dtype) for c in columns})
        self.output.begin(table, self.made, self.scenario.remarks())
        return self._end(table, stopped, interrupted=False)

    def step(self, progress: bool, end_process: bool) -> Results:
        """Step the scenario's FMUs; keep what there is, whatever happens."""
        paths, descriptions = self._fmus()
        folder = self.scenario.file.parent
        parameters = {c.name: fmu_parameters(c, folder) for c in self.scenario.components}
        from .cosimulation import Master
        from .coupling_error import bond_names, energy_residuals

        with Master(self.scenario, paths, descriptions, parameters, self._listen) as master:
            self._master = master
            bonds = bond_names(master.nodes, self.scenario.algorithm)
            if bonds:
                self.made["energy_residual"] = dict.fromkeys(bonds)
            hang = self._end_process if end_process else None
            stopped: RunError | None = None
            with Interrupt(hang) as interrupt:
                try:
                    self._go(master, interrupt, progress)
                except RunError as error:
                    if not master.rows or error.exit_code != 1:
                        raise
                    stopped = error
            table = master.table()
            if bonds:
                self.made["energy_residual"] = energy_residuals(
                    master.nodes, self.scenario.algorithm, self.scenario.step, table
                )
            frame = self._end(table, stopped, interrupt.asked and master.rows <= master.steps)
            if interrupt.asked:  # a caller that makes many runs is to stop as well
                raise RunInterrupted("interrupted after the last step; every row is kept.", frame)
            return frame

    def _go(self, master: Master, interrupt: Interrupt, progress: bool) -> None:
        try:
            master.start()
        finally:
            if master.rows:
                self.output.begin(master.table(), self.made, self.scenario.remarks())
        title = self.scenario.title
        if self.output.quiet:  # one of several, which differ in it
            title += f", a step of {1e3 * self.scenario.step:.4g} ms"
        with Progress(title, master.steps, progress) as bar:
            count, due = 1, time.perf_counter() + FLUSH
            try:
                while master.rows <= master.steps and not interrupt.asked:
                    before = time.perf_counter()
                    master.advance(count)
                    now = time.perf_counter()
                    count = max(1, min(8 * count, int(count * BLOCK / max(now - before, 1e-9))))
                    bar.show(master.rows - 1)
                    if now >= due:
                        self.output.write(master.table(self.output.written))
                        due = now + FLUSH
            finally:
                if self.output.written < master.rows:
                    self.output.write(master.table(self.output.written))

    def _end(self, table: Table, stopped: RunError | None, interrupted: bool) -> Results:
        if stopped:
            self.output.log(f"error: {stopped}")
        frame = self._finish(table, complete=not (stopped or interrupted))
        if not (stopped or interrupted):
            return frame
        kept = "Rows up to t = {:.9g} s are kept in {}, marked incomplete.".format(
            table.time[(self.output.written or len(table.time)) - 1],
            self.output.results or "the frame of this error",
        )
        if stopped:
            raise IncompleteRunError(f"{stopped}\n  {kept}", frame) from stopped
        raise RunInterrupted(f"interrupted. {kept}", frame)

    def _finish(self, table: Table, complete: bool) -> Results:
        self.made["wall_time"] = round(time.perf_counter() - self.began, 3)
        for column in table.columns:
            if column.name.endswith(".stroke_ratio"):
                self._judge_stroke(column.name, table)
        frame = to_frame(table, self.made, complete)
        self.output.log(
            f"{'complete' if complete else 'incomplete'}: {len(table.time)} rows up to "
            f"t = {table.time[-1]:.9g} s in {self.made['wall_time']} s"
        )
        self.output.finish(frame)
        return frame

    def _judge_stroke(self, name: str, table: Table) -> None:
        ratio = table.values[name]
        if ratio.max() > 1:
            first = table.time[(ratio > 1).argmax()]
            self.output.warn(
                f"{name.rpartition('.')[0]}: the displacement leaves the stroke: stroke_ratio "
                f"is above 1 from t = {first:.9g} s on, at most {ratio.max():.4g}"
            )

    def _fmus(self) -> tuple[dict[str, Path], dict[str, Description]]:
        """Return each component's FMU file, built where needed, and what it says of itself."""
        paths, descriptions = {}, {}
        for component in self.scenario.components:
            path = component.path or self.ensure(
                component.made_of(), component.building, component.controller, component.effects
            )
            # A missing binary is explained when the FMU is loaded, with the way out.
            description = read_description(path, any_platform=True)
            paths[component.name], descriptions[component.name] = path, description
            self.made["fmus"][component.name] = f"{description.name} {description.guid}"
        return paths, descriptions

    def _listen(self, message: Message) -> None:
        text = message.text
        if not text.startswith(f"{message.component}: "):
            text = f"{message.component}: {text}"
        if message.status == "OK":
            self.output.log(f"t = {self._time():.9g} s: {text}")
        else:
            self.output.warn(text)

    def _time(self) -> float:
        return self._master.time if hasattr(self, "_master") else 0.0

    def _end_process(self) -> None:
        """Save what there is and leave: the main thread is in a component that hangs."""
        master = self._master
        if master.rows:
            self.output.write(master.table(self.output.written))
            kept = f"Rows up to t = {master.time:.9g} s are kept in {self.output.results}."
        else:
            kept = "Nothing was kept."
        print(f"interrupted; a component does not end its step. {kept}", file=sys.stderr)
        sys.stderr.flush()
        master.forget()
        os._exit(130)

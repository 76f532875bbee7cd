"""Results of a run: tables, pandas frames with units, CSV and Parquet files.

Row k holds every output at t_k. A file says how it was made and whether it is complete; a CSV
file grows while the run goes on, so that a run that is killed leaves what it had.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..core.files import replaced_by
from ..core.text import written
from ..data.response_spectrum import response_spectrum, usual_periods
from ..errors import RunError, not_usable
from ..fmu.description import Description
from ..view import Viewable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..system.model import System


_KIND = "# bristle results"
_DTYPES = {"Real": "float64", "Integer": "int64", "Enumeration": "int64", "Boolean": "bool"}
_NAMED = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\]]*)\])?")
_SCENARIO = "# scenario:"
Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class OutputColumn:
    """A column of results: "damper.force", its kind in FMI's words, its unit or None."""

    name: str
    kind: str = "Real"
    unit: str | None = None

    @property
    def dtype(self) -> str:
        """The numpy type of its values."""
        return _DTYPES[self.kind]

    @property
    def header(self) -> str:
        """The column's title in a CSV file."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class RunTable:
    """Rows of results: `time` [s] of shape (n,), and one array of shape (n,) per column.

    `made` is what the engine knows of how they were made.
    """

    time: Array
    columns: tuple[OutputColumn, ...]
    values: dict[str, Array]
    made: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.time if name == "time" else self.values[name]


def to_frame(table: RunTable, made: Mapping[str, Any], complete: bool = True) -> Results:
    """Return a table as a pandas frame that draws itself.

    Its index is the time [s]; `attrs["units"]` maps columns (and "time") to units,
    `attrs["made"]` says how the results were made, `attrs["complete"]` whether the run ended.
    """
    frame = Results(table.values, index=pd.Index(table.time, name="time"))
    units = {"time": "s"} | {c.name: c.unit for c in table.columns if c.unit}
    frame.attrs.update(units=units, made=dict(made), complete=complete)
    return frame


def from_frame(frame: pd.DataFrame) -> RunTable:
    """Return the table of a frame that `to_frame` made."""
    kinds = {"f": "Real", "i": "Integer", "b": "Boolean"}
    units = frame.attrs.get("units", {})
    columns = tuple(
        OutputColumn(str(name), kinds[frame[name].dtype.kind], units.get(name)) for name in frame
    )
    values = {column.name: frame[column.name].to_numpy() for column in columns}
    return RunTable(frame.index.to_numpy(), columns, values)


class CsvWriter:
    """A CSV file of results that grows with the run and says "incomplete" until it is complete.

    The first rows are there as soon as the file is: it replaces an older one in one step.

    Parameters
    ----------
    path : Path
        The file.
    table : RunTable
        The columns, and the first rows.
    made : mapping
        How the results are made; `scenario` is a text of several lines.

    Raises
    ------
    RunError
        The file cannot be written, now or later; the text says what is kept.
    """

    def __init__(self, path: Path, table: RunTable, made: Mapping[str, Any]) -> None:
        self.path = path
        head = _head(table.columns, made)
        self._place = len(f"{_KIND}\n".encode())
        whole = head.encode() + _lines(table)
        try:
            replaced_by(path, lambda new: new.write_bytes(whole))
            self._file = path.open("r+b", buffering=0)
        except OSError as error:
            raise cannot_write(path, error, 0) from error
        self.rows = len(table.time)

    def close(self) -> None:
        """Close the file; without `finish` it stays marked incomplete."""
        self._file.close()

    def write(self, table: RunTable) -> None:
        """Append rows; a line is written whole or, when the disk is full, taken back."""
        end = self._file.seek(0, os.SEEK_END)
        lines = memoryview(_lines(table))
        try:
            while lines:
                lines = lines[self._file.write(lines) :]
        except OSError as error:
            self._file.truncate(end)
            raise cannot_write(self.path, error, self.rows) from error
        self.rows += len(table.time)

    def finish(self, complete: bool, wall_time: float) -> None:
        """Write into the head whether the run is complete, and its wall time [s]."""
        try:
            self._file.seek(self._place)
            self._file.write(_status(complete, wall_time).encode())
        except OSError as error:
            raise cannot_write(self.path, error, self.rows) from error


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a frame of results as CSV; RunError if that fails."""
    made = frame.attrs["made"]
    writer = CsvWriter(path, from_frame(frame), made)
    try:
        writer.finish(frame.attrs["complete"], made.get("wall_time", 0.0))
    finally:
        writer.close()


def write_parquet(frame: pd.DataFrame, path: Path) -> None:
    """Write a frame of results as Parquet, units as metadata of the columns.

    The file appears when it is whole. RunError if it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = from_frame(frame)
    time = pa.field("time", pa.float64(), metadata={"unit": "s"})
    fields = [
        pa.field(c.name, c.dtype.replace("float64", "double"), metadata={"unit": c.unit or ""})
        for c in table.columns
    ]
    about = {"made": frame.attrs["made"], "complete": frame.attrs["complete"]}
    schema = pa.schema([time, *fields], metadata={"bristle": json.dumps(about)})
    arrays = [table.time, *table.values.values()]
    whole = pa.table([pa.array(a) for a in arrays], schema=schema)
    try:
        replaced_by(path, lambda new: pq.write_table(whole, new))
    except OSError as error:
        raise cannot_write(path, error, 0) from error


def load_results(path: str | Path) -> Results:
    """Return the results in a CSV or Parquet file that a run wrote.

    Parameters
    ----------
    path : path
        results.csv or results.parquet, or the folder that holds one of them.

    Returns
    -------
    Results
        The pandas frame that the run returned. `attrs["complete"]` is False if the run did not come
        to its end; the rows until then are there.

    Raises
    ------
    RunError
        There is no such file, or it is not one that a run wrote.

    Examples
    --------
    >>> import bristle, tempfile
    >>> folder = tempfile.mkdtemp()
    >>> results = bristle.run(
    ...     "bench_sine_bingham", {"run.stop": 0.5}, out=folder
    ... )
    >>> bristle.load_results(folder).equals(results)
    True
    """
    if not isinstance(path, str | Path):
        raise not_usable(
            f"load_results takes a file or a folder, not {written(path)}: "
            'load_results("results/el_centro_lugre_passive").'
        )
    path = Path(path)
    if path.is_dir():
        found = [path / name for name in ("results.csv", "results.parquet")]
        path = next((file for file in found if file.exists()), found[0])
    try:
        if path.suffix == ".parquet":
            return _read_parquet(path)
        return _read_csv(path)
    except OSError as error:
        raise not_usable(f"{path}: cannot be read: {error.strerror or error}.") from error
    except (ValueError, KeyError, csv.Error) as error:  # those of pyarrow and json included
        raise not_usable(f"{path}: not a file that bristle wrote, or damaged: {error}.") from error


def cannot_write(path: Path, error: OSError, rows: int) -> RunError:
    """Return a RunError for a file that cannot be written; exit code 2 if nothing was."""
    reason = error.strerror or str(error)
    if not rows:
        return not_usable(f"{path}: cannot be written: {reason}.")
    return RunError(f"{path}: cannot be written on: {reason}; {rows} rows are in it.")


def _status(complete: bool, wall_time: float) -> str:
    """Return the lines of the head that are written twice, always of the same length."""
    state = "complete" if complete else "incomplete"
    return f"# status: {state:10}\n# wall_time: {wall_time:12.3f}\n"


def _head(columns: tuple[OutputColumn, ...], made: Mapping[str, Any]) -> str:
    known = {k: v for k, v in made.items() if k not in ("wall_time", "scenario")}
    for key, kinds in (("integers", ("Integer", "Enumeration")), ("booleans", ("Boolean",))):
        known[key] = [column.name for column in columns if column.kind in kinds]
    lines = [f"# {key}: {json.dumps(value, ensure_ascii=False)}\n" for key, value in known.items()]
    scenario = "".join(f"#   {line}".rstrip() + "\n" for line in made["scenario"].splitlines())
    titles = io.StringIO()
    csv.writer(titles, lineterminator="\n").writerow(
        ["time [s]", *(column.header for column in columns)]
    )
    return (
        f"{_KIND}\n{_status(False, 0.0)}{''.join(lines)}{_SCENARIO}\n{scenario}{titles.getvalue()}"
    )


def _lines(table: RunTable) -> bytes:
    import pyarrow as pa
    from pyarrow.csv import WriteOptions, write_csv

    names = ["time", *(column.name for column in table.columns)]
    arrays = [pa.array(a) for a in (table.time, *(table.values[name] for name in names[1:]))]
    sink = io.BytesIO()
    write_csv(
        pa.table(arrays, names), sink, WriteOptions(include_header=False, quoting_style="none")
    )
    return sink.getvalue()


def _read_csv(path: Path) -> Results:
    import pyarrow as pa
    from pyarrow.csv import ConvertOptions, ReadOptions, read_csv

    data = path.read_bytes()
    made: dict[str, Any] = {}
    scenario: list[str] = []
    place = 0
    while data[place : place + 1] == b"#":
        end = data.index(b"\n", place) + 1
        line = data[place : end - 1].decode()
        place = end
        if line.startswith("#   ") or line == "#":
            scenario.append(line[4:])
        elif ": " in line:
            key, _, value = line[2:].partition(": ")
            made[key] = value.strip() if key == "status" else json.loads(value)
    if not data.startswith(_KIND.encode()):
        raise ValueError(f'it does not begin with "{_KIND}"')
    complete = made.pop("status") == "complete"
    made["scenario"] = "".join(f"{line}\n" for line in scenario)
    body = io.BytesIO(data[place : data.rindex(b"\n") + 1])  # a line cut short is left out
    titles = next(csv.reader([body.readline().decode()]))[1:]
    kinds = dict.fromkeys(made.pop("integers"), "Integer")
    kinds |= dict.fromkeys(made.pop("booleans"), "Boolean")
    matches = [match for title in titles if (match := _NAMED.fullmatch(title))]
    columns = tuple(
        OutputColumn(m["name"], kinds.get(m["name"], "Real"), m["unit"]) for m in matches
    )
    types = {"time": pa.float64()}
    types |= {c.name: pa.type_for_alias(c.dtype.replace("float64", "double")) for c in columns}
    options = ConvertOptions(column_types=types)
    read = read_csv(body, ReadOptions(column_names=list(types)), convert_options=options)
    values = {name: read[name].to_numpy(zero_copy_only=False) for name in read.column_names}
    return to_frame(RunTable(values.pop("time"), columns, values), made, complete)


def _read_parquet(path: Path) -> Results:
    import pyarrow.parquet as pq

    read = pq.read_table(path)
    about = json.loads(read.schema.metadata[b"bristle"])
    kinds = {"float64": "Real", "int64": "Integer", "bool": "Boolean"}
    values = {name: read[name].to_numpy() for name in read.column_names}
    columns = tuple(
        OutputColumn(f.name, kinds[str(values[f.name].dtype)], f.metadata[b"unit"].decode() or None)
        for f in read.schema
        if f.name != "time"
    )
    return to_frame(RunTable(values.pop("time"), columns, values), about["made"], about["complete"])


# What feeds the inputs of a run, by the connections of the scenario that its results hold.


class Feed(NamedTuple):
    """The output that feeds an input, which gets factor output + offset; "" where nothing does."""

    output: str = ""
    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_plain(self) -> bool:
        """Whether the input gets the output as it is."""
        return self.factor == 1.0 and self.offset == 0.0

    def given(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the input gets (n,) where the output has these values (n,)."""
        return self.factor * values + self.offset


NOTHING = Feed()
"""What feeds an input that is not connected."""


def feeds_of(scenario: str) -> dict[str, Feed]:
    """Return what feeds each input, by `component.input`.

    Parameters
    ----------
    scenario : the text of a scenario as `system.toml` writes it
    """
    told = tomllib.loads(scenario).get("connections", {})
    return {
        target: Feed(said) if isinstance(said, str) else Feed(
            said["from"], said.get("factor", 1.0), said.get("offset", 0.0)
        )
        for target, said in told.items()
    }  # fmt: skip


# Results of a run: a pandas frame that knows its units and draws itself.


class Results(pd.DataFrame, Viewable):
    """Every output of a run at every step: a pandas frame that a notebook shows as table and plot.

    What is made of it, a slice or a sum, is a plain frame; `plot` of that is pandas' own.

    Attributes
    ----------
    index : Index
        Time [s]; row k holds the outputs at t_k, t = 0 included.
    columns : Index
        Outputs by name: "damper.force".
    attrs : dict
        `attrs["units"]` maps columns and "time" to units, `attrs["made"]` tells how the results
        were made, `attrs["complete"]` whether the run came to its end.

    Examples
    --------
    >>> import bristle
    >>> results = bristle.run("bench_sine_bingham", {"run.stop": 0.5})
    >>> results.attrs["units"]["damper.force"], results.attrs["complete"]
    ('N', True)
    >>> figure = results.plot()  # figure.savefig("run.png") keeps it
    """

    @property
    def _constructor(self) -> Callable[..., pd.DataFrame]:
        return pd.DataFrame

    def plot(self, title: str = "") -> Figure:  # type: ignore[override]  # pandas has an accessor
        """Return the figure of the run: accelerations, drifts, voltages, loops of the dampers.

        Parameters
        ----------
        title : str
            Above the panels; by default the scenario's title.
        """
        shown = Results(self)
        shown.attrs = dict(self.attrs)
        if title:
            shown.attrs["made"] = {**self.attrs.get("made", {}), "title": title}
        return Viewable.plot(shown)

    def _repr_html_(self) -> str:
        return Viewable._repr_html_(self)


# What the rows and columns of a run are, whichever engine fills them.


def make_columns(
    system: System, descriptions: Mapping[str, Description] | None = None
) -> tuple[OutputColumn, ...]:
    """Return the columns of the results: every output but texts, in the order of the file.

    `descriptions` are those of the FMUs that are stepped; else the scenario's own.
    """
    return tuple(
        OutputColumn(f"{name}.{variable.name}", variable.kind, variable.unit)
        for name, component in system.components.items()
        for variable in (descriptions or {}).get(name, component.description).of("output")
        if variable.kind != "String"
    )


def count_steps(stop: float, step: float) -> int:
    """Return the number of whole steps up to `stop`."""
    ratio = stop / step
    return round(ratio) if math.isclose(ratio, round(ratio), rel_tol=1e-9) else int(ratio)


def times(first: int, last: int, step: float) -> Array:
    """Return t_k for k = first ... last - 1, shape (last - first,).

    Where 1/step is whole, t_k = k / (1/step): 0.3 s is then 0.3 and not 0.30000000000000004.
    """
    rate = round(1 / step)
    numbers = np.arange(first, last)
    if math.isclose(rate * step, 1.0, rel_tol=1e-12):
        return np.divide(numbers, rate, dtype=np.float64)
    return np.multiply(numbers, step, dtype=np.float64)


# Response spectra of a run: of the ground, and of the floors as equipment on them feels it.

SPECTRUM_FILE = "spectrum.csv"
_ACCELERATION_ENDS = ("ground_acceleration", "_acceleration_absolute")
"""How outputs end that have a spectrum: absolute accelerations."""


def accelerations(names: Mapping[str, object]) -> list[str]:
    """Return those names of outputs that are absolute accelerations, in their order."""
    return [name for name in names if name.endswith(_ACCELERATION_ENDS)]


def spectra(columns: Mapping[str, Array], step: float) -> dict[str, Array]:
    """Return the 5 % damped spectra of absolute acceleration of a run's ground and floors.

    Parameters
    ----------
    columns : name of an output to its rows (n,), accelerations [m/s2]
    step : between two rows [s]

    Returns
    -------
    dict
        "period" (m,) s, then each acceleration's spectrum (m,) m/s2 by the name of the output.

    Raises
    ------
    RunError
        If no output is an absolute acceleration, one is not finite, or the rows are too far apart.
    """
    names = accelerations(columns)
    periods = usual_periods(step)
    if not names:
        raise not_usable(
            "no output is an acceleration of ground or floor, so that there is no response "
            "spectrum. A scenario with a Structure has them."
        )
    if not len(periods):
        raise not_usable(f"rows {step:g} s apart are too few for a response spectrum.")
    broken = [name for name in names if not np.isfinite(columns[name]).all()]
    if broken:
        raise not_usable(f"{', '.join(broken)}: not finite, so that there is no response spectrum.")
    found = {name: response_spectrum(columns[name], step, periods) for name in names}
    return {"period": periods, **found}


def write_spectra(frame: pd.DataFrame, path: Path) -> None:
    """Write a run's spectra as CSV: a row per period, a column per acceleration, with units.

    Raises
    ------
    RunError
        As `spectra`, or if the file cannot be written.
    """
    if len(frame) < 2:
        raise not_usable("the run has one row alone: there is no response spectrum.")
    columns = {str(name): frame[name].to_numpy() for name in frame}
    found = spectra(columns, float(frame.index[1] - frame.index[0]))
    head = ["period [s]", *(f"{name} [m/s2]" for name in list(found)[1:])]
    rows = [",".join(head)]
    rows += [",".join(f"{value:.9g}" for value in row) for row in zip(*found.values(), strict=True)]
    try:
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    except OSError as error:
        raise cannot_write(path, error, 0) from error


# Peaks and RMS values of a run's outputs.

_INTERESTING = re.compile(
    r"\.(.*acceleration(_absolute)?|base_displacement|drift\d*|displacement|force|voltage"
    r"|command_raw|stroke_ratio|value)$"
)


@dataclass(frozen=True)
class Summary:
    """One output over a whole run: the largest absolute value, when it came, and the RMS."""

    name: str
    unit: str | None
    peak: float
    time_of_peak: float
    rms: float


def reals(frame: pd.DataFrame) -> list[str]:
    """Return the names of the Real outputs of a run."""
    return [str(name) for name in frame if frame[name].dtype.kind == "f"]


def foreign(frame: pd.DataFrame) -> set[str]:
    """Return the names of a run's components that are FMU files, as the results tell."""
    scenario = tomllib.loads(frame.attrs.get("made", {}).get("scenario", ""))
    components = scenario.get("components", {})
    return {name for name, part in components.items() if str(part.get("fmu")).endswith(".fmu")}


def judged_by(frame: pd.DataFrame) -> list[str]:
    """Return the outputs that a run is judged by; each component has at least one of them."""
    others, found = foreign(frame), set()
    for component, names in by_component(reals(frame)).items():
        chosen = [name for name in names if _INTERESTING.search(name)]
        found.update(names if component in others else chosen or names)
    return [name for name in reals(frame) if name in found]


def statistic_of(values: NDArray[Any], how: str) -> float:
    """Return the "peak" (of its size), "rms", "max", "min", "mean" or "last" of an output (n,)."""
    if how == "peak":
        return float(max(values.max(), -values.min()))
    if how == "rms":
        return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))
    return float(values[-1] if how == "last" else getattr(values, how)())


def by_component(names: Iterable[str]) -> dict[str, list[str]]:
    """Return names of outputs such as "damper.force" by their component."""
    parts: dict[str, list[str]] = {}
    for name in names:
        parts.setdefault(name.partition(".")[0], []).append(name)
    return parts


def summarise(frame: pd.DataFrame, everything: bool = False) -> list[Summary]:
    """Return peak and RMS of the Real outputs of a run, over all of its rows.

    Parameters
    ----------
    frame : DataFrame
        Results as `bristle.run` returns them.
    everything : bool
        Every Real output; otherwise of each built-in component those that a run is usually judged
        by (accelerations, drifts, forces, voltages), or all if it has none of these, and of each
        foreign FMU all.
    """
    names = reals(frame) if everything else judged_by(frame)
    units, time = frame.attrs["units"], frame.index.to_numpy()
    found = []
    for name in names:
        values = frame[name].to_numpy()
        at = int(np.argmax(np.abs(values)))
        peak, rms = float(abs(values[at])), statistic_of(values, "rms")
        found.append(Summary(name, units.get(name), peak, float(time[at]), rms))
    return found

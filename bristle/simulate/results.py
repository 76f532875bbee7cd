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
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import RunError, not_usable
from ..findings import written

if TYPE_CHECKING:
    import pandas as pd

    from .frame import Results

_KIND = "# bristle results"
_DTYPES = {"Real": "float64", "Integer": "int64", "Enumeration": "int64", "Boolean": "bool"}
_NAMED = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\]]*)\])?")
_SCENARIO = "# scenario:"
Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Column:
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
class Table:
    """Rows of results: `time` [s] of shape (n,), and one array of shape (n,) per column."""

    time: Array
    columns: tuple[Column, ...]
    values: dict[str, Array]


def to_frame(table: Table, made: Mapping[str, Any], complete: bool = True) -> Results:
    """Return a table as a pandas frame that draws itself.

    Its index is the time [s]; `attrs["units"]` maps columns (and "time") to units,
    `attrs["made"]` says how the results were made, `attrs["complete"]` whether the run ended.
    """
    import pandas as pd

    from .frame import Results

    frame = Results(table.values, index=pd.Index(table.time, name="time"))
    units = {"time": "s"} | {c.name: c.unit for c in table.columns if c.unit}
    frame.attrs.update(units=units, made=dict(made), complete=complete)
    return frame


def from_frame(frame: pd.DataFrame) -> Table:
    """Return the table of a frame that `to_frame` made."""
    kinds = {"f": "Real", "i": "Integer", "b": "Boolean"}
    units = frame.attrs.get("units", {})
    columns = tuple(
        Column(str(name), kinds[frame[name].dtype.kind], units.get(name)) for name in frame
    )
    values = {column.name: frame[column.name].to_numpy() for column in columns}
    return Table(frame.index.to_numpy(), columns, values)


class CsvWriter:
    """A CSV file of results that grows with the run and says "incomplete" until it is complete.

    The first rows are there as soon as the file is: it replaces an older one in one step.

    Parameters
    ----------
    path : Path
        The file.
    table : Table
        The columns, and the first rows.
    made : mapping
        How the results are made; `scenario` is a text of several lines.

    Raises
    ------
    RunError
        The file cannot be written, now or later; the text says what is kept.
    """

    def __init__(self, path: Path, table: Table, made: Mapping[str, Any]) -> None:
        self.path = path
        head = _head(table.columns, made)
        self._place = len(f"{_KIND}\n".encode())
        new = path.with_name(path.name + ".new")
        try:
            try:
                new.write_bytes(head.encode() + _lines(table))
                new.replace(path)
            finally:
                new.unlink(missing_ok=True)
            self._file = path.open("r+b", buffering=0)
        except OSError as error:
            raise cannot_write(path, error, 0) from error
        self.rows = len(table.time)

    def close(self) -> None:
        """Close the file; without `finish` it stays marked incomplete."""
        self._file.close()

    def write(self, table: Table) -> None:
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

    def finish(
        self, complete: bool, wall_time: float, residuals: Mapping[str, float | None] | None = None
    ) -> None:
        """Write into the head whether the run is complete, its wall time [s], energy residuals.

        Parameters
        ----------
        complete, wall_time : bool, float [s]
        residuals : share [1] per power bond, of the bonds that `made` named
        """
        try:
            self._file.seek(self._place)
            self._file.write(_status(complete, wall_time, residuals or {}).encode())
        except OSError as error:
            raise cannot_write(self.path, error, self.rows) from error


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a frame of results as CSV; RunError if that fails."""
    made = frame.attrs["made"]
    writer = CsvWriter(path, from_frame(frame), made)
    try:
        residuals = made.get("energy_residual")
        writer.finish(frame.attrs["complete"], made.get("wall_time", 0.0), residuals)
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
    new = path.with_name(path.name + ".new")
    try:
        try:
            pq.write_table(pa.table([pa.array(a) for a in arrays], schema=schema), new)
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)
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


def _status(complete: bool, wall_time: float, residuals: Mapping[str, float | None]) -> str:
    """Return the lines of the head that are written twice, always of the same length."""
    lines = [
        f"# status: {'complete' if complete else 'incomplete':10}",
        f"# wall_time: {wall_time:12.3f}",
    ]
    if residuals:
        each = [f"{json.dumps(name)}: {_fixed(value)}" for name, value in residuals.items()]
        lines.append(f"# energy_residual: {{{', '.join(each)}}}")
    return "".join(f"{line}\n" for line in lines)


def _fixed(value: float | None) -> str:
    """Return a number of JSON, always of the same length; null for what is not finite."""
    known = value is not None and math.isfinite(value)
    return f"{value:24.16e}" if known else f"{'null':>24}"


def _head(columns: tuple[Column, ...], made: Mapping[str, Any]) -> str:
    twice = ("wall_time", "energy_residual")
    known = {k: v for k, v in made.items() if k not in (*twice, "scenario")}
    for key, kinds in (("integers", ("Integer", "Enumeration")), ("booleans", ("Boolean",))):
        known[key] = [column.name for column in columns if column.kind in kinds]
    lines = [f"# {key}: {json.dumps(value, ensure_ascii=False)}\n" for key, value in known.items()]
    scenario = "".join(f"#   {line}".rstrip() + "\n" for line in made["scenario"].splitlines())
    titles = io.StringIO()
    csv.writer(titles, lineterminator="\n").writerow(
        ["time [s]", *(column.header for column in columns)]
    )
    status = _status(False, 0.0, dict.fromkeys(made.get("energy_residual", {})))
    return f"{_KIND}\n{status}{''.join(lines)}{_SCENARIO}\n{scenario}{titles.getvalue()}"


def _lines(table: Table) -> bytes:
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
    columns = tuple(Column(m["name"], kinds.get(m["name"], "Real"), m["unit"]) for m in matches)
    types = {"time": pa.float64()}
    types |= {c.name: pa.type_for_alias(c.dtype.replace("float64", "double")) for c in columns}
    options = ConvertOptions(column_types=types)
    read = read_csv(body, ReadOptions(column_names=list(types)), convert_options=options)
    values = {name: read[name].to_numpy(zero_copy_only=False) for name in read.column_names}
    return to_frame(Table(values.pop("time"), columns, values), made, complete)


def _read_parquet(path: Path) -> Results:
    import pyarrow.parquet as pq

    read = pq.read_table(path)
    about = json.loads(read.schema.metadata[b"bristle"])
    kinds = {"float64": "Real", "int64": "Integer", "bool": "Boolean"}
    values = {name: read[name].to_numpy() for name in read.column_names}
    columns = tuple(
        Column(f.name, kinds[str(values[f.name].dtype)], f.metadata[b"unit"].decode() or None)
        for f in read.schema
        if f.name != "time"
    )
    return to_frame(Table(values.pop("time"), columns, values), about["made"], about["complete"])

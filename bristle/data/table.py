"""Tables of numbers from any file that a laboratory hands over: columns with titles and units.

CSV and other delimited text (also gzip-compressed), Parquet, MAT up to version 7, results of
bristle itself, pandas frames. Nothing is converted here; see `measurement`.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from .columns import Column
from .titles import titles, unit_or_none

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

LARGEST = 256 * 1024**2
"""Largest content that is read, after decompression [bytes]: about 3 million rows of 8 columns."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers.

    `values` maps a column's text, its title in the file, to (n,) floats, NaN where a value is
    missing. `words` says of a column that holds text where the first is. `lines` (n,) is the line
    of the file, or the row, that each sample is from, called `place`.
    """

    source: str
    columns: tuple[Column, ...]
    values: dict[str, Array]
    lines: NDArray[np.int64]
    place: str = "line"
    words: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of samples."""
        return len(self.lines)

    def find(self, called: str) -> Column:
        """Return the column of a title, or of a name without its unit where that is one column.

        Raises
        ------
        RecordError
            If there is no such column, or several.
        """
        for column in self.columns:
            if column.text == called:
                return column
        named = [column for column in self.columns if column.name == called]
        if len(named) == 1:
            return named[0]
        there = ", ".join(f'"{column.text}"' for column in self.columns)
        what = "several columns are" if named else "no column is"
        raise RecordError(f'{self.source}: {what} called "{called}"; there are {there}.')

    def where(self, row: int) -> str:
        """Return the place of a sample in words: "line 12"."""
        return f"{self.place} {self.lines[row]}"


def read_table(path: Path | str) -> Table:
    """Return the table in a file, whatever its format.

    Raises
    ------
    RecordError
        If the file cannot be read, is too large, or is of a format that is not read: with the
        file, the line where there is one, and what would be right.
    """
    path = Path(path)
    name = str(path)
    content = _content(path, name)
    if content.startswith(b"PAR1"):
        return _parquet(content, name)
    if content.startswith(b"MATLAB 5.0") or path.suffix.lower() == ".mat":
        from .matlab import read_mat

        return read_mat(content, name)
    _refuse_others(content, name)
    from .delimited import read_delimited

    return read_delimited(content, name)


def table_from_frame(frame: pd.DataFrame, name: str = "frame") -> Table:
    """Return the table of a pandas frame: titles with units, or units in `attrs["units"]`.

    An index with a name is a column, too: the time of bristle's own results is one.
    """
    if frame.index.name is not None:
        frame = frame.reset_index().rename(columns={frame.index.name: str(frame.index.name)})
    data = {str(key): frame[key].to_numpy() for key in frame.columns}
    return from_arrays(data, name, frame.attrs.get("units", {}))


def from_arrays(
    data: Mapping[str, NDArray[Any]],
    source: str,
    units: Mapping[str, str | None] | None = None,
    notes: tuple[str, ...] = (),
) -> Table:
    """Return the table of named arrays (n,); what holds no numbers is named in `words`."""
    units = units or {}
    size = len(next(iter(data.values()))) if data else 0
    columns = titles(list(data), [units.get(name) or "" for name in data])
    values: dict[str, Array] = {}
    words: dict[str, str] = {}
    for column, array in zip(columns, data.values(), strict=True):
        numbers = _numbers(array)
        values[column.text] = np.full(size, np.nan) if numbers is None else numbers
        if numbers is None:
            words[column.text] = f"it holds {array.dtype} and no numbers"
    return Table(source, columns, values, np.arange(1, size + 1), "row", words, notes)


def _numbers(array: NDArray[Any]) -> Array | None:
    """Return an array as floats, instants as seconds since the first; None if it holds neither."""
    if array.dtype.kind in "fiub":
        return np.asarray(array, dtype=float)
    if array.dtype.kind in "mM":
        since = array - array[0] if array.dtype.kind == "M" else array
        return np.asarray(since / np.timedelta64(1, "ns"), dtype=float) * 1e-9
    return None


def _content(path: Path, name: str) -> bytes:
    """Return a file's bytes, decompressed, after refusing what is too large."""
    try:
        if not path.is_file():
            what = "this is a folder" if path.is_dir() else "there is no such file"
            raise RecordError(f"{name}: {what}. A measurement is one file.")
        size = path.stat().st_size
        content = path.read_bytes() if size <= LARGEST else b""
        if content[:2] == b"\x1f\x8b":
            with gzip.open(path) as stream:
                content = stream.read(LARGEST + 1)
            size = len(content)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(f"{name}: the file cannot be read ({reason}).") from None
    if size > LARGEST:
        raise RecordError(
            f"{name}: {size / 1024**2:.0f} MB are more than the limit of {LARGEST // 1024**2} MB "
            "for one measurement. Cut it, or sample it more coarsely."
        )
    if not content.strip():
        raise RecordError(f"{name}: the file is empty. A measurement has titles and numbers.")
    return content


def _refuse_others(content: bytes, name: str) -> None:
    known = {
        _HDF5: "this is HDF5. Save the measurement as CSV, Parquet or MAT (version 7).",
        b"PK\x03\x04": "this is a zip or an Excel workbook. Save the sheet as CSV.",
        b"\xd0\xcf\x11\xe0": "this is an old Excel workbook. Save the sheet as CSV.",
        b"TDSm": "this is TDMS. Export the channels as CSV.",
    }
    for mark, text in known.items():
        if content.startswith(mark):
            raise RecordError(f"{name}: {text}")


def _parquet(content: bytes, name: str) -> Table:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        read = pq.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise RecordError(f"{name}: no Parquet file, or damaged ({error}).") from None
    units = {}
    for one in read.schema:
        stated = (one.metadata or {}).get(b"unit", b"").decode()
        units[one.name] = stated if unit_or_none(stated) is not None else None
    data = {
        column: read[column].to_numpy()
        for column in read.column_names
        if not column.startswith("__index")
    }
    if not data or not len(read):
        raise RecordError(f"{name}: the file holds no samples.")
    notes: tuple[str, ...] = ()
    if b'"complete": false' in (read.schema.metadata or {}).get(b"bristle", b""):
        notes = ("the run that wrote this file did not come to its end",)
    return from_arrays(data, name, units, notes)

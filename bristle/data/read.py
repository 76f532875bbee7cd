"""Tables from any file that a laboratory hands over.

CSV and other delimited text (also gzip-compressed), Parquet, MAT up to version 7, results of
bristle itself. Nothing is converted here; see `measurement`.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from ..errors import RecordError
from .delimited import read_delimited
from .matlab import read_mat
from .table import Table, from_arrays
from .titles import unit_or_none

LARGEST = 256 * 1024**2
"""Largest content that is read, after decompression [bytes]: about 3 million rows of 8 columns."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


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
        return read_mat(content, name)
    _refuse_others(content, name)
    return read_delimited(content, name)


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

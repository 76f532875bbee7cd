"""Parquet: a column a channel, its unit in the field's metadata."""

from __future__ import annotations

import json

from ...errors import RecordError
from ..table import Table, from_arrays, refuse_twice
from ..titles import unit_or_none


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is Parquet, by its first bytes."""
    return content.startswith(b"PAR1")


def read(content: bytes, name: str) -> Table:
    """Return the table in a Parquet file.

    Raises
    ------
    RecordError
        If the file is damaged, two columns have one name, or it holds no samples.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        read = pq.ParquetFile(pa.BufferReader(content)).read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise RecordError(f"{name}: no Parquet file, or damaged ({error}).") from None
    refuse_twice(read.column_names, name)
    about = read.schema.metadata or {}
    of_frame = json.loads(about.get(b"PANDAS_ATTRS", b"{}")).get("units", {})
    units = {}
    for one in read.schema:
        stated = (one.metadata or {}).get(b"unit", b"").decode() or str(of_frame.get(one.name, ""))
        units[one.name] = stated if unit_or_none(stated) is not None else None
    data = {column: read[column].to_numpy() for column in read.column_names}
    for column in [name for name in data if name.startswith("__index")]:
        index = data.pop(column)
        if index.dtype.kind in "mM" and "time" not in data:  # an index without a name
            data = {"time": index, **data}
    if not data or not len(read):
        raise RecordError(f"{name}: the file holds no samples.")
    notes: tuple[str, ...] = ()
    if b'"complete": false' in about.get(b"bristle", b""):
        notes = ("the run that wrote this file did not come to its end",)
    return from_arrays(data, name, units, notes)

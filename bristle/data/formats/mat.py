"""MAT files up to version 7 (7.3 is HDF5): vectors, columns of matrices, fields of structures."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import RecordError
from ..table import Table
from ._vectors import columns_of, table_of


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is MAT, by its first bytes or its ending."""
    return content.startswith(b"MATLAB 5.0") or suffix == ".mat"


def read(content: bytes, name: str) -> Table:
    """Return the table in a MAT file.

    Vectors of the commonest length are the columns; a matrix of that many rows gives `name_1`,
    `name_2`. Fields of structures are called `structure.field`. Where no vector is a time, one is
    made from a scalar called dt, Ts or fs.

    Raises
    ------
    RecordError
        If the file is damaged, or holds no vector.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        loaded = loadmat(io.BytesIO(content), squeeze_me=True, struct_as_record=False)
    # A damaged file surfaces as any of these from the reader's own parsing.
    except (
        MatReadError, ValueError, LookupError, TypeError, ArithmeticError, OSError, MemoryError,
        NotImplementedError,
    ) as error:  # fmt: skip
        raise RecordError(f"{name}: no MAT file, or damaged ({error}).") from None
    found = [
        pair
        for key, value in loaded.items()
        if not key.startswith("__")
        for pair in _arrays(key, value)
    ]
    return table_of(found, name)


def _arrays(key: str, value: Any) -> Iterator[tuple[str, np.ndarray[Any, np.dtype[Any]]]]:
    """Yield (name, array) of what one variable holds, structures followed."""
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        if {"Name", "Data"} <= set(fields):  # recorders write lists of named signals
            yield from _arrays(f"{key}.{value.Name}", value.Data)
            return
        for one in fields:
            yield from _arrays(f"{key}.{one}", getattr(value, one))
        return
    array = np.asarray(value)
    if array.dtype == object:
        for index, item in enumerate(array.ravel(), 1):
            if hasattr(item, "_fieldnames"):
                yield from _arrays(f"{key}({index})", item)
        return
    yield from columns_of(key, array)

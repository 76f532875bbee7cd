"""MAT up to version 7 (7.3 is HDF5), and NPZ: vectors, columns of matrices, structures."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ...errors import RecordError
from ..table import Table
from . import DAMAGED
from ._tree import Leaf, Node, Unread, table_of


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is MAT or NPZ, by its first bytes or its ending."""
    return content.startswith(b"MATLAB 5.0") or suffix in (".mat", ".npz")


def read(content: bytes, name: str) -> Table:
    """Return the table in a MAT file, or an NPZ file.

    Vectors are columns; a matrix gives `name_1`, `name_2`, or what a list of names beside it says.
    Fields of structures are called `structure.field`, signals of Simulink by their labels. An array
    of structures holds runs. Where no vector is a time, one is made from a scalar called dt, Ts or
    fs.

    Raises
    ------
    RecordError
        If the file is damaged, holds no vector, or channels do not overlap in time.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    kind = "NPZ" if content.startswith(b"PK") else "MAT"
    try:
        if kind == "NPZ":
            loaded = {**np.load(io.BytesIO(content), allow_pickle=False)}
        else:
            loaded = loadmat(io.BytesIO(content), squeeze_me=True, struct_as_record=False)
    except (MatReadError, *DAMAGED) as error:
        raise RecordError(f"{name}: no {kind} file, or damaged ({error}).") from None
    tree = {key: _node(value) for key, value in loaded.items() if not key.startswith("__")}
    return table_of(tree, name)


def _node(value: Any) -> Node:
    """Return what one variable holds, structures followed."""
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        return {one: _node(getattr(value, one)) for one in fields}
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    if array.dtype.names or type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        words = [one for one in array.ravel()[:1].tolist()[0] if isinstance(one, str | bytes)]
        last = words[-1] if words else "unknown"
        return Unread(last.decode(errors="replace") if isinstance(last, bytes) else last)
    if array.dtype == object:
        if array.ndim == 0:  # a sparse matrix, or what scipy has no array for
            return Unread(type(value).__name__)
        return [_node(one) for one in array.ravel()]
    if array.dtype.kind in "US":
        return [str(one).rstrip() for one in array.ravel()]
    return Leaf(array)

"""HDF5, and MAT files of version 7.3, which are HDF5: datasets, fields of structures."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ...errors import RecordError
from ..table import Table
from . import DAMAGED, library
from ._one_time import step_in
from ._tree import STARTS, TELLS_SCALE, Bare, Leaf, Node, Unread, table_of

_MARK = b"\x89HDF\r\n\x1a\n"
_UNITS = ("unit", "units", "Unit", "Units", "UNIT")


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is HDF5, by its first bytes or those after MATLAB's own."""
    return content.startswith((_MARK, b"MATLAB 7.3"))


def read(content: bytes, name: str) -> Table:
    """Return the table in an HDF5 file.

    Datasets of one dimension are columns, called `group.dataset`; a matrix gives `name_1`,
    `name_2`; a compound dataset gives its fields, called `dataset.field` where two share a name.
    An attribute `unit` or `units` is the unit. The rest is as in a MAT file of version 7.

    Raises
    ------
    RecordError
        If h5py is not installed, the file is damaged, or it holds no vector.
    """
    h5py = library("h5py", name, "HDF5 (as MAT of version 7.3 is)")
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            tree = _group(file, h5py)
    except DAMAGED as error:
        raise RecordError(f"{name}: no HDF5 file, or damaged ({error}).") from None
    return table_of(tree, name)


def _group(group: Any, h5py: Any) -> dict[str, Node]:
    """Return what is below a group, its rate as well; what MATLAB keeps for itself is left."""
    told = {"unit": unit} if (unit := _unit(group)) else {}
    return (
        {key: Leaf(np.asarray(value)) for key, value in _times(group).items()}
        | told
        | {
            key: node
            for key, item in group.items()
            if not key.startswith("#") and item is not None
            for node in [_node(item, group.file, h5py)]
            if node is not None
        }
    )


def _node(item: Any, file: Any, h5py: Any) -> Node | None:
    """Return a group, a dataset or an array of references of MATLAB; None for what is no data."""
    kind = item.attrs.get("MATLAB_class", b"")
    if isinstance(item, h5py.Group):
        fields = _group(item, h5py)
        sizes = {len(one) for one in fields.values() if isinstance(one, list)}
        referred = all(
            getattr(one, "dtype", None) is not None and h5py.check_ref_dtype(one.dtype)
            for one in item.values()
        )
        if referred and fields and len(sizes) == 1:  # an array of structures, field by field
            (size,) = sizes
            lists = {key: one for key, one in fields.items() if isinstance(one, list)}
            return [{key: one[k] for key, one in lists.items()} for k in range(size)]
        return fields
    if "MATLAB_object_decode" in item.attrs:
        return Unread(kind.decode(errors="replace"))
    if h5py.check_ref_dtype(item.dtype):
        return [_node(file[one], file, h5py) if one else "" for one in np.ravel(item[()])]
    if kind == b"char":
        return "" if "MATLAB_empty" in item.attrs else _word(item[()])
    if h5py.check_string_dtype(item.dtype) or item.dtype.kind in "SU":
        words = [_decoded(one) for one in np.ravel(item[()])]
        return words if item.shape else words[0]
    if item.dtype.names:
        rows = np.asarray(item[()])
        unit = _unit(item)
        return Bare({one: Leaf(np.asarray(rows[one]), unit) for one in item.dtype.names})
    if item.dtype.kind in "fiubc" and "MATLAB_empty" not in item.attrs:
        return _with_names(Leaf(np.asarray(item[()]), _unit(item), _times(item)), item)
    return None


def _times(item: Any) -> dict[str, float]:
    """Return the attributes that are numbers and tell a step, a rate, a start or a scale."""
    return {
        key: float(np.ravel(value)[0])
        for key, value in item.attrs.items()
        if (key.lower() in STARTS or TELLS_SCALE.search(key) or step_in(key, 1.0))
        and np.size(value) == 1
        and np.asarray(value).dtype.kind in "fiu"
    }


def _with_names(leaf: Leaf, item: Any) -> Node:
    """Return numbers with the lists of texts that stand in their attributes, of names and units."""
    lists = {
        key: [_decoded(one) for one in np.ravel(value)]
        for key, value in item.attrs.items()
        if isinstance(value, np.ndarray) and value.size > 1 and value.dtype.kind in "OSU"
    }
    own = item.name.rpartition("/")[2]
    return Bare({own: leaf, **lists}) if lists and leaf.array.ndim == 2 else leaf


def _word(codes: Any) -> str:
    """Return a text of MATLAB from its codes, which it stores column by column."""
    return "".join(map(chr, np.ravel(np.asarray(codes).T, order="F").tolist())).strip()


def _decoded(text: Any) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else str(text)


def _unit(item: Any) -> str:
    for key in _UNITS:
        stated = item.attrs.get(key)
        if stated is not None and np.size(stated) == 1:
            return _decoded(np.ravel(stated)[0])  # some programs write an array of one text
    return ""

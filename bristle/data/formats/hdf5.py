"""HDF5, and MAT files of version 7.3, which are HDF5: datasets, fields of structures."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import RecordError
from ..table import Table
from ..titles import unit_or_none
from ._extra import library
from ._vectors import AnyArray, columns_of, table_of

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
    found: list[tuple[str, AnyArray]] = []
    units: dict[str, str | None] = {}
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            for key, dataset in _datasets(file, h5py):
                for called, array in _arrays(key, dataset):
                    column = f"{key}.{called}" if called in units else called
                    found.append((column, array))
                    units[column] = _unit(dataset)
    # A damaged file surfaces as any of these from the library's own parsing.
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, MemoryError) as error:
        raise RecordError(f"{name}: no HDF5 file, or damaged ({error}).") from None
    return table_of(found, name, units)


def _datasets(group: Any, h5py: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the datasets below a group with their names; what MATLAB keeps for itself is left."""
    for key, item in group.items():
        if key.startswith("#") or item is None:
            continue
        called = f"{path}.{key}" if path else key
        if isinstance(item, h5py.Group):
            yield from _datasets(item, h5py, called)
        elif isinstance(item, h5py.Dataset) and item.attrs.get("MATLAB_class") != b"char":
            yield called, item


def _arrays(key: str, dataset: Any) -> Iterator[tuple[str, AnyArray]]:
    if dataset.dtype.names:
        rows = np.asarray(dataset[()])
        for field in dataset.dtype.names:
            yield from columns_of(field, np.asarray(rows[field]))
    elif dataset.dtype.kind in "fiub" and dataset.ndim <= 2:
        yield from columns_of(key, np.asarray(dataset[()]))


def _unit(dataset: Any) -> str | None:
    for key in _UNITS:
        stated = dataset.attrs.get(key)
        if stated is not None and np.size(stated) == 1:
            first = np.ravel(stated)[0]  # some programs write an array of one text
            text = first.decode(errors="replace") if isinstance(first, bytes) else str(first)
            unit = unit_or_none(text)
            return None if unit is None else unit.name
    return None

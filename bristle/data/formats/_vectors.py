"""Named arrays of a file as a table: those of the commonest length are its columns."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...errors import RecordError
from ..table import Table, from_arrays

AnyArray: TypeAlias = NDArray[Any]

_STEPS = ("dt", "ts", "tsample", "t_s", "sampletime", "sample_time", "delta_t", "step")
_RATES = ("fs", "rate", "samplerate", "sample_rate", "sampling_rate", "fsample", "f_s")


def columns_of(key: str, array: AnyArray) -> Iterator[tuple[str, AnyArray]]:
    """Yield (name, array) of an array of numbers; a matrix gives `name_1`, `name_2` ..."""
    if array.dtype.kind not in "fiub" or not array.size:
        return
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()
    if array.ndim == 2:
        columns = array.T if array.shape[0] >= array.shape[1] else array
        for index, column in enumerate(columns, 1):
            yield f"{key}_{index}", column
    elif array.ndim < 2:
        yield key, array


def table_of(
    found: Sequence[tuple[str, AnyArray]],
    name: str,
    units: Mapping[str, str | None] | None = None,
) -> Table:
    """Return the table of the vectors of the commonest length.

    Where no vector is a time, one is made from a scalar called dt, Ts or fs.

    Parameters
    ----------
    found : names and arrays: (n,), or one number
    name : the file, for messages
    units : names to units, where the file says them

    Raises
    ------
    RecordError
        If there is no vector.
    """
    lengths = Counter(len(array) for _, array in found if array.ndim and len(array) > 1)
    if not lengths:
        raise RecordError(f"{name}: the file holds no vector of numbers.")
    size = max(lengths, key=lambda length: (lengths[length], length))
    data = {key: array for key, array in found if array.ndim and len(array) == size}
    others = sorted({key for key, array in found if array.ndim and len(array) not in (1, size)})
    notes = []
    if others:
        notes.append(f"left out, for they have another length than {size}: {', '.join(others)}")
    _add_time(data, {key: array for key, array in found if array.size == 1}, size, notes)
    return from_arrays(data, name, units, tuple(notes))


def _add_time(
    data: dict[str, AnyArray], scalars: Mapping[str, AnyArray], size: int, notes: list[str]
) -> None:
    """Make a time from a sampling step or rate where no vector can be one."""
    if any(_short(key) in ("t", "time", "x.time") or "time" in _short(key) for key in data):
        return
    for key, array in scalars.items():
        value = float(array.ravel()[0])
        short = _short(key)
        if not 0.0 < value < np.inf or short not in (*_STEPS, *_RATES):
            continue
        step = value if short in _STEPS else 1.0 / value
        data["time_s"] = np.arange(size) * step
        notes.append(f"the time is made from {key} = {value:g} {'s' if short in _STEPS else 'Hz'}")
        return


def _short(key: str) -> str:
    return key.rpartition(".")[2].lower()

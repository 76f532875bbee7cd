"""MAT files up to version 7: vectors, columns of matrices, fields of structures."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import RecordError
from ..table import Table, from_arrays

_STEPS = ("dt", "ts", "tsample", "t_s", "sampletime", "sample_time", "delta_t", "step")
_RATES = ("fs", "rate", "samplerate", "sample_rate", "sampling_rate", "fsample", "f_s")


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
        If the file is of version 7.3, damaged, or holds no vector.
    """
    if content.startswith((b"MATLAB 7.3", b"\x89HDF")):
        raise RecordError(
            f"{name}: this is a MAT file of version 7.3, which is HDF5. Save it as version 7: "
            "save('run.mat', 't', 'F', '-v7')."
        )
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
    lengths = Counter(len(array) for _, array in found if array.ndim and len(array) > 1)
    if not lengths:
        raise RecordError(f"{name}: the file holds no vector of numbers.")
    size = max(lengths, key=lambda length: (lengths[length], length))
    data = {key: array for key, array in found if array.ndim and len(array) == size}
    others = sorted({key for key, array in found if array.ndim and len(array) not in (1, size)})
    notes = []
    if others:
        notes.append(f"left out, because their length is not {size}: {', '.join(others)}")
    _add_time(data, {key: array for key, array in found if array.size == 1}, size, notes)
    return from_arrays(data, name, notes=tuple(notes))


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
    if array.dtype.kind not in "fiub" or not array.size:
        return
    if array.ndim == 2:
        columns = array.T if array.shape[0] >= array.shape[1] else array
        for index, column in enumerate(columns, 1):
            yield f"{key}_{index}", column
    elif array.ndim < 2:
        yield key, array


def _add_time(
    data: dict[str, np.ndarray[Any, np.dtype[Any]]],
    scalars: dict[str, np.ndarray[Any, np.dtype[Any]]],
    size: int,
    notes: list[str],
) -> None:
    """Make a time from a sampling step or rate where no vector can be one."""
    if any(_short(key) in ("t", "time", "x.time") or "time" in _short(key) for key in data):
        return
    for key, array in scalars.items():
        value = float(array.ravel()[0])
        short = _short(key)
        if value <= 0.0 or short not in (*_STEPS, *_RATES):
            continue
        step = value if short in _STEPS else 1.0 / value
        data["time_s"] = np.arange(size) * step
        notes.append(f"the time is made from {key} = {value:g} {'s' if short in _STEPS else 'Hz'}")
        return


def _short(key: str) -> str:
    return key.rpartition(".")[2].lower()

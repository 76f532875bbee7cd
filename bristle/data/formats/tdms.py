"""TDMS of National Instruments: the channels of one group; no index file is needed."""

from __future__ import annotations

import io
from collections import Counter
from typing import Any

import numpy as np

from ...errors import RecordError
from ..channels import quantity_of_unit
from ..table import Table, from_arrays
from ..titles import unit_or_none
from ._extra import library

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
_RISING = 0.98  # share of the steps of a time that are positive, at least


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is TDMS or the index of one, by its first bytes."""
    return content.startswith((b"TDSm", b"TDSh"))


def read(content: bytes, name: str) -> Table:
    """Return the table in a TDMS file.

    The group with most channels of one length is read; its waveforms' step gives the time where no
    channel is one.

    Raises
    ------
    RecordError
        If npTDMS is not installed, the file is an index or damaged, or it holds no samples.
    """
    if content.startswith(b"TDSh"):
        raise RecordError(
            f"{name}: this is the index of a TDMS file and holds no samples. Take the .tdms file; "
            "it is read without its index."
        )
    tdms = library("nptdms", name, "TDMS")
    try:
        file = tdms.TdmsFile.read(io.BytesIO(content))
        groups = {group.name: _channels(group) for group in file.groups()}
    # A damaged file surfaces as any of these from the library's own parsing.
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError, EOFError,
            MemoryError, RuntimeError, ArithmeticError) as error:  # fmt: skip
        raise RecordError(f"{name}: no TDMS file, or damaged ({error}).") from None
    if not any(groups.values()):
        raise RecordError(f"{name}: the TDMS file holds no samples.")
    chosen = max(groups, key=lambda key: _size(groups[key]))
    channels = groups[chosen]
    size = _length(channels)
    notes = [] if len(groups) == 1 else [f'of {len(groups)} groups "{chosen}" is read']
    others = [key for key, (array, _, _) in channels.items() if len(array) != size]
    if others:
        notes.append(f"left out, for they have another length than {size}: {', '.join(others)}")
    kept = {key: one for key, one in channels.items() if len(one[0]) == size}
    data = {key: array for key, (array, _, _) in kept.items()}
    units: dict[str, str | None] = {key: unit for key, (_, unit, _) in kept.items()}
    steps = {step for _, _, step in kept.values() if step}
    timed = any(_is_time(key, array, units[key]) for key, array in data.items())
    if not timed and len(steps) == 1:
        step = steps.pop()
        data, units["time"] = {"time": np.arange(size) * step, **data}, "s"
        notes.append(f"the time is made from wf_increment = {step:g} s")
    return from_arrays(data, name, units, tuple(notes))


Channels = dict[str, tuple[Any, str | None, float]]
"""Name to samples (n,), unit and step [s], 0 where none is given."""


def _channels(group: Any) -> Channels:
    out: Channels = {}
    for channel in group.channels():
        array = np.asarray(channel[:])
        if array.ndim != 1 or not len(array):
            continue
        stated = next((channel.properties[key] for key in _UNITS if key in channel.properties), "")
        unit = unit_or_none(str(stated))
        step = float(channel.properties.get("wf_increment", 0.0) or 0.0)
        out[channel.name] = array, None if unit is None else unit.name, step
    return out


def _is_time(name: str, array: Any, unit: str | None) -> bool:
    """Return whether a channel is the time by its name or, in any language, by its unit."""
    if "time" in name.lower() or array.dtype.kind == "M":
        return True
    # What is written beside a time is often a wf_increment of 1, which nobody set.
    if quantity_of_unit(unit) != "time" or array.dtype.kind not in "fiu":
        return False
    return float(np.mean(np.diff(array) > 0.0)) > _RISING


def _length(channels: Channels) -> int:
    lengths = Counter(len(array) for array, _, _ in channels.values())
    return max(lengths, key=lambda length: (lengths[length], length))


def _size(channels: Channels) -> tuple[int, int]:
    """Return how many channels have the commonest length, and that length."""
    if not channels:
        return 0, 0
    size = _length(channels)
    return sum(len(array) == size for array, _, _ in channels.values()), size

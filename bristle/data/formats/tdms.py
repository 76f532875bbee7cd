"""TDMS of National Instruments: the channels of a group and of those that were recorded with it.

No index file is needed.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import Array
from ...core.text import listed, plain
from ...errors import RecordError
from ...units import parse as parse_unit
from ..channels import quantity_of_unit
from ..table import Table
from ..titles import unit_or_none
from . import DAMAGED, _one_time, library
from ._one_time import SAME, AnyArray, Series, by_length, overlap, unset_step
from ._tree import Found, one_table

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units", "Units")
_UNSET = np.datetime64("1904-01-02")
"""LabVIEW's zero of time, and a day more for time zones: a start that nobody set."""
_SHARED = 0.5
"""Share of a group's time that another group has, at the least, to be read with it."""
_RISING = 0.98  # share of the steps of a time that are positive, at least


_STEP = "wf_increment"
_TELLS_STEP = re.compile("rate|freq|sampl|^fs|^dt", re.IGNORECASE)


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is TDMS or the index of one, by its first bytes."""
    return content.startswith((b"TDSm", b"TDSh"))


def read(content: bytes, name: str) -> Table:
    """Return the table in a TDMS file.

    The group with most channels is read, and those beside it that hold other channels of the same
    time. A channel's time is that of a channel beside it that is one, else its waveform's start,
    offset and step; channels of several times are put on one.

    Raises
    ------
    RecordError
        If npTDMS is not installed, the file is an index or damaged, or it holds no samples; if the
        channels of a group do not overlap in time.
    """
    if content.startswith(b"TDSh"):
        raise RecordError(
            f"{name}: this is the index of a TDMS file and holds no samples. Take the .tdms file; "
            "it is read without its index."
        )
    tdms = library("nptdms", name, "TDMS")
    try:
        file = tdms.TdmsFile.read(io.BytesIO(content))
        groups = {group.name: _channels(group, file.properties) for group in file.groups()}
    except DAMAGED as error:
        raise RecordError(f"{name}: no TDMS file, or damaged ({error}).") from None
    groups = {key: channels for key, channels in groups.items() if channels}
    if not groups:
        raise RecordError(f"{name}: the TDMS file holds no samples.")
    chosen = max(groups, key=lambda key: _size(groups[key]))
    zero = min(_instants(groups), default=None)
    clocks = {key: _series(channels, zero) for key, channels in groups.items()}
    beside, remarks = _beside(groups, clocks, chosen)
    remarks += [one for key in (chosen, *beside) for one in clocks[key].remarks]
    remarks += _assumed({k: one for key in (chosen, *beside) for k, one in groups[key].items()})
    return _table([chosen, *beside], groups, clocks, name, remarks)


class _Channel(NamedTuple):
    """Samples (n,), unit, and of the waveform its start, offset and step [s], 0 if not given.

    `called` is the property that tells the step.
    """

    array: AnyArray
    unit: str | None
    start: np.datetime64 | None
    offset: float
    step: float
    called: str


Channels = dict[str, _Channel]


class _Clocks(NamedTuple):
    """A group's channels by their times; `untimed` has none; `made` from waveforms; `times` are
    channels themselves; `remarks` say what was taken for which."""

    series: list[Series]
    untimed: dict[str, AnyArray]
    made: bool
    times: list[str]
    remarks: list[str]


def _channels(group: Any, of_file: Mapping[str, Any]) -> Channels:
    """Return a group's channels; what they do not tell of their waveform, group or file may."""
    out: Channels = {}
    for channel in group.channels():
        array = np.asarray(channel[:])
        if array.ndim != 1 or not len(array):
            continue
        given = channel.properties
        stated = next((given[key] for key in _UNITS if key in given), "")
        unit = unit_or_none(str(stated))
        given = {**of_file, **group.properties, **given}
        start = given.get("wf_start_time")
        known = isinstance(start, np.datetime64) and not np.isnat(start) and start > _UNSET
        step, offset = (_seconds(given, key) for key in ("wf_increment", "wf_start_offset"))
        called, (other, rate) = _STEP, _by_rate(given)
        if other and (step <= 0.0 or step == 1.0):  # nobody set it, or left it at 1
            step, called = other, rate
        out[channel.name] = _Channel(
            array, None if unit is None else unit.name, start if known else None, offset,
            max(step, 0.0), called,
        )  # fmt: skip
    return out


def _by_rate(given: Mapping[str, Any]) -> tuple[float, str]:
    """Return the step [s] that the one property tells which is a rate or a step, and its name."""
    found = {}
    for key, value in given.items():
        number, _, unit = str(value).partition(" ")
        with suppress(ValueError):
            step = _one_time.step_in(f"{key} [{unit}]" if unit else key, float(number))
            if step > 0.0 and _TELLS_STEP.search(key):
                found[step] = key
    ((step, called),) = found.items() if len(found) == 1 else ((0.0, _STEP),)
    return step, called


def _seconds(given: Any, key: str) -> float:
    """Return a number of a waveform's axis in s, 0 where there is none or the axis is no time."""
    unit = unit_or_none(str(given.get("wf_xunit_string") or "s"))
    value = float(given.get(key, 0.0) or 0.0)
    if unit is None or quantity_of_unit(unit.name) != "time" or not np.isfinite(value):
        return 0.0
    return value * unit.factor


def _instants(groups: dict[str, Channels]) -> Iterator[np.datetime64]:
    """Yield the instants at which the channels begin, as far as they are told."""
    for one in (one for channels in groups.values() for one in channels.values()):
        if one.array.dtype.kind == "M":
            yield one.array[0]
        elif one.start is not None:
            yield one.start


def _series(channels: Channels, zero: np.datetime64 | None) -> _Clocks:
    """Return a group's channels by their times, in s since `zero` where they tell an instant.

    A channel that is a time counts for all of its length, `wf_increment` is then often a 1 that
    nobody set; what began later than it is later by that.
    """
    times = [key for key, one in channels.items() if _is_time(key, one.array, one.unit)]
    remarks: list[str] = []
    ahead = _times_of(channels, times, zero, remarks)
    found: dict[Any, Series] = {}
    untimed: dict[str, AnyArray] = {}
    made = False
    starts = [one.start for one in channels.values() if one.start is not None]
    for key, one in channels.items():
        size = len(one.array)
        own = ahead.get(key)
        if own is not None:
            late = 0.0 if key == own else _late(one, own, channels)
            clock: Any = own, late
            if clock not in found and (time := _time_in(channels[own], zero)) is not None:
                found[clock] = Series(time + late, {})
        elif one.step and size > 1:
            start = one.start if one.start is not None else min(starts, default=zero)
            since = 0.0 if start is None else _since(zero, start)
            clock = (since + one.offset, one.step, size)
            if clock not in found:
                even = since + one.offset + np.arange(size) * one.step
                found[clock] = Series(np.asarray(even, dtype=float), {})
            made = True
        else:
            clock = None
        if clock in found:
            found[clock].data[key] = one.array
        else:
            untimed[key] = one.array
    series, untimed = by_length(untimed, list(found.values()))
    return _Clocks(series, untimed, made, times, remarks)


def _times_of(
    channels: Channels, times: list[str], zero: np.datetime64 | None, remarks: list[str]
) -> dict[str, str]:
    """Return the time of each channel that has one of its length: the first one of that length.

    Where each of several stands ahead of channels, and they tell different times of one record, it
    is that of the channels behind it.
    """
    out: dict[str, str] = {}
    for size in {len(channels[key].array) for key in times}:
        own = [key for key, one in channels.items() if len(one.array) == size]
        able = [key for key in own if key in times]
        if _differ([_time_in(channels[key], zero) for key in able]):
            leads = [k for k, after in pairwise([*own, able[0]]) if {k, after} & {*able} == {k}]
            if own[0] != able[0] or leads != able:
                remarks.append(
                    f"{listed(able)} tell different times, and {able[0]} is taken for all "
                    "channels: expected each of them ahead of its own channels"
                )
                able = able[:1]
        else:
            able = able[:1]
        last = able[0]
        for key in own:
            last = out[key] = key if key in able else last
    return out


def _differ(times: list[Array | None]) -> bool:
    """Return whether times (n,) s of one length are those of one record, and not the same."""
    series = [Series(time, {}) for time in times if time is not None]
    if len(series) < max(len(times), 2):
        return False
    (begin, end), first = overlap(series), series[0]
    apart = max(float(np.max(np.abs(one.time - first.time))) for one in series)
    return apart > SAME * first.step and end - begin >= _SHARED * float(np.ptp(first.time))


def _late(one: _Channel, own: str, channels: Channels) -> float:
    """Return how much later [s] a channel began than the time that was recorded with it.

    Where that time tells no start, its start is that of most channels of its length.
    """
    beside = [other for other in channels.values() if len(other.array) == len(one.array)]
    begins = [(other.start, other.offset) for other in beside if other.start is not None]
    if one.start is None or not begins:
        return 0.0
    time = channels[own]
    usual = Counter(begins).most_common(1)[0][0]
    first = usual if time.start is None else (time.start, time.offset)
    return float(_since(first[0], one.start)) + one.offset - first[1]


def _assumed(channels: Channels) -> list[str]:
    """Return that a start is not known where others have one."""
    made = {key: one for key, one in channels.items() if one.step}
    if any(_is_time(key, one.array, one.unit) for key, one in channels.items()):
        return []
    lacking = [key for key, one in made.items() if one.start is None]
    sizes = {len(one.array) for one in made.values()}
    bare = [k for k, one in channels.items() if not one.step and len(one.array) in sizes]
    said = []
    if lacking and len(lacking) < len(made):
        said.append(f"no wf_start_time is given for {listed(lacking)}: taken to begin as others do")
    if bare:
        said.append(f"no wf_increment is given for {listed(bare)}: taken to be sampled as others")
    return said


def _since(zero: Any, instants: Any) -> Any:
    """Return instants as s since one."""
    return np.float64(1e-9) * ((instants - zero) / np.timedelta64(1, "ns"))


def _time_in(channel: _Channel, zero: np.datetime64 | None) -> Array | None:
    """Return a channel's times (n,) s, None where they do not increase throughout."""
    array = channel.array
    if array.dtype.kind == "M":
        first = array[0] if zero is None else zero
        time = _since(first, array)
    elif array.dtype.kind in "fiu":
        unit = parse_unit(channel.unit or "s")
        time = np.asarray(array, dtype=float) * unit.factor
    else:
        return None
    return time if len(time) > 1 and (np.diff(time) > 0.0).all() else None


def _beside(
    groups: dict[str, Channels], clocks: dict[str, _Clocks], chosen: str
) -> tuple[list[str], list[str]]:
    """Return the groups that are read beside the chosen one, and what is said of the others."""
    known, own = set(groups[chosen]) - set(clocks[chosen].times), clocks[chosen].series
    beside, remarks = [], []
    for key, clock in clocks.items():
        if key == chosen:
            continue
        names = set(groups[key]) - set(clock.times)
        what = f'group "{key}" ({listed(sorted(names) or groups[key], 4)}) is not read: '
        if names & known:
            remarks.append(what + "its channels are called as others are; is it a run of its own?")
        elif not own or not clock.series:
            sizes = {len(one.array) for one in groups[chosen].values()}
            if own or clock.series or not {len(one) for one in clock.untimed.values()} <= sizes:
                remarks.append(what + "nothing tells its time")
                continue
            known |= names
            beside.append(key)
        else:
            begin, end = overlap([*own, *clock.series])
            whole = overlap(own)
            if end - begin < _SHARED * (whole[1] - whole[0]):
                first, last = overlap(clock.series)
                remarks.append(
                    f"{what}it was recorded from {plain(first, 5)} s to {plain(last, 5)} s, and "
                    f'"{chosen}" from {plain(whole[0], 5)} s to {plain(whole[1], 5)} s'
                )
                continue
            known |= names
            beside.append(key)
    return beside, remarks


def _table(
    read: list[str], groups: dict[str, Channels], clocks: dict[str, _Clocks], name: str,
    remarks: list[str],
) -> Table:  # fmt: skip
    """Return the table of the channels in some groups of a file."""
    every = {key: one for group in read for key, one in groups[group].items()}
    found = Found(units={key: one.unit for key, one in every.items() if one.unit}, remarks=remarks)
    if len(groups) > 1:
        told = listed(f'"{one}"' for one in read)
        verb = "is" if len(read) == 1 else "are"
        found.notes.append(f"of {len(groups)} groups {told} {verb} read")
    for clock in (clocks[group] for group in read):
        for one in clock.series:
            own = next((key for key in clock.times if key in one.data), "")
            if own and every[own].array.dtype.kind == "M":
                found.units[own] = "s"
            data = {key: array for key, array in one.data.items() if key != own}
            time = one.time / parse_unit(found.units.get(own, "s")).factor
            found.clocks.append((own or "time", time, data))
        found.loose |= clock.untimed
    if "time" not in every:
        found.units["time"] = "s"
    times = [(called, time) for called, time, data in found.clocks if data]
    if len(times) == 1 and times[0][0] == "time" and "time" not in every:
        called = {one.called for one in every.values() if one.step}
        step = float(np.median(np.diff(times[0][1])))
        told = f"the time is made from {listed(sorted(called))}: {step:g} s a sample"
        (found.notes if called == {_STEP} else found.remarks).append(told)
        found.remarks[:0] = unset_step(_STEP, step)
    return one_table(found, name)


def _is_time(name: str, array: Any, unit: str | None) -> bool:
    """Return whether a channel is the time by its name or, in any language, by its unit."""
    if "time" in name.lower() or array.dtype.kind == "M":
        return True
    # What is written beside a time is often a wf_increment of 1, which nobody set.
    if quantity_of_unit(unit) != "time" or array.dtype.kind not in "fiu":
        return False
    return float(np.mean(np.diff(array) > 0.0)) > _RISING


def _size(channels: Channels) -> tuple[int, int]:
    """Return how many channels a group has, and how long most of them are."""
    lengths = Counter(len(one.array) for one in channels.values())
    return len(channels), max(lengths, key=lambda length: (lengths[length], length))

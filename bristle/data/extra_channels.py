"""Channels besides those that bristle knows: a pressure, a second force, a strain.

They command nothing and fit nothing by themselves: an error may depend on them, and a learned curve
may follow them. What is wrong with one costs this channel, and never the run.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import plain
from ..errors import RecordError, UnitError
from ..units import conversion, parse, same_dimension, si_unit
from .channels import DRIVE, PLAIN, UNITS, ChannelSpec, is_channel, meaning, of_a_sensor
from .table import Table
from .titles import Column

MIN_VALUES = 20
"""Values of such a channel in a run, at least."""

HOLE = 0.25
"""Share of a run over which it may have no value, at the most."""

ABSURD = 1e30
"""What some recorders write where a value is missing; so do larger numbers."""

MAX_CHANNELS = 40
"""Columns of a file that are taken for such channels, at the most."""

COMPARED = 2000
"""Values of a column that are compared with those of another."""

SAME = 1e-6, 1e-12
"""Share of its spread by which a column may leave a line in another one and hold the same, and
share of its largest value below which that spread is none."""

RAW = 0.02, 1e-9
"""The same of a raw signal, by its rounding."""

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_TITLE_UNIT = re.compile(r".*[\[(]\s*(?P<unit>[^\[\]()]+?)\s*[\])]\s*")
_TAKEN = {
    "speed", "direction", "rest", "travel", "stroke", "age", "slowing", "rebuilding", "resonance",
    "slip", "stroke_ratio", "moving_mass", "dissipated_energy", "fault", "curve",
    "time_since_reversal", *UNITS,
}  # fmt: skip
"""What coordinates, labels and ports of a damper are called."""


@dataclass(frozen=True, eq=False)
class Extra:
    """Such a channel in a run: `values` (n,) in `unit`, SI where the unit is known."""

    values: Array
    unit: str

    @property
    def known_unit(self) -> str:
        """The unit as parameters of effects have it: "1" where bristle does not know it."""
        try:
            return parse(self.unit).name
        except UnitError:
            return "1"

    def of(self, part: slice) -> Extra:
        """Return some of its samples."""
        return replace(self, values=self.values[part])


def refused_name(name: str) -> str:
    """Return why a channel cannot have a name, in a few words; "" where it can."""
    if is_channel(name):
        return f"{name} is a channel that bristle knows: [channels.{name}] is its place"
    if not _NAME.fullmatch(name):
        return "small letters, digits and _ are right, a letter first"
    if name in _TAKEN:
        return "a coordinate, a label or a port has this name"
    return ""


def as_word(text: str) -> str:
    """Return a text as a name has it: "Acc. pressure" is acc_pressure."""
    plain_text = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "_", plain_text.lower()).strip("_")


def name_of(column: Column, taken: Iterable[str]) -> str:
    """Return a name for the channel in a column, from its title, that none of `taken` has."""
    name = as_word(column.name) or "channel"
    name = name if name[0].isalpha() else f"channel_{name}"
    known, number = {*taken}, 2
    free = name
    while free in known or refused_name(free):
        free, number = f"{name}_{number}", number + 1
    return free


def unit_as_written(column: Column) -> str:
    """Return the unit in a column's title, whether it is known or not; "" where it has none."""
    if column.unit is not None:
        return column.unit.name
    written = _TITLE_UNIT.fullmatch(column.text)
    return column.written or (written["unit"] if written else "")


def unit_of(spec: ChannelSpec) -> str:
    """Return the unit in which a channel is kept: SI where its own is known, else its own."""
    try:
        return si_unit(spec.unit)
    except UnitError:
        return spec.unit


def found_in(table: Table, used: Iterable[str], names: Iterable[str]) -> dict[str, ChannelSpec]:
    """Return the channels in the columns of a table that have a title and a unit, by name.

    Not those that hold the same as another column, in other units or as raw volts as well, nor a
    second time or index: what grows by the same amount from sample to sample.

    Parameters
    ----------
    table : what a file holds
    used : titles of the columns that are channels already
    names : those of other channels
    """
    used = [text for text in used if text in table.values]
    seen = [table.values[text] for text in used]
    counted = np.arange(table.rows, dtype=float)
    out: dict[str, ChannelSpec] = {}
    raw = raw_signals(table)
    for column in table.columns:
        if column.text in raw:
            continue
        unit = unit_as_written(column)
        if len(out) == MAX_CHANNELS:
            break
        if column.text in used or column.text in table.not_numeric or not unit:
            continue
        values = _known_values(table.values[column.text])
        if np.isfinite(values).sum() < MIN_VALUES:
            continue
        if any(_on_a_line(values, one, *SAME) for one in (counted, *seen)):
            continue
        seen.append(values)
        out[name_of(column, (*names, *out))] = ChannelSpec(column.text, unit)
    return out


# Columns of raw volts or milliamperes that stand beside the same signal in its own unit.


def _is_electric(column: Column) -> bool:
    """Return whether a column is in volts or amperes, or in mV/V as of a bridge."""
    return column.stated.endswith("V/V") or any(
        same_dimension(column.stated, PLAIN[name]) for name in ("voltage", "current")
    )


def raw_signals(table: Table) -> dict[str, str]:
    """Return the columns that hold raw signals, each with that of the same signal in its unit.

    They have the name of the other column, where it is one of a sensor, or lie on a line with it.
    """
    there = [one for one in table.columns if one.text not in table.not_numeric and one.unit]
    raw = [one for one in there if _is_electric(one)]
    others = [one for one in there if not _is_electric(one) and not _is_command_or_time(one)]
    out: dict[str, str] = {}
    for one in raw:
        for other in others:
            same = one.name.strip().lower() == other.name.strip().lower()
            values, beside = table.values[one.text], table.values[other.text]
            if (same and _is_sensed(one)) or _on_a_line(values, beside, *RAW):
                out[one.text] = other.text
                break
    return out


def _is_command_or_time(column: Column) -> bool:
    return any(same_dimension(column.stated, PLAIN[name]) for name in (*DRIVE, "time"))


def _is_sensed(column: Column) -> bool:
    meant = meaning(column.name, None)
    return of_a_sensor(column.name) or (
        meant is not None and meant.quantity not in (*DRIVE, "time")
    )


def _known_values(values: Array) -> Array:
    """Return values (n,) with NaN where none was measured."""
    return np.where(np.abs(values) < ABSURD, values, np.nan)


def _on_a_line(values: Array, other: Array, off: float, still: float) -> bool:
    """Return whether a column is another one in other units; a constant one is not.

    Parameters
    ----------
    values, other : (n,) of the columns
    off, still : as `SAME` and `RAW` have them
    """
    both = np.flatnonzero((np.abs(values) < ABSURD) & (np.abs(other) < ABSURD))
    if len(both) < MIN_VALUES:
        return False
    both = both[:: -(-len(both) // COMPARED)]
    y, x = (one[both] - one[both].mean() for one in (values, other))
    spread, power = float(np.std(y)), float(x @ x)
    if not spread > still * float(np.max(np.abs(values[both]))) or not power > 0.0:
        return False
    return float(np.std(y - x * (x @ y) / power)) <= off * spread


@dataclass(frozen=True, eq=False)
class Read:
    """The extra channels of a file as read: `time` [s] and `values` in SI of each, and `notes`."""

    known: Mapping[str, tuple[Array, Array, str]]
    notes: tuple[str, ...]

    def beside(self, name: str, time: Array, values: Array, unit: str) -> Read:
        """Return the same with one more channel, where it has values enough.

        Parameters
        ----------
        name, unit : of the channel
        time, values : (n,) s, and in that unit, NaN where a value is missing
        """
        there = np.isfinite(values) & np.isfinite(time)
        try:
            _refuse_holes(time, there)
        except RecordError:  # its mean counts all the same, and is told
            return self
        return replace(self, known={**self.known, name: _in_order(time, values, there, unit)})

    def at(self, times: Array) -> dict[str, Extra]:
        """Return the channels at the samples of a run.

        Parameters
        ----------
        times : (n,) s, evenly spaced; where the file is sampled faster, the mean about each counts
        """
        step = float(times[1] - times[0])
        out = {}
        for name, (own, values, unit) in self.known.items():
            every = round(step / float(np.median(np.diff(own))))
            if every > 1:
                values = _smoothed(values, every)
            out[name] = Extra(np.asarray(np.interp(times, own, values)), unit)
        return out


def _smoothed(values: Array, every: int) -> Array:
    from scipy.ndimage import convolve1d

    window = np.hanning(2 * every + 1)[1:-1]
    return np.asarray(convolve1d(values, window / window.sum(), mode="nearest"))


def read_extra(table: Table, time: Array, wanted: Mapping[str, ChannelSpec]) -> Read:
    """Return the extra channels of a table; the notes tell of those that it does not hold.

    Parameters
    ----------
    table : what a file holds
    time : (n,) s of its rows
    wanted : where each channel is, by name
    """
    found: dict[str, tuple[Array, Array, str]] = {}
    notes = []
    for name, spec in wanted.items():
        try:
            values, unit = _converted(table, spec)
            there = np.isfinite(values) & np.isfinite(time)
            _refuse_holes(time, there)
        except RecordError as error:
            notes.append(f"{name}: left out of this run: {error}")
            continue
        filled = len(time) - int(there.sum())
        if filled:
            share = plain(100.0 * filled / len(time), 2)
            notes.append(f"{name}: {share} % of its values are missing and are interpolated")
        found[name] = _in_order(time, values, there, unit)
    return Read(found, tuple(notes))


def _in_order(time: Array, values: Array, there: Flags, unit: str) -> tuple[Array, Array, str]:
    """Return the times and values that are there, in the order of time, and their unit."""
    order = np.argsort(time[there], kind="stable")
    return time[there][order], values[there][order], unit


def _converted(table: Table, spec: ChannelSpec) -> tuple[Array, str]:
    """Return the values (n,) of a channel in its unit, NaN where one is missing, and that unit."""
    column = table.find(spec.column)
    if column.text in table.not_numeric:
        raise RecordError(f'column "{column.text}": {table.not_numeric[column.text]}')
    written = unit_as_written(column)
    if written and spec.unit and not _same_unit(written, spec.unit):
        raise RecordError(f'"{column.text}" is in {written} here, and in {spec.unit} in study.toml')
    unit = unit_of(spec)
    factor, offset = (1.0, 0.0) if unit == spec.unit else conversion(spec.unit, unit)
    values = spec.sign * (factor * _known_values(table.values[column.text]) + offset)
    return np.asarray(values), unit


def _same_unit(first: str, second: str) -> bool:
    try:
        return parse(first) == parse(second)
    except UnitError:
        return first == second


def _refuse_holes(time: Array, there: Flags) -> None:
    """Refuse a channel that has too few values in a run to be interpolated."""
    count = int(there.sum())
    if count < MIN_VALUES:
        raise RecordError(f"it has {count} values; {MIN_VALUES} or more are needed")
    begin, end = float(np.nanmin(time)), float(np.nanmax(time))
    edges = np.concatenate([[begin], np.sort(time[there]), [end]])
    widest = int(np.argmax(np.diff(edges)))
    if edges[widest + 1] - edges[widest] > HOLE * (end - begin):
        raise RecordError(
            f"no value from {plain(edges[widest], 4)} s to {plain(edges[widest + 1], 4)} s"
        )

"""Tables of numbers: columns with titles and units, not converted yet; see `measurement`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array, Flags, Indices
from ..core.text import listed
from ..errors import RecordError
from .titles import Column, titles

if TYPE_CHECKING:
    import pandas as pd


_CODE = -7999.0
"""A number that loggers write where nothing was measured, besides nines: -9999, 99999.99."""

_LEAPS = 5.0
"""Times as far outside of its neighbours as other samples are, 1 % aside, a mark is."""

_SURE = 3
"""Marks at the least that stand out like that; some stand where the column passes by."""


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers.

    `values` maps a column's text, its title in the file, to (n,) floats, NaN where a value is
    missing. `not_numeric` says of a column that holds text where it is. `lines` (n,) is the line
    of the file, or the row, that each sample is from, called `place`. `remarks` are the notes that
    who makes a study reads at once: what of the file is not read, or moved in time. `split` cuts
    the runs that a file holds one below the other, "" where it holds one; see `pieces`.
    """

    source: str
    columns: tuple[Column, ...]
    values: dict[str, Array]
    lines: Indices
    place: str = "line"
    not_numeric: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    split: str = ""

    @property
    def rows(self) -> int:
        """Number of samples."""
        return len(self.lines)

    def find(self, called: str) -> Column:
        """Return the column of a title, or of a name without its unit where that is one column.

        Raises
        ------
        RecordError
            If there is no such column, or several.
        """
        for column in self.columns:
            if column.text == called:
                return column
        named = [column for column in self.columns if column.name == called]
        if len(named) == 1:
            return named[0]
        there = listed(f'"{column.text}"' for column in self.columns)
        what = "several columns are" if named else "no column is"
        raise RecordError(f'{self.source}: {what} called "{called}"; there are {there}.')

    def where(self, row: int) -> str:
        """Return the place of a sample in words: "line 12"."""
        return f"{self.place} {self.lines[row]}"


def without_codes(table: Table) -> Table:
    """Return a table without the numbers that a logger writes where nothing was measured.

    Such as -9999: no other value of the column comes near it, or it jumps there and back.
    """
    values, remarks = dict(table.values), list(table.remarks)
    for key, own in table.values.items():
        size = np.abs(own)
        nines = np.floor(size) + 1.0
        able = (nines >= 1e3) & (10.0 ** np.round(np.log10(np.maximum(nines, 1.0))) == nines)
        able |= own == _CODE
        if not able.any():
            continue
        met, often = np.unique(own[able], return_counts=True)
        code = met[np.lexsort((np.abs(met), often))[-1]]
        is_code = own == code
        others = size[~is_code & np.isfinite(own)]
        if others.size < _SURE:
            continue
        if float(others.max()) < 0.5 * abs(code) or _jumps_to(is_code, own):
            values[key] = np.where(is_code, np.nan, own)
            remarks.append(
                f'"{key}" is {code:g} in {is_code.sum()} places, and else within '
                f"{others.max():.4g}: taken as missing there"
            )
    return replace(table, values=values, remarks=tuple(remarks))


def _jumps_to(is_code: Flags, own: Array) -> bool:
    """Return whether a column (n,) is far off where it has one value, and comes back at once.

    As a mark within the range of what is measured does; a signal that passes through does not.
    """
    y = own[~is_code & np.isfinite(own)]
    after = np.clip(np.cumsum(~is_code & np.isfinite(own))[is_code], 1, len(y) - 1)
    beyond = _outside(own[is_code], y[after - 1], y[after])
    usual = float(np.quantile(_outside(y[1:-1], y[:-2], y[2:]), 0.99))
    return usual > 0.0 and int(np.count_nonzero(beyond > _LEAPS * usual)) >= _SURE


def _outside(y: Array, before: Array, after: Array) -> Array:
    """Return how far values (n,) are outside of those before and after them."""
    low, high = np.minimum(before, after), np.maximum(before, after)
    return np.maximum(np.maximum(low - y, y - high), 0.0)


def table_from_frame(frame: pd.DataFrame, name: str = "frame") -> Table:
    """Return the table of a pandas frame: titles with units, or units in `attrs["units"]`.

    An index with a name is a column, too: the time of bristle's own results is one.

    Raises
    ------
    RecordError
        If two columns have one name.
    """
    if frame.index.name is not None:
        frame = frame.reset_index().rename(columns={frame.index.name: str(frame.index.name)})
    names = [str(key) for key in frame.columns]
    refuse_twice(names, name)
    data = {key: frame.iloc[:, k].to_numpy() for k, key in enumerate(names)}
    return from_arrays(data, name, frame.attrs.get("units", {}))


def refuse_twice(names: Sequence[str], source: str) -> None:
    """Refuse columns that share a name: which one is meant, nobody could say.

    Raises
    ------
    RecordError
        If a name stands twice.
    """
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise RecordError(
            f'{source}: {names.count(twice)} columns are called "{twice}". Rename them.'
        )


def from_arrays(
    data: Mapping[str, NDArray[Any]],
    source: str,
    units: Mapping[str, str | None] | None = None,
    notes: tuple[str, ...] = (),
    remarks: tuple[str, ...] = (),
) -> Table:
    """Return the table of named arrays (n,); what holds no numbers is named in `not_numeric`.

    Parameters
    ----------
    data : title to (n,) of any type, in the column's own unit
    source : where the arrays are from, for messages
    units : title to unit; without one the unit in the title counts, if it has one
    notes, remarks : what to know of the table, in sentences, and what to know at once
    """
    units = units or {}
    size = len(next(iter(data.values()))) if data else 0
    columns = titles(list(data), [units.get(name) or "" for name in data])
    values: dict[str, Array] = {}
    not_numeric: dict[str, str] = {}
    for column, array in zip(columns, data.values(), strict=True):
        numbers = _numbers(array)
        values[column.text] = np.full(size, np.nan) if numbers is None else numbers
        if numbers is None:
            not_numeric[column.text] = f"it holds {array.dtype} and no numbers"
    return Table(
        source, columns, values, np.arange(1, size + 1), "row", not_numeric, notes, remarks
    )


def one_below_the_other(tables: Sequence[Table], source: str, title: str) -> Table:
    """Return the columns that all tables have, of one after the other, and one of their numbers.

    Parameters
    ----------
    tables : the runs of a file
    source : the file, for messages
    title : what the column of the numbers is called, from 1; `split` of what is returned names it
    """
    first = tables[0]
    alike = [one for one in first.columns if all(one.text in table.values for table in tables)]
    data = {one.text: np.concatenate([table.values[one.text] for table in tables]) for one in alike}
    numbers = [np.full(table.rows, number) for number, table in enumerate(tables, 1)]
    title = next(text for text in (title, f"{title} of file") if text not in data)
    units = {one.text: one.unit.name for one in alike if one.unit}
    remarks = dict.fromkeys(remark for table in tables for remark in table.remarks)
    notes = dict.fromkeys(note for table in tables for note in table.notes)
    joined = from_arrays(
        {**data, title: np.concatenate(numbers)}, source, {**units}, tuple(notes), tuple(remarks)
    )
    return replace(joined, split=f"column {title}")


def _numbers(array: NDArray[Any]) -> Array | None:
    """Return an array as floats, instants as seconds since the first; None if it holds neither."""
    if array.dtype.kind in "fiub":
        return np.asarray(array, dtype=float)
    if array.dtype.kind in "mM":
        since = array - array[0] if array.dtype.kind == "M" else array
        return np.asarray(since / np.timedelta64(1, "ns"), dtype=float) * 1e-9
    return None

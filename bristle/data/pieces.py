"""A file that holds several runs, cut into them: where time restarts, by a column, or at rests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..core.arrays import Array, Indices
from ..errors import RecordError
from ..units import conversion
from .channels import ChannelSpec
from .noise import SHORTEST, stretches
from .table import Table

RIGHT = 'expected "restart", "rests", "column TITLE", "sheets" or "sheet NAME".'

SHEET = "sheet"
"""Title of the column that tells the sheets of a workbook apart."""

STANDS = 0.01
"""Share of the usual top speed below which a rig rests."""

RESTS = 1.0
"""Time [s] for which it does between two runs."""


def wrong_split(split: str) -> str:
    """Return what is wrong with how files are to be cut, "" where nothing is."""
    kind, _, title = split.partition(" ")
    if kind in ("column", "sheet"):
        return "" if title.strip() else RIGHT
    return "" if kind in ("restart", "rests", "sheets") and not title else RIGHT


def holds_several(split: str) -> bool:
    """Return whether files hold several runs each: not where nothing but a sheet is chosen."""
    return bool(split) and not split.startswith("sheet ")


def pieces_of(table: Table, split: str, channels: Mapping[str, ChannelSpec]) -> list[Table]:
    """Return the runs in a file, each a table of its own, in the order of the file.

    Stretches of fewer than 60 samples, such as a single line between two runs, are left out.

    Parameters
    ----------
    table : the whole file
    split : "restart" where time goes back, "column TITLE" where the number in a column changes,
        "rests" in the middle of rests of a second or more, "sheets" where a workbook's next sheet
        begins; "" or "sheet NAME" for one run
    channels : where channels are; the time is needed, and for rests a motion

    Raises
    ------
    RecordError
        If nothing separates runs, or a column that is needed is not there.
    """
    if not holds_several(split) or (split == "sheets" and SHEET not in table.values):
        return [table]
    if wrong_split(split):
        raise RecordError(f"{table.source}: split = {split!r}; {RIGHT}")
    kind, _, title = split.partition(" ")
    if kind == "restart":
        cuts = np.flatnonzero(np.diff(_filled(_values(table, "time", channels))) < 0.0) + 1
    elif kind in ("column", "sheets"):
        title = title or SHEET
        cuts = np.flatnonzero(np.diff(_filled(_numbers(table, title.strip()))) != 0.0) + 1
    else:
        cuts = _rests(table, channels)
    parts = [part for part in np.split(np.arange(table.rows), cuts) if len(part) >= SHORTEST]
    if len(parts) < 2:
        why = {
            "restart": "its time never goes back",
            "column": f'"{title.strip()}" never changes',
            "sheets": "its sheets are of one run",
            "rests": f"nothing rests for {RESTS:g} s between two motions",
        }[kind]
        if len(cuts):
            why = f"no two of its stretches have {SHORTEST} samples, the fewest of a run"
        raise RecordError(f"{table.source}: {why}: the file holds one run. Leave split out.")
    return [_rows(table, part, number) for number, part in enumerate(parts, 1)]


def _numbers(table: Table, title: str) -> Array:
    """Return a column's numbers; RecordError where it holds words."""
    column = table.find(title).text
    if column in table.not_numeric:
        raise RecordError(
            f'{table.source}: column "{column}": {table.not_numeric[column]}. A column that tells '
            "runs apart holds numbers."
        )
    return table.values[column]


def _filled(values: Array) -> Array:
    """Return values (n,) with the last one that is known where one is missing."""
    known = np.isfinite(values)
    return values[np.maximum.accumulate(np.where(known, np.arange(len(values)), 0))]


def _values(table: Table, channel: str, channels: Mapping[str, ChannelSpec]) -> Array:
    spec = channels.get(channel)
    if spec is None or not spec.column:
        raise RecordError(
            f"{table.source}: no column is the {channel}, which tells its runs apart."
        )
    return _numbers(table, spec.column)


def _seconds(table: Table, spec: ChannelSpec | None) -> float:
    """Return how many seconds one in the column of the time is."""
    stated = (spec.unit or table.find(spec.column).stated) if spec is not None else ""
    return conversion(stated or "s", "s")[0]


def _rests(table: Table, channels: Mapping[str, ChannelSpec]) -> Indices:
    """Return the middles of rests between two motions."""
    motion = "velocity" if "velocity" in channels else "displacement"
    y, spec = _values(table, motion, channels), channels.get("time")
    step = 0.0 if spec is None or spec.step is None else spec.step
    if not step:
        step = float(np.median(np.diff(_filled(_values(table, "time", channels)))))
        step *= _seconds(table, spec)
    every = np.arange(len(y))
    good = np.isfinite(y)
    if not good.any():
        raise RecordError(f"{table.source}: the {motion}, which tells its runs apart, is missing.")
    y = np.interp(every, every[good], y[good])
    window = max(1, round(0.1 * RESTS / step)) if step > 0.0 else 1
    if len(y) <= 4 * window:
        return np.zeros(0, dtype=np.int64)  # too short for two runs and a rest
    smooth = np.convolve(y, np.ones(window) / window, mode="same")
    speed = np.abs(smooth) if motion == "velocity" else np.abs(np.gradient(smooth))
    speed[: 2 * window], speed[-2 * window :] = speed[2 * window], speed[-2 * window - 1]
    still = speed < STANDS * float(np.quantile(speed, 0.98))
    # Turning points are no rests: they are short.
    found = [
        (a + b) // 2
        for a, b in stretches(still).tolist()
        if a > 0 and b < len(y) and (b - a) * step >= RESTS
    ]
    return np.array(found, dtype=np.int64)


def _rows(table: Table, part: Indices, number: int) -> Table:
    return replace(
        table,
        source=f"{table.source}, run {number}",
        values={name: values[part] for name, values in table.values.items()},
        lines=table.lines[part],
    )

"""Tables from any file that a laboratory hands over.

CSV and other delimited text (also gzip-compressed), Excel, Parquet, MAT, NPZ, TDMS, HDF5: see
`formats`. Nothing is converted here; see `measurement`.
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.arrays import Array, Indices
from ..core.text import listed, plain
from ..errors import RecordError
from . import formats
from .channels import meaning, quantity_of_unit
from .noise import SHORTEST
from .sampling import goes_on
from .table import Table
from .titles import Column

LARGEST = 256 * 1024**2
"""Largest content that is read, after decompression [bytes]: about 3 million rows of 8 columns."""


ENDINGS = (
    ".csv", ".txt", ".dat", ".asc", ".tsv", ".prn", ".lvm", ".mat", ".parquet", ".xlsx", ".tdms",
    ".h5", ".hdf5", ".npz",
)  # fmt: skip
"""Endings of the files that a folder of measurements is taken to consist of."""


def read_table(path: Path | str, split: str = "") -> Table:
    """Return the table in a file, whatever its format.

    Parameters
    ----------
    path : of the file
    split : how files hold runs: "sheet NAME" and "sheets" tell what of a workbook is read, and with
        "restart" a time that goes back is no counter

    Raises
    ------
    RecordError
        If the file cannot be read, is too large, or is of a format that is not read: with the
        file, the line where there is one, and what would be right.
    """
    path = Path(path)
    kind, _, title = split.partition(" ")
    sheet = {"sheet": title.strip(), "sheets": "*"}.get(kind, "")
    table = formats.read(content_of(path), path.suffix.lower(), str(path), sheet)
    return table if kind == "restart" else in_order(table)


def files_in(folder: Path) -> list[Path]:
    """Return the measurement files in a folder, told by their endings, in order.

    Raises
    ------
    RecordError
        If there is none.
    """
    found = sorted(
        path
        for path in folder.iterdir()
        if path.is_file()
        and path.name[:1] not in ".~"
        and path.name.lower().removesuffix(".gz").endswith(ENDINGS)
    )
    if not found:
        raise RecordError(
            f"{folder}: this folder is no study, and holds no measurement: no file in it ends in "
            f"{', '.join(ENDINGS)}."
        )
    return found


def content_of(path: Path) -> bytes:
    """Return a file's bytes, decompressed.

    Raises
    ------
    RecordError
        If there is no such file, it cannot be read, is empty or too large.
    """
    name = str(path)
    try:
        if not path.is_file():
            what = "this is a folder" if path.is_dir() else "there is no such file"
            raise RecordError(f"{name}: {what}. A measurement is one file.")
        size = path.stat().st_size
        content = path.read_bytes() if size <= LARGEST else b""
        if content[:2] == b"\x1f\x8b":
            with gzip.open(path) as stream:
                content = stream.read(LARGEST + 1)
            size = len(content)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(f"{name}: the file cannot be read ({reason}).") from None
    if size > LARGEST:
        raise RecordError(
            f"{name}: {size / 1024**2:.0f} MB are more than the limit of {LARGEST // 1024**2} MB "
            "for one measurement. Cut it, or sample it more coarsely."
        )
    if not content.strip():
        raise RecordError(f"{name}: the file is empty. A measurement has titles and numbers.")
    return content


# Times as loggers write them: counters that begin again, and rows that are not in order.

_EVEN = 1.5
"""Spacing in usual ones up to which rows in the order of time leave no gap."""
_CLOCKS = (1.0, 60.0, 3600.0, 43200.0, 86400.0)
"""Times [s] after which a clock begins again."""


def in_order(table: Table) -> Table:
    """Return a table whose times increase, where they do once a counter goes on or rows are sorted.

    A counter began again where a clock or a number of so many bits does, and all channels go on
    there; runs one below the other do not. Rows are sorted where that leaves times evenly spaced.
    """
    values = dict(table.values)
    for column in table.columns:
        time = values[column.text]
        if column.text in table.not_numeric or not _tells_time(column):
            continue
        if len(time) < SHORTEST or not np.isfinite(time).all():
            continue
        back = np.flatnonzero(np.diff(time) < 0.0)
        if not len(back):
            return table
        if period := _period(column, time, back):
            others = [own for key, own in values.items() if key != column.text]
            if all(goes_on(own, back) for own in others):
                again = np.zeros(len(time))
                again[back + 1] = period
                values[column.text] = time + np.cumsum(again)
                told = listed([f"{table.place} {table.lines[k + 1]}" for k in back], 3)
                unit = f" {column.stated}" if column.stated else ""
                remark = (
                    f'"{column.text}" begins again after {plain(period, 12)}{unit} ({told}), where '
                    "all channels go on: taken as a counter that ran over"
                )
                return replace(table, values=values, remarks=(*table.remarks, remark))
        order = np.argsort(time, kind="stable")
        spacing = np.diff(time[order])
        if spacing.min() > 0.0 and spacing.max() <= _EVEN * np.median(spacing):
            how = "descends" if len(back) == len(time) - 1 else "is not in order"
            remark = f'"{column.text}" {how}: the rows are taken in the order of time'
            return replace(
                table, values={key: own[order] for key, own in values.items()},
                lines=table.lines[order], remarks=(*table.remarks, remark),
            )  # fmt: skip
        return table
    return table


def _tells_time(column: Column) -> bool:
    if column.unit is not None:
        return quantity_of_unit(column.stated) == "time"
    meant = meaning(column.name, None)
    return meant is not None and meant.quantity == "time"


def _period(column: Column, time: Array, back: Indices) -> float:
    """Return after what a counter begins again, in the unit of its column; 0 if it is none."""
    spacing = np.diff(time)
    step = float(np.median(spacing[spacing > 0.0])) if (spacing > 0.0).any() else 0.0
    own = time[back] + step - time[back + 1]
    second = 1.0 if column.unit is None else 1.0 / column.unit.factor
    whole = bool((time == np.round(time)).all())
    able = [second * clock for clock in _CLOCKS]
    able += [2.0**bits for bits in range(8, 33)] if whole else []
    able += [10.0**digits for digits in range(3, 10)] if whole and second != 1.0 else []
    return next((one for one in able if float(np.max(np.abs(own - one))) <= 0.51 * step), 0.0)

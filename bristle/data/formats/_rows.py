"""Rows of a delimited text: which fields are numbers, and how rows become columns."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np

from ...core.arrays import Array, Indices
from ...errors import RecordError
from ...physics.motion_file import shortened

_MISSING = frozenset(
    ("", "-", "--", "nan", "-nan", "nan(ind)", "na", "n/a", "#n/a", "null", "none", "1.#qnan")
)
_INFINITE = frozenset(("inf", "-inf", "+inf", "infinity", "-infinity", "1.#inf", "-1.#inf"))
_POINT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(?:\d+,?\d*|,\d+)(?:[eEdD][+-]?\d+)?")
_BLANKS = "'\u2019 \u00a0\u202f\u2009"
# By whether the decimal mark is a comma: a decimal mark that comes twice parts groups, too.
_GROUPED = {
    comma: re.compile(
        rf"[+-]?[1-9]\d{{0,2}}(?:(?:(?P<mark>[{other}{_BLANKS}])\d{{3}})(?:(?P=mark)\d{{3}})*"
        rf"(?:{own}\d*)?|(?:{own}\d{{3}}){{2,}})"
    )
    for comma, own, other in ((False, r"\.", ","), (True, ",", "."))
}


@dataclass
class Layout:
    """How a text is laid out: `delimiter` "" stands for blanks, `numeric` by column."""

    delimiter: str
    comma: bool
    numeric: list[bool]

    def split(self, line: str) -> list[str]:
        """Return the fields of a line."""
        if not self.delimiter:  # a blank of another kind parts thousands
            return line.split() if line.isascii() else re.split("[ \t]+", line.strip(" \t\r\n"))
        if '"' in line:
            return next(csv.reader([line], delimiter=self.delimiter), [])
        return line.split(self.delimiter)

    def fits(self, fields: Sequence[str]) -> bool:
        """Return whether fields are a row of data: numbers where there are numbers."""
        if len(fields) != len(self.numeric):
            return False
        states = [
            state_of(one, self.comma) for one, n in zip(fields, self.numeric, strict=True) if n
        ]
        return "word" not in states and "number" in states


@dataclass
class Body:
    """What is read: values (n,) per column, words that stand among them, the line of each row.

    `grouped` has the first number with groups of thousands of each column that has some.
    """

    values: list[Array]
    lines: Indices
    not_numeric: dict[int, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    grouped: dict[int, str] = field(default_factory=dict)


def state_of(text: str, comma: bool) -> str:
    """Return whether a field is a "number", "missing", or a "word"."""
    value = _value(text, comma)
    return "word" if value is None else "number" if isfinite(value) else "missing"


def is_grouped(text: str, comma: bool) -> bool:
    """Return whether a field is a number with groups of thousands that are no decimals."""
    return _GROUPED[comma].fullmatch(text.strip().strip('"').strip()) is not None


def without_groups(text: str, comma: bool) -> str:
    """Return a number without what parts its thousands, with a decimal point."""
    found = _GROUPED[comma].fullmatch(text)
    own = "," if comma else "."
    mark = (found["mark"] or own) if found else ""
    return (text.replace(mark, "") if mark else text).replace(own, ".")


def plain_number(text: str) -> float:
    """Return a number with a decimal point; NaN where a text is missing, infinite or a word."""
    return float(text.lower().replace("d", "e")) if _POINT.fullmatch(text) else float("nan")


def is_comment(line: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip()[:1] in ("#", "%")


def read_fast(lines: list[str], first: int, layout: Layout) -> Body | None:
    """Read rows of plain numbers at the speed of pyarrow; None if there is anything else."""
    if not layout.delimiter or not all(layout.numeric):
        return None
    import pyarrow as pa
    from pyarrow.csv import ConvertOptions, ParseOptions, ReadOptions, read_csv

    full = _full(lines, first, layout)
    names = [str(k) for k in range(len(layout.numeric))]
    convert = ConvertOptions(
        column_types=dict.fromkeys(names, pa.float64()),
        null_values=["", "NaN", "nan", "NAN"],
        decimal_point="," if layout.comma else ".",
    )
    parse = ParseOptions(delimiter=layout.delimiter, ignore_empty_lines=False)
    body = io.BytesIO("\n".join([lines[k] for k in full]).encode())
    try:
        read = read_csv(body, ReadOptions(column_names=names), parse, convert)
    except pa.ArrowInvalid:
        return None
    values = [_floats(read[name]) for name in names]
    if any(np.isinf(array).any() for array in values) or len(read) != len(full):
        return None
    return Body(values, np.array(full, dtype=np.int64) + 1)


def _full(lines: list[str], first: int, layout: Layout) -> list[int]:
    """Return the indices of the lines that are rows.

    A blank line is no sample: it would count where times come from a given step. Tabs alone are a
    row of missing values where tabs part columns, but at the end of a text.
    """
    last = len(lines)
    while last > first and not lines[last - 1].strip():
        last -= 1
    tabs = len(layout.numeric) - 1 if layout.delimiter == "\t" else 0
    return [
        k for k in range(first, last) if lines[k].strip() or (tabs and lines[k].count("\t") == tabs)
    ]


def _floats(column: Any) -> Array:
    """Return a column of pyarrow's (n,), what is empty as nan.

    Its `to_numpy` imports pandas, which takes as long as all else that is done with a file.
    """
    whole = column.combine_chunks()
    if whole.null_count:
        return np.asarray(column.to_numpy(), dtype=float)
    return np.array(np.from_dlpack(whole), dtype=float)


def read_slow(lines: list[str], first: int, layout: Layout, name: str) -> Body:
    """Read rows one by one, so that what is wrong has a line.

    Parameters
    ----------
    lines : the whole text, line by line
    first : index of the first line of data; lines before it are not read
    layout : how fields are separated, and which columns hold numbers
    name : the file, for messages

    Raises
    ------
    RecordError
        If a row has more or fewer fields than `layout` has columns; a last row that is cut short is
        left out instead.
    """
    wide = len(layout.numeric)
    rows: list[list[float]] = []
    places: list[int] = []
    not_numeric: dict[int, str] = {}
    grouped: dict[int, str] = {}
    notes: list[str] = []
    full = [k for k in _full(lines, first, layout) if not is_comment(lines[k])]
    infinite = 0
    for k in full:
        fields = layout.split(lines[k].strip(" \n\r"))
        while len(fields) > wide and not fields[-1].strip():
            fields.pop()
        if len(fields) != wide:
            if k == full[-1] and len(fields) < wide:
                notes.append(f"line {k + 1}, the last one, is cut off and left out")
                break
            raise RecordError(
                f'{name}, line {k + 1}: "{shortened(lines[k].strip())}" has {len(fields)} columns, '
                f"and the rows above it {wide}. Is the line cut, or has it decimal commas?"
            )
        row = []
        for index, text in enumerate(fields):
            value = _value(text, layout.comma)
            if value is not None and abs(value) >= 1e3 and is_grouped(text, layout.comma):
                grouped.setdefault(index, text.strip().strip('"').strip())
            if value is None:
                why = f'line {k + 1}: "{shortened(text.strip())}" is no number'
                not_numeric.setdefault(index, why)
            infinite += value == float("inf")
            row.append(float("nan") if value is None or value == float("inf") else value)
        rows.append(row)
        places.append(k + 1)
    if infinite:
        notes.append(f"{infinite} infinite values are taken as missing")
    array = np.array(rows, dtype=float).reshape(len(rows), wide)
    values = [array[:, k].copy() for k in range(wide)]
    return Body(values, np.array(places), not_numeric, notes, grouped)


def _value(text: str, comma: bool) -> float | None:
    """Return a field's number, NaN where it is missing, infinity, or None for a word."""
    plain = text.strip().strip('"').strip()
    if (_COMMA if comma else _POINT).fullmatch(plain):
        return float(plain.replace(",", ".").replace("D", "E").replace("d", "e"))
    if is_grouped(plain, comma):
        return plain_number(without_groups(plain, comma))
    lower = plain.lower().replace("+", "")
    if lower in _INFINITE:
        return float("inf")
    return float("nan") if lower in _MISSING else None

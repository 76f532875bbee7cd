"""Rows of a delimited text: which fields are numbers or instants, how rows become columns."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ...core.arrays import Array, Flags, Indices
from ...core.text import plain
from ...errors import RecordError
from ...physics.motion_file import shortened
from ..titles import Column

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

    def fits(self, fields: Sequence[str], fewest: int = 1) -> bool:
        """Return whether fields are a row of data: numbers where there are numbers.

        Parameters
        ----------
        fields : of the row
        fewest : numbers that it must have at the least
        """
        if len(fields) != len(self.numeric):
            return False
        states = [
            state_of(one, self.comma) for one, n in zip(fields, self.numeric, strict=True) if n
        ]
        return "word" not in states and states.count("number") >= fewest


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
        If a row has more or fewer fields than `layout` has columns.
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


# Groups of thousands: 1.234 for 1234 beside decimal commas, "1,234.5", 1'234.5, 1 234,5.
#
# A mark that is no decimal mark can only part groups. A decimal mark parts groups where the values
# of a column say so: all that have one have three digits behind it, none without one reaches 1000,
# and the values follow each other evenly only so.

_EVEN = 0.9  # by what factor a column is more even with groups than with decimals


def read_groups(
    columns: tuple[Column, ...], body: Body, lines: list[str], layout: Layout
) -> tuple[Column, ...]:
    """Read the groups of thousands in a body, in place; return the columns with what is doubted.

    Parameters
    ----------
    columns : of the file
    body : as read, with decimal marks wherever they can be meant
    lines : the whole text, line by line
    layout : how its fields are parted
    """
    mark = "," if layout.comma else "."

    def texts(index: int, of: Flags | None = None) -> list[str]:
        places = body.lines if of is None else body.lines[of]
        rows = (layout.split(lines[at - 1].strip(" \r\n")) for at in places)
        return [row[index].strip().strip('"').strip() for row in rows]

    kinds = {
        k: _kind(values, partial(texts, k), mark)
        for k, values in enumerate(body.values)
        if k not in body.not_numeric and k not in body.grouped
    }
    for k in body.grouped:
        if k not in body.not_numeric:
            kinds[k] = _refused(k, body, texts(k), layout)
    of_kind = {kind: [k for k, own in kinds.items() if own == kind] for kind in kinds.values()}
    decimal, groups = of_kind.get("decimal", []), of_kind.get("groups", [])
    out = list(columns)
    other = "." if layout.comma else ","
    for k, own in ((k, texts(k)) for k, kind in kinds.items() if kind == ""):
        if _all_grouped(own, layout):
            doubt = _doubt(own[0], own[0].replace(other, ""), other, "a thousandth as large")
            out[k] = replace(columns[k], doubt=doubt)
    if groups and not decimal:
        groups = groups + [k for k in (*of_kind.get("open", []), *of_kind.get("whole", []))
                           if any(mark in text for text in texts(k))]  # fmt: skip
    elif not decimal:
        for k in of_kind.get("open", []):
            text = next(text for text in texts(k) if mark in text)
            doubt = _doubt(text, text.replace(mark, "."), mark, "1000 times as large")
            out[k] = replace(columns[k], doubt=doubt)
    for k in groups:
        own = texts(k)
        body.grouped[k] = next(text for text in own if mark in text)
        if decimal:
            body.not_numeric[k] = (
                f'"{body.grouped[k]}" must be a group of thousands, where "{mark}" is the decimal '
                f'mark in "{columns[decimal[0]].text}": write numbers without groups'
            )
        else:
            body.values[k] = np.array([plain_number(text.replace(mark, "")) for text in own])
    for k, text in body.grouped.items():
        if k not in body.not_numeric:
            bare = text.replace(mark, "") if k in groups else without_groups(text, layout.comma)
            value = plain(plain_number(bare), 12)
            body.notes.append(f'"{columns[k].text}" has groups of thousands: "{text}" is {value}')
    return tuple(out)


def _refused(k: int, body: Body, texts: list[str], layout: Layout) -> str:
    """Return "groups" where decimal marks part them as well; refuse numbers without groups."""
    mark = "," if layout.comma else "."
    if any(text.count(mark) > 1 for text in texts):
        return "groups"
    for text, value, at in zip(texts, np.abs(body.values[k]), body.lines, strict=True):
        if value >= 1000.0 and not is_grouped(text, layout.comma):
            body.not_numeric[k] = (
                f'line {at}: "{text}" has no group of thousands, and "{body.grouped[k]}" has one'
            )
            break
    return ""


def _all_grouped(texts: list[str], layout: Layout) -> bool:
    """Return whether every number of a column may have a decimal mark of its own."""
    own = re.compile(rf"[+-]?[1-9]\d{{0,2}}\{'.' if layout.comma else ','}\d{{3}}")
    return all(own.fullmatch(text) for text in texts if text)


def _doubt(text: str, value: str, mark: str, right: str) -> str:
    """Return that a number with a mark may be another one."""
    return (
        f'"{text}" is read as {value}, and nothing tells whether its "{mark}" is a decimal mark or '
        f"parts thousands: then give a unit {right}"
    )


def _kind(values: Array, texts: Callable[[Flags], list[str]], mark: str) -> str:
    """Return what the marks in a column are: "decimal", "groups", or "open" where nothing tells.

    "whole" where no value has decimals, so that it may have no marks at all.

    Parameters
    ----------
    values : (n,) as read with decimals
    texts : returns the fields of some rows (n,)
    mark : the decimal mark
    """
    finite = np.isfinite(values)
    good = np.abs(values[finite])
    parts = good[good != np.round(good)]
    if not parts.size:
        return "whole"
    if parts.min() < 1.0 or parts.max() >= 1000.0 or not _whole(1e3 * parts).all():
        return "decimal"
    # All others have three digits behind the mark.
    own = _numbers(texts(finite & _whole(100.0 * np.where(finite, values, 0.0))), mark)
    bare = [abs(int(text)) for text in own if mark not in text]
    grouped = re.compile(rf"[+-]?[1-9]\d{{0,2}}\{mark}\d{{3}}")
    if max(bare, default=0) >= 1000 or not all(
        grouped.fullmatch(text) for text in own if mark in text
    ):
        return "decimal"
    if not any(bare):
        return "open"
    own = _numbers(texts(finite), mark)
    with_decimals = _unevenness(np.array([plain_number(text.replace(mark, ".")) for text in own]))
    with_groups = _unevenness(np.array([plain_number(text.replace(mark, "")) for text in own]))
    if with_groups < _EVEN * with_decimals:
        return "groups"
    return "decimal" if with_decimals < _EVEN * with_groups else "open"


def _whole(values: Array) -> Flags:
    return np.asarray(np.abs(values - np.round(values)) <= 1e-6)


def _numbers(texts: list[str], mark: str) -> list[str]:
    return [text for text in texts if text.lstrip("+-").replace(mark, "").isdigit()]


def _unevenness(values: Array) -> float:
    """Return how far a column goes from sample to sample in all, by its range."""
    span = float(np.ptp(values))
    return float(np.sum(np.abs(np.diff(values)))) / span if span else 0.0


# Dates and times of day, as recorders of several countries write them, as seconds.

_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
_WITHOUT_HOURS = "%M:%S.%f"
_DATES = (
    "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y", "%Y/%m/%d", "%d-%m-%Y",
    "%m-%d-%Y", "%d-%b-%Y", "%d %b %Y", "%b %d %Y",
)  # fmt: skip
_FORMS = (
    *(f"{date} {clock}" for date in _DATES for clock in _CLOCKS), *_CLOCKS, _WITHOUT_HOURS
)  # fmt: skip
_DATE_MARK = re.compile(r"(?<=\d)[-_T/](?=\d\d?:\d\d)|(?<![^\s])0 days? ")
_COLON = re.compile(r"(\d\d?:\d\d:\d\d):(?=\d{3,6}\b)")  # 10:00:00:250, before its milliseconds
_DAY = 86400.0


def seconds_of(texts: Sequence[str]) -> Array | None:
    """Return instants as seconds since the first (n,), None where they are none.

    ISO 8601, `12.03.2024 10:00:00.000` and its like, a time of day alone, which may pass midnight,
    or minutes and seconds with their fraction; with a point, a comma or a colon. Of `03/12/2024`
    either number may be the month, which matters where a date changes: what gives the shorter
    record counts, else the day comes first.
    """
    bare = [_COLON.sub(r"\1.", text.strip().strip('"').strip()) for text in texts]
    if not bare or not bare[0]:
        return None
    found = _by_iso(bare)
    if found is None:
        bare = [_with_point(_DATE_MARK.sub(" ", text).strip()) for text in bare]
        able = (one for form in _FORMS if (one := _by_form(bare, form)) is not None)
        day, last = (text.partition(" ")[0] for text in (bare[0], bare[-1]))
        found = (
            next(able, None) if day == last or ":" in day else min(able, key=_span, default=None)
        )
    if found is None:
        return None
    instants, clock = found
    try:
        seconds = np.array([(one - instants[0]).total_seconds() for one in instants])
    except TypeError:  # some have a time zone, some none: nothing tells how far apart they are
        return None
    if clock:
        seconds += _DAY * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -0.5 * _DAY)
    return seconds


def _span(found: tuple[list[datetime], bool]) -> timedelta:
    """Return how long instants with a date last."""
    return max(found[0]) - min(found[0])


def _by_iso(texts: Sequence[str]) -> tuple[list[datetime], bool] | None:
    try:
        return [datetime.fromisoformat(text) for text in texts], False
    except ValueError:
        return None


def _by_form(texts: Sequence[str], form: str) -> tuple[list[datetime], bool] | None:
    try:
        if form == _WITHOUT_HOURS and not all("." in text for text in texts):
            return None  # 10:30 may be hours and minutes
        _instant(texts[0], form)  # most forms fail here
        return [_instant(text, form) for text in texts], form in _CLOCKS
    except ValueError:
        return None


def _instant(text: str, form: str) -> datetime:
    """Return an instant; whole seconds may be written without their fraction."""
    try:
        return datetime.strptime(text, form)
    except ValueError:
        if ".%f" not in form:
            raise
        return datetime.strptime(text, form.replace(".%f", ""))


def _with_point(text: str) -> str:
    """Return a text with at most six digits of seconds, after a point."""
    day, colon, rest = text.rpartition(":")
    seconds, mark, more = rest.replace(",", ".").partition(".")
    digits = more[: len(more) - len(more.lstrip("0123456789"))]
    return f"{day}{colon}{seconds}{mark}{digits[:6]}{more[len(digits) :]}" if colon else text

"""Groups of thousands: 1.234 for 1234 beside decimal commas, "1,234.5", 1'234.5, 1 234,5.

A mark that is no decimal mark can only part groups. A decimal mark parts groups where the values of
a column say so: all that have one have three digits behind it, none without one reaches 1000, and
the values follow each other evenly only so.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...core.arrays import Array, Flags
from ...core.text import plain
from ..titles import Column
from ._rows import Body, Layout, is_grouped, plain_number, without_groups

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
    if groups and not decimal:
        groups = groups + [k for k in (*of_kind.get("open", []), *of_kind.get("whole", []))
                           if any(mark in text for text in texts(k))]  # fmt: skip
    elif not decimal:
        for k in of_kind.get("open", []):
            out[k] = replace(columns[k], doubt=_open_text(texts(k), mark))
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


def _open_text(texts: list[str], mark: str) -> str:
    text = next(text for text in texts if mark in text)
    return (
        f'"{text}" is read with decimals, and nothing in the file tells whether its "{mark}" parts '
        "thousands: then give a unit 1000 times as large"
    )

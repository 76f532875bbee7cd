"""Rows packed one behind the other in a flat sequence, each behind its length.

What is fixed when a component is built, and what its parameters imply, lie so: in lists inside
FMUs, in arrays in compiled code, with sizes that nobody has to know beforehand.
"""

from __future__ import annotations

from collections.abc import Iterable

from .linear import Row


def packed(*rows: Iterable[float]) -> list[float]:
    """Return rows of numbers as one flat list; `row` finds them again."""
    flat: list[float] = []
    for one in rows:
        numbers = [float(value) for value in one]
        flat.append(float(len(numbers)))
        flat.extend(numbers)
    return flat


def place(flat: Row, k: int) -> int:
    """Return where row k begins: the index of its first number."""
    at = 0
    for _ in range(k):
        at += int(flat[at]) + 1
    return at + 1


def row(flat: Row, k: int) -> Row:
    """Return row k; in compiled code it is a view."""
    begin = place(flat, k)
    return flat[begin : begin + int(flat[begin - 1])]


def open_row(flat: Row, k: int, count: int) -> int:
    """Make room for row k, the rows before it being there; return the index of its first number.

    Parameters
    ----------
    flat : the packed rows, long enough
    k : number of the row
    count : how many numbers it has
    """
    begin = place(flat, k)
    flat[begin - 1] = float(count)
    return begin

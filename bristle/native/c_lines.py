"""Statements of C, and which of them nothing needs."""

from __future__ import annotations

import re
from typing import NamedTuple


class Line(NamedTuple):
    """A statement: its text, the variable that it does no more than set, the label that it is."""

    text: str
    sets: str = ""
    label: str = ""


def needed(lines: list[Line]) -> list[Line]:
    """Return the lines without those that set what nothing reads."""
    while True:
        words = [set(re.findall(r"\w+", one.text)) for one in lines]
        read: set[str] = set()
        for one, said in zip(lines, words, strict=True):
            read |= said - {one.sets}
        kept = [one for one in lines if not one.sets or one.sets in read]
        if len(kept) == len(lines):
            return kept
        lines = kept

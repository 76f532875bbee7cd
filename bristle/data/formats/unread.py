"""Formats that are known and not read: what to save the measurement as instead."""

from __future__ import annotations

from typing import NoReturn

from ...errors import RecordError

ORDER = 1

MARKS = {
    b"PK\x03\x04": "this is a zip archive and no Excel workbook. Unpack it.",
    b"\xd0\xcf\x11\xe0": "this is an old Excel workbook. Save it as .xlsx, or the sheet as CSV.",
    b"PK\x05\x06": "this is an empty zip archive.",
}
"""The first bytes of a format, and what a user is told."""


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file begins as one of these formats does."""
    return content.startswith(tuple(MARKS))


def read(content: bytes, name: str) -> NoReturn:
    """Raise RecordError with what would be right."""
    text = next(text for mark, text in MARKS.items() if content.startswith(mark))
    raise RecordError(f"{name}: {text}")

"""Formats that are known and not read: what to save the measurement as instead."""

from __future__ import annotations

import re
from typing import NoReturn

from ...errors import RecordError

ORDER = 1

MARKS = {
    b"PK\x03\x04": "this is a zip archive and no Excel workbook. Unpack it.",
    b"\xd0\xcf\x11\xe0": "this is an old Excel workbook. Save it as .xlsx, or the sheet as CSV.",
    b"PK\x05\x06": "this is an empty zip archive.",
    b"\x93NUMPY": "this is an array of NumPy without names. Save named ones with numpy.savez.",
    b"MDF     ": "this is MDF, which is not read. Save it as CSV, Parquet or MAT (version 7).",
}
"""The first bytes of a format, and what a user is told."""

TEXTS = {
    re.compile(
        rb"-1\s*\n\s*(?:15|55|58b?|82|151|164|24\d\d)\b[^,;\t]*\n"
    ): "a universal file (UFF)",
    re.compile(rb"<[?!a-z]", re.IGNORECASE): "XML or HTML",
    re.compile(rb'\{\s*["}]|\[\s*(?:[{"\[\]]|(?:[-\d.eE+]+|null|true|false)\s*,)'): "JSON",
}
"""How a text of a format begins, and what it is called."""
_BEGIN = 4096
_BOMS = b"\xef\xbb\xbf"


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file begins as one of these formats does."""
    return suffix in (".json", ".jsonl", ".ndjson") or bool(_what(content))


def read(content: bytes, name: str) -> NoReturn:
    """Raise RecordError with what would be right."""
    raise RecordError(f"{name}: {_what(content) or _not_read('JSON')}")


def _what(content: bytes) -> str:
    """Return what a user is told of a file, "" where it is none of these."""
    if mark := next((mark for mark in MARKS if content.startswith(mark)), b""):
        return MARKS[mark]
    begin = content[:_BEGIN].removeprefix(_BOMS)
    if begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        begin = begin.decode("utf-16", "replace").encode()
    begin = begin.lstrip()
    return next((_not_read(what) for form, what in TEXTS.items() if form.match(begin)), "")


def _not_read(what: str) -> str:
    return (
        f"this is {what}, which is not read. Save it as CSV, a column a channel, with titles and "
        'units such as "time [s],force [kN]".'
    )

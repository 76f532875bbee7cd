"""LabVIEW measurement files (.lvm): text with a header of its own, in one or more segments."""

from __future__ import annotations

from ...errors import RecordError
from ..table import Table
from . import delimited

_BEGINS = b"LabVIEW Measurement"


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is a LabVIEW measurement, by its first bytes."""
    return content[:64].lstrip(b"\xef\xbb\xbf").startswith(_BEGINS)


def read(content: bytes, name: str) -> Table:
    """Return the table in a LabVIEW measurement file.

    Units are those of Y_Unit_Label. Where X_Value is not written, the time follows from Delta_X.

    Raises
    ------
    RecordError
        If the header does not end, or no rows of numbers follow it.
    """
    text = content.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if not any(line.startswith("X_Value") for line in lines):
        raise RecordError(
            f'{name}: no line of this LabVIEW file begins with "X_Value": its titles are missing.'
        )
    comma = any(line.split("\t")[:2] == ["Decimal_Separator", ","] for line in lines[:40])
    separator = "," if any(line.startswith("Separator,") for line in lines[:40]) else "\t"
    out: list[str] = []
    about: dict[str, list[str]] = {}
    header, row = True, 0
    for line in lines:
        fields = line.split(separator)
        if not header and fields[0] == "Channels":  # a further segment
            header = True
        if header:
            first = "X_Value" not in about
            about[fields[0]] = fields[1:]
            header = fields[0] != "X_Value"
            out.append(_titles(fields, about) if first and not header else "")
            row = 0
        else:
            out.append(_row(fields, about, row, comma) if line.strip() else "")
            row += bool(line.strip())
    return delimited.read("\n".join(out).encode(), name)


def _titles(fields: list[str], about: dict[str, list[str]]) -> str:
    """Return the line of titles with the units that the header says."""
    units = about.get("Y_Unit_Label", [])
    named = ["time [s]"]
    for k, title in enumerate(fields[1:]):
        if title.strip() == "Comment":
            continue
        unit = units[k].strip() if k < len(units) else ""
        named.append(f"{title.strip()} [{unit}]" if unit else title.strip())
    return "\t".join(named)


def _row(fields: list[str], about: dict[str, list[str]], row: int, comma: bool) -> str:
    """Return a row with its time, without a comment at its end."""
    count = about.get("Channels", [""])[0].strip()
    wide = 1 + int(count) if count.isdigit() else len(fields)
    values = [one.strip() for one in fields[:wide]]
    if comma:
        values = [one.replace(",", ".") for one in values]
    if not values[0]:
        start, step = (_number(about.get(key, ["0"])[0]) for key in ("X0", "Delta_X"))
        values[0] = repr(start + row * step)
    return "\t".join(values)


def _number(text: str) -> float:
    return float(text.replace(",", ".") or "0")

"""LabVIEW measurement files (.lvm): text with a header of its own, in one or more segments."""

from __future__ import annotations

from dataclasses import replace

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
        If the header does not end, its channels have different times, or no rows of numbers
        follow it.
    """
    text, notes = delimited.decoded(content, name)
    lines = delimited.lines_of(text)
    if not any(line.startswith("X_Value") for line in lines):
        raise RecordError(
            f'{name}: no line of this LabVIEW file begins with "X_Value": its titles are missing.'
        )
    comma = any(line.split("\t")[:2] == ["Decimal_Separator", ","] for line in lines[:40])
    separator = "," if any(line.startswith("Separator,") for line in lines[:40]) else "\t"
    out: list[str] = []
    about: dict[str, list[str]] = {}
    kept: list[int] = []
    header, row = True, 0
    for line in lines:
        fields = line.split(separator)
        if not header and fields[0] == "Channels":  # a further segment
            header = True
        if header:
            first = "X_Value" not in about
            about[fields[0]] = fields[1:]
            header = fields[0] != "X_Value"
            if not header:
                _refuse_other_times(about, fields, name)
                kept = [k for k, title in enumerate(fields) if _is_kept(k, title.strip())]
            out.append(_titles(fields, kept, about) if first and not header else "")
            row = 0
        else:
            out.append(_row(fields, kept, _time(about, row, name), comma) if line.strip() else "")
            row += bool(line.strip())
    table = delimited.read("\n".join(out).encode(), name)
    return replace(table, notes=(*notes, *table.notes))


def _is_kept(index: int, title: str) -> bool:
    """Return whether a column is the time or a channel: each channel may have a time before it."""
    return index == 0 or title not in ("X_Value", "Comment")


def _refuse_other_times(about: dict[str, list[str]], fields: list[str], name: str) -> None:
    """Refuse channels that were sampled at different times: one time stands for all."""
    several = sum(title.strip() == "X_Value" for title in fields) > 1
    for key in ("X0", "Delta_X") if several else ("Delta_X",):
        stated = sorted(set(_numbers(about, key, name)))
        if len(stated) > 1:
            raise RecordError(
                f"{name}: its channels differ in {key} ({', '.join(map(str, stated))}): they were "
                "sampled at different times. Save channels of one rate in one file."
            )


def _titles(fields: list[str], kept: list[int], about: dict[str, list[str]]) -> str:
    """Return the line of titles with the units that the header says."""
    units = about.get("Y_Unit_Label", [])
    named = ["time [s]"]
    for channel, k in enumerate(kept[1:]):
        title = fields[k].strip()
        unit = units[channel].strip() if channel < len(units) else ""
        named.append(f"{title} [{unit}]" if unit else title)
    return "\t".join(named)


def _row(fields: list[str], kept: list[int], time: float, comma: bool) -> str:
    """Return a row of what is kept, with the time that counts where none is written."""
    values = [fields[k].strip() if k < len(fields) else "" for k in kept]
    if comma:
        values = [one.replace(",", ".") for one in values]
    values[0] = values[0] or repr(time)
    return "\t".join(values)


def _time(about: dict[str, list[str]], row: int, name: str) -> float:
    """Return the time [s] of a row of its segment, from the header."""
    start, step = ((_numbers(about, key, name) or [0.0])[0] for key in ("X0", "Delta_X"))
    return start + row * step


def _numbers(about: dict[str, list[str]], key: str, name: str) -> list[float]:
    """Return what the header gives for a key, a number per channel."""
    texts = [one.strip() for one in about.get(key, []) if one.strip()]
    try:
        return [float(text.replace(",", ".")) for text in texts]
    except ValueError:
        raise RecordError(f'{name}: {key} is "{" ".join(texts)}"; numbers are right.') from None

"""Text of NI SignalExpress and LabVIEW waveforms: names, start times, `dt:`, then rows."""

from __future__ import annotations

from dataclasses import replace

from ...errors import RecordError
from ..table import Table
from ..titles import unit_or_none
from . import delimited


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file begins with the names of channels."""
    return content[:64].lstrip(b"\xef\xbb\xbf").lower().startswith(b"channel names:")


def read(content: bytes, name: str) -> Table:
    """Return the table in such a text, with the time of its `dt:`; `Force - N` is in N.

    Raises
    ------
    RecordError
        If names, `dt:` or `data:` are missing, or channels have other steps or start times.
    """
    text, notes = delimited.decoded(content, name)
    lines = delimited.lines_of(text)
    head = {
        line.strip().lower(): k for k, line in enumerate(lines[:40]) if line.strip()[-1:] == ":"
    }
    below = {key: lines[k + 1].strip("\r\n").split("\t") for key, k in head.items()}
    if not {"channel names:", "dt:", "data:"} <= below.keys():
        raise RecordError(f'{name}: "channel names:", "dt:" and "data:" are right, in this order.')
    for key in ("dt:", "start times:"):
        if len({one.strip() for one in below.get(key, ()) if one.strip()}) > 1:
            raise RecordError(
                f"{name}, line {head[key] + 2}: channels of several {key[:-1]}. Export those "
                "of one in a file."
            )
    step, first = below["dt:"][0].strip(), head["data:"] + 1
    units = below.get("unit:", below.get("units:", []))
    titles = []
    for k, text in enumerate(below["channel names:"]):
        title, _, unit = text.rpartition(" - ")
        unit = unit if title and unit_or_none(unit) else (units[k] if k < len(units) else "")
        titles.append(f"{title or text} [{unit}]" if unit else text)
    try:
        dt = float(step.replace(",", "."))
    except ValueError:
        raise RecordError(f'{name}, line {head["dt:"] + 2}: "{step}" is no number.') from None
    times = (repr(k * dt) for k in range(len(lines)))
    mark = "," if "," in step else "."
    out = [""] * (first - 1) + ["\t".join(["time [s]", *titles])]
    out += [
        f"{next(times).replace('.', mark)}\t{line}" if line.strip() else ""
        for line in lines[first:]
    ]
    table = delimited.read("\n".join(out).encode(), name)
    return replace(table, notes=(*notes, *table.notes))

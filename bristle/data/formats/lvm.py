"""Text of LabVIEW: measurement files (.lvm), in one or more segments, and SignalExpress's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from ...core.text import listed
from ...errors import RecordError
from ..channels import meaning
from ..table import Table, from_arrays
from ..titles import unit_or_none
from . import delimited
from ._one_time import Series, on_one_time, unset_step
from ._rows import seconds_of

_BEGINS, _EXPRESS = b"labview measurement", b"channel names:"
_TIME = "time [s]"
_About: TypeAlias = Mapping[str, list[str]]


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is text of LabVIEW, by its first bytes."""
    return content[:64].lstrip(b"\xef\xbb\xbf").lower().startswith((_BEGINS, _EXPRESS))


def read(content: bytes, name: str) -> Table:
    """Return the table in a text of LabVIEW.

    Units are those of Y_Unit_Label. Where X_Value is not written, the time follows from X0 and
    Delta_X; channels of several times are put on one.

    Raises
    ------
    RecordError
        If the header does not end, no rows of numbers follow it, or its channels do not overlap in
        time.
    """
    text, notes = delimited.decoded(content, name)
    lines = delimited.lines_of(text)
    if lines[0].lower().startswith(_EXPRESS.decode()):
        lines = _as_measurement(lines, name)
    parts = _parts(lines, name)
    if not parts:
        raise RecordError(
            f'{name}: no line behind the header of this LabVIEW file begins with "X_Value": its '
            "titles are missing."
        )
    named, out, made = parts[0].titles, [""] * len(lines), True
    for part in parts:
        if part.titles != named:
            raise RecordError(
                f"{name}, line {part.begin}: a segment of {listed(part.titles, 4)}, and the first "
                f"one has {listed(named, 4)}. Save each segment as a file."
            )
        for row, at in enumerate(k for k in range(part.begin, part.end) if lines[k].strip()):
            fields = part.fields(lines[at])
            out[at] = "\t".join([*part.times(fields, row), *(fields[k] for k in part.columns)])
            made &= not fields[0]
    out[parts[0].begin - 1] = "\t".join([*[_TIME] * len(named), *named])
    table = delimited.read("\n".join(out).encode(), name)
    remarks = unset_step("Delta_X", parts[0].clocks[0].step) if made else []
    table = _on_one_time(table, parts, name)
    return replace(table, notes=(*notes, *table.notes), remarks=(*remarks, *table.remarks))


class _Clock(NamedTuple):
    """The time of a channel: its column, -1 without one, its start and step [s], and what written
    times lack [s]."""

    column: int
    start: float
    step: float
    late: float


class _Part(NamedTuple):
    """A segment: its lines of data, counted from 0, and by channel title, column and clock."""

    begin: int
    end: int
    mark: str
    comma: bool
    titles: list[str]
    columns: list[int]
    clocks: list[_Clock]

    def fields(self, line: str) -> list[str]:
        """Return the texts in a line, with decimal points."""
        texts = [one.strip() for one in line.split(self.mark)]
        texts += [""] * (1 + max(self.columns) - len(texts))
        return [one.replace(",", ".") for one in texts] if self.comma else texts

    def times(self, fields: Sequence[str], row: int) -> list[str]:
        """Return the time of each channel in a row, by the header where none is written."""
        out = []
        for column, start, step, late in self.clocks:
            written = fields[column] if column >= 0 else ""
            made = repr(start + row * step)
            out.append((repr(float(written) + late) if late else written) if written else made)
        return out


def _as_measurement(lines: Sequence[str], name: str) -> list[str]:
    """Return the lines of a text of SignalExpress as those of a measurement file.

    Its header is `channel names:`, `start times:`, `dt:`, each with a line of values below it, and
    `data:`; `Force - N` is in N.
    """
    head = {one.strip().lower(): k for k, one in enumerate(lines[:40]) if one.strip()[-1:] == ":"}
    below = {key: lines[k + 1].split("\t") for key, k in head.items()}
    if not {"channel names:", "dt:", "data:"} <= below.keys():
        raise RecordError(f'{name}: "channel names:", "dt:" and "data:" are right, in this order.')
    named = [text.rpartition(" - ") for text in below["channel names:"]]
    told = [unit if title and unit_or_none(unit) else "" for title, _, unit in named]
    titles = [one[0] if unit else "".join(one) for one, unit in zip(named, told, strict=True)]
    units = below.get("unit:", below.get("units:", told))
    comma = ["Decimal_Separator", ","] if "," in below["dt:"][0] else []
    about = [comma, ["Y_Unit_Label", *units], ["Time", *below.get("start times:", [])],
             ["Delta_X", *below["dt:"]]]  # fmt: skip
    out = ["\t".join(one) for one in about] + [""] * head["data:"]
    out[head["data:"] :] = ["\t".join(["X_Value", *titles])]
    return out + [f"\t{line}" if line.strip() else "" for line in lines[head["data:"] + 1 :]]


def _parts(lines: Sequence[str], name: str) -> list[_Part]:
    """Return the segments of a measurement file."""
    comma = any(line.split("\t")[:2] == ["Decimal_Separator", ","] for line in lines[:40])
    mark = "," if any(line.startswith("Separator,") for line in lines[:40]) else "\t"
    about: dict[str, list[str]] = {}
    out: list[_Part] = []
    header = True
    for at, line in enumerate(lines):
        fields = line.split(mark)
        if fields[0] == "Channels" and out:
            out[-1], header = out[-1]._replace(end=min(at, out[-1].end)), True
        if header:
            about[fields[0]] = fields[1:]
            header = fields[0] != "X_Value"
            if not header:
                # Each channel may have a time before it: one of all is the first.
                every = [title.strip() for title in fields]
                kept = [
                    k for k, text in enumerate(every) if k and text not in ("X_Value", "Comment")
                ]
                while kept and not every[kept[-1]]:
                    kept.pop()
                place = f"{name}, line {at + 1}"
                for axis in filter(None, _of_channels(about, "X_Dimension", len(kept))):
                    if (meant := meaning(axis, None)) is None or meant.quantity != "time":
                        raise RecordError(f"{place}: X_Dimension is {axis}; Time is right here.")
                units = _of_channels(about, "Y_Unit_Label", len(kept))
                titles = [f"{every[k]} [{unit}]" if unit else every[k]
                          for k, unit in zip(kept, units, strict=True)]  # fmt: skip
                clocks = _clocks(about, every, kept, name)
                out.append(_Part(at + 1, len(lines), mark, comma, titles, kept, clocks))
    return out


def _clocks(about: _About, every: list[str], kept: list[int], name: str) -> list[_Clock]:
    """Return the clock of each channel of a segment.

    A channel begins X0 after its date and time of day, unless times are absolute.
    """
    starts, steps = (_numbers(about, key, len(kept), name) for key in ("X0", "Delta_X"))
    begins = [0.0] * len(kept)
    if (about.get("Time_Pref") or [""])[0].strip() != "Absolute":
        begins = _instants(about, len(kept))
    # A written time is that of the column before the channel, from the first channel's start on.
    columns = [k for k, title in enumerate(every) if k == 0 or title == "X_Value"]
    own = [max(k for k in columns if k < channel) for channel in kept]
    return [
        _Clock(
            column if step == steps[0] or column else -1, begin + start, step,
            begin - begins[0] + (0.0 if column else start - starts[0]),
        )
        for column, begin, start, step in zip(own, begins, starts, steps, strict=True)
    ]  # fmt: skip


def _instants(about: _About, count: int) -> list[float]:
    """Return when the channels began [s], after the first one; 0 where nothing tells it."""
    days, clocks = (_of_channels(about, key, count) for key in ("Date", "Time"))
    if not all(clocks):
        return [0.0] * count
    found = seconds_of([f"{day} {clock}".strip() for day, clock in zip(days, clocks, strict=True)])
    return [0.0] * count if found is None else found.tolist()


def _on_one_time(table: Table, parts: Sequence[_Part], name: str) -> Table:
    """Return a table whose channels have a time each, which stand first, with one time."""
    count = len(parts[0].titles)
    times, channels = table.columns[:count], table.columns[count:]
    texts = [one.text for one in (times[0], *channels)]
    every = [table.values[one.text] for one in times]
    stated = sorted({clock.step for part in parts for clock in part.clocks})
    alike = all(np.array_equal(one, every[0], equal_nan=True) for one in every)
    if alike and len(stated) < 2:
        columns = [replace(one, index=k) for k, one in enumerate((times[0], *channels))]
        values = {text: table.values[text] for text in texts}
        return replace(table, columns=tuple(columns), values=values)
    words = [table.not_numeric[one.text] for one in table.columns if one.text in table.not_numeric]
    if words:
        raise RecordError(f"{name}: {words[0]}; numbers are right where channels have own times.")
    first = min(float(np.nanmin(one)) for one in every)
    series: dict[bytes, Series] = {}
    for k, column in enumerate(channels):
        there = np.flatnonzero(np.isfinite(table.values[column.text]))
        part = slice(there[0], there[-1] + 1) if there.size else slice(0)
        time = every[k][part] - first
        if len(time) < 2 or not (np.diff(time) > 0.0).all():
            raise RecordError(
                f'{name}: the times of "{column.text}" do not increase from sample to sample, and '
                "its channels have different times. Save channels of one time in one file."
            )
        apart, own = float(np.median(np.diff(time))), parts[0].clocks[k].step
        if len(stated) > 1 and abs(apart - own) > 0.01 * own:
            raise RecordError(
                f"{name}: its channels differ in Delta_X ({', '.join(map(str, stated))}), and the "
                f'times of "{column.text}" are {apart:g} s apart. Save the file anew with times '
                "that agree."
            )
        its = series.setdefault(time.tobytes(), Series(time, {}))
        its.data[column.text] = table.values[column.text][part]
    joined = on_one_time(list(series.values()), name)
    data = {_TIME: joined.time, **{text: joined.data[text] for text in texts[1:]}}
    return from_arrays(data, name, None, table.notes, joined.remarks)


def _of_channels(about: _About, key: str, count: int) -> list[str]:
    """Return what the header gives for a key by channel, "" where it gives nothing.

    Where each channel has a column for its time, its entry stands in one of its two columns.
    """
    texts = [one.strip() for one in about.get(key, [])]
    filled = [one for one in texts if one]
    return (filled if len(filled) >= count else [*texts, *[""] * count])[:count]


def _numbers(about: _About, key: str, count: int, name: str) -> list[float]:
    """Return the numbers of a key by channel, the first one where a channel has none."""
    texts = _of_channels(about, key, count)
    try:
        found = [float(text.replace(",", ".")) if text else None for text in texts]
    except ValueError:
        raise RecordError(f'{name}: {key} is "{" ".join(texts)}"; numbers are right.') from None
    first = next((one for one in found if one is not None), 0.0)
    return [first if one is None else one for one in found]

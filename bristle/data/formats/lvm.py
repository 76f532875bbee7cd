"""LabVIEW measurement files (.lvm): text with a header of its own, in one or more segments."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core.text import listed
from ...errors import RecordError
from ..channels import meaning
from ..table import Table, from_arrays
from . import delimited
from ._one_time import Series, on_one_time, unset_step
from ._rows import seconds_of

_BEGINS = b"LabVIEW Measurement"


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is a LabVIEW measurement, by its first bytes."""
    return content[:64].lstrip(b"\xef\xbb\xbf").startswith(_BEGINS)


def read(content: bytes, name: str) -> Table:
    """Return the table in a LabVIEW measurement file.

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
    if not any(line.startswith("X_Value") for line in lines):
        raise RecordError(
            f'{name}: no line of this LabVIEW file begins with "X_Value": its titles are missing.'
        )
    comma = any(line.split("\t")[:2] == ["Decimal_Separator", ","] for line in lines[:40])
    separator = "," if any(line.startswith("Separator,") for line in lines[:40]) else "\t"
    found: list[_Line | None] = []
    about: dict[str, list[str]] = {}
    kept: list[int] = []
    clocks: list[_Clock] = []
    titles: tuple[list[str], int] | None = None
    header, row = True, 0
    for line in lines:
        fields = line.split(separator)
        if not header and fields[0] == "Channels":  # a further segment
            header = True
        if header:
            about[fields[0]] = fields[1:]
            header = fields[0] != "X_Value"
            if not header:
                # Each channel may have a time before it: one of all is the first.
                every = [title.strip() for title in fields]
                kept = [k for k, t in enumerate(every) if not k or t not in ("X_Value", "Comment")]
                clocks = _clocks(about, fields, kept, name)
                units = _of_channels(about, "Y_Unit_Label", len(kept) - 1)
                pairs = zip((every[k] for k in kept[1:]), units, strict=True)
                own = [f"{title} [{unit}]" if unit else title for title, unit in pairs]
                titles = titles or (own, len(found))
                place = f"{name}, line {len(found) + 1}"
                if own != titles[0]:
                    raise RecordError(
                        f"{place}: a segment of {listed(own, 4)}, and the first one has "
                        f"{listed(titles[0], 4)}. Save each segment as a file."
                    )
                for axis in filter(None, _of_channels(about, "X_Dimension", len(own))):
                    if (meant := meaning(axis, None)) is None or meant.quantity != "time":
                        raise RecordError(f"{place}: X_Dimension is {axis}; Time is right here.")
            found.append(None)
            row = 0
        else:
            found.append(_Line(fields, kept, clocks, row) if line.strip() else None)
            row += bool(line.strip())
    if titles is None:
        raise RecordError(f"{name}: the header of this LabVIEW file does not end with titles.")
    named, at = titles
    if any(len(line.clocks) > 1 for line in found if line):
        return _on_one_time(found, named, comma, name, tuple(notes))
    rows = [None if line is None else _cells(line, 1, comma) for line in found]
    out = ["" if row is None else "\t".join([*row[0], *row[1]]) for row in rows]
    out[at] = "\t".join(["time [s]", *named])
    table = delimited.read("\n".join(out).encode(), name)
    made = not any(line.fields[0].strip() for line in found if line)
    unset = unset_step("Delta_X", clocks[0].step) if made else []
    return replace(table, notes=(*notes, *table.notes), remarks=(*unset, *table.remarks))


class _Clock(NamedTuple):
    """The time of a channel: its column, its start and step [s], what written times lack [s]."""

    column: int
    start: float
    step: float
    late: float


class _Line(NamedTuple):
    """A row of a segment: its fields, those of the channels, their clocks, its number from 0."""

    fields: list[str]
    kept: list[int]
    clocks: list[_Clock]
    row: int


def _clocks(
    about: dict[str, list[str]], fields: list[str], kept: list[int], name: str
) -> list[_Clock]:
    """Return the clock of each channel of a segment, or one where all have the same.

    A channel begins X0 after its date and time of day, unless times are absolute.
    """
    count = len(kept) - 1
    starts, steps = (_numbers(about, key, count, name) for key in ("X0", "Delta_X"))
    begins = [0.0] * count
    if (about.get("Time_Pref") or [""])[0].strip() != "Absolute":
        begins = _instants(about, count)
    # A written time is that of the column before the channel, from the first channel's start on.
    columns = [k for k, title in enumerate(fields) if k == 0 or title.strip() == "X_Value"]
    own = [max(k for k in columns if k < channel) for channel in kept[1:]]
    late = [
        begins[k] - begins[0] + (starts[k] - starts[0] if own[k] == 0 else 0.0)
        for k in range(count)
    ]
    found = [
        _Clock(own[k] if steps[k] == steps[0] or own[k] else -1, begins[k] + starts[k], steps[k],
               late[k])
        for k in range(count)
    ]  # fmt: skip
    alike = all(one[1:] == found[0][1:] for one in found)
    return found[:1] if alike and set(own) == {0} else found


def _instants(about: dict[str, list[str]], count: int) -> list[float]:
    """Return when the channels began [s], after the first one; 0 where nothing tells it."""
    days, clocks = (_of_channels(about, key, count) for key in ("Date", "Time"))
    if not all(clocks):
        return [0.0] * count
    found = seconds_of([f"{day} {clock}".strip() for day, clock in zip(days, clocks, strict=True)])
    return [0.0] * count if found is None else found.tolist()


def _on_one_time(
    found: list[_Line | None], named: list[str], comma: bool, name: str, notes: tuple[str, ...]
) -> Table:
    """Return the table of channels that have a time each, on one.

    Parameters
    ----------
    found : the lines of the file, None where it is no row
    named : titles of the channels
    comma : whether decimals have commas
    name, notes : the file, for messages, and what is to be known of it
    """
    rows = [_numbers_of(line, len(named), comma, at, name) for at, line in enumerate(found) if line]
    times, values = (np.array([row[k] for row in rows]) for k in (0, 1))
    times -= np.nanmin(times)
    stated = sorted({clock.step for line in found if line for clock in line.clocks})
    series: dict[bytes, Series] = {}
    for k, title in enumerate(named):
        there = np.flatnonzero(np.isfinite(values[:, k]))
        part = slice(there[0], there[-1] + 1) if there.size else slice(0)
        time = times[part, k]
        if len(time) < 2 or not (np.diff(time) > 0.0).all():
            raise RecordError(
                f'{name}: the times of "{title}" do not increase from sample to sample, and its '
                "channels have different times. Save channels of one time in one file."
            )
        apart = float(np.median(np.diff(time)))
        own = rows[part.start][2][k]
        if len(stated) > 1 and abs(apart - own) > 0.01 * own:
            raise RecordError(
                f"{name}: its channels differ in Delta_X ({', '.join(map(str, stated))}), and the "
                f'times of "{title}" are {apart:g} s apart. Save the file anew with times that '
                "agree."
            )
        series.setdefault(time.tobytes(), Series(time, {})).data[title] = values[part, k]
    joined = on_one_time(list(series.values()), name)
    data = {"time [s]": joined.time, **{title: joined.data[title] for title in named}}
    return from_arrays(data, name, None, notes, joined.remarks)


def _numbers_of(
    line: _Line, count: int, comma: bool, at: int, name: str
) -> tuple[list[float], list[float], list[float]]:
    """Return the times, values and stated steps in a row, by channel; NaN where one is missing."""
    steps = [clock.step for clock in line.clocks]
    try:
        times, values = _cells(line, count, comma)
        numbers = [[float(one) if one else np.nan for one in texts] for texts in (times, values)]
    except ValueError as error:
        raise RecordError(f"{name}, line {at + 1}: {error}; numbers are right.") from None
    return numbers[0], numbers[1], steps * (count if len(steps) == 1 else 1)


def _cells(line: _Line, count: int, comma: bool) -> tuple[list[str], list[str]]:
    """Return the texts of `count` times and of all channels in a row.

    Where no time is written, that of the header counts.
    """
    texts = [one.strip().replace(",", ".") if comma else one.strip() for one in line.fields]
    values = [texts[k] if k < len(texts) else "" for k in line.kept[1:]]
    times = []
    for clock in line.clocks if len(line.clocks) > 1 else line.clocks * count:
        written = texts[clock.column] if 0 <= clock.column < len(texts) else ""
        if not written:
            times.append(repr(clock.start + line.row * clock.step))
        else:
            times.append(repr(float(written) + clock.late) if clock.late else written)
    return times, values


def _of_channels(about: dict[str, list[str]], key: str, count: int) -> list[str]:
    """Return what the header gives for a key by channel, "" where it gives nothing.

    Where each channel has a column for its time, its entry stands in one of its two columns.
    """
    texts = [one.strip() for one in about.get(key, [])]
    filled = [one for one in texts if one]
    return (filled if len(filled) >= count else [*texts, *[""] * count])[:count]


def _numbers(about: dict[str, list[str]], key: str, count: int, name: str) -> list[float]:
    """Return the numbers of a key by channel, the first one where a channel has none."""
    texts = _of_channels(about, key, count)
    try:
        found = [float(text.replace(",", ".")) if text else None for text in texts]
    except ValueError:
        raise RecordError(f'{name}: {key} is "{" ".join(texts)}"; numbers are right.') from None
    first = next((one for one in found if one is not None), 0.0)
    return [first if one is None else one for one in found]

"""Delimited text as recorders write it: preambles, titles, rows of units, decimal commas.

Where the numbers begin is found from the numbers themselves: the rows in the middle of the file
show how columns are parted and which hold numbers, and the first row like them begins the data.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from itertools import islice

import numpy as np

from ...core.arrays import Array
from ...core.text import listed, plural
from ...errors import RecordError
from ...physics.motion_file import shortened, without_end_mark
from ...units import parse as parse_unit
from ..channels import meaning, quantity_of_unit
from ..table import Table
from ..titles import Column, is_unit_row, title, title_rows, titles, unit_or_none
from ._one_time import HERTZ, OF_SAMPLES, RATE, SECOND, step_in
from ._rows import (
    Body,
    Layout,
    is_comment,
    is_grouped,
    plain_number,
    read_fast,
    read_groups,
    read_slow,
    seconds_of,
    state_of,
)

ORDER = 2
HEADER = 4
"""Rows of titles, units and what loggers add, at the most."""

_TOKEN = re.compile(r'"[^"]*"|[^\s\[(]\S*(?: ?[\[(][^\])]*[\])])?|\S+')
"""A title and its unit in brackets, or one of the two."""
_GROUP = re.compile(r"\d{3}(?:\.\d*)?")
_QUOTED = 8
"""Lines at most in which a quoted title may be written."""
_BEHIND = 40
"""Lines at most that may stand behind the numbers: sums, remarks, a line that is cut."""
_SAMPLED = re.compile(
    rf"(?P<what>\b(?:fs|dt|{OF_SAMPLES}(?:rate|freq[a-z]*|interval[a-z]*|period[a-z]*|time|zeit))\b)"
    r"(?P<unit>[^\d\n]*?)"
    r"(?P<value>\d+(?:[.,]\d+)*(?:[eE][+-]?\d+)?)[;,\s]*(?P<after>[A-Za-zµ]+)?",
    re.IGNORECASE,
)
_WIDE = 60
"""Values in a row of a table that is wider than long, from which on its channels are rows."""
_RIGHT = 'Titles with units are, for example, "time [s];force [kN]".'


def recognises(content: bytes, suffix: str) -> bool:
    """Return True: what is left is text, or refused with a reason."""
    return True


def read(content: bytes, name: str) -> Table:
    """Return the table in a delimited text.

    Columns are parted by commas, semicolons, tabs, bars or blanks; decimals have points, or commas
    where columns are not parted by commas. Lines that begin with `#` or `%` are comments.

    Raises
    ------
    RecordError
        If no rows of numbers are found, a row has another count of columns, or decimal commas
        cannot be told from those between columns: with the line.
    """
    text, notes = decoded(content, name)
    lines = _with_whole_titles(lines_of(text.replace("\u2212", "-")))
    _refuse_channels_as_rows(lines, name)
    layout = _find_layout(lines, name)
    first = _first_row(lines, layout)
    columns = _header(lines[:first], layout, name, first, notes)
    lines = _without_repeated(lines, first, layout, name, notes)
    lines, remarks = _without_end(lines, layout, notes)
    body = read_fast(lines, first, layout) or read_slow(lines, first, layout, name)
    columns = read_groups(columns, body, lines, layout)
    columns, body = _without_empty(columns, body)
    if any("bristle results" in line for line in lines[:1]) and any(
        re.match(r"# status: incomplete", line) for line in lines[:first]
    ):
        notes.append("the run that wrote this file did not come to its end")
    columns = _instants(columns, body, lines, layout)
    not_numeric = {columns[index].text: text for index, text in body.not_numeric.items()}
    values = {column.text: body.values[k] for k, column in enumerate(columns)}
    above = [";".join(layout.split(line)) for line in lines[:first]]
    if made := _time_by_rate(columns, above, len(body.lines)):
        column, values[made[0].text], remark = made
        columns, remarks = (*columns, column), [*remarks, remark]
    return Table(
        name, columns, values, body.lines, "line", not_numeric, (*notes, *body.notes),
        tuple(remarks),
    )  # fmt: skip


def _with_whole_titles(lines: list[str]) -> list[str]:
    """Return the lines with quoted titles of several lines in one, and empty ones behind it."""
    out = list(lines)
    for k, line in enumerate(lines[:_WIDE]):
        if not out[k] or line.count('"') % 2 == 0:
            continue
        for end in range(k + 2, min(k + 1 + _QUOTED, len(lines)) + 1):
            whole = " ".join(lines[k:end])
            if whole.count('"') % 2 == 0:
                out[k:end] = [whole, *[""] * (end - k - 1)]
                break
    return out


def _without_end(lines: list[str], layout: Layout, notes: list[str]) -> tuple[list[str], list[str]]:
    """Return the lines without those behind the numbers, and remarks on them.

    They are sums, such as a row of maxima, words, or a last line that is cut off: in a number as
    well, where all numbers above it have more decimals.
    """
    full = [k for k, line in enumerate(lines) if line.strip() and not is_comment(line)]
    last = next(k for k in reversed(full) if layout.fits(layout.split(_without_ends(lines[k])), 0))
    behind = [k for k in full if k > last]
    if not behind and last == len(lines) - 1 and _is_cut(lines, full, layout):
        behind = [last]
    if not behind or len(behind) > _BEHIND:
        return lines, []
    out = [*lines[: behind[0]], *[""] * (len(lines) - behind[0])]
    shown = shortened(lines[behind[0]].strip())
    words = any(state_of(one, layout.comma) == "word" for one in layout.split(_without_ends(shown)))
    if len(behind) == 1 and not words:
        notes.append(f"line {behind[0] + 1}, the last one, is cut off and left out")
        return out, []
    several = f"s {behind[0] + 1} to {behind[-1] + 1}" if len(behind) > 1 else f" {behind[0] + 1}"
    return out, [f'line{several} behind the numbers, "{shown}", left out']


def _is_cut(lines: list[str], full: list[int], layout: Layout) -> bool:
    """Return whether the last number of a text without an end of line has lost digits."""
    mark = "," if layout.comma else "."
    ends = [layout.split(_without_ends(lines[k]))[-1].partition(mark)[2] for k in full[-60:]]
    sizes = {len(one) for one in ends[:-1] if one}
    return len(ends) == 60 and len(sizes) == 1 and len(ends[-1]) < min(sizes)


def _time_by_rate(
    columns: tuple[Column, ...], above: list[str], rows: int
) -> tuple[Column, Array, str] | None:
    """Return a time (rows,) s by the one rate that lines above the titles state.

    None where a column may tell the time, or titles are missing.
    """
    meant = [meaning(one.name, one.stated) for one in columns]
    times = (quantity_of_unit(one.stated) == "time" for one in columns)
    told = any(one is not None and one.quantity == "time" for one in meant)
    if told or any(times) or all(one.text == f"column {one.index + 1}" for one in columns):
        return None
    found = {
        step: (k, line)
        for k, line in enumerate(above)
        if (match := _SAMPLED.search(line)) and (step := _step_of(match)) > 0.0
    }
    if len(found) != 1:
        return None
    ((step, (k, line)),) = found.items()
    remark = f'the time is made from line {k + 1}, "{shortened(line.strip())}": {step:g} s a sample'
    return title(len(columns), "time [s]"), np.arange(rows, dtype=np.float64) * step, remark


def _step_of(match: re.Match[str]) -> float:
    """Return the sampling step [s] that a line states, 0 where it is not clear."""
    is_rate = RATE.fullmatch(match["what"]) is not None
    text = match["value"]
    if is_rate and is_grouped(text, comma=False):  # 12,800 Hz
        text = text.replace(",", "")
    elif is_rate and is_grouped(text, comma=True):  # 1.000 Hz may be either
        return 0.0
    value = plain_number(text.replace(",", "."))
    bracket = re.search(r"[\[(]([^\])]*)", match["unit"])
    spelled = bracket[1] if bracket else match["after"] or ""
    unit = unit_or_none(spelled)
    if not value > 0.0 or (bracket and unit is None):
        return 0.0
    if unit is None or unit.dimension not in (SECOND, HERTZ):
        return step_in(match["what"], value) if is_rate else 0.0
    return step_in(f"{match['what']} [{unit.name}]", value)


def _refuse_channels_as_rows(lines: list[str], name: str) -> None:
    """Refuse a table that lies on its side, before anybody takes its samples for columns."""
    if max(map(len, lines)) < 2 * _WIDE:
        return
    full = [line for line in lines if line.strip() and not is_comment(line)]
    for delimiter in (";", "\t", "|", ",", None):
        wide = max((len(line.split(delimiter)) for line in full), default=0)
        if wide < max(_WIDE, 4 * len(full)):
            continue
        rows = [line for line in full if len(line.split(delimiter)) > wide / 2]
        begin = [row.split(delimiter, 1)[0].strip().strip('"') for row in rows]
        named = listed([f'"{shortened(one)}"' for one in begin], 4)
        first = f"{'they begin' if len(rows) > 1 else 'it begins'} with {named}"
        raise RecordError(
            f"{name}: {plural(len(rows), 'row')} of about {wide} values; {first}. "
            "Here its channels are rows, and a column a channel is right: transpose the table."
        )


def decoded(content: bytes, name: str) -> tuple[str, list[str]]:
    """Return a file's text, and what is to be known of how it was read.

    Raises
    ------
    RecordError
        If it is no text.
    """
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            return content.decode("utf-16"), []
        except UnicodeDecodeError as error:
            raise RecordError(f"{name}: this is no whole UTF-16 text ({error.reason}).") from None
    content = without_end_mark(content)
    for form, high in (("utf-16-le", content[1:4096:2]), ("utf-16-be", content[:4096:2])):
        if len(high) > _WIDE and high.count(0) > 0.9 * len(high):
            return content[: len(content) // 2 * 2].decode(form, "replace"), []
    content = content.rstrip(b"\0") or content
    if b"\0" in content[:65536]:
        raise RecordError(
            f"{name}: this is binary data of a kind that is not read. "
            "Save the measurement as CSV, Parquet or MAT (version 7)."
        )
    try:
        return content.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace"), ["not UTF-8: read as Windows-1252 text"]


def lines_of(text: str) -> list[str]:
    """Return the lines of a text, however they end."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _is_data(line: str, layout: Layout) -> bool:
    return (
        bool(line.strip())
        and not is_comment(line)
        and layout.fits(layout.split(_without_ends(line)))
    )


def _without_ends(line: str) -> str:
    """Return a line without blanks around it; a tab there parts an empty field from the others."""
    return line.strip(" \r\n")


def _find_layout(lines: list[str], name: str) -> Layout:
    """Return how the rows in the middle of a text are laid out."""
    full = [k for k, line in enumerate(lines) if line.strip() and not is_comment(line)]
    if not full:
        raise RecordError(f"{name}: there is no row of numbers. {_RIGHT}")
    middle = [_without_ends(lines[k]) for k in islice(full, len(full) // 2, len(full) // 2 + 60)]
    if len(middle) > 3:
        middle.pop()  # the last line of a file may be cut
    # A rig may rest in the middle: whole numbers do not tell how decimals are written.
    spread = full[len(full) // 2 : -1 : max(1, len(full) // 120)]
    middle += [_without_ends(lines[k]) for k in spread]
    best: tuple[float, Layout] | None = None
    for delimiter in (";", "\t", "|", ",", ""):
        quoted = any('"' in row for row in middle)
        for comma in (False, True) if delimiter != "," or quoted else (False,):
            found = _try_layout(middle, delimiter, comma)
            if found and (best is None or found[0] > best[0]):
                best = found
    if best is None:
        shown = shortened(middle[0]) if middle else ""
        raise RecordError(
            f'{name}, line {full[len(full) // 2] + 1 if full else 1}: "{shown}" is no row of '
            f"numbers, and no rows around it are. {_RIGHT}"
        )
    _refuse_comma_for_both(lines, best[1], name)
    return best[1]


def _try_layout(rows: list[str], delimiter: str, comma: bool) -> tuple[float, Layout] | None:
    """Return a layout with a score: how much of the rows it reads as numbers."""
    layout = Layout(delimiter, comma, [])
    split = [layout.split(row) for row in rows]
    count, often = Counter(map(len, split)).most_common(1)[0]
    # One column is a layout of its own only where nothing parts the text.
    if count < 2 and (delimiter != "" or any(mark in row for row in rows for mark in ";\t|")):
        return None
    same = [fields for fields in split if len(fields) == count]
    states = [[state_of(fields[k], comma) for fields in same] for k in range(count)]
    layout.numeric = [2 * column.count("word") < len(column) for column in states]
    layout.numeric = [
        n and "number" in column for n, column in zip(layout.numeric, states, strict=True)
    ]
    if not any(layout.numeric):
        return None
    # What needs no groups of thousands is the better reading; a field may well be empty.
    grouped = sum(is_grouped(text, comma) for fields in same for text in fields)
    numbers = sum(len(one) - one.count("word") for one in states) - 0.02 * grouped
    share = numbers / sum(map(len, states))
    # Points win where both would do: whole numbers have neither.
    return (often / len(rows)) * share + 0.01 * min(count, 5) - 0.001 * comma, layout


def _refuse_comma_for_both(lines: list[str], layout: Layout, name: str) -> None:
    """Refuse `0,001,2,5`, where a comma parts columns and decimals alike, or thousands."""
    if layout.delimiter != ",":
        return
    wide = len(layout.numeric)
    k = next((k for k, line in enumerate(lines[:400]) if k and _is_data(line, layout)), 0)
    fields = layout.split(lines[k - 1].strip()) if k else []
    above = [text for text in fields if text.strip()]
    doubled = wide == 2 * len(above) and not any(state_of(one, False) == "number" for one in above)
    if len(fields) == wide or not (doubled or wide == len(above) + 1):
        return
    last = {layout.split(_without_ends(one))[-1] for one in lines[k:] if _is_data(one, layout)}
    if doubled or (len(last) > 1 and all(map(_GROUP.fullmatch, last))):
        raise RecordError(
            f"{name}, line {k + 1}: {wide} numbers under {len(above)} titles. Commas part columns "
            "and decimals, or thousands, alike here: save the file with semicolons between "
            "columns, or with decimal points and without groups of thousands."
        )


def _header(
    above: list[str], layout: Layout, name: str, first: int, notes: list[str]
) -> tuple[Column, ...]:
    """Return the columns from the lines above the first row of data."""
    wide = len(layout.numeric)
    rows = [
        (k, fields)
        for k, line in enumerate(above)
        if line.strip() and not is_comment(line)
        for fields in [_title_fields(line, layout, wide)]
    ]
    fitting = [(k, fields) for k, fields in rows if len(fields) == wide]
    block = fitting[-1:]
    if fitting and fitting[-1] == rows[-1]:
        block = _last_block(fitting, above)
    for line in reversed([] if fitting else above[-HEADER:]):
        fields = _title_fields(line.strip().lstrip("#% "), layout, wide)
        if not is_comment(line) or len(fields) != wide:
            break
        block.insert(0, (0, fields))
    if not block:
        notes.append("no titles: columns are called column 1, column 2, ... and have no units")
        return titles([""] * wide)
    at, of_units = title_rows([fields for _, fields in block])
    k, names = block[at]
    if fitting:
        numbers = sum(state_of(one, layout.comma) == "number" for one in names)
        if of_units is None and numbers > wide / 2:
            raise RecordError(
                f'{name}, line {k + 1}: "{shortened(above[k].strip())}" is neither titles nor a '
                "row of numbers like those below it. Correct or remove it."
            )
        if k:
            notes.append(f"titles in line {k + 1}, numbers from line {first + 1} on")
        notes += [
            f'line {line + 1}, "{shortened(above[line].strip())}", is taken as a description: '
            f"titles are in line {k + 1}"
            + (f", units in line {block[of_units][0] + 1}" if of_units is not None else "")
            for row, (line, _) in enumerate(block)
            if row not in (at, of_units) and row > min(at, at if of_units is None else of_units)
        ]
    rest = [fields for row, (_, fields) in enumerate(block) if row != at]
    return titles(names, None if of_units is None else block[of_units][1], rest)


def _last_block(rows: list[tuple[int, list[str]]], above: list[str]) -> list[tuple[int, list[str]]]:
    """Return the last rows with nothing but empty lines between them, four at the most."""
    block = rows[-1:]
    for row in reversed(rows[:-1]):
        if any(above[k].strip() for k in range(row[0] + 1, block[0][0])) or len(block) == HEADER:
            break
        block.insert(0, row)
    return block


def _first_row(lines: list[str], layout: Layout) -> int:
    """Return the index of the first line of data.

    Numbers that count the columns, 1 to n or 0 to n - 1, are those of channels, and belong to the
    titles, unless the next rows go on as evenly; so does what stands above a row of units.
    """
    for k, line in enumerate(lines):
        if not _is_data(line, layout):
            continue
        full = (one for one in islice(lines, k + 1, None) if one.strip())
        rows = [layout.split(_without_ends(one)) for one in (line, *islice(full, 2))]
        if is_unit_row(rows[1] if len(rows) > 1 and len(rows[1]) == len(rows[0]) else []):
            continue
        if not _counts_columns(rows[0]) or _goes_on(rows, layout):
            return k
    return next(k for k, line in enumerate(lines) if _is_data(line, layout))


def _counts_columns(fields: list[str]) -> bool:
    there = [(k, text.strip().strip('"')) for k, text in enumerate(fields) if text.strip()]
    return len(there) > 2 and any(
        all(text == str(k + begin) for k, text in there) for begin in (0, 1)
    )


def _goes_on(rows: list[list[str]], layout: Layout) -> bool:
    """Return whether the first of three rows is as far from the second as that from the third."""
    if len(rows) < 3 or not all(state_of(row[0], layout.comma) == "number" for row in rows):
        return False
    first, second, third = (float(row[0].strip(' "').replace(",", ".")) for row in rows)
    return abs((second - first) - (third - second)) <= 0.01 * abs(third - second)


def _without_repeated(
    lines: list[str], first: int, layout: Layout, name: str, notes: list[str]
) -> list[str]:
    """Return the lines without titles that come again, with what stands above and below them.

    Test machines write their header before every block of a test; RecordError if units differ.
    """

    def tells_units(line: str) -> bool:
        return is_unit_row(_title_fields(line, layout, len(layout.numeric)))

    above = next((k for k in range(first - 1, -1, -1) if lines[k].strip()), -1)
    units = lines[above].strip() if above > 0 and tells_units(lines[above]) else ""
    while above > 0 and tells_units(lines[above]):
        above -= 1
    title = lines[above].strip() if above >= 0 else ""
    if not title or is_comment(title):
        return lines
    again = [k for k in range(first, len(lines)) if lines[k].strip() == title]
    out = list(lines)
    for k in again:
        for step in (-1, 1):
            at = k
            while first <= at < len(lines) and not _is_data(lines[at], layout):
                if units and at > k and lines[at].strip() != units and tells_units(lines[at]):
                    raise RecordError(
                        f'{name}, line {at + 1}: the units are "{shortened(lines[at].strip())}" '
                        f'here, and "{shortened(units)}" above. Save each block as a file.'
                    )
                out[at] = ""
                at += step
    if again:
        notes.append(f"the titles come again in {len(again)} places, such as line {again[0] + 1}")
    return out


def _title_fields(line: str, layout: Layout, wide: int) -> list[str]:
    """Return the titles in a line; there may be one less or more than numbers, left empty."""
    stripped = line.strip("\n\r ")
    fields = layout.split(stripped) if layout.delimiter else []
    others = (stripped.split(mark) for mark in ";\t|,") if len(fields) < 2 else ()
    fields = next((one for one in others if len(one) == wide > 1), fields)
    if len(fields) < 2:  # blanks may part titles above a table of tabs
        fields = re.split(r"\s{2,}|\t", stripped)  # titles of several words stand further apart
        said = re.match(r"[^:]*\S:\s", stripped)  # "Time: 1.8 s" is no title
        if len(fields) != wide and not said:
            fields = _TOKEN.findall(stripped)
    if len(fields) == wide - 1 and layout.delimiter:
        fields.append("")
    while len(fields) > wide and not fields[-1].strip():
        fields.pop()
    return fields


def _without_empty(columns: tuple[Column, ...], body: Body) -> tuple[tuple[Column, ...], Body]:
    """Leave out columns without title and without values, as a delimiter at the end makes them."""
    kept = [
        k
        for k, column in enumerate(columns)
        if not (column.text == f"column {k + 1}" and np.isnan(body.values[k]).all())
        or k in body.not_numeric
    ]
    body.values = [body.values[k] for k in kept]
    body.not_numeric = {kept.index(k): text for k, text in body.not_numeric.items() if k in kept}
    return tuple(columns[k] for k in kept), body


def _instants(
    columns: tuple[Column, ...], body: Body, lines: list[str], layout: Layout
) -> tuple[Column, ...]:
    """Turn columns of dates and times of day into seconds since the first."""
    out = list(columns)
    for index in list(body.not_numeric):
        try:
            texts = [layout.split(_without_ends(lines[at - 1]))[index] for at in body.lines]
        except IndexError:
            continue
        seconds = seconds_of(texts)
        if seconds is None:
            continue
        body.values[index] = seconds
        del body.not_numeric[index]
        out[index] = replace(columns[index], unit=parse_unit("s"), problem="", written="")
        told = "taken as s since the first"
        part = next((k for k, one in enumerate(columns) if one.name.lower() == "ms"), None)
        if part is not None and _are_thousandths(body.values[part], seconds):
            body.values[index] = seconds + (body.values[part] - body.values[part][0]) / 1e3
            told += f', with the ms of "{columns[part].text}"'
        body.notes.append(f'"{columns[index].text}" holds instants: {told}')
    return tuple(out)


def _are_thousandths(values: Array, seconds: Array) -> bool:
    """Return whether values (n,) are the ms in whole seconds (n,)."""
    whole = bool((values == np.round(values)).all() and (seconds == np.round(seconds)).all())
    return whole and float(values.min()) >= 0.0 and float(values.max()) < 1e3

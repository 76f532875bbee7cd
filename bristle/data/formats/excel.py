"""Excel workbooks (.xlsx, .xlsm): the values of one sheet. Nothing in them is executed.

A sheet is read as the text that it would be saved as, so that preambles, titles, rows of units and
instants are found as in any other text.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from datetime import date, datetime, time
from typing import Any, NamedTuple
from xml.etree import ElementTree

from ...core.text import listed, plural
from ...errors import RecordError
from ...units import parse as parse_unit
from ..channels import meaning, quantity_of_unit
from ..noise import SHORTEST
from ..pieces import SHEET
from ..table import Table, one_below_the_other
from ..titles import title_rows, unit_or_none
from . import DAMAGED, delimited, library

ENTRY = "xl/workbook.xml"
LARGEST = 512 * 1024**2
"""Largest content of a workbook that is unpacked [bytes]."""

ROWS = 10
"""Rows of numbers that tell a measurement's sheet from a log of the test."""

_OF_A_RUN = {"time", "displacement", "velocity", "acceleration", "force", "voltage", "current"}

_MERGED = re.compile(rb'<mergeCell [^>]*ref="([A-Z]+)(\d+):([A-Z]+)(\d+)"')
_CELL = re.compile(rb"<c [^>]*[^>/]>.*?</c>", re.DOTALL)
_ANY_FORMULA = re.compile(rb"<f[ >/]")
_VALUE = re.compile(rb"<v(?: [^>/]*)?>[^<]")
_QUOTED = re.compile(r'"[^"]*"|\\.')  # what a number's format writes as it stands
_THOUSANDS = re.compile(r"[0#?](,+)(?![0#?])")
_PLACE = re.compile(rb'r="([A-Z]+\d+)"')


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is a workbook, by what its zip archive holds."""
    if not content.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return ENTRY in archive.namelist()
    except (zipfile.BadZipFile, ValueError, OSError):
        return suffix in (".xlsx", ".xlsm")


def read(content: bytes, name: str) -> Table:
    """Return the table in the sheet of a workbook that holds a measurement; see `read_sheet`."""
    return read_sheet(content, name, "")


def read_sheet(content: bytes, name: str, sheet: str) -> Table:
    """Return the table in a workbook: the values of a sheet.

    Of formulas the values count that were stored with them. Macros are not run.

    Parameters
    ----------
    content, name : the file, and what messages call it
    sheet : its title; "" for the one that holds a measurement, "*" for all with the columns of
        that one, one below the other

    Raises
    ------
    RecordError
        If openpyxl is not installed, the file is damaged, no sheet holds rows of numbers or is
        called so, cells of the table are merged, or formulas have no stored values.
    """
    openpyxl = library("openpyxl", name, "an Excel workbook")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _refuse_large(archive, name)
            macros = any(one.endswith("vbaProject.bin") for one in archive.namelist())
            book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            # The library's fast way tells less than the XML of a sheet.
            read = [
                _Sheet(one.title, archive.read(one._worksheet_path.lstrip("/")), _text(one),
                       f'{name}, sheet "{one.title}"')
                for one in book.worksheets if one.sheet_state == "visible" or one.title == sheet
            ]  # fmt: skip
    except (zipfile.BadZipFile, ElementTree.ParseError, *DAMAGED) as error:
        raise RecordError(f"{name}: no Excel workbook, or damaged ({error}).") from None
    notes = ("the workbook holds macros, which are not run",) if macros else ()
    if sheet not in ("", "*", *(one.title for one in read)):
        there = listed(f'"{one.title}"' for one in read)
        raise RecordError(f'{name}: no sheet is called "{sheet}"; there are {there}.')
    able, others = _chosen([one for one in read if sheet in ("", "*", one.title)], name)
    others |= {one.title: f'"{one.title}"' for one in read if one.title not in others}
    titles = [column.text for column in able[0][1].columns]
    alike = [
        one
        for one in sorted(able, key=lambda one: read.index(one[0]))
        if [column.text for column in one[1].columns] == titles and one[1].rows >= SHORTEST
    ]
    able = alike if sheet == "*" and alike else able[:1]
    tables = [_finished(book, *one) for one in able]
    own = [one.title for one, _ in able]
    left = [text for title, text in others.items() if title not in own]
    hidden = [one.title for one in book.worksheets if one.sheet_state != "visible"]
    left += [f'"{title}" (hidden)' for title in hidden if title not in own]
    table = tables[0]
    if len(tables) > 1:
        table = replace(one_below_the_other(tables, name, SHEET), notes=table.notes)
    remarks = table.remarks
    if left or len(own) > 1:
        quoted = listed((f'"{title}"' for title in own), 6)
        what = f"sheets {quoted} are" if len(own) > 1 else f"sheet {quoted} is"
        rest = f"; {listed(left, 6)} {'is' if len(left) == 1 else 'are'} not" if left else ""
        several = len(alike) > 1 and not sheet
        way = ": --sheet NAME reads another, --sheet '*' each as a run" if several else ""
        remarks = (f"{what} read{rest}{way}", *remarks)
    return replace(table, notes=(*notes, *table.notes), remarks=remarks, place="row")


class _Sheet(NamedTuple):
    """A sheet: its title, XML and text, and what messages call it."""

    title: str
    part: bytes
    text: str
    where: str


def _chosen(
    sheets: Sequence[_Sheet], name: str
) -> tuple[list[tuple[_Sheet, Table]], dict[str, str]]:
    """Return the sheets that hold tables, the likeliest first, and by title what each holds.

    That is the one with most of what a run consists of, as its titles say, among those long enough
    for one; the first where several are alike. A log, a calibration or a summary often stands
    before the measurement. A sheet whose formulas were never computed may be the one.
    """
    reasons: list[str] = []
    read: list[tuple[_Sheet, Table]] = []
    holds: dict[str, str] = {}
    for sheet in sheets:
        if len(_without_values(sheet.part)) >= ROWS:
            _refuse_without_values(sheet.part, sheet.where)
        try:
            table = delimited.read(sheet.text.encode(), sheet.where)
        except RecordError as error:
            reasons.append(str(error))
            holds[sheet.title] = f'"{sheet.title}"'
            continue
        read.append((sheet, table))
        titles = listed([column.text for column in table.columns], 4)
        rows = plural(table.rows, "row")
        holds[sheet.title] = f'"{sheet.title}" ({rows}: {titles})'
    if not read:
        for sheet in sheets:
            _refuse_without_values(sheet.part, sheet.where)
        raise RecordError(
            reasons[0] if len(reasons) == 1 else f"{name}: no sheet holds rows of numbers."
        )
    return sorted(read, key=lambda one: _worth(one[1]), reverse=True), holds


def _finished(book: Any, sheet: _Sheet, table: Table) -> Table:
    """Return the table of a sheet's text with what the cells of the workbook tell besides."""
    _refuse_without_values(sheet.part, sheet.where)
    lines = ["", *delimited.lines_of(sheet.text)]
    first = int(table.lines[0])
    _refuse_merged(sheet.part, table, lines[1:first], sheet.where)
    cells = next(book[sheet.title].iter_rows(min_row=first, max_row=first))
    table = _as_shown(table, [(cell.number_format or "").partition(";")[0] for cell in cells])
    formulas = len(_formulas(sheet.part))
    told = [f"{formulas} cells hold formulas: their stored values are taken"] if formulas else []
    return replace(table, notes=(*told, *table.notes))


def _worth(table: Table) -> tuple[bool, int, bool]:
    """Return whether a table is long enough for a run, how many of its quantities it holds, and
    whether it has more than a few rows."""
    found = set()
    for column in table.columns:
        meant = meaning(column.name, column.stated)
        found.add(meant.quantity if meant is not None else quantity_of_unit(column.stated))
    return table.rows >= SHORTEST, len(found & _OF_A_RUN), table.rows >= ROWS


def _refuse_large(archive: zipfile.ZipFile, name: str) -> None:
    size = sum(one.file_size for one in archive.infolist())
    if size > LARGEST:
        raise RecordError(
            f"{name}: {size / 1024**2:.0f} MB unpacked are more than the limit of "
            f"{LARGEST // 1024**2} MB. Save the sheet as CSV, or cut it."
        )


def _as_shown(table: Table, forms: Sequence[str]) -> Table:
    """Return a table whose values are what cells show: 50 % is stored as 0.5, 1.9 kN as 1911.

    Parameters
    ----------
    table : as read from the sheet's text
    forms : the format of the numbers in each column; a comma behind the digits shows thousands, of
        the unit that it writes behind them, and what has another unit than % is in none
    """
    values, notes, percent = dict(table.values), list(table.notes), parse_unit("%")
    columns = list(table.columns)
    for k, column in enumerate(columns):
        written = forms[column.index] if column.index < len(forms) else ""
        form = _QUOTED.sub("", written)
        if match := _THOUSANDS.search(form):
            behind = unit_or_none("".join(_QUOTED.findall(written)).strip('" '))
            unit, own = behind or column.unit, column.unit or behind
            if unit is None or own is None or unit.dimension == own.dimension:
                size = unit.factor / own.factor if unit and own else 1.0
                values[column.text] = values[column.text] * size / 1e3 ** len(match[1])
            if behind is None:
                told = f'its cells are shown in thousands, as "{form}", and taken as they are shown'
                columns[k] = column = replace(column, doubt=told)
            elif column.unit is None:
                columns[k] = column = replace(column, unit=behind)
        if "%" not in form or column.problem or column.unit not in (None, percent):
            continue
        values[column.text] = 100.0 * values[column.text]
        columns[k] = replace(column, unit=percent)
        notes.append(f'"{column.text}" is shown in per cent, and is taken so')
    return replace(table, columns=tuple(columns), values=values, notes=tuple(notes))


def _text(sheet: Any) -> str:
    """Return a sheet as text, cells parted by tabs, a line per row."""
    sheet.reset_dimensions()  # what some programs write there is wrong
    rows = [[_cell(value) for value in row] for row in sheet.iter_rows(values_only=True)]
    while rows and not any(rows[-1]):
        rows.pop()
    wide = max((max((k + 1 for k, one in enumerate(r) if one), default=0) for r in rows), default=0)
    return "\n".join("\t".join((row + [""] * wide)[:wide]) for row in rows) + "\n"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat(sep=" ") if isinstance(value, datetime) else value.isoformat()
    return " ".join(str(value).split())


def _formulas(part: bytes) -> list[bytes]:
    """Return the cells of a sheet's XML that hold formulas."""
    if not _ANY_FORMULA.search(part):
        return []
    return [cell for cell in _CELL.findall(part) if _ANY_FORMULA.search(cell)]


def _without_values(part: bytes) -> list[bytes]:
    """Return the cells of a sheet's XML whose formulas were never computed."""
    return [cell for cell in _formulas(part) if not _VALUE.search(cell)]


def _refuse_without_values(part: bytes, where: str) -> None:
    """Refuse formulas that were never computed: nothing here computes them."""
    for cell in _without_values(part):
        place = _PLACE.search(cell)
        at = f", cell {place.group(1).decode()}" if place else ""
        raise RecordError(
            f"{where}{at}: the formula has no stored value, and formulas are not computed "
            "here. Open the workbook in a spreadsheet and save it, or paste values."
        )


def _refuse_merged(part: bytes, table: Table, above: Sequence[str], where: str) -> None:
    """Refuse merged cells in the table, its titles or their units; elsewhere they do no harm.

    Parameters
    ----------
    part : the sheet's XML
    table : as read from the sheet's text
    above : the rows above the first one of numbers
    where : the file and the sheet, for messages
    """
    rows = [line.split("\t") for line in above[-delimited.HEADER :]]
    titles, of_units = title_rows(rows) if rows else (0, None)
    highest = titles if of_units is None else min(titles, of_units)
    first = int(table.lines[0]) - len(rows) + highest
    for match in _MERGED.finditer(part):
        left, top, right, bottom = (one.decode() for one in match.groups())
        if int(bottom) >= first and (left != right or int(bottom) > int(top)):
            raise RecordError(
                f"{where}: cells {left}{top}:{right}{bottom} are merged, so that a title or a "
                "value stands for several. Unmerge them, and fill each cell."
            )

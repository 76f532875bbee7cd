"""CSV files with named columns: which column is what, in which unit.

A column is called `time [s]`, `time (s)` or `time_s`; `acceleration [m/s2]`, `acc_g` or
`velocity_mm_s` (mm/s). Lines that begin with `#` are comments. Decimal points, not commas.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

from ..core.text import listed
from ..errors import PhysicsError, UnitError
from ..physics.motion_file import check_times, number, rows, shortened
from ..units import Unit
from ..units import parse as parse_unit

_BRACKETS = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>.*)\))\s*")
_TIME = parse_unit("s").dimension
_ACCELERATION = parse_unit("m/s2").dimension
_A_G = "the g can be the unit or stand for ground. Write a_g [m/s2], or acc [g]."
_RIGHT = 'A header with units is, for example, "time [s],acceleration [m/s2]" or "time_s,acc_g".'


@dataclass(frozen=True, slots=True)
class Column:
    """One column: where it stands, its text in the header, and what that means.

    `unit` is None where the text gives none that can be read; `problem` then says why, if it
    gives one at all, and `written` is that of a row of units. `doubt` is what speaks against how
    its values were read.
    """

    index: int
    text: str
    name: str
    unit: Unit | None
    problem: str = ""
    written: str = ""
    doubt: str = ""

    @property
    def stated(self) -> str:
        """The name of its unit, "" where it has none."""
        return self.unit.name if self.unit else ""

    def is_a(self, dimension: tuple[int, ...], *names: str) -> bool:
        """Return whether the unit has that dimension and the name is one of those, if any."""
        if self.unit is None or self.unit.dimension != dimension:
            return False
        return not names or self.name.rpartition(".")[2].lower() in names


def column(index: int, text: str) -> Column:
    """Return a column from its text in the header."""
    text = text.strip().strip('"').strip()
    match = _BRACKETS.fullmatch(text)
    if match:
        spelled = match["square"] if match["square"] is not None else match["round"]
        try:
            return Column(index, text, match["name"], parse_unit(spelled))
        except UnitError as error:
            return Column(index, text, match["name"], None, str(error))
    parts = text.split("_")
    # The longest ending that is a unit: `velocity_mm_s` is in mm/s, not in s.
    for size in (2, 1):
        name, ending = "_".join(parts[:-size]), parts[-size:]
        if not name or not all(re.match(r"[A-Za-z%]", part) for part in ending):
            continue
        if len(name) == 1 and ending == ["g"]:
            return Column(index, text, text, None, _A_G)
        try:
            return Column(index, text, name, parse_unit("/".join(ending)))
        except UnitError:
            continue
    return Column(index, text, text, None)


def parse(text: str, name: str) -> tuple[list[float], list[float]]:
    """Return times [s] and ground accelerations [m/s2] of the text of a CSV file.

    Parameters
    ----------
    text : str
        The whole file. Columns are parted by commas, semicolons or tabs.
    name : str
        The file, for messages.

    Raises
    ------
    PhysicsError
        If no or several columns can be meant, one has no unit, a value is no finite number, or the
        times are out of order, doubled or leave a gap.
    """
    found = list(rows(text))
    if not found:
        raise PhysicsError(f"{name}: the file is empty. {_RIGHT}")
    line, header = found[0]
    delimiter = max(",;\t", key=header.count)
    where = f"{name}, line {line}"
    try:
        texts = next(csv.reader([header], delimiter=delimiter))
    except csv.Error as error:
        raise PhysicsError(f"{where}: this is no header ({error}). {_RIGHT}") from None
    if all(_is_number(field) for field in texts):
        raise PhysicsError(f"{where}: the columns have no names and no units. {_RIGHT}")
    columns = [column(index, field) for index, field in enumerate(texts)]
    time, acceleration = _time_column(columns, where), _acceleration_column(columns, where)
    lines, times, values = [], [], []
    for line, row in found[1:]:
        fields = row.split(delimiter)
        if len(fields) != len(columns):
            raise PhysicsError(
                f'{name}, line {line}: "{shortened(row)}" has {len(fields)} columns, and the '
                f"header {len(columns)}. Is the line cut, or has it decimal commas?"
            )
        lines.append(line)
        times.append(_value(fields, time, name, line))
        values.append(_value(fields, acceleration, name, line))
    check_times(times, lines, name)
    return times, values


def _value(fields: list[str], wanted: Column, name: str, line: int) -> float:
    assert wanted.unit is not None
    return number(fields[wanted.index], name, line, wanted.unit.factor)


def _time_column(columns: list[Column], where: str) -> Column:
    timed = [found for found in columns if found.is_a(_TIME)]
    named = [found for found in timed if found.is_a(_TIME, "time", "t")]
    if len(named or timed) == 1:
        return (named or timed)[0]
    raise _no_column(columns, timed, where, "time", ("time", "t"), "time")


def _acceleration_column(columns: list[Column], where: str) -> Column:
    fitting = [found for found in columns if found.is_a(_ACCELERATION)]
    named = [found for found in fitting if found.is_a(_ACCELERATION, "ground_acceleration")]
    if len(named) == 1:
        return named[0]
    if len(fitting) == 1:
        return fitting[0]
    names = ("acceleration", "ground_acceleration", "accel", "acc", "ag", "a_g", "a")
    raise _no_column(columns, fitting, where, "acceleration", names, "ground_acceleration")


def _no_column(
    columns: list[Column],
    fitting: list[Column],
    where: str,
    quantity: str,
    names: tuple[str, ...],
    right: str,
) -> PhysicsError:
    """Say why no column, or more than one, can be meant; `right` is the name without the unit."""
    if fitting:
        several = listed([f'"{found.text}"' for found in fitting])
        # Who takes the advice keeps the numbers: the unit is that of the column.
        units = dict.fromkeys(found.unit.name for found in fitting if found.unit)
        called = " or ".join(f'"{right} [{unit}]"' for unit in units)
        if len(units) > 1:
            called += ", in its own unit"
        return PhysicsError(
            f"{where}: {several} could all be the {quantity}. Call the one that is meant {called}."
        )
    for found in columns:
        if found.problem and found.name.lower() in names:
            return PhysicsError(f'{where}: "{found.text}": {found.problem}')
        if found.unit is None and found.name.lower() in names:
            return PhysicsError(f'{where}: "{found.text}" has no unit. {_RIGHT}')
    there = shortened(", ".join(f'"{found.text}"' for found in columns))
    return PhysicsError(
        f"{where}: no column is a{'n'[: quantity[0] == 'a']} {quantity} with a "
        f"unit; there are {there}. {_RIGHT}"
    )


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True

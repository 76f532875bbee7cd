"""PEER AT2 files: four title lines, then accelerations in rows, evenly spaced in time.

The layout is that of the PEER strong-motion database, in both of its ages:
`NPTS=   5372, DT=   .0100 SEC` and `4000    0.0100    NPTS, DT`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..errors import PhysicsError
from ..physics.motion_file import number, shortened
from ..units import Unit
from ..units import parse as parse_unit
from .titles import unit_or_none

_TITLE_LINES = 10  # at most; four in the files of the database
_SHORTEST = 1e-6  # s; times are rounded to a thousandth of it
_LONGEST = 60.0  # s; what takes longer between two samples is no shaking
_PLAIN = 1.0  # s; a longer step without a unit may be in ms
_NUMBER = r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[ED][-+]?[0-9]+)?)"
_WHOLE = rf"([1-9][0-9]{{0,2}}(?:[,' ][0-9]{{3}})+(?![0-9.])|{_NUMBER[1:-1]})"
"""A count, which may have its thousands in groups: 1,200."""
_SPELLED = r"(?:\s*[\[(]?\s*([A-Z][A-Z.]*))?"
_COUNT = re.compile(rf"NPTS\s*[=:]?\s*{_WHOLE}", re.IGNORECASE)
_STEP = re.compile(
    rf"\bDT\s*[=:]?\s*{_NUMBER}(?![0-9.]*(?:,|\s*/\s*)[0-9]){_SPELLED}", re.IGNORECASE
)
"""With its unit; not the first number of a fraction such as 1/200, or of a decimal comma."""
_BOTH_BEFORE = re.compile(rf"^\s*{_WHOLE}\s+{_NUMBER}\s+NPTS\b.*\bDT\b{_SPELLED}", re.IGNORECASE)
_SIGN_INSIDE = re.compile(r"(?<=[0-9.])(?=[-+])")
"""Where a column ends and the next begins, in rows of a fixed width that leaves no blank."""
_VALUE = re.compile(r"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:E[-+]?[0-9]+)?")
_UNITS = re.compile(
    r"UNITS?\s*(?:OF|[:=])\s*([A-Z/0-9^*.]+(?:\s*[X*/]\s*[0-9.^]+)?)", re.IGNORECASE
)
"""With a factor behind it, as in G x 1000."""


def looks_like(text: str) -> bool:
    """Return whether a text is AT2 whatever its file is called."""
    return any(
        _BOTH_BEFORE.search(line) or (_COUNT.search(line) and _STEP.search(line))
        for line in _lines(text)[:_TITLE_LINES]
        if not line.startswith("#")
    )


def parse(text: str, name: str) -> tuple[list[float], list[float]]:
    """Return times [s] from 0 and accelerations [m/s2] of the text of an AT2 file.

    Parameters
    ----------
    text : str
        The whole file.
    name : str
        The file, for messages.

    Raises
    ------
    PhysicsError
        If the title lines give no NPTS, DT or unit, the unit is not that of an acceleration, a
        value is no finite number, or their count is not NPTS.
    """
    lines = _lines(text)
    if not any(line.strip() for line in lines):
        raise PhysicsError(f"{name}: the file is empty. AT2 has four title lines, then values.")
    last = next((k for k, line in enumerate(lines[:_TITLE_LINES]) if "NPTS" in line.upper()), None)
    if last is None:
        raise PhysicsError(
            f"{name}, line {min(4, len(lines))}: no NPTS and DT in the title lines. "
            'AT2 says there, for example, "NPTS=   5372, DT=   .0100 SEC".'
        )
    count, step = _count_and_step(lines[last], name, last + 1)
    unit = _unit(lines[: last + 1], name)
    values = [
        number(field, name, line, unit.factor)
        for line, row in enumerate(lines[last + 1 :], last + 2)
        for field in _fields(row)
    ]
    if len(values) != count:
        why = "The file is cut or has been edited; fetch it again."
        if len(values) == 2 * count:
            why = "AT2 holds values alone: remove the column of times."
        raise PhysicsError(
            f"{name}, line {last + 1}: NPTS announces {count} values, and {len(values)} follow. "
            f"{why}"
        )
    if count < 2:
        raise PhysicsError(f"{name}: {count} sample. A record has two at least.")
    # Rounded, so that 7 steps of 0.01 s are at 0.07 s, as in any table of the record.
    return [round(k * step, 9) for k in range(count)], values


def _lines(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _fields(row: str) -> Iterator[str]:
    """Yield the numbers of a row; a minus sign may be all that parts two of them."""
    for field in row.split():
        plain = field.upper().replace("D", "E")
        parts = _SIGN_INSIDE.split(plain)
        # Of 1.5-101 no one can say whether it is two numbers, or one without its E.
        whole = plain if plain[-1].isdigit() else field.upper()  # END is no ENE
        yield from parts if all(map(_VALUE.fullmatch, parts)) else (whole,)


def _count_and_step(row: str, name: str, line: int) -> tuple[int, float]:
    """Return NPTS and DT [s], which is in the unit behind it, in s where there is none."""
    before = _BOTH_BEFORE.search(row)
    if before:
        whole, fraction, spelled = before.groups()
    else:
        count, step = _COUNT.search(row), _STEP.search(row)
        if count is None or step is None:
            raise PhysicsError(
                f'{name}, line {line}: "{shortened(row.strip())}" does not give both NPTS and DT, '
                'as in "NPTS=   5372, DT=   .0100 SEC".'
            )
        whole, (fraction, spelled) = count[1], step.groups()
    points = number(re.sub("[,' ]", "", whole.upper()).replace("D", "E"), name, line)
    spacing = number(fraction.upper().replace("D", "E"), name, line)
    spacing *= _seconds(spelled, f"{name}, line {line}")
    if not spelled and _PLAIN < spacing <= _LONGEST:
        raise PhysicsError(
            f"{name}, line {line}: DT = {spacing:g} has no unit, and is long for one in s. "
            "Write SEC or MSEC behind it."
        )
    if points != int(points) or points < 1 or not _SHORTEST <= spacing <= _LONGEST:
        raise PhysicsError(
            f"{name}, line {line}: NPTS = {whole} and DT = {spacing:g} s. NPTS is a count, "
            f"and DT is from {_SHORTEST:g} to {_LONGEST:g} s."
        )
    return int(points), spacing


def _seconds(spelled: str | None, where: str) -> float:
    """Return how many seconds one in the unit of DT is."""
    unit = unit_or_none((spelled or "s").rstrip("."))
    if unit is None or unit.dimension != parse_unit("s").dimension:
        raise PhysicsError(
            f'{where}: DT is in "{spelled}", which is no unit of time that is known. '
            "SEC or MSEC is right."
        )
    return unit.factor


def _unit(titles: list[str], name: str) -> Unit:
    """Return the unit of the values, which the title lines must name."""
    for line, title in enumerate(titles, 1):
        found = _UNITS.search(title)
        if not found:
            continue
        unit = _read_unit(found[1].rstrip("."), f"{name}, line {line}")
        if unit.dimension != parse_unit("m/s2").dimension:
            raise PhysicsError(
                f"{name}, line {line}: the values are in {found[1]}, which is no acceleration. "
                "Take the AT2 file of the record, not VT2 or DT2."
            )
        other = re.search("VELOCITY|DISPLACEMENT", title.upper())
        if other and "ACC" not in title.upper():
            raise PhysicsError(
                f"{name}, line {line}: the values are a {other[0].lower()} in {found[1]}. "
                "Take the AT2 file of the record, not VT2 or DT2."
            )
        return unit
    raise PhysicsError(
        f"{name}, lines 1 to {len(titles)}: the title lines name no unit. AT2 says, for example, "
        '"ACCELERATION TIME SERIES IN UNITS OF G".'
    )


def _read_unit(spelled: str, where: str) -> Unit:
    """Return a unit spelled as it should be, or in capitals as title lines are."""
    found = map(unit_or_none, (spelled, spelled.lower(), spelled.capitalize()))
    if (unit := next(filter(None, found), None)) is None:
        raise PhysicsError(f'{where}: the unit "{spelled}" is not known. AT2 has G, or CM/S2.')
    return unit

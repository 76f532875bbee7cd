"""What the title of a column says: name and unit, in the spellings that laboratories use."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import UnitError
from ..units import Unit
from ..units import parse as parse_unit
from .channels import meaning, of_a_drive, of_a_sensor, quantity_of_unit

_BRACKETS = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>.*)\))\s*")
_LIKE_BRACKETS = str.maketrans("{}<>\uff3b\uff3d\uff08\uff09", "[][][]()")
_FACTOR = re.compile(
    r"(?<!\d)[*/÷]\s*10+\b|[\])]\s*[x\u00d7·*/÷]\s*[\d.]\S*|(?<=\S)\s+[x\u00d7]\s*10+\b"
    r"|\b10\s*[\^\u00b9\u00b2\u00b3\u2070-\u2079]|\b1[eE][+-]?\d"
)
"""A factor in a title, by which values may have been multiplied or divided."""
_A_G = "the g can be the unit or stand for ground. Write a_g [m/s2], or acc [g]."
_PARTED = re.compile(
    r"(?P<name>.*[^\s,:;=/-])\s*(?P<by>\s/\s|\s-\s|[,:;=]\s*|\sin\s|\s)\s*(?P<unit>[^\s,:;=]+)\s*"
)
_BRACKET = re.compile(r".*[\[(]\s*(?P<unit>[^\])]*?)\s*[\])]")
_BARE = re.compile(r"(?:/|in )?[\[(]?\s*(?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*?)\s*[\])]?")
_WHOLE = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")
_DEGREES = re.compile(r"(?:deg(?:rees?|\.)?|grad|[°º])? ?(?:[cC](?:elsius)?|[fF](?:ahrenheit)?)")
_TEMPERATURE = re.compile(
    rf"(?P<name>.*?\S)\s*(?:[\[(]\s*(?:{_DEGREES.pattern})\s*[\])]|[_/] ?(?:{_DEGREES.pattern})"
    rf"|(?:,| in) (?:{_DEGREES.pattern})|\s(?=[dg°º])(?:{_DEGREES.pattern}))\s*"
)
_NOTHING = ("", "-", "1", "[]", "()", "[-]", "(-)", "[1]", "n/a", "none", "ts", "rn", "no.")


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


def column(index: int, text: str) -> Column:
    """Return a column from its text in the header."""
    text = text.strip().strip('"').strip()
    plain = text.translate(_LIKE_BRACKETS)
    if found := _FACTOR.search(plain):
        name = re.split(r"\s*[\[(]", plain)[0]
        return Column(index, text, name, None, f'"{found[0].strip(" )]")}" in it may be a factor')
    match = _BRACKETS.fullmatch(plain)
    if match:
        spelled = match["square"] if match["square"] is not None else match["round"]
        try:
            return Column(index, text, match["name"], parse_unit(_renamed(spelled)))
        except UnitError as error:
            return Column(index, text, match["name"], None, str(error))
    parts = text.rstrip("_").split("_")  # MATLAB makes Force_kN_ of "Force (kN)"
    # The longest ending that is a unit: `velocity_mm_s` is in mm/s, not in s.
    for size in (2, 1):
        name, ending = "_".join(parts[:-size]), parts[-size:]
        if not name or not all(re.match(r"[A-Za-z%]", part) for part in ending):
            continue
        if len(name) == 1 and ending == ["g"]:
            return Column(index, text, text, None, _A_G)
        try:
            return Column(index, text, name, parse_unit(_renamed("/".join(ending))))
        except UnitError:
            continue
    return Column(index, text, text, None)


def title(index: int, text: str) -> Column:
    """Return a column from its title: `force [kN]`, `F (kN)`, `F_kN`, `F/kN`, `F, kN`, `F in kN`.

    Parameters
    ----------
    index : int
        Where the column stands, from 0.
    text : str
        Its title in the file.
    """
    found = column(index, text)
    if found.unit is not None and _BRACKETS.fullmatch(found.text):
        other = title(index, found.name)  # Force [N] (kN); of "cell 25 kN [N]" one is a range
        subscript = re.fullmatch("_.", found.name[len(other.name) :])  # F_N is a normal force
        unit = None if subscript or other.name[-1:].isdigit() else other.unit
        if unit and unit.dimension == found.unit.dimension and _differs(other, found.unit):
            problem = f"the title says {unit.name}, and {found.unit.name}."
            return replace(found, unit=None, problem=problem)
    if found.unit is not None or _FACTOR.search(found.text):
        return found
    if (own := _by_its_name(found)) is not None:
        return own
    brackets = _WHOLE.finditer(found.text.translate(_LIKE_BRACKETS))
    told = [(one, unit) for one in brackets if (unit := unit_or_none(one[0][1:-1])) is not None
            and any(unit.dimension)]  # fmt: skip
    if len(told) == 1:  # Force [kN] (filtered), Force [kN] CH3
        before = found.text[: told[0][0].start()].strip()
        return replace(found, name=before or found.name, unit=told[0][1], problem="")
    if found.problem:
        return found
    parted = _PARTED.fullmatch(found.text)
    unit = unit_or_none(parted["unit"]) if parted else None
    if parted and unit is not None and (parted["by"].strip() or _fits(parted["name"], unit)):
        return replace(found, name=parted["name"], unit=unit)
    return _by_slash(found)


def _fits(name: str, unit: Unit) -> bool:
    """Return whether a name says the quantity of a unit; g may stand for ground."""
    meant = meaning(name, None)
    return unit.name != "g" and meant is not None and meant.quantity == quantity_of_unit(unit.name)


def _by_its_name(column: Column, spelled: str = "") -> Column | None:
    """Return a column in a unit that its name tells: degrees "C" or "F", gravity "G"; else None.

    F alone is mostly a force: it is that of Fahrenheit where the name is one of a temperature.
    """
    bracket = _BRACKETS.fullmatch(column.text)
    gravity = spelled or (bracket and (bracket["square"] or bracket["round"])) or ""
    meant = meaning(column.name, None)
    if gravity in ("G", "mG") and meant is not None and meant.quantity == "acceleration":
        return replace(column, unit=parse_unit(gravity.lower()), problem="", written="")
    match = _TEMPERATURE.fullmatch(column.text) if not spelled else None
    if match is None and not _DEGREES.fullmatch(spelled):
        return None
    name = match["name"] if match else column.name
    spelled = column.text[match.end("name") :].strip("[]() ,/_") if match else spelled
    meant = meaning(name, None)
    told = of_a_sensor(name) or (meant is not None and meant.quantity == "time")
    if not told and (meant is not None or spelled.lower() == "f"):
        return None
    unit = parse_unit("degF" if "f" in spelled.lower() else "degC")
    return replace(column, name=name, unit=unit, problem="", written="")


def _by_slash(column: Column) -> Column:
    """Return a column called `F/kN`: a symbol or a word for a quantity, by a unit.

    `m/s` is the unit of a speed and no name; `s/mm` is the unit of nothing.
    """
    name, _, spelled = column.text.partition("/")
    whole, unit = unit_or_none(column.text), unit_or_none(spelled)
    told = whole is not None and quantity_of_unit(whole.name) is not None
    if unit is None or told or (meaning(name, None) is None and not of_a_drive(name)):
        return column
    return replace(column, name=name, unit=unit)


def titles(
    names: Sequence[str],
    units: Sequence[str] | None = None,
    others: Sequence[Sequence[str]] = (),
) -> tuple[Column, ...]:
    """Return the columns of a header and of the row of units below it, each title once.

    Columns without a title are called `column 3`, counted from 1; a title that is met again gets a
    number: `F`, `F (2)`. Without a row of units, no other row of the header may deny the units.
    """
    out: list[Column] = []
    met: dict[str, int] = {}
    for index, name in enumerate(names):
        text = name.strip().strip('"').strip() or f"column {index + 1}"
        met[text] = met.get(text, 0) + 1
        found = title(index, text)
        if met[text] > 1:
            found = replace(found, text=f"{text} ({met[text]})")
        bare = "" if units is None else units[index].strip()
        bare = "" if len(bare) > 1 and _is_time(bare) else bare  # "Time", and no tonne
        if units is not None and bare.lower() not in _NOTHING:
            found = _in_unit(found, units[index].strip().strip('"').strip())
        for row in others if units is None else ():
            found = _undenied(found, title(index, row[index]))
        out.append(found)
    return tuple(out)


def _in_unit(column: Column, text: str) -> Column:
    """Return a column in the unit that a row of units says; in none where its title denies it."""
    unit = row_unit(text)
    if unit is None and (own := _by_its_name(column, text.strip("[]() "))) is not None:
        return own
    if unit is not None and _differs(column, unit):
        assert column.unit is not None
        problem = f"the title says {column.unit.name}, and the row of units {unit.name}."
        return replace(column, unit=None, problem=problem)
    if unit is not None:
        return replace(column, unit=unit, problem="")
    written = _WHOLE.fullmatch(text)
    spelled = text[1:-1].strip() if written else text
    return replace(column, unit=None, problem=f'unit "{spelled}" is not known.', written=spelled)


def _differs(column: Column, unit: Unit) -> bool:
    """Return whether a title tells another unit, in brackets or of the same quantity.

    The ending of a name need not be a unit: "voltage_in" is in no inches.
    """
    own = column.unit
    if own is None or (own.factor, own.dimension, own.offset) == unit[1:]:
        return False
    return own.dimension == unit.dimension or _BRACKET.fullmatch(column.text) is not None


def _undenied(column: Column, other: Column) -> Column:
    """Return a column, in no unit where another row of the header says another one in brackets."""
    if other.unit is None or not _BRACKET.fullmatch(other.text) or not _differs(column, other.unit):
        return column
    assert column.unit is not None
    problem = f'the title says {column.unit.name}, and "{other.text}" in the header another unit.'
    return replace(column, unit=None, problem=problem)


def title_rows(rows: Sequence[Sequence[str]]) -> tuple[int, int | None]:
    """Return which of the rows above the numbers holds the titles, and which their units, if any.

    Names and units may be followed, or parted, by a row of channel numbers, types, descriptions or
    processing. The row of units and the row of names are those that belong together: the units are
    those of what the names say. Without a row of units the last row counts, but where one above it
    tells a time, and as much.

    Parameters
    ----------
    rows : one or more, each with a field per column, from the highest to the lowest
    """
    pairs = [
        (_fit(names, units), t == u - 1, t, u)
        for u, units in enumerate(rows)
        if len(rows) > 1
        and is_unit_row(_without_time(units, rows))
        and not _denies_time(units, rows)
        for t, names in enumerate(rows)
        if t != u
    ]
    last = len(rows) - 1
    told = [_score(row) for row in rows]
    if pairs:
        *_, names, units = max(pairs)
        # Titles that have their own units tell more than a row of ranges or modes above them.
        if told[names] + sum(row_unit(text) is not None for text in rows[units]) >= max(told):
            return names, units
    able = [k for k, row in enumerate(rows) if told[k] >= told[last] and any(map(_is_time, row))]
    return max(able, key=lambda k: told[k], default=last), None


def _without_time(units: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a row without the word "Time" where another one says so too, as loggers write it."""
    others = [row for row in rows if row is not units]
    return [
        "" if _is_time(text) and any(_is_time(row[k]) for row in others) else text
        for k, text in enumerate(units)
    ]


def _fit(names: Sequence[str], units: Sequence[str]) -> int:
    """Return in how many columns a unit is that of the quantity which the name says."""
    pairs = [(title(0, name), row_unit(text)) for name, text in zip(names, units, strict=True)]
    return sum(
        unit is not None
        and (by_unit := quantity_of_unit(unit.name)) is not None
        and (meant := meaning(one.name, unit.name)) is not None
        and meant.quantity == by_unit
        for one, unit in pairs
    )


def _score(names: Sequence[str]) -> int:
    """Return how much titles tell: a quantity counts, and so does a unit."""
    columns = [title(0, name) for name in names]
    known = [meaning(one.name, one.stated) for one in columns]
    return sum(one is not None for one in known) + sum(one.unit is not None for one in columns)


def _is_time(name: str) -> bool:
    found = title(0, name)
    meant = meaning(found.name, found.stated)
    return meant is not None and meant.quantity == "time"


def _denies_time(units: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Return whether a row gives what is called a time another unit: such as N, for "number"."""
    known = [row_unit(text) for text in units]
    return any(
        unit is not None and quantity_of_unit(unit.name) != "time" and _is_time(name)
        for row in rows
        if row is not units
        for name, unit in zip(row, known, strict=True)
    )


def row_unit(text: str) -> Unit | None:
    """Return the unit in a row of units, `[kN]` or `kN`; None if it is none."""
    match = _BARE.fullmatch(text.strip().strip('"'))
    return unit_or_none(match["unit"]) if match else None


def is_unit_row(fields: Sequence[str]) -> bool:
    """Return whether a row below the titles holds units: what is there is one, or in brackets.

    Test machines and loggers count in units of their own, too, such as `sec;segments;mm;kN`: most
    are known then, and the others name no quantity.
    """
    some = [field.strip().strip('"').strip() for field in fields]
    some = [field for field in some if field.lower() not in _NOTHING]
    other = [field for field in some if row_unit(field) is None]
    known = len(some) - len(other)
    other = [field for field in other if not _DEGREES.fullmatch(field)]
    if not known or all(_WHOLE.fullmatch(field) for field in other):
        return known > 0
    return known > len(other) and all(meaning(field, None) is None for field in other)


def unit_or_none(text: str) -> Unit | None:
    """Return a unit, or None where the text spells none."""
    if not text.strip():
        return None
    for spelled in (_renamed(text), text.strip().rstrip(".")):
        try:
            return parse_unit(spelled)
        except UnitError:
            continue
    return None


def _renamed(text: str) -> str:
    """Return a unit as bristle spells it where instruments spell it otherwise."""
    return _RENAMED.get(text.strip().rstrip(".").lower(), text)  # "in.", "lbs.", "sec."


# What instruments print and no standard knows, some in capitals.
_SPELLINGS = {
    "V": "volt, volts, в",
    "mV": "millivolt, millivolts",
    "A": "amp, amps, ampere, amperes, \u0430",
    "mA": "milliamp, milliamps",
    "%": "percent, per cent, pct",
    "T": "tesla",
    "N": "newton, newtons, н",
    "kN": "kilonewton, kilonewtons, kilo-newton, kn, кн",
    "kgf": "kp, kilopond, kg-f, kg f, kg_f",
    "lbf": "lbs, lb, lbf, lb-f, lb f, lb_f",
    "kip": "kip, kips, klbf, klbs, klb",
    "um": "micron, microns, micrometer, micrometre, micrometers, micrometres, µ, μ",
    "mm": "millimeter, millimetre, millimeters, millimetres, mm, мм",
    "cm": "centimeter, centimetre, centimeters, centimetres",
    "m": "meter, metre, meters, metres, м",
    "in": 'inch, inches, in, "',
    "mil": "mils, thou",
    "mm/s": "mm/sec, mm/s, mms-1, mms^-1",
    "m/s": "m/sec, m/s, ms-1, ms^-1",
    "in/s": "in/sec, in/s",
    "m/s2": "ms-2, ms^-2",
    "mm/s2": "mms-2, mms^-2",
    "g": "g's, g_n, gn",
    "Gal": "gal, gals",
    "h": "hour, hours, hr, hrs",
    "min": "min, minute, minutes, mins, minuten",
    "s": "sec, secs, second, seconds, sekunden, sek, seg, s, \u0441, сек",
    "ms": "msec, msecs, millisecond, milliseconds, millisekunden, ms, мс",
    "us": "microseconds, usec",
    "Hz": "hertz, hz",
    "kHz": "khz",
}
_RENAMED = {text: unit for unit, texts in _SPELLINGS.items() for text in texts.split(", ")}

"""Numbers as people write them, names that were misspelt."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from math import floor, isfinite, log10

_LONGEST = 9  # digits after the point beyond which a number is told as a power of ten
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

# By SI unit: from which size on which unit is shown, and what its values are multiplied by.
_SCALES: dict[str, tuple[tuple[float, float, str], ...]] = {
    "m": ((0.0, 1e3, "mm"), (10.0, 1.0, "m")),
    "m/s": ((0.0, 1e3, "mm/s"), (10.0, 1.0, "m/s")),
    "N": ((0.0, 1.0, "N"), (2e3, 1e-3, "kN"), (2e6, 1e-6, "MN")),
    "J": ((0.0, 1.0, "J"), (2e3, 1e-3, "kJ"), (2e6, 1e-6, "MJ")),
    "Pa": ((0.0, 1.0, "Pa"), (2e3, 1e-3, "kPa"), (2e6, 1e-6, "MPa")),
    "T": ((0.0, 1e3, "mT"), (0.1, 1.0, "T")),
}

# The same for a value that stands alone, and may be small.
_FINE: dict[str, tuple[tuple[float, float, str], ...]] = {
    "m": ((0.0, 1e9, "nm"), (1e-6, 1e6, "µm"), (1e-3, 1e3, "mm"), (10.0, 1.0, "m")),
    "m/s": ((0.0, 1e3, "mm/s"), (1.0, 1.0, "m/s")),
    "s": ((0.0, 1e6, "µs"), (1e-4, 1e3, "ms"), (1.0, 1.0, "s")),
    "kg": ((0.0, 1e3, "g"), (1.0, 1.0, "kg")),
    "V": ((0.0, 1e3, "mV"), (0.1, 1.0, "V")),
    "A": ((0.0, 1e3, "mA"), (0.1, 1.0, "A")),
    "T": ((0.0, 1e6, "µT"), (1e-3, 1e3, "mT"), (0.1, 1.0, "T")),
    "N/m": ((0.0, 1.0, "N/m"), (1e3, 1e-3, "kN/m"), (1e6, 1e-6, "MN/m")),
}


def plain(value: float, digits: int = 3) -> str:
    """Return a number with some significant digits and without a power of ten.

    220, not 2.2e+02. Digits before the point that are not significant are zeros. What would take
    more than nine digits after the point is a power of ten as it is printed: 2.5 × 10⁻¹².
    """
    if not isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    power = floor(log10(abs(value)))
    rounded = round(value, digits - 1 - power)
    places = digits - 1 - floor(log10(abs(rounded))) if rounded else 0
    if power < -_LONGEST or power > 15:
        return f"{value / 10.0**power:.{digits - 1}f}{times_ten(power)}"
    text = f"{rounded:.{max(places, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def times_ten(power: int) -> str:
    """Return a power of ten as a factor after a number: " × 10⁻¹²"."""
    return f" × 10{str(power).translate(_RAISED)}"  # noqa: RUF001


def tick(value: float) -> str:
    """Return a number at a mark of a logarithmic axis: 0.01, 1, 100, and 10⁻⁵ for 1e-05."""
    if isfinite(value) and value < 0.0:
        return f"-{tick(-value)}"
    if not value > 0.0 or 1e-4 <= value < 1e5:
        return plain(value)
    power = floor(log10(value) + 1e-9)  # 1e-05 is one decade, whatever the logarithm rounds to
    share = plain(value / 10.0**power, 2)
    raised = times_ten(power)
    return raised.rpartition(" ")[2] if share == "1" else f"{share}{raised}"


def log_ticks(low: float, high: float) -> Callable[[float], str]:
    """Return what writes the decades of a logarithmic axis: all plain numbers, or all powers.

    Parameters
    ----------
    low, high : float
        Ends of the axis, above zero.
    """
    if low >= 1e-4 and high < 1e5:
        return tick
    return lambda value: times_ten(round(log10(value))).rpartition(" ")[2] if value > 0.0 else ""


def typed(value: float) -> str:
    """Return a number as one would type it, 1000000; 10⁹ where zeros would have to be counted."""
    few_zeros = value == 0.0 or 1e-6 <= abs(value) < 1e7
    return plain(value, 6) if few_zeros else tick(value)


def scale(unit: str, size: float, fine: bool = False) -> tuple[float, str]:
    """Return the factor and the unit in which values in an SI unit are shown.

    Parameters
    ----------
    unit : str
        The unit that values are in.
    size : float
        How large they are on this rig, in that unit: one page has one unit.
    fine : bool
        Whether a value stands alone: then it has the unit that suits it, ms, µm or g.
    """
    found = (1.0, unit)
    known = _SCALES | _FINE if fine else _SCALES
    for least, factor, shown in known.get(unit, ()):
        if abs(size) >= least:
            found = factor, shown
    return found


def quantity(
    value: float, unit: str, digits: int = 3, size: float | None = None, fine: bool = False
) -> str:
    """Return a value with its unit: "220 N", "1.3 kN", "110 mm/s", "2.5 × 10⁶ N/m3".

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        An SI unit, or any other, which is then kept; "1" for none.
    digits : int
        Significant digits.
    size : float, optional
        How large such values are on this rig; else the value itself decides on the unit.
    fine : bool
        As in `scale`.
    """
    factor, shown = scale(unit, value if size is None else size, fine)
    value *= factor
    power = 3 * floor(log10(abs(value)) / 3.0) if 1e6 <= abs(value) < 1e15 else 0
    number = plain(value / 10.0**power, digits) + (times_ten(power) if power else "")
    return f"{number} {'' if shown == '1' else shown}".rstrip()


def percent(share: float, digits: int = 1) -> str:
    """Return a share as text: "8.6 %"."""
    return f"{round(100.0 * share, digits) + 0.0:.{digits}f} %"  # + 0.0: no minus before a zero


def short_z(z: float | None) -> str:
    """Return z as text, with the digits that tell it from 1; "not known" where it is no number."""
    if z is None or z != z:
        return "not known"
    return f"{z:.2f}" if z < 10.0 else plain(z)


def with_interval(value: float, std: float | None) -> tuple[str, str]:
    """Return a value with the digits that its interval leaves, and the interval: "± 12"."""
    if std is None or not isfinite(std) or std <= 0.0:
        return plain(value, 5), "-"
    half = 1.96 * std
    size = max(abs(value), half)
    power = 3 * floor(log10(size) / 3.0) if not 1e-3 <= size < 1e5 else 0
    scaled, width = value / 10.0**power, half / 10.0**power
    digits = 1 - floor(log10(width))
    places = max(digits, 0)
    tail = times_ten(power) if power else ""
    texts = (f"{round(one, digits):.{places}f}".replace("-", "\u2212") for one in (scaled, width))
    shown_value, shown_width = texts
    power_of_zero = "" if not round(scaled, digits) else tail  # no "0 × 10³"
    return f"{shown_value}{power_of_zero}", f"± {shown_width}{tail}"


LIST_AT_MOST = 12
"""Longer lists of names are cut down to the nearest few."""
LINES, CHARACTERS = 10, 1000
"""Size of a message at most."""
LIST_LONGEST = 300
"""Characters of a list of names at most."""


def nearest(name: str, names: Iterable[str], count: int = 1) -> list[str]:
    """Return the names most like `name`, upper and lower case alike, best first."""
    folded: dict[str, str] = {}
    for candidate in names:
        folded.setdefault(candidate.casefold(), candidate)
    matches = get_close_matches(name.casefold(), folded, n=count, cutoff=0.6)
    return [folded[match] for match in matches]


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return a sentence with the name most like one that is not there, "" where none is."""
    close = nearest(name, names)
    return f' Did you mean "{close[0]}"?' if close else ""


def plural(count: int, what: str) -> str:
    """Return how many there are of something: "1 run", "12 runs"."""
    return f"{count} {what}{'s' * (count != 1)}"


def joined(names: Sequence[str]) -> str:
    """Return names as a list in words: "a, b and c"."""
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def listed(names: Iterable[str], most: int = LIST_AT_MOST) -> str:
    """Return names parted by commas, the first ones and a count of the rest where they are many.

    Parameters
    ----------
    names : iterable of str
        Names, in quotes where they need them.
    most : int
        How many are named at most.
    """
    names = list(names)
    shown = names[:most]
    # Titles may be as long as a line each.
    while len(shown) > 1 and len(", ".join(shown)) > LIST_LONGEST:
        shown = shown[:-1]
    rest = len(names) - len(shown)
    return ", ".join(shown) + (f" and {rest} more" if rest else "")


def cut_short(text: str, beside: Sequence[str] = (), way: str = "") -> str:
    """Return a message of `LINES` lines and `CHARACTERS` at most, with a count of what is left out.

    The last guard: who lists what a file holds uses `listed`.

    Parameters
    ----------
    text : the message
    beside : lines that are printed with it, and count as well
    way : how to see all, such as "--json"
    """
    end = f"; all:  {way}" if way else "."
    lines = text.split("\n")
    most = LINES - len(beside)
    kept = lines if len(lines) <= most else lines[: most - 1]
    size = CHARACTERS - sum(len(one) + 1 for one in beside)
    room = size - 60  # what is said of the rest takes the others
    if len("\n".join(kept)) > (size if kept is lines else room):
        while len(kept) > 1 and len("\n".join(kept)) > room:
            kept = kept[:-1]
        if len(kept[0]) > room:
            rest = len(text) - room
            return f"{kept[0][:room]} ... and {rest:,} more characters{end}"
    rest = len(lines) - len(kept)
    told = [f"  ... and {rest:,} more line{'s' * (rest > 1)}{end}"] if rest else []
    return "\n".join([*kept, *told])


_MOST_SAID = 270  # characters of what an FMU said: a report says them twice


def in_one_line(text: str) -> str:
    """Return a text of others in one line, cut to a length that a row holds."""
    text = " ".join(text.split())
    rest = len(text) - _MOST_SAID
    return f"{text[:_MOST_SAID]} ... and {rest:,} more characters" if rest > 0 else text


def unknown(what: str, name: str, names: Iterable[str], more: str = "") -> str:
    """Return the words for a name that is not there, with what would be right.

    Parameters
    ----------
    what, name : str
        Kind of thing and the name that was written.
    names : iterable of str
        All names that there are.
    more : str
        Where to read them all, for lists too long to print.
    """
    names = list(names)
    words = f'there is no {what} "{name}".' + did_you_mean(name, names)
    if not names:
        words += " There are none."
    elif len(names) <= LIST_AT_MOST:
        words += f" There are: {', '.join(names)}."
    else:
        others = dict.fromkeys((*nearest(name, names, 3), *names))
        some = [one for one in others if one not in nearest(name, names)][:3]
        words += f" There are {len(names)}, among them {', '.join(some)}."
        if more:
            words += f" All: {more}"
    return words


def written(value: object) -> str:
    """Return the words for a value as somebody wrote it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'the text "{value if len(value) <= 60 else value[:57] + "..."}"'
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a whole number beyond all bounds"
    return str(value)


def literal(text: str) -> str:
    """Return a text as a Python literal in double quotes, whatever quotes it holds."""
    return json.dumps(text, ensure_ascii=False)  # Python has all of its escapes


def in_docstring(text: str) -> str:
    """Return a text as it stands between triple quotes, where Python reads that text."""
    return text.replace("\\", "\\\\").replace('"""', r"\"\"\"")


def number(value: object) -> float | str:
    """Return a finite number as float, or the words for why the value is none."""
    if isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return f"is {written(value)}, not a number"
        return f"is {written(value)}, and a number needs no quotes"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"is {written(value)}, not a number"
    try:
        result = float(value)
    except OverflowError:
        return f"is {written(value)}"
    return result if isfinite(result) else f"is {result}, not a finite number"


def capital(note: str, files: Iterable[str]) -> str:
    """Return a note as a sentence begins; the name of a file that it begins with stays as it is.

    Parameters
    ----------
    note : the words
    files : names or paths of the files, with / between folders
    """
    if note.startswith(tuple(file.rpartition("/")[2] for file in files)):
        return note
    return note[:1].upper() + note[1:]


def install(extra: str) -> str:
    """Return the command that installs what an extra of bristle needs."""
    return f"pip install 'bristle[{extra}]'"


def command(*words: object) -> str:
    """Return a `bristle` command as a shell reads it: what holds a space is quoted.

    Parameters
    ----------
    *words : what follows `bristle`: texts and paths
    """
    texts = ["bristle", *(str(word) for word in words)]
    if sys.platform != "win32":
        return shlex.join(texts)
    from subprocess import list2cmdline

    return list2cmdline(texts)


def shown(of: object, about: str, lines: Iterable[str] = ()) -> str:
    """Return the text of `repr`: the class with what it is about, and a line each below.

    Parameters
    ----------
    of : object
        The result.
    about : str
        Behind the name of its class; "" for nothing.
    lines : iterable of str
        What it says.

    Examples
    --------
    >>> shown(1.5, "a number", ["It is small."])
    '<float: a number>\\n  It is small.'
    """
    head = type(of).__name__ + (f": {about}" if about else "")
    return "\n".join([f"<{head}>", *(f"  {line}" for line in lines)])

"""What the names of files tell of their runs: numbers with units, and how decimals are written."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, log10
from pathlib import Path
from statistics import median
from typing import NamedTuple

from ..units import convert, same_dimension
from .channels import DRIVE, PLAIN, TEMPERATURE, UNITS, label_text
from .tone import Tone, amplitude_fits, amplitude_off, frequency_fits, frequency_off

# What the names of files tell of their runs: numbers with units, and how decimals are written.
#
# `0p5A`, `0,5A` and `0.5A` are half an ampere. In `0_5A`, `0-5A`, `0x5A` or `0d5A` the mark may be
# a decimal mark, or part a number from another one; `050V` may stand for 0.50 V. All names of a
# campaign settle that together: the frequency and the amplitude that they tell are held against the
# measured motion, and numbers before the mark that count the runs are no part of a level. What
# stays open is not taken.

_HARDLY = "kKvVcCoO"
DOUBTFUL = f"_- xXdD'~=;#^:+\u2013\u2014\u00f7!$&@\u00a7`\u00b4\u2019\ufffd{_HARDLY}"
"""What may part two numbers, or be a decimal mark."""

SPELLED = {
    "pct": "%", "percent": "%", "C": "degC", "inch": "in", "PSI": "psi", "Nm": "N.m", "hz": "Hz",
    "HZ": "Hz", "MM": "mm",
    "volt": "V", "Volt": "V",
    **dict.fromkeys(("amp", "Amp", "AMP", "AMPS", "ampere", "Ampere"), "A"),
}  # fmt: skip
"""Units as names spell them."""

_LETTERS = DOUBTFUL[3 : -len(_HARDLY)]  # of these, which hardly part numbers
_POINTS = ".,\u00b7\u2219\u22c5\u2027\u066b\uff0e"  # and raised points: 0·5A
# "1p5", where a point would end a name
_SURE = rf"(?:[{_POINTS}]|[pP][tT]?|point|dot|[kK]omma|comma|[pP]unkt)"
_NO_DECIMALS = rf"(?<![\d.])(?<!\d[{_POINTS}])"  # of 0,5_1Hz, "5_1" is no number
_OF_LABELS = {"pressure": "psi|PSI|mbar|bar|hPa|kPa|MPa|Pa", "load": "kN|lbf", "torque": "Nm"}
"""Units that tell a label by themselves, which is then called by both: pressure_psi."""
_UNITS_IN_NAMES = "|".join(
    [
        "mA|[aA]mperes?|[aA]mps?|AMPS?|A|mV|[vV]olts?|V|mT|pct|percent|%|Hz|hz|HZ|mm|MM|cm|um|inch|in",
        "degC|degF|C",
        *_OF_LABELS.values(),
    ]
)
SIGN = r"(?:(?<![^_= ])-|(?<![A-Za-z])(?:minus|neg)[ _-]?)?"
"""T=-10C, cold_-10C and minus10C have one; in run-10C the minus parts words."""
_DOUBLED = "--"  # the mark of a minus behind one that parts words: run--10C beside run-10C
_APART = r"(?:[ ]?|[_-](?=psi|PSI|bar|kPa|MPa))"  # 50_psi; but 3_A parts words
_SPEED = r"(?<=m)[_-](?:s|sec|min)(?![A-Za-z0-9])"  # 100mm_s is one, and 10mm_s1 is none
_AFTER_UNIT = re.compile(
    rf"(?<![\d.])({SIGN}\d+)({_UNITS_IN_NAMES})(\d+)(?![A-Za-z0-9.,%])"
)  # 0A5, as resistors are marked
_NO_POWER = r"(?<!\d[eE])(?<!\d[eE][-+])"  # 5E-1A is half an ampere, and not 1 A: it is not read
_SMALL = ("mA", "mV", "mT")  # their numbers are whole
_UNIT = "unit"  # the mark of these
_DIGITS = {"0", "5", "00", "25", "50", "75"}  # decimals that hardly count repeated runs


class Token(NamedTuple):
    """A number with a unit in a name.

    `value` is in the unit of its quantity, `text` as it stands there, `number` without the unit,
    `pattern` that of --level.
    """

    value: float
    text: str
    number: str
    pattern: str


@dataclass(frozen=True)
class Reading:
    """How the numbers in the names of a campaign are written.

    `marks` are decimal marks besides those that are always; `digits` tells by quantity how many
    decimals a number without a mark has; `open` what to say of the quantities that nothing settles;
    `why` what was settled, in sentences.
    """

    marks: tuple[str, ...] = ()
    digits: Mapping[str, int] = field(default_factory=dict)
    open: Mapping[str, str] = field(default_factory=dict)
    doubts: Mapping[str, str] = field(default_factory=dict)
    why: tuple[str, ...] = ()


def number_in(marks: Sequence[str] = ()) -> str:
    """Return the regular expression of a number in a name, with marks besides those of all."""
    more = re.escape("".join(mark for mark in marks if len(mark) == 1))
    return rf"\d+(?:(?:{_SURE}{f'|[{more}]{{1,2}}' if more else ''})\d+)?"


def value_of(text: str) -> float:
    """Return the number that a text in a name spells, whatever its decimal mark."""
    minus = text.startswith(("-", "minus", "neg"))
    whole, *rest = re.findall(r"\d+", text)
    value = float(f"{whole}.{rest[0]}" if rest else whole)
    return -value if minus else value


def tokens_of(file: Path, reading: Reading | None = None) -> dict[str, Token]:
    """Return what a name tells by quantity. What is told twice tells nothing."""
    reading = reading or Reading()
    out: dict[str, Token] = {}
    twice = set()
    number = number_in(reading.marks)
    sign = f"(?:(?<=-)-|{SIGN})" if _DOUBLED in reading.marks else SIGN
    wanted = re.compile(
        rf"{_NO_DECIMALS}{_NO_POWER}({sign}{number}){_APART}({_UNITS_IN_NAMES})(?![A-Za-z]|{_SPEED})"
    )
    stem = file.stem
    found = [(match.start(), match[1], match[2], match[0]) for match in wanted.finditer(stem)]
    if _UNIT in reading.marks:
        after = {
            match.start(): (match.start(), f"{match[1]}.{match[3]}", match[2], match[0])
            for match in _AFTER_UNIT.finditer(stem)
        }
        found = [after.get(one[0], one) for one in found]
    for start, text, spelled, whole in found:
        unit = SPELLED.get(spelled) or SPELLED.get(spelled.removesuffix("s"), spelled)
        name = quantity_of(unit)
        value = value_of(text)
        if (digits := reading.digits.get(name, 0)) and not spelled.startswith(_SMALL):
            value /= 10.0**digits
        letter = re.search(r"[A-Za-z]*$", stem[:start])
        before = letter.group() if letter else ""
        value = convert(value, unit, PLAIN.get(name) or UNITS.get(name, unit))
        if name in out and out[name].value != value:
            twice.add(name)
        out[name] = Token(value, before + whole, text, f"{before}{{}}{spelled}")
    return {name: one for name, one in out.items() if name not in twice}


def quantity_of(unit: str) -> str:
    """Return the command or the label that a unit in a name tells, "" where it tells neither."""
    for name in (*DRIVE, *UNITS):
        if same_dimension(unit, PLAIN.get(name) or UNITS[name]):
            return name
    for name, units in _OF_LABELS.items():
        if unit in (SPELLED.get(one, one) for one in units.split("|")):
            return f"{name}_{unit}"
    return ""


def reading_of(files: Sequence[Path], tones: Sequence[Tone | None]) -> Reading:
    """Return how the numbers in the names of a campaign are written.

    Parameters
    ----------
    files : (n,) of the campaign
    tones : (n,) what the motion of each is, None where it is unknown or has no single frequency
    """
    plain = [tokens_of(file) for file in files]
    marks, why, open_ = [], [], {}
    for mark in (*DOUBTFUL, _UNIT, _DOUBLED):
        with_mark = [tokens_of(file, Reading((mark,))) for file in files]
        differ = sorted(
            {n for a, b in zip(plain, with_mark, strict=True) for n in {*a, *b}
             if _values(a, n) != _values(b, n)}
        )  # fmt: skip
        if not differ:
            continue
        seen = _by_motion(plain, with_mark, tones)
        said = {
            name: _doubled_is_minus(name, files)
            if mark == _DOUBLED
            else _by_names(mark, name, plain, with_mark)
            for name in differ
        }
        if seen > 0 or (seen == 0 and all(one > 0 for one in said.values())):
            marks.append(mark)
            what = f'"{mark}"' if mark != _UNIT else "a unit between digits"
            by = "the measured motion" if seen > 0 else "all names together"
            of = "has a minus" if mark == _DOUBLED else "is a decimal mark"
            why.append(f"{what} in the names {of}, by {by}")
            continue
        for name in differ:
            if said[name] > 0 or (seen == 0 and said[name] == 0):
                open_[name] = _open_text(name, plain, with_mark)
    open_ |= (
        _ranges(files, plain)
        | _below_zero(files, plain)
        | _with_and_without([tokens_of(file, Reading(tuple(marks))) for file in files])
    )
    digits, by_digits, doubts = _digits(plain, tones) if not marks else ({}, [], {})
    return Reading(tuple(marks), digits, open_, doubts, (*why, *by_digits))


def _values(tokens: Mapping[str, Token], name: str) -> float | None:
    return tokens[name].value if name in tokens else None


def _by_motion(
    plain: Sequence[Mapping[str, Token]],
    with_mark: Sequence[Mapping[str, Token]],
    tones: Sequence[Tone | None],
) -> int:
    """Return 1 where the motion says that a mark is a decimal mark, -1 that it is none, else 0."""
    for name, off, fits in (
        ("frequency", frequency_off, frequency_fits),
        ("amplitude", amplitude_off, amplitude_fits),
    ):
        votes = []
        for a, b, tone in zip(plain, with_mark, tones, strict=True):
            if tone is None or _values(a, name) == _values(b, name):
                continue
            one, other = (off(each[name].value, tone) if name in each else inf for each in (a, b))
            nearest = (a if one < other else b).get(name)
            votes.append(
                0 if nearest is None or not fits(nearest.value, tone) else 1 if other < one else -1
            )
        if votes and abs(sum(votes)) >= 0.8 * len(votes):
            return 1 if sum(votes) > 0 else -1
    return 0


def _by_names(
    mark: str,
    name: str,
    plain: Sequence[Mapping[str, Token]],
    with_mark: Sequence[Mapping[str, Token]],
) -> int:
    """Return 1 where the names say that a mark is a decimal mark, -1 that it is none, else 0."""
    told = [
        b[name]
        for a, b in zip(plain, with_mark, strict=True)
        if name in b and _values(a, name) != _values(b, name)
    ]
    used = [re.findall(r"\d+", one.number) for one in told]
    if any(len(one) != 2 for one in used) or not used:
        return 0
    heads, tails = [one[0] for one in used], [one[1] for one in used]
    if mark in _HARDLY:  # a unit, as in 20C2A, unless the motion says otherwise
        return 0 if "0" in heads else -1
    if mark == _UNIT:
        of_head = [sorted({int(t) for h, t in used if h == head}) for head in {*heads}]
        if all(one == list(range(1, len(one) + 1)) for one in of_head):
            return -1  # they count repeated runs: 2A1, 2A2
        return 1 if {*tails} <= _DIGITS and {*tails} != {"0"} and "0" in heads else 0
    if any(len(head) > 1 and head[0] == "0" for head in heads):  # of a date, or a counter
        return -1
    words = {one.text.partition(one.number)[0] for one in told}
    words = {word for word in words if word and not re.fullmatch(_UNITS_IN_NAMES, word)}
    if words and not {*tails} <= _DIGITS:  # oil100_10C: the number of the letters before it
        return -1
    if words and all(name.startswith(word.lower()) or word == "I" for word in words):
        return 1  # I0_5A, temp20_5C
    if len({len(tail) for tail in tails}) > 1 and any(
        len(tail) > 1 and tail.endswith("0") for tail in tails
    ):  # no decimals: 1_5A and 1_10A
        return -1
    counting = len({*heads}) == len(heads) > 2
    some = len(used) < sum(name in one for one in with_mark)  # others have no mark: 1A
    if "0" in heads:
        sure = some or len({*heads}) < len(heads) or mark in _LETTERS
        return 1 if sure and not (counting and mark not in _LETTERS and not some) else 0
    if mark in _LETTERS:
        return 1 if len({*tails}) > 1 and not counting else 0
    parted = any(len(re.findall(r"\d+", a[name].number)) > 1 for a in plain if name in a)
    if some and parted:  # others have a decimal mark that is sure: 1_0A beside 0p5A
        return 0
    return -1 if counting or len({*heads}) == 1 else 0


def _doubled_is_minus(name: str, files: Sequence[Path]) -> int:
    """Return 1 where a minus in "--" is the number's, -1 where the two part words, else 0."""
    stems = [file.stem for file in files]
    if any(stem.count(_DOUBLED) > 1 for stem in stems):
        return -1
    if any(re.search(r"(?<![-_= ])-(?!-)", stem.lstrip("-")) for stem in stems):
        return 1  # one alone parts words: run--10C beside run-10C
    return 0 if name == TEMPERATURE else -1


def _open_text(
    name: str, plain: Sequence[Mapping[str, Token]], with_mark: Sequence[Mapping[str, Token]]
) -> str:
    """Return what is said of a quantity whose numbers may be read in two ways."""
    k = next(k for k, (a, b) in enumerate(zip(plain, with_mark, strict=True))
             if _values(a, name) != _values(b, name))  # fmt: skip
    told = with_mark[k].get(name) or plain[k][name]
    one, other = (_text(tokens[k], name) for tokens in (plain, with_mark))
    return (
        f'"{told.text}" and the like in the names may be {one} or {other}, and nothing settles '
        f"it: no {name} is taken. --runs FILE, a table with a row per file, says it"
    )


def _ranges(files: Sequence[Path], plain: Sequence[Mapping[str, Token]]) -> dict[str, str]:
    """Return what is said of quantities of which a name tells two: those of 0.5-1.5A."""
    out = {}
    for file, tokens in zip(files, plain, strict=True):
        for name, one in tokens.items():
            number = (
                rf"\d+{_SURE}\d+ ?(?:[-\u2013\u2014]|\.\.|_?to_?|_?bis_?) ?{re.escape(one.text)}"
            )
            if found := re.search(number, file.stem):
                out[name] = (
                    f'"{found[0]}" in the names is a range: no {name} is taken. '
                    "--runs FILE, a table with a row per file, says it"
                )
    return out


def _below_zero(files: Sequence[Path], plain: Sequence[Mapping[str, Token]]) -> dict[str, str]:
    """Return what is said of temperatures such as m10C, whose letter may stand for a minus."""
    for file, tokens in zip(files, plain, strict=True):
        one = tokens.get(TEMPERATURE)
        if one and re.search(rf"(?<![A-Za-z])[mMnN]{re.escape(one.number)}", file.stem):
            return {
                TEMPERATURE: f'"{one.text}" in the names may lie below zero: no temperature is '
                "taken. --runs FILE, a table with a row per file, says it"
            }
    return {}


def _with_and_without(tokens: Sequence[Mapping[str, Token]]) -> dict[str, str]:
    """Return what is said of a command whose levels are 050 in some names and 0.50 in others."""
    out = {}
    for name in DRIVE:
        numbers = [one[name].number.lstrip("-") for one in tokens if name in one]
        marked = next((one for one in numbers if not one.isdigit()), "")
        bare = next((one for one in numbers if re.fullmatch(r"0+[1-9]\d*", one)), "")
        if marked and bare:
            out[name] = (
                f'"{bare}" stands beside "{marked}" in the names, and may lack its decimal mark: '
                f"no {name} is taken. --runs FILE, a table with a row per file, says it"
            )
    return out


def _text(tokens: Mapping[str, Token], name: str) -> str:
    if name not in tokens:
        return "none"
    return label_text(name, tokens[name].value, PLAIN[name] if name in DRIVE else "")


def _digits(
    plain: Sequence[Mapping[str, Token]], tones: Sequence[Tone | None]
) -> tuple[dict[str, int], list[str], dict[str, str]]:
    """Return by quantity how many decimals numbers without a mark have, why, and what is doubted.

    Numbers of one length that begin with zeros may leave out their decimal mark: 050 for 0.50.
    """
    shared = [name for name in plain[0] if all(name in one for one in plain)] if plain else []
    texts = {name: [one[name].number.lstrip("-") for one in plain] for name in shared}
    wide = {
        name: len(own[0])
        for name, own in texts.items()
        if len({len(text) for text in own}) == 1 and all(text.isdigit() for text in own)
        and len(own[0]) > 1 and any(text[0] == "0" for text in own)
        and any(int(text) for text in own)
    }  # fmt: skip
    powers = {}
    for name in {"frequency", "amplitude"} & {*wide}:
        stated = [(one[name].value, tone) for one, tone in zip(plain, tones, strict=True) if tone]
        if (power := _power([one for one in stated if one[0] > 0.0], name)) is not None:
            powers[name] = power
    alike = {size: {p for n, p in powers.items() if wide[n] == size} for size in wide.values()}
    known = {
        name: powers[name] if name in powers else next(iter(alike[size]))
        for name, size in wide.items()
        if name in powers or len(alike[size]) == 1
    }
    digits = {name: power for name, power in known.items() if power > 0}
    why = []
    if digits:
        name = next(iter(digits))
        why.append(
            f'"{texts[name][0]}" and the like in the names have {digits[name]} '
            f"decimal{'s' * (digits[name] > 1)}, by the measured motion"
        )
    doubts = {}
    for name in wide:
        if name in known:
            continue
        text = next(text for text in texts[name] if int(text))
        doubts[name] = f'"{text}" may stand for {text[0]}.{text[1:]}; --runs FILE says it then'
    return digits, why, doubts


def _power(stated: Sequence[tuple[float, Tone]], name: str) -> int | None:
    """Return by which power of ten what names tell is larger than the motion; None if by none."""
    fits = frequency_fits if name == "frequency" else amplitude_fits
    measured = [tone.frequency if name == "frequency" else tone.amplitude for _, tone in stated]
    if not stated:
        return None
    pairs = zip(stated, measured, strict=True)
    power = round(median(log10(value / size) for (value, _), size in pairs))
    right = all(fits(value / 10.0**power, tone) for value, tone in stated)
    return power if power >= 0 and right else None

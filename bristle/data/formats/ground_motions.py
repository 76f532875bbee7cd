"""Ground motions as archives hand them over: title lines, then accelerations evenly spaced in time.

Read are PEER AT2 in both of its ages (`NPTS=   5372, DT=   .0100 SEC` and `4000    0.0100    NPTS,
DT`), ESM and ITACA (DYNA), K-NET and KiK-net, COSMOS V1 and V2, and USGS SMC. What an archive
states twice must agree: a count with the values, a duration with step and count.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ...core.text import plain
from ...errors import PhysicsError, RecordError
from ...physics.motion_file import number, shortened
from ...units import parse as parse_unit
from ..table import Table, from_arrays
from ..titles import unit_or_none
from .delimited import decoded, lines_of

_TITLE_LINES = 10  # of AT2 at most; four in the files of the database
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
_UNITS = re.compile(r"(?:UNITS?\s*(?:OF|[:=])|\bACC\w*\s+IN\b)\s*([^,;]*)", re.IGNORECASE)
_TIMES = re.compile(r"\W*x?\W*\d", re.IGNORECASE)
_SCALED = re.compile(r"\b(?:SCAL|FACTOR|MULTIPL)[A-Z ]*\W{0,3}[0-9.]+", re.IGNORECASE)
"""What may have been done to the values, and nothing tells whether it was."""
_PAIR = re.compile(r"\s*([A-Z][A-Z0-9_/^]*):\s*(.*?)\s*")
_COSMOS_DATA = re.compile(
    r"\s*(?P<count>\d+)\s+(?P<what>[a-z]+)\w*\s+(?:data\s+)?pts?\b.*?approx\.?\s+(?P<long>[\d.]+)\s*"
    r"sec.*?units\s*=\s*(?P<unit>[^,(]+)",
    re.IGNORECASE,
)
_COSMOS_STEPS = 61, 33
"""Where the real header has the interval [ms]: that of the series, and that of the recorder."""
_KNET_SCALE = re.compile(r"([\d.]+)\s*\(gal\)\s*/\s*([\d.]+)")
_SMC_FIRST = re.compile(r"\s*[1-9*]\s+(?P<what>(?:UN)?CORRECTED ACCELEROGRAM|[A-Z ]+)\s*")


class _Record(NamedTuple):
    """What title lines tell: how many values, their step [s], how many m/s2 one is.

    The values stand in the lines from `first` to before `end`, counted from 0; line `said` gives
    their count. `peak` is the largest one [m/s2] of counts whose zero is their mean, else 0.
    """

    points: int
    step: float
    factor: float
    first: int
    said: int
    end: int | None = None
    peak: float = 0.0
    why: str = "The file is cut or has been edited; fetch it again."
    remarks: tuple[str, ...] = ()


def recognises(content: bytes, suffix: str) -> bool:
    """Return whether a file is a ground motion of an archive, whatever it is called."""
    return suffix == ".at2" or _archive(content) is not None


def read(content: bytes, name: str) -> Table:
    """Return times [s] from 0 and accelerations [m/s2] of a ground motion of an archive.

    Raises
    ------
    RecordError
        If the title lines give no count, step or unit, the unit is not that of an acceleration, a
        value is no finite number, or their count is another one: with the line.
    """
    text, _ = decoded(content, name)
    lines = lines_of(text)
    if not any(line.strip() for line in lines):
        raise RecordError(f"{name}: the file is empty. AT2 has four title lines, then values.")
    try:
        found = (_archive(content) or _at2)(lines, name)
        values = np.array(_numbers(lines, found.first, found.end, name, found.factor))
    except PhysicsError as error:
        raise RecordError(str(error)) from None
    where = f"{name}, line {found.said}"
    if not (found.points >= 1 and _SHORTEST <= found.step <= _LONGEST):
        raise RecordError(
            f"{where}: {found.points} values, {found.step:g} s apart; a step from {_SHORTEST:g} to "
            f"{_LONGEST:g} s is right."
        )
    if len(values) != found.points:
        why = found.why
        if len(values) == 2 * found.points:
            why = "Accelerations alone are right: remove the column of times."
        raise RecordError(
            f"{where}: {found.points} values are announced, and {len(values)} follow. {why}"
        )
    if len(values) < 2:
        raise RecordError(f"{name}: {len(values)} sample. A record has two at least.")
    remarks = found.remarks
    if found.peak:
        zero = float(values.mean())
        values -= zero
        remarks += (
            f"{plain(zero, 4)} m/s2, the mean of its counts, is taken off: its largest is then "
            f"{plain(float(np.abs(values).max()), 4)} m/s2, and {plain(found.peak, 4)} m/s2 is "
            "stated",
        )
    # Rounded, so that 7 steps of 0.01 s are at 0.07 s, as in any table of the record.
    time = np.array([round(k * found.step, 9) for k in range(found.points)])
    return from_arrays(
        {"time [s]": time, "acceleration [m/s2]": values}, name, remarks=remarks
    )  # fmt: skip


def _archive(content: bytes) -> Callable[[Sequence[str], str], _Record] | None:
    """Return what reads the title lines of a file, None where they are of no archive."""
    lines = lines_of(content[:16384].decode("latin-1").removeprefix("\u00ef\u00bb\u00bf"))
    if any(
        _BOTH_BEFORE.search(line) or (_COUNT.search(line) and _STEP.search(line))
        for line in lines[:_TITLE_LINES]
        if not line.startswith("#")
    ):
        return _at2
    if any(line.lstrip().startswith("SAMPLING_INTERVAL_S:") for line in lines):
        return _esm
    if lines[0].startswith("Origin Time") and any(line.startswith("Scale Fac") for line in lines):
        return _knet
    if any("Real-header value" in line for line in lines):
        return _cosmos
    if _SMC_FIRST.fullmatch(lines[0]) and len(lines) > 27 and lines[10].strip() == "*":
        return _smc
    return None


def _fields(row: str) -> Iterator[str]:
    """Yield the numbers of a row; a minus sign may be all that parts two of them."""
    for field in row.split():
        plain_field = field.upper().replace("D", "E")
        parts = _SIGN_INSIDE.split(plain_field)
        # Of 1.5-101 no one can say whether it is two numbers, or one without its E.
        whole = plain_field if plain_field[-1].isdigit() else field.upper()  # END is no ENE
        yield from parts if all(map(_VALUE.fullmatch, parts)) else (whole,)


def _numbers(
    lines: Sequence[str], begin: int, end: int | None, name: str, factor: float = 1.0
) -> list[float]:
    """Return the numbers in some lines, counted from 0, times a factor."""
    return [
        number(field, name, line, factor)
        for line, row in enumerate(lines[begin:end], begin + 1)
        for field in _fields(row)
    ]


def _told(
    found: Mapping[str, tuple[str, int]], key: str, name: str, archive: str
) -> tuple[str, int]:
    """Return what title lines say for a key, and in which line."""
    match = next((one for title, one in found.items() if title.startswith(key)), ("", 0))
    if not match[1] or not (match[0].strip() or key == "memo"):
        raise PhysicsError(f'{name}: no "{key}" in the title lines, which {archive} has.')
    return match


def _factor(text: str, where: str) -> float:
    """Return how many m/s2 one in a unit is, spelled as it should be, or in capitals.

    Words may stand behind it, but no factor, as in G (X 1000).
    """
    first, _, rest = text.strip().partition(" ")
    spelled = text.strip("()[]. ").replace(" PER ", "/")
    texts = [spelled] if _TIMES.match(rest) else [spelled, first.strip("()[]. ")]
    found = (unit_or_none(how(one)) for one in texts for how in (str, str.lower, str.capitalize))
    if (unit := next(filter(None, found), None)) is None:
        raise PhysicsError(f'{where}: the unit "{texts[-1]}" is not known. G or CM/S2 is right.')
    if unit.dimension != parse_unit("m/s2").dimension:
        raise PhysicsError(
            f"{where}: the values are in {spelled}, which is no acceleration. "
            "Take the file of the accelerations, at PEER AT2 and not VT2 or DT2."
        )
    return unit.factor


def _not_accelerations(what: str, where: str) -> PhysicsError:
    return PhysicsError(
        f"{where}: the values are a {what}. "
        "Take the file of the accelerations, at PEER AT2 and not VT2 or DT2."
    )


def _at2(lines: Sequence[str], name: str) -> _Record:
    last = next((k for k, line in enumerate(lines[:_TITLE_LINES]) if "NPTS" in line.upper()), None)
    if last is None:
        raise PhysicsError(
            f"{name}, line {min(4, len(lines))}: no NPTS and DT in the title lines. "
            'AT2 says there, for example, "NPTS=   5372, DT=   .0100 SEC".'
        )
    where = f"{name}, line {last + 1}"
    before = _BOTH_BEFORE.search(lines[last])
    if before:
        whole, fraction, spelled = before.groups()
    else:
        count, step = _COUNT.search(lines[last]), _STEP.search(lines[last])
        if count is None or step is None:
            raise PhysicsError(
                f'{where}: "{shortened(lines[last].strip())}" does not give both NPTS and DT, '
                'as in "NPTS=   5372, DT=   .0100 SEC".'
            )
        whole, (fraction, spelled) = count[1], step.groups()
    points = number(re.sub("[,' ]", "", whole.upper()).replace("D", "E"), name, last + 1)
    spacing = number(fraction.upper().replace("D", "E"), name, last + 1)
    second = unit_or_none((spelled or "s").rstrip("."))
    if second is None or second.factor > 1.0 or second.dimension != parse_unit("s").dimension:
        raise PhysicsError(
            f'{where}: DT is in "{spelled}", which is no unit of time that is known. '
            "SEC or MSEC is right."
        )
    spacing *= second.factor
    if not spelled and _PLAIN < spacing <= _LONGEST:
        raise PhysicsError(
            f"{where}: DT = {spacing:g} has no unit, and is long for one in s. "
            "Write SEC or MSEC behind it."
        )
    if points != int(points):
        raise PhysicsError(f"{where}: NPTS = {whole}; a whole number is right.")
    for line, title in enumerate(lines[: last + 1], 1):
        if (found := _SCALED.search(title)) is not None:
            raise PhysicsError(
                f'{name}, line {line}: "{shortened(found[0])}", and nothing tells whether the '
                "values were multiplied by it. Write the unit that they are in, such as UNITS OF "
                "G, and no factor."
            )
    for line, title in enumerate(lines[: last + 1], 1):
        if found := _UNITS.search(title):
            here = f"{name}, line {line}"
            factor = _factor(found[1], here)
            other = re.search("VELOCITY|DISPLACEMENT", title.upper())
            if other and "ACC" not in title.upper():
                raise _not_accelerations(f"{other[0].lower()} in {found[1].strip()}", here)
            return _Record(int(points), spacing, factor, last + 1, last + 1)
    raise PhysicsError(
        f"{name}, lines 1 to {last + 1}: the title lines name no unit. AT2 says, for example, "
        '"ACCELERATION TIME SERIES IN UNITS OF G".'
    )


def _esm(lines: Sequence[str], name: str) -> _Record:
    """Of ESM and ITACA: 64 lines `KEY: value`, then a value a line."""
    found: dict[str, tuple[str, int]] = {}
    for line, text in enumerate(lines, 1):
        if not (pair := _PAIR.fullmatch(text)):
            break
        found.setdefault(pair[1], (pair[2], line))

    of = partial(_told, found, name=name, archive="ESM")
    kind = found.get("DATA_TYPE", ("ACCELERATION", 0))
    if not kind[0].upper().startswith("ACC"):
        raise _not_accelerations(kind[0].lower(), f"{name}, line {kind[1]}")
    (count, said), (step, at) = of("NDATA"), of("SAMPLING_INTERVAL_S")
    unit, line = of("UNITS")
    points, spacing = int(number(count, name, said)), number(step, name, at)
    text, place = found.get("DURATION_S", ("", 0))
    lasts = number(text, name, place) if text else points * spacing
    whole = sum(bool(line.strip()) for line in lines[len(found) :]) == points
    if whole and abs(lasts - points * spacing) > 2.0 * spacing + 0.01 * lasts:
        raise PhysicsError(
            f"{name}, line {place}: {points} values, {spacing:g} s apart, do not last {lasts:g} s. "
            "The file is cut or has been edited; fetch it again."
        )
    return _Record(points, spacing, _factor(unit, f"{name}, line {line}"), len(found), said)


def _knet(lines: Sequence[str], name: str) -> _Record:
    """Of K-NET and KiK-net: titles of 18 letters up to `Memo.`, then counts and their scale."""
    found = {line[:18].strip().lower(): (line[18:], k) for k, line in enumerate(lines[:24], 1)}

    of = partial(_told, found, name=name, archive="K-NET")
    scale, line = of("scale factor")
    if (pair := _KNET_SCALE.search(scale)) is None:
        raise PhysicsError(f'{name}, line {line}: "{scale.strip()}"; 2000(gal)/8388608 is right.')
    (rate, at), (long, said) = of("sampling freq"), of("duration")
    rate_hz = number(rate.lower().replace("hz", ""), name, at)
    gal = parse_unit("cm/s2").factor
    factor = gal * number(pair[1], name, line) / number(pair[2], name, line)
    peak, at = of("max. acc")
    return _Record(
        round(rate_hz * number(long, name, said)), 1.0 / rate_hz if rate_hz else 0.0, factor,
        of("memo")[1], said, peak=gal * number(peak, name, at),
    )  # fmt: skip


def _cosmos(lines: Sequence[str], name: str) -> _Record:
    """Of COSMOS: a header of text, one of integers, one of reals, comments, then the values."""
    found = [(k, match) for k, line in enumerate(lines) if (match := _COSMOS_DATA.match(line))]
    own = [(k, match) for k, match in found if match["what"].lower().startswith("acc")]
    if not own:
        what = found[0][1]["what"].lower() if found else "record of another kind"
        raise _not_accelerations(what, f"{name}, line {found[0][0] + 1 if found else 1}")
    if len(own) > 1:
        raise PhysicsError(
            f"{name}, line {own[1][0] + 1}: this COSMOS file holds {len(own)} accelerations. "
            "Save the one that is meant as a file of its own."
        )
    k, data = own[0]
    where = f"{name}, line {k + 1}"
    if data["unit"].strip().lower() == "counts":
        raise PhysicsError(f"{where}: the values are raw counts. Take the file of V1 or V2.")
    factor, count, long = _factor(data["unit"].strip(), where), int(data["count"]), data["long"]
    head = max(j for j in range(k) if "Real-header value" in lines[j])
    rows = ["" if row.lstrip()[:1] == "|" or "omment" in row else row for row in lines[:k]]
    reals = _numbers(rows, head + 1, k, name)
    steps = [1e-3 * reals[at] for at in _COSMOS_STEPS if at < len(reals) and reals[at] > 0.0]
    agree = [step for step in steps if abs(step * count - float(long)) < 1.5]
    if not agree:
        told = " or ".join(f"{step:g} s" for step in steps) or "none"
        raise PhysicsError(
            f"{where}: {count} values in about {long} s, and the real header gives a step of "
            f"{told}. The file is cut or has been edited; fetch it again."
        )
    end = next((j for j in range(k, len(lines)) if lines[j].startswith("End-of-data")), None)
    others = [match["what"].lower() for _, match in found if match is not data]
    remarks = (f"beside it, and not read: {', '.join(others)}",) if others else ()
    return _Record(count, agree[0], factor, k + 1, k + 1, end, remarks=remarks)


def _smc(lines: Sequence[str], name: str) -> _Record:
    """Of USGS SMC: 11 lines of text, 48 integers, 50 reals, comments, then values in cm/s2."""
    first = _SMC_FIRST.fullmatch(lines[0])
    if first is None or "ACCELEROGRAM" not in first["what"]:
        what = lines[0].strip(" *0123456789").lower()
        raise _not_accelerations(what or "record of an unknown kind", f"{name}, line 1")

    whole, reals = _numbers(lines, 11, 17, name), _numbers(lines, 17, 27, name)
    if len(whole) != 48 or len(reals) != 50:
        raise PhysicsError(
            f"{name}, lines 12 to 27: {len(whole)} whole numbers and {len(reals)} reals; "
            "SMC has 48 and 50."
        )
    rate = reals[1]
    if not 1.0 / _LONGEST <= rate <= 1.0 / _SHORTEST:
        raise PhysicsError(
            f"{name}, line 18: {rate:g} samples per second. Values of uneven times are not read."
        )
    gal = parse_unit("cm/s2").factor
    return _Record(int(whole[16]), 1.0 / rate, gal, 27 + int(whole[15]), 14)

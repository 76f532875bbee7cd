"""What is known of whole runs: from the names of their files, or from a table beside them."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from pathlib import Path

from ..data.channels import DRIVE, PLAIN
from ..data.formats.delimited import decoded
from ..data.labels import UNITS, Label, label_text
from ..data.titles import title, unit_or_none
from ..data.tone import Tone, amplitude_fits, frequency_fits, label_doubt
from ..errors import RecordError, StudyError, UnitError
from ..findings import listed
from ..quantity import quantity
from ..units import convert
from .file_names import (
    DOUBTFUL,
    SIGN,
    SPELLED,
    Reading,
    number_in,
    quantity_of,
    reading_of,
    tokens_of,
    value_of,
)
from .run_file import EXCLUDE, ROLES
from .run_titles import counted_names

_FILE = ("file", "run", "name", "datei", "filename")


@dataclass(frozen=True)
class RunChoices:
    """What a user says of all runs of a new study.

    `levels` patterns such as "I{}A", where {} is the command's level in a file's name; `labels`
    such as "oil=oil{}"; `table` a file with a row per run; `split` how files hold several runs;
    `rate` [Hz] to which faster runs are decimated, None for what a fit needs, 0 for none; `mask`
    whether isolated spikes count as not measured; `test` which files are test runs, by their paths
    or by patterns of their names.
    """

    levels: Sequence[str] = ()
    labels: Sequence[str] = ()
    table: Path | None = None
    split: str = ""
    rate: float | None = None
    mask: bool = False
    test: Sequence[Path | str] = ()

    def __post_init__(self) -> None:
        """Refuse a rate that is none with a StudyError."""
        if self.rate is not None and not 0.0 <= self.rate < inf:
            raise StudyError(
                f"the rate to which runs are decimated is {self.rate:g} Hz (--rate); 0 keeps all "
                "samples, a positive number is right else."
            )


@dataclass(frozen=True)
class Facts:
    """What is known of one run: levels of its command, labels, and its role, "" where not said."""

    levels: Mapping[str, float] = field(default_factory=dict)
    labels: Mapping[str, Label] = field(default_factory=dict)
    role: str = ""

    def and_(self, other: Facts) -> Facts:
        """Return these facts with others, which count where both say something."""
        return Facts(
            {**self.levels, **other.levels}, {**self.labels, **other.labels},
            other.role or self.role,
        )  # fmt: skip


def facts_of(
    files: Sequence[Path],
    choices: RunChoices,
    commanded: bool,
    tones: Sequence[Tone | None] = (),
    others: Sequence[Path] = (),
) -> tuple[list[Facts], list[str]]:
    """Return what is known of each file's run, and where it is from, in sentences.

    Parameters
    ----------
    files : one run or more each
    choices : patterns and table that were given
    commanded : whether the files hold a channel of the command: then names give no level unasked
    tones : what the motion of each file is, against which its name is held; none by default
    others : files of the same campaign, whose names tell how numbers are written, too

    Raises
    ------
    StudyError
        If a pattern fits no name, two sources differ, or the table cannot be read.
    """
    tones = tones or [None] * len(files)
    reading = reading_of([*files, *others], [*tones, *([None] * len(others))])
    found, notes = _offered(files, choices, commanded, reading)
    for pattern in choices.levels:
        rows = [_matched(file, pattern, reading, level=True) for file in files]
        found = _joined(found, rows)
        notes.append(_levels_found(rows, pattern))
    for pattern in choices.labels:
        rows = [_matched(file, pattern, reading, level=False) for file in files]
        found = _joined(found, rows)
    if choices.table is not None:
        rows = rows_of_table(choices.table, files, commanded)
        found = _joined(found, rows)
        notes += _of_table(rows, choices.table)
    asked = {name for one in found for name in one.levels}
    if commanded and asked:
        raise StudyError(
            f"{', '.join(sorted(asked))}: a level of each run, and a channel of the command as "
            "well. One of the two: leave the level out, or the channel with --channel."
        )
    if len(asked) > 1:
        raise StudyError(f"{' and '.join(sorted(asked))} both as levels; one command is right.")
    doubts = _doubted(files, found, tones)
    if not doubts and choices.table is None:
        doubts = _told_twice(files, tones, reading)
    return found, [*notes, *doubts]


def _doubted(
    files: Sequence[Path], found: Sequence[Facts], tones: Sequence[Tone | None]
) -> list[str]:
    """Return that labels contradict the measured motion, in one sentence."""
    wrong = [
        (file.name, text)
        for file, one, tone in zip(files, found, tones, strict=True)
        if tone is not None and (text := label_doubt(one.labels, tone))
    ]
    if not wrong:
        return []
    name, text = wrong[0]
    more = f", and so in {len(wrong) - 1} more of {len(files)} runs" if len(wrong) > 1 else ""
    return [
        f"{name}: {text}{more}: what the names say is doubtful, the level of a command as well. "
        "--runs FILE, a table with a row per file, says it"
    ]


def _told_twice(files: Sequence[Path], tones: Sequence[Tone | None], reading: Reading) -> list[str]:
    """Return that two names differ in how numbers are written alone, and their motions differ."""
    first: dict[str, tuple[Path, Tone]] = {}
    for file, tone in zip(files, tones, strict=True):
        tokens = tokens_of(file, reading)
        if tone is None or not tokens:
            continue
        key = file.stem
        for name, token in tokens.items():
            key = key.replace(token.text, f"<{name} {token.value:g}>")
        other, motion = first.setdefault(key, (file, tone))
        if other.stem == file.stem or (
            frequency_fits(motion.frequency, tone) and amplitude_fits(motion.amplitude, tone)
        ):
            continue
        one, two = (
            f"{quantity(each.frequency, 'Hz', 3)}, {quantity(each.amplitude, 'm', 3, fine=True)}"
            for each in (motion, tone)
        )
        told = ", ".join(
            label_text(name, token.value, PLAIN.get(name, "")) for name, token in tokens.items()
        )
        return [
            f"{other.name} and {file.name} tell the same, {told}, and their motions differ ({one} "
            f"and {two}): what one of the names says is doubtful. --runs FILE, a table with a row "
            "per file, says it"
        ]
    return []


def _of_table(rows: Sequence[Facts], table: Path) -> list[str]:
    """Return the sentence that tells what a table says of the runs, with units that it may lack."""
    found: dict[str, dict[Label, str]] = {}
    for row in rows:
        for name, value in (*row.levels.items(), *row.labels.items()):
            text = label_text(name, value, PLAIN[name] if name in row.levels else "")
            found.setdefault(name, {})[value] = text
    if not found:
        return []
    told = "; ".join(f"{name} {listed(found[name].values(), 6)}" for name in sorted(found))
    return [f"of each run, from {table}: {told}"]


def _levels_found(rows: Sequence[Facts], pattern: str) -> str:
    """Return the sentence that tells which levels a pattern found."""
    (name,) = rows[0].levels
    values = sorted({row.levels[name] for row in rows})
    levels = ", ".join(label_text(name, value, PLAIN[name]) for value in values)
    return f"{name} of each run: from the names of the files, by '{pattern}': {levels}"


def _joined(first: list[Facts], more: list[Facts]) -> list[Facts]:
    return [one.and_(other) for one, other in zip(first, more, strict=True)]


# -- names


def _offered(
    files: Sequence[Path], choices: RunChoices, commanded: bool, reading: Reading
) -> tuple[list[Facts], list[str]]:
    """Return what all names tell without being asked, and the sentences that say so."""
    tokens = [tokens_of(file, reading) for file in files]
    shared = [name for name in tokens[0] if all(name in one for one in tokens)] if tokens else []
    given = {pattern.partition("=")[0] for pattern in choices.labels}
    found, notes = [Facts() for _ in files], []
    for name in shared:
        drive = name in DRIVE
        if (drive and (commanded or choices.levels or choices.table)) or name in given:
            continue
        if name in reading.open:
            notes.append(reading.open[name])
            continue
        values = [one[name].value for one in tokens]
        seen, pattern = tokens[0][name].text, tokens[0][name].pattern
        if drive and _counts(values):
            notes.append(
                f'"{seen}" and the like in the names may count the files; '
                f"--level '{pattern}' takes them for the {name}"
            )
            continue
        unit = PLAIN[name] if drive else ""
        levels = ", ".join(label_text(name, value, unit) for value in sorted(set(values)))
        text = f'{name} of each run: from the names of the files, as in "{seen}": {levels}'
        if name in reading.doubts:
            text += f". Doubtful: {reading.doubts[name]}"
        if drive:
            text += ". No column holds a command"
            text += f". --level '{pattern}' says the same" if not reading.digits.get(name) else ""
        notes.append(text)
        for k, value in enumerate(values):
            more = Facts(levels={name: value}) if drive else Facts(labels={name: value})
            found[k] = found[k].and_(more)
    return found, [*notes, *(reading.why if notes else ())]


def _counts(values: Sequence[float]) -> bool:
    """Return whether numbers only count the files: 1, 2, 3 ..., each once."""
    return len(values) > 2 and sorted(values) == [float(k) for k in range(1, len(values) + 1)]


def _matched(file: Path, pattern: str, reading: Reading, *, level: bool) -> Facts:
    """Return what a pattern such as "I{}A" or "oil=batch{}" finds in a name."""
    asked = f'{"--level" if level else "--label"} "{pattern}"'
    named, _, rest = pattern.rpartition("=")
    right = "--level 'I{}A', or --level 'current=run{}_', is right"
    right = right if level else "--label 'oil=batch{}' is right"
    if rest.count("{}") != 1 or (not level and not named):
        raise StudyError(f"{asked}: {right}, where {{}} is the value.")
    before, after = rest.split("{}")
    spelled = re.match(r"[A-Za-z%]*", after)
    unit = SPELLED.get(spelled.group(), spelled.group()) if spelled else ""
    known = unit_or_none(unit) if unit else None
    if level:
        named = named or (_quantity_or_none(known.name) if known else "")
        if named not in DRIVE:
            raise StudyError(
                f"{asked}: a unit must follow {{}}, A or V or %, or the "
                f"channel stand before it: {right}."
            )
    target = PLAIN.get(named) or UNITS.get(named, "")
    number = target != "" or known is not None
    sign = "[-+]?" if before else rf"(?:\+|{SIGN})"  # alone, a pattern reads as names are read
    # Where a number fits no other way, what stands between its digits is its decimal mark.
    forms = [number_in(reading.marks), number_in(DOUBTFUL)] if number else [r"[A-Za-z0-9.]+"]
    forms = [sign + one for one in forms] if number else forms
    found = (
        re.search(rf"{re.escape(before)}({one}){re.escape(after)}{end}", f"{file.stem}{more}")
        for one in forms
        for more, end in (("_", ""), ("", "$"))
    )
    match = next((one for one in found if one), None)
    if match is None:
        raise StudyError(f'{asked}: it fits no part of "{file.name}".')
    if not number:
        return Facts(labels={named: match.group(1)})
    value = value_of(match.group(1))
    if known is not None and target:
        try:
            value = convert(value, known.name, target)
        except UnitError as error:
            raise StudyError(f"{asked}: {named}: {error}") from None
    return Facts(levels={named: value}) if level else Facts(labels={named: value})


def _quantity_or_none(unit: str) -> str:
    try:
        return quantity_of(unit)
    except UnitError:
        return ""


# -- a table beside the files


def rows_of_table(path: Path, files: Sequence[Path], commanded: bool = False) -> list[Facts]:
    """Return the rows of a table in the order of the files; StudyError for what is not right.

    `commanded` tells whether the files hold a channel of the command.
    """
    try:
        text, _ = decoded(path.read_bytes(), str(path))
    except OSError as error:
        raise StudyError(f"--runs {path}: cannot be read ({error.strerror or error}).") from None
    except RecordError:
        raise StudyError(
            f"--runs {path}: this is no text. Save the table of runs as CSV."
        ) from None
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"]
    if len(lines) < 2:
        raise StudyError(f"--runs {path}: a line of titles and a line per run are right.")
    delimiter = max(",;\t", key=lines[0].count)
    header, *rows = csv.reader(lines, delimiter=delimiter)
    at = [k for k, name in enumerate(header) if name.strip().lower() in _FILE]
    if not at:
        raise StudyError(f'--runs {path}: no column is called "file"; there are {listed(header)}.')
    named = [name.strip() for name in header if name.strip()]
    twice = next((name for name in named if named.count(name) > 1), "")
    if twice:
        raise StudyError(f'--runs {path}: {named.count(twice)} columns are called "{twice}".')
    names = counted_names(header, commanded)
    found: dict[str, Facts] = {}
    for number, row in enumerate(rows, 2):
        where = f"--runs {path}, row {number}"
        if len(row) != len(header):
            raise StudyError(f"{where}: {len(row)} fields under {len(header)} titles.")
        file = Path(row[at[0]].strip()).name
        if file in found:
            raise StudyError(f"{where}: there is a row of {file} above; one is right.")
        found[file] = _facts(header, names, row, at[0], where)
    return [_row_of(file, found, path) for file in files]


def _row_of(file: Path, rows: Mapping[str, Facts], path: Path) -> Facts:
    for name in (file.name, file.stem):
        if name in rows:
            return rows[name]
    raise StudyError(f"--runs {path}: no row is of {file.name}; every run needs one.")


def _facts(
    header: Sequence[str], names: Sequence[str], row: Sequence[str], file: int, where: str
) -> Facts:
    """Return what a row says: numbers in the unit of their title, words as they are."""
    found = Facts()
    for k, (text, name, field_text) in enumerate(zip(header, names, row, strict=True)):
        value = field_text.strip()
        if k == file or not value:
            continue
        column = title(k, text)
        if name == "role":
            if value not in (*ROLES, EXCLUDE):
                right = f"{', '.join(ROLES)} or {EXCLUDE}"
                raise StudyError(f'{where}: role is "{value}"; {right} is right.')
            found = replace(found, role=value)
            continue
        target = PLAIN.get(name, "") if name in DRIVE else UNITS.get(name, "")
        number = _number_or_none(value)
        if number is None and target:
            raise StudyError(f'{where}: {name} is "{value}"; a finite number is right.')
        if number is None:
            found = found.and_(Facts(labels={name: value}))
            continue
        if target and column.problem:
            raise StudyError(
                f'{where}: "{text.strip()}": {column.problem} {name} [{target}] is right.'
            )
        if target and column.unit is not None:
            try:
                number = convert(number, column.unit.name, target)
            except UnitError as error:
                raise StudyError(f"{where}: {name}: {error}") from None
        more = Facts(levels={name: number}) if name in DRIVE else Facts(labels={name: number})
        found = found.and_(more)
    return found


def _number_or_none(text: str) -> float | None:
    """Return a finite number, None where a text is none."""
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return None
    return number if isfinite(number) else None

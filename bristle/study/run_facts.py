"""What is known of whole runs: from the names of their files, or from a table beside them."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from math import inf, isfinite
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from ..core.text import command, listed, quantity
from ..data.channels import DRIVE, PLAIN, TEMPERATURE, UNITS, Label, label_name, label_text, meaning
from ..data.extra_channels import ABSURD, as_word
from ..data.formats.delimited import decoded
from ..data.run_names import (
    DOUBTFUL,
    SIGN,
    SPELLED,
    Reading,
    Token,
    number_in,
    quantity_of,
    reading_of,
    tokens_of,
    value_of,
)
from ..data.table import Table
from ..data.titles import Column, title, unit_or_none
from ..data.tone import Tone, amplitude_fits, frequency_fits, label_doubts, times_told
from ..errors import RecordError, StudyError, UnitError
from ..units import convert, same_dimension
from .runs import names_of_runs
from .study_file import EXCLUDE, ROLES, TEST, Place, RunFile, Settings

# What the titles of a table of runs tell: `I [A]` is the current, `T (°C)` the temperature.


def counted_names(header: Sequence[str], commanded: bool) -> list[str]:
    """Return the name under which each column of a table of runs counts.

    A title in other words counts where its unit says what it is, no other column has that name, and
    no other one could have it too.

    Parameters
    ----------
    header : the titles
    commanded : whether the files hold a channel of the command: then a level must be called so
    """
    columns = [title(k, text) for k, text in enumerate(header)]
    names = [column.name.strip().lower().replace(" ", "_") for column in columns]
    commands = [_command(column) for column in columns]
    if not commanded and not any(name in DRIVE for name in names):
        _take(names, commands)
    if TEMPERATURE not in names:
        _take(names, [TEMPERATURE if _in(column, UNITS[TEMPERATURE]) else "" for column in columns])
    return [
        f"{name}_{column.unit.name}"  # as names of files tell it: pressure_psi
        if name not in (*DRIVE, *UNITS) and column.unit and column.unit.name.isalpha()
        else name
        for name, column in zip(names, columns, strict=True)
    ]


def _take(names: list[str], found: Sequence[str]) -> None:
    """Give the one column that tells a quantity its name; nothing where several do."""
    at = [k for k, name in enumerate(found) if name]
    if len(at) == 1:
        names[at[0]] = found[at[0]]


def _command(column: Column) -> str:
    """Return the command that words and unit of a title tell, "" for none."""
    told = meaning(column.name, column.unit.name) if column.unit else None
    if told is None or told.quantity not in DRIVE or not _in(column, PLAIN[told.quantity]):
        return ""
    return told.quantity


def _in(column: Column, unit: str) -> bool:
    return column.unit is not None and same_dimension(column.unit.name, unit)


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


def _fact(name: str, value: Any, *, level: bool = False) -> Facts:
    return Facts({name: value}) if level else Facts(labels={name: value})


def _joined(found: Sequence[Facts], others: Sequence[Facts]) -> list[Facts]:
    """Return the facts of runs with others of the same runs."""
    return [one.and_(other) for one, other in zip(found, others, strict=True)]


def facts_of(
    files: Sequence[Path],
    choices: RunChoices,
    commanded: bool,
    tones: Sequence[Tone | None] = (),
    others: Sequence[Path] = (),
    columns: Sequence[Facts] = (),
) -> tuple[list[Facts], list[str]]:
    """Return what is known of each file's run, and where it is from, in sentences.

    Parameters
    ----------
    files : one run or more each
    choices : patterns and table that were given
    commanded : whether the files hold a channel of the command: then names give no level unasked
    tones : what the motion of each file is, against which its name is held; none by default
    others : files of the same campaign, whose names tell how numbers are written, too
    columns : what columns of the files tell, see `of_columns`; names, patterns and table go before

    Raises
    ------
    StudyError
        If a pattern fits no name, two sources differ, or the table cannot be read.
    """
    tones = tones or [None] * len(files)
    paths = files
    if len({file.parent for file in files}) > 1:  # lab/0.5A/run_1.csv
        files = [Path(f"{one.parent.name}_{one.name}") for one in files]
    reading = reading_of([*files, *others], [*tones, *([None] * len(others))])
    found, notes = _offered(files, choices, commanded, reading, tones)
    found = _joined(columns or found, found)
    for pattern in choices.levels:
        rows = [_matched(file, pattern, reading, level=True) for file in files]
        found = _joined(found, rows)
        (name,) = rows[0].levels
        told = f"{name} of each run: from the names of the files, by '{pattern}'"
        notes.append(
            f"{told}: {', '.join(_texts(name, sorted({r.levels[name] for r in rows}), level=True))}"
        )
    for pattern in choices.labels:
        rows = [_matched(file, pattern, reading, level=False) for file in files]
        found = _joined(found, rows)
    if choices.table is not None:
        rows = rows_of_table(choices.table, paths, commanded)
        found = _joined(found, rows)
        notes += _of_table(rows, choices.table)
    asked = {name for one in found for name in one.levels}
    if commanded and asked:
        raise StudyError(
            f"{', '.join(sorted(asked))}: a level of each run, and a channel of the command as "
            "well. One of the two: leave the level out, or the channel with --without."
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
    doubts = label_doubts([one.labels for one in found], tones)
    wrong = [(file.name, text) for file, text in zip(files, doubts, strict=True) if text]
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
            frequency_fits(motion.frequency, tone)
            and amplitude_fits(motion.amplitude, tone, (1.0,))
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
    found: dict[str, dict[Label, None]] = {}
    for row in rows:
        for name, value in (*row.levels.items(), *row.labels.items()):
            found.setdefault(name, {})[value] = None
    levels = {name for row in rows for name in row.levels}
    told = "; ".join(
        f"{label_name(name)} {listed(_texts(name, found[name], level=name in levels), 6)}"
        for name in sorted(found)
    )
    return [f"of each run, from {table}: {told}"] if told else []


def _texts(name: str, values: Iterable[Label], *, level: bool) -> list[str]:
    return [label_text(name, value, PLAIN[name] if level else "") for value in values]


# -- names


def _offered(
    files: Sequence[Path], choices: RunChoices, commanded: bool, reading: Reading,
    tones: Sequence[Tone | None],
) -> tuple[list[Facts], list[str]]:  # fmt: skip
    """Return what all names tell without being asked, and the sentences that say so."""
    tokens = [tokens_of(file, reading) for file in files]
    shared = [name for name in tokens[0] if all(name in one for one in tokens)] if tokens else []
    given = {pattern.partition("=")[0] for pattern in choices.labels}
    found, notes = [Facts() for _ in files], []
    known = commanded or choices.levels or choices.table
    drives = [] if known else [name for name in shared if name in DRIVE]
    if len(drives) > 1:
        ways = " or ".join(f"--level '{tokens[0][name].pattern}'" for name in drives)
        notes.append(f"the names tell {' and '.join(drives)}: {ways} says which is the command")
    elif not drives and not known:
        notes += _in_some_names(files, tokens)
    for name in shared:
        drive = name in DRIVE
        if (drive and (known or len(drives) > 1)) or name in given:
            continue
        if name in reading.open:
            notes.append(reading.open[name])
            continue
        values = [one[name].value for one in tokens]
        seen, pattern = tokens[0][name].text, tokens[0][name].pattern
        if drive and _counts(values):
            takes = f"; --level '{pattern}' takes them for the {name}"
            takes = takes if _fits(files, pattern, reading) else ""
            notes.append(f'"{seen}" and the like in the names may count the files{takes}')
            continue
        told = times_told([{name: one} for one in values], tones)
        values = [one / told for one in values]
        more = [_fact(name, value, level=drive) for value in values]
        text = (
            f'{label_name(name)} of each run: from the names of the files, as in "{seen}": '
            f"{', '.join(_texts(name, sorted({*values}), level=drive))}"
        )
        if told != 1.0:
            text += f'. By the measured motion "{seen}" is the stroke, twice of it'
        if name in reading.doubts:
            text += f". Doubtful: {reading.doubts[name]}"
        if drive:
            text += ". No column holds a command"
            same = not reading.digits.get(name) and _fits(files, pattern, reading)
            text += f". --level '{pattern}' says the same" if same else ""
        notes.append(text)
        found = _joined(found, more)
    return found, [*notes, *(reading.why if notes else ())]


def _in_some_names(files: Sequence[Path], tokens: Sequence[Mapping[str, Token]]) -> list[str]:
    """Return that most names tell the level of a command, and one does not."""
    for name in DRIVE:
        own = [one[name].text for one in tokens if name in one]
        if 2 * len(own) > len(files):
            other = next(file for file, one in zip(files, tokens, strict=True) if name not in one)
            return [
                f'"{own[0]}" and the like are in {len(own)} of {len(files)} names, and not in '
                f'"{other.name}": no {name} is taken. --runs FILE, a table with a row per file, '
                "says it"
            ]
    return []


def _fits(files: Sequence[Path], pattern: str, reading: Reading) -> bool:
    """Return whether a pattern of a level fits all names."""
    try:
        return bool([_matched(file, pattern, reading, level=True) for file in files])
    except StudyError:
        return False


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
        named = named or (quantity_of(known.name) if known else "")
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
        return _fact(named, match.group(1))
    value = value_of(match.group(1))
    if known is not None and target:
        try:
            value = convert(value, known.name, target)
        except UnitError as error:
            raise StudyError(f"{asked}: {named}: {error}") from None
    return _fact(named, value, level=level)


# -- columns that stand still

STILL = 0.02
"""Standard deviation within runs, by that of the runs' means, below which a column stands still."""


def of_columns(
    tables: Sequence[Table],
    taken: Container[str],
    closed: Sequence[bool] = (),
    known: Container[str] | None = None,
) -> tuple[list[Facts], list[str], list[str]]:
    """Return what columns tell of whole runs, by standing still in each file and differing.

    Parameters
    ----------
    tables : one run each
    taken : titles of the columns that are channels
    closed : which files are test runs, by which nothing is chosen; none by default
    known : names that are looked for, of runs that others join; None takes what differs

    Returns
    -------
    the facts of each file, sentences that say where they are from, and the titles of the columns
    that change in no file at all
    """
    facts, notes, constant = [Facts() for _ in tables], list[str](), list[str]()
    open_ = [k for k in range(len(tables)) if not (closed and closed[k])]
    for column in tables[0].columns:
        unit = column.unit.name if column.unit else ""
        word = as_word(column.name)
        name = f"{word}_{unit}" if unit.isalpha() else word
        own = [one.values[column.text] for one in tables if column.text in one.values]
        own = [values[np.abs(values) < ABSURD] for values in own]
        if (
            column.text in taken or word in (*DRIVE, *UNITS, "") or _in(column, UNITS["frequency"])
            or any(column.text in one.not_numeric for one in tables)
            or sum(len(values) > 0 for values in own) < len(tables)
        ):  # fmt: skip
            continue
        within = max(float(np.ptp(values)) for values in own)
        levels = [float(np.mean(values)) for values in own]
        levels = [float(f"{y:.{4 if within else 9}g}") for y in levels]
        between = float(np.std([levels[k] for k in open_]))
        if known is not None:
            tells = name in known
        elif unit:
            tells = max(float(np.std(one)) for one in own) <= STILL * between and between > 0.0
        else:  # without a unit a number that no run shares only names the runs
            tells = within == 0.0 and 1 < len({*levels}) < len(levels)
        if tells:
            facts = _joined(facts, [_fact(name, y) for y in levels])
            seen = listed(_texts(name, sorted({levels[k] for k in open_}), level=False), 6)
            notes.append(f'{label_name(name)} of each run: from the column "{column.text}": {seen}')
            constant += [column.text] if within == 0.0 else []
    return facts, notes, constant


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
    for name in (*DRIVE, *UNITS):
        own = [text.strip() for text, one in zip(header, names, strict=True) if one == name]
        if len(own) > 1:
            raise StudyError(f"--runs {path}: {listed(own)} all tell the {name}; one is right.")
    found: dict[str, Facts] = {}
    for number, row in enumerate(rows, 2):
        where = f"--runs {path}, row {number}"
        if len(row) != len(header):
            raise StudyError(f"{where}: {len(row)} fields under {len(header)} titles.")
        file = PureWindowsPath(row[at[0]].strip()).name  # of paths of any system
        if file in found:
            raise StudyError(f"{where}: there is a row of {file} above; one is right.")
        found[file] = _facts(header, names, row, at[0], where)
    if not any(name in found for file in files for name in (file.name, file.stem)):
        raise StudyError(
            f"--runs {path}: its {len(found)} rows are of {listed(found, 3)}, and none of the "
            f"{len(files)} runs is called so: {listed([file.name for file in files], 3)}. The "
            "names of the files are right in that column."
        )
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
            found = found.and_(_fact(name, value))
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
        found = found.and_(_fact(name, number, level=name in DRIVE))
    return found


def _number_or_none(text: str) -> float | None:
    """Return a finite number, None where a text is none."""
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return None
    return number if isfinite(number) else None


# What the runs of a new study are for: training, to be held out, or the test at the end.

_WORDS = {
    "train": "train training ident identification fit estimation est calibration cal kalibrierung",
    "holdout": "valid validation val vali test holdout hold check verify verification validierung "
    "kontrolle kontrollmessung pruefung pruef pr\u00fcfung pr\u00fcf gegenprobe",
}
_TRAIN, _HOLDOUT = (frozenset(words.split()) for words in _WORDS.values())
_ANY_RUN = frozenset({"test", "hold", "check", "pruefung", "pruef", "pr\u00fcfung", "pr\u00fcf"})
"""Words by which any run may be called: they count beside names for training alone."""
_WITH_NUMBER = re.compile(r"[^\W\d_]*\d+(?:[.,]\d+)?[^\W\d_]*")


def for_test(files: Sequence[Path], choices: RunChoices) -> list[bool]:
    """Return which files are test runs: those that a path, a pattern or the table names.

    Parameters
    ----------
    files : one run or more each
    choices : patterns and table that were given

    Raises
    ------
    StudyError
        If a pattern fits no name, all files are test runs, or the table cannot be read.
    """
    out = [False] * len(files)
    if choices.table is not None:
        out = [row.role == TEST for row in rows_of_table(choices.table, files)]
    for one in map(str, choices.test):
        found = [k for k, file in enumerate(files) if _is_chosen(file, one)]
        if not found:
            raise StudyError(
                f"test runs: no file of the data is {one}; there are "
                f"{', '.join(file.name for file in files)}."
            )
        for k in found:
            out[k] = True
    if all(out):
        raise StudyError(
            "test runs: all files are. Leave some for training, and one to be held out."
        )
    return out


def _is_chosen(file: Path, one: str) -> bool:
    return file == Path(one) or any(fnmatchcase(text, one) for text in (file.name, file.as_posix()))


def roles_of(names: list[str], closed: list[bool]) -> tuple[list[str], list[str]]:
    """Return the roles of runs, and the notes that tell why.

    Parameters
    ----------
    names : of the files in data/
    closed : which of them are test runs; see `roles_by_name` for the others
    """
    roles, notes = roles_by_name([n for n, test in zip(names, closed, strict=True) if not test])
    rest = iter(roles)
    every = [TEST if is_test else next(rest) for is_test in closed]
    test = listed(name for name, role in zip(names, every, strict=True) if role == TEST)
    if test:
        notes.append(f"test runs, which no fit and no verdict sees: {test}")
    return every, notes


def roles_by_name(names: list[str], *, added: bool = False) -> tuple[list[str], list[str]]:
    """Return roles and why: by the names of files, else a third is held out.

    Parameters
    ----------
    names : of the files
    added : whether they join runs that have roles: else names count where they give both
    """
    found = [_role_in(name) for name in names]
    theirs = [_words(name) for name, role in zip(names, found, strict=True) if role == "holdout"]
    sure = "" not in found or all(words & (_HOLDOUT - _ANY_RUN) for words in theirs)
    if any(found) if added else sure and 0 < len(theirs) < len(names):
        roles, note = [role or "train" for role in found], "roles follow the names of the files"
    elif len(names) == 1:
        alone = "there is one run: its last 30 % are held out, which is weaker than a separate run"
        joins = f"{names[0]} is for training; --holdout '{names[0]}' holds it out"
        return ["train"], [joins if added else alone]
    else:
        held, which = a_third(names)
        roles = ["holdout" if k in held else "train" for k in range(len(names))]
        note = f"{which} is held out; bristle study roles changes that"
    held_out = [name for name, role in zip(names, roles, strict=True) if role == "holdout"]
    return roles, [f"{note}. Held out: {listed(held_out) or 'none'}"]


def _role_in(name: str) -> str:
    """Return the role that a file's name tells, "" where it tells none."""
    words = _words(name)
    return "holdout" if words & _HOLDOUT else "train" if words & _TRAIN else ""


def _words(name: str) -> set[str]:
    return {*re.split(r"[\W\d_]+", Path(name).stem.lower())}


def a_third(names: Sequence[str]) -> tuple[set[int], str]:
    """Return the places of the runs to hold out, of three one, and the words that tell which.

    It is every third run in the order of the names. Where three levels of a campaign take turns
    (5, 20 and 40 °C), that would leave one of them without training: then those runs are taken
    whose levels have lost the smallest share so far.

    Parameters
    ----------
    names : of the files; words with a number that some names share are levels ("40mm", "speed3")
    """
    words = [set(_WITH_NUMBER.findall(Path(name).stem.lower())) for name in names]
    runs = Counter(word for own in words for word in own)
    levels = [{word for word in own if 1 < runs[word] < len(names)} for own in words]
    every = set(range(1, len(names), 3))
    held = Counter(word for k in every for word in levels[k])
    if all(held[word] < runs[word] for word in held):
        return every, "every third run"

    def loss(k: int) -> tuple[int, float, bool]:
        shares = [(held[word] + 1) / runs[word] for word in levels[k]]
        return shares.count(1.0), sum(shares), k not in every

    out: set[int] = set()
    held.clear()
    for _ in every:
        out.add(best := min(set(range(len(names))) - out, key=lambda k: (*loss(k), k)))
        held.update(levels[best])
    return out, "a third of the runs, of each level as few as can be,"


# Other roles for the runs of a study: which runs are meant, and what must be left.


def roles_by_place(path: Path, settings: Settings, roles: Mapping[str, str]) -> dict[Place, str]:
    """Return the new roles of runs by their places.

    Parameters
    ----------
    path : of study.toml, for messages
    settings : its content
    roles : role by the name or the file of a run

    Raises
    ------
    StudyError
        If there is no such run or role, or too few runs would be left for training or held out.
    """
    every = (*settings.runs, *settings.excluded)
    names = names_of_runs(settings)
    known: dict[str, RunFile] = {}
    for run in every:
        known |= {names[run.place]: run, run.name: run}
    found: dict[Place, str] = {}
    for name, role in roles.items():
        if role not in (*ROLES, EXCLUDE):
            raise StudyError(f'role "{role}" of {name}; there are {", ".join((*ROLES, EXCLUDE))}.')
        if name not in known:
            there = listed(names.values())
            raise StudyError(f'{path}: no run is called "{name}"; there are {there}.')
        found[known[name].place] = role
    refuse_too_few(path, settings, found)
    return found


def refuse_too_few(path: Path, settings: Settings, found: Mapping[Place, str]) -> None:
    """Refuse roles that leave nothing to fit to, or nothing to judge by.

    Parameters
    ----------
    path : of study.toml, for messages
    settings : its content
    found : the roles that change, by the place of a run

    Raises
    ------
    StudyError
        With the command that gives the missing role too.
    """
    every = (*settings.runs, *settings.excluded)
    roles = [found.get(run.place, run.role) for run in every]
    fitted, judged = roles.count(ROLES[0]), roles.count(ROLES[1])
    if fitted + judged == 0:
        raise StudyError(f"{path}: no run would be left; some for training are needed.")
    if fitted + judged > 1 and 0 in (fitted, judged):
        lacking, other = ("held out", ROLES[1]) if fitted else ("for training", ROLES[0])
        names = names_of_runs(settings)
        there = listed(
            names[run.place] for run, role in zip(every, roles, strict=True) if role in ROLES[:2]
        )
        order = command("study", "roles", path.parent, *_options(found, names), f"--{other}", "RUN")
        raise StudyError(
            f"{path}: no run would be {lacking}. A model is judged on runs that it was not fitted "
            f"to, so that both are needed. Nothing is written. With one of {there} as RUN this "
            f"does it: {order}"
        )


def _options(found: Mapping[Place, str], names: Mapping[Place, str]) -> Iterator[str]:
    """Yield the options of `bristle study roles` that give runs these roles."""
    for role in (*ROLES, EXCLUDE):
        chosen = [names[place] for place, own in found.items() if own == role]
        yield from [f"--{role}", *chosen] if chosen else []

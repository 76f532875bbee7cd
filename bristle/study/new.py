"""A new study's folder from files: channels guessed with reasons, runs to train on or held out."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from ..data.channels import ChannelSpec, channel_unit
from ..data.guess import Guess, guess_channels, left_out
from ..data.measurement import measurements_of
from ..data.model import new_model
from ..data.model_text import model_text
from ..data.read import read_table
from ..data.table import Table
from ..errors import BristleError, StudyError, UnitError
from ..physics.building import read_building
from ..physics.laws import DEFAULT
from ..units import canonical
from .history import History, Step
from .settings import TEST, RunFile, Settings, write_settings

_WORDS = {
    "train": "train training ident identification fit estimation est calibration cal",
    "holdout": "valid validation val vali test holdout hold check verify verification",
}
_TRAIN, _HOLDOUT = (frozenset(words.split()) for words in _WORDS.values())
_CHOICE = re.compile(r"(?P<channel>\w+)=(?P<sign>-?)(?P<column>[^@]+?)(?:@(?P<unit>[^@]*))?")


@dataclass(frozen=True)
class Made:
    """A study's folder that was made: what was guessed, what was left out, and what to know."""

    guesses: tuple[Guess, ...]
    unused: tuple[str, ...]
    notes: tuple[str, ...]


def make_folder(
    folder: Path,
    files: Sequence[Path | str],
    *,
    rig: str = "bench",
    building: Path | str | None = None,
    channels: Mapping[str, ChannelSpec] | None = None,
    title: str = "",
    law: str = DEFAULT,
    test: Sequence[Path | str] = (),
) -> Made:
    """Make a study's folder from files.

    Parameters
    ----------
    folder, files, rig, building, channels, title, law, test : see
        `bristle.study.create.create_study`

    Raises
    ------
    StudyError, RecordError
        As `create_study`.
    """
    if folder.exists():
        raise StudyError(f"{folder}: is there already. Take another name, or remove it.")
    if not files:
        raise StudyError("a study needs measurements: --data 'lab/*.csv' names their files.")
    levels = _levels(rig, building)
    tables = [read_table(Path(file)) for file in files]
    closed = _for_test([Path(file) for file in files], test)
    first = tables[closed.index(False)]  # a guess is a choice, which no test run may see
    guesses = _chosen(first, guess_channels(first, rig, levels), channels or {})
    _refuse_incomplete(first, guesses, rig, channels or {})
    specs = {
        guess.channel: ChannelSpec(guess.column, guess.unit, guess.sign) for guess in guesses
    } | {name: spec for name, spec in (channels or {}).items() if spec.step is not None}
    digests = {}
    for file, table in zip(files, tables, strict=True):
        _refuse_other_columns(table, guesses, first)
        pieces = measurements_of(table, specs, estimate=False)
        digests[str(file)] = [piece.digest() for piece in pieces]
    names = _names([Path(file) for file in files])
    runs, notes = _roles(names, closed)
    notes += _twins([str(file) for file in files], digests, closed)
    comments = {guess.channel: _comment(guess) for guess in guesses}
    settings = Settings(title or folder.name, rig, tuple(runs), specs, comments=comments)
    _write(folder, settings, dict(zip(names, map(Path, files), strict=True)), building, law)
    unused = tuple(
        text for text in left_out(first, guesses) if text not in {g.column for g in guesses}
    )
    return Made(tuple(guesses), unused, tuple(notes))


def parse_channel(text: str) -> tuple[str, ChannelSpec]:
    """Return (channel, where it is) of `--channel force=-Ch3@kN`.

    The column's title or name follows the `=`, a minus before it turns the sign, a unit stands
    after `@`.

    Raises
    ------
    StudyError
        If the text cannot be read, or there is no such channel or unit.
    """
    match = _CHOICE.fullmatch(text.strip())
    if match is None:
        raise StudyError(
            f'--channel "{text}": CHANNEL=COLUMN@UNIT is right, as in --channel force=Ch3@kN, with '
            "a minus before the column to turn its sign."
        )
    try:
        channel_unit(match["channel"])
        unit = canonical(match["unit"]) if match["unit"] else ""
    except BristleError as error:
        raise StudyError(f'--channel "{text}": {error}') from None
    return match["channel"], ChannelSpec(match["column"].strip(), unit, -1 if match["sign"] else 1)


def _levels(rig: str, building: Path | str | None) -> list[str] | None:
    if rig == "structure" and building is not None:
        return read_building(building).levels()
    if building is not None:
        raise StudyError("--building goes with --rig structure alone.")
    return None


def _chosen(table: Table, guesses: list[Guess], channels: Mapping[str, ChannelSpec]) -> list[Guess]:
    """Return the guesses with those replaced that were given."""
    given = {}
    for channel, spec in channels.items():
        if spec.step is not None:
            continue
        column = table.find(spec.column)
        unit = spec.unit or (column.unit.name if column.unit else "")
        given[channel] = Guess(channel, column.text, unit, spec.sign, "given")
    taken = {guess.column for guess in given.values()}
    kept = [g for g in guesses if g.column not in taken and g.channel not in channels]
    return [*kept, *given.values()]


def _refuse_incomplete(
    table: Table, guesses: list[Guess], rig: str, channels: Mapping[str, ChannelSpec]
) -> None:
    """Refuse what lacks a channel or a unit, with all that was guessed."""
    there = {guess.channel for guess in guesses} | set(channels)
    wrong = []
    if "time" not in there:
        wrong.append("no column can be the time: --channel time=COLUMN@s, or --step 0.002")
    if rig == "bench":
        if not there & {"displacement", "velocity"}:
            wrong.append(
                "no column can be a displacement or velocity: --channel velocity=COLUMN@m/s"
            )
        if "force" not in there:
            wrong.append("no column can be the force: --channel force=COLUMN@N")
    elif not any(name.startswith(("base_", "floor", "drift")) for name in there):
        wrong.append(
            "no column can be the response of a level: --channel base_displacement=COLUMN@m"
        )
    for guess in guesses:
        if not guess.unit:
            right = channel_unit(guess.channel)
            wrong.append(
                f'{guess.channel}: the unit of "{guess.column}" is not given: '
                f'--channel "{guess.channel}={guess.column}@{right}", or what it is in'
            )
    if wrong:
        seen = "".join(f"\n    {guess}" for guess in guesses)
        unused = left_out(table, guesses)
        rest = f"\n  Not used: {', '.join(unused)}." if unused else ""
        raise StudyError(
            f"{table.source}: some channels cannot be guessed."
            + "".join(f"\n  {line}" for line in wrong)
            + (f"\n  The guess so far:{seen}" if seen else "")
            + rest
        )


def _refuse_other_columns(table: Table, guesses: Iterable[Guess], first: Table) -> None:
    there = {column.text: column for column in table.columns}
    for guess in guesses:
        if guess.column not in there:
            raise StudyError(
                f'{table.source}: there is no column "{guess.column}" ({guess.channel}), as in '
                f"{first.source}; there are {', '.join(there)}. All runs of a study have the same "
                "columns."
            )
        stated, unit = there[guess.column].unit, guess.unit
        if stated is not None and first.find(guess.column).unit is not None:
            try:
                same = stated.name == canonical(unit) or first.find(guess.column).unit == stated
            except UnitError:
                same = False
            if not same:
                raise StudyError(
                    f'{table.source}: "{guess.column}" is in {stated.name}, and in {unit} in '
                    f"{first.source}. All runs of a study have the same units."
                )


def _names(files: list[Path]) -> list[str]:
    """Return a name in data/ for each file, made different where two files share one."""
    out: list[str] = []
    for file in files:
        name, number = file.name, 2
        while name.lower() in (other.lower() for other in out):
            stem, dot, rest = file.name.partition(".")
            name, number = f"{stem}_{number}{dot}{rest}", number + 1
        out.append(name)
    return out


def _for_test(files: list[Path], chosen: Sequence[Path | str]) -> list[bool]:
    """Return which files are test runs: those that a path or a pattern of names chooses."""
    out = [False] * len(files)
    for one in map(str, chosen):
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


def _roles(names: list[str], closed: list[bool]) -> tuple[list[RunFile], list[str]]:
    """Return the runs with their roles, and the notes that tell why.

    Parameters
    ----------
    names : of the files in data/
    closed : which of them are test runs; see `_seen_roles` for the others
    """
    roles, notes = _seen_roles([n for n, is_test in zip(names, closed, strict=True) if not is_test])
    rest = iter(roles)
    every = [TEST if is_test else next(rest) for is_test in closed]
    test = ", ".join(name for name, role in zip(names, every, strict=True) if role == TEST)
    if test:
        notes.append(f"test runs, which no fit and no verdict sees: {test}")
    return [RunFile(f"data/{n}", role) for n, role in zip(names, every, strict=True)], notes


def _seen_roles(names: list[str]) -> tuple[list[str], list[str]]:
    """Return roles and why: by the names of files, else every third is held out."""
    words = [set(re.split(r"[^a-z]+", name.lower())) for name in names]
    found = ["holdout" if w & _HOLDOUT else "train" if w & _TRAIN else "" for w in words]
    if len(names) == 1:
        return ["train"], [
            "there is one run: its last 30 % are held out, which is weaker than a separate run"
        ]
    if (
        "holdout" in found
        and len(set(found) | {"train"}) == 2
        and found.count("holdout") < len(found)
    ):
        roles = [role or "train" for role in found]
        note = "roles follow the names of the files"
    else:
        roles = ["holdout" if k % 3 == 1 else "train" for k in range(len(names))]
        note = "every third run is held out; change role in study.toml if another choice is better"
    held_out = ", ".join(name for name, role in zip(names, roles, strict=True) if role == "holdout")
    return roles, [f"{note}. Held out: {held_out}"]


def _twins(files: list[str], digests: Mapping[str, list[str]], closed: Sequence[bool]) -> list[str]:
    first: dict[str, str] = {}
    twins = []
    is_test = dict(zip(files, closed, strict=True))
    for file in files:
        whole = " ".join(digests[file])
        if whole in first and is_test[file] != is_test[first[whole]]:
            raise StudyError(
                f"{file} and {first[whole]} are the same measurement, and one of them is a test "
                "run: it tests nothing. Use another run, or remove one."
            )
        if whole in first:
            twins.append((file, first[whole]))
        first.setdefault(whole, file)
    if len(files) > 1 and len(first) == 1:
        raise StudyError(
            f"{files[0]} and the other {len(files) - 1} files hold the same measurement: nothing "
            "can be held out. Take runs with different motions, or one file alone."
        )
    return [f"{file} is the same measurement as {other}: remove one" for file, other in twins]


def _comment(guess: Guess) -> str:
    return guess.reason + (f"\ndoubtful: {guess.doubt}" if guess.doubt else "")


def _write(
    folder: Path,
    settings: Settings,
    data: Mapping[str, Path],
    building: Path | str | None,
    law: str,
) -> None:
    """Write the folder beside its place, then move it there."""
    draft: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
        for sub in ("data", "effects", "history", "reports"):
            (draft / sub).mkdir()
        for name, source in data.items():
            shutil.copyfile(source, draft / "data" / name)
        model = new_model(law)
        if building is not None:
            shutil.copyfile(building, draft / Path(building).name)
            model = replace(model, building=Path(building).name)
        write_settings(draft / "study.toml", settings)
        text = model_text(model)
        History(draft).add(Step(0, f"begin with {law}", "the study was made"), text)
        draft.chmod(0o755)
        draft.replace(folder)
    except OSError as error:
        raise StudyError(
            f"{error.filename or folder}: the study cannot be written ({error.strerror or error})."
        ) from None
    finally:
        if draft is not None:
            shutil.rmtree(draft, ignore_errors=True)

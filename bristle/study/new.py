"""A new study's folder from files: channels guessed with reasons, runs to train on or held out."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, log10
from pathlib import Path

import numpy as np

from ..core.files import new_folder
from ..core.progress import counted
from ..core.text import capital, command, listed, plain
from ..data.building_file import read_building
from ..data.channels import (
    DRIVE,
    ChannelSpec,
    at_device,
    channel_unit,
    in_unit,
    meaning,
    no_device,
)
from ..data.checks.channels import SLOW
from ..data.decimate import FAST, RATE
from ..data.extra_channels import found_in, raw_signals
from ..data.guess import Guess, guess_channels, left_out, may_be_time, too_few_rows
from ..data.measurement import in_si, measurements_of
from ..data.noise import SHORTEST
from ..data.pieces import holds_several, pieces_of
from ..data.read import read_table
from ..data.table import Table
from ..data.tone import Tone, tone_of
from ..errors import BristleError, StudyError, UnitError
from ..model.model import new_model
from ..model.model_file import model_text
from ..physics.building import Building, with_damper
from ..physics.drive import VOLTAGE
from ..physics.laws import DEFAULT
from ..units import canonical, convert, same_dimension
from .history import History, Step
from .run_facts import Facts, RunChoices, facts_of, for_test, of_columns, roles_of
from .runs import names_of_runs
from .study_file import ALL, EXCLUDE, ROLES, TEST, RunFile, Settings, write_settings

_REMARKS = 6
"""Remarks on files that are printed at most."""
_NO_COMMAND = (
    "no command was recorded: this is taken as a device that nothing commands{}. If one acts on "
    "it, its column or --level is needed"
)
ENDS = (0.005, 0.995)
"""Shares of the samples below the two ends of the displacement's range, so that no spike is one."""
NEAR_ZERO = 0.45
"""Share of the displacement's range up to which its middle may lie from zero: farther off, and
zero is outside the range or at its very edge."""
_CHOICE = re.compile(r"(?P<channel>\w+)=(?P<sign>-?)(?P<column>[^@]+?)(?:@(?P<unit>[^@]*))?")


@dataclass(frozen=True)
class NewStudy:
    """A study's folder that was made: what was guessed, what was left out, and what to know.

    `extra` are the channels besides those that bristle knows, by name.
    """

    guesses: tuple[Guess, ...]
    extra: Mapping[str, ChannelSpec]
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
    law: str | None = None,
    runs: RunChoices | None = None,
    device: str | None = None,
    without: Sequence[str] = (),
) -> NewStudy:
    """Make a study's folder from files.

    Parameters
    ----------
    folder, files, rig, building, channels, title, law, runs, device, without : see
        `bristle.study.steps.create_study`

    Raises
    ------
    StudyError, RecordError
        As `create_study`.
    """
    if folder.exists():
        raise StudyError(f"{folder}: is there already. Take another name, or remove it.")
    if not files:
        raise StudyError("a study needs measurements: --data 'lab/*.csv' names their files.")
    choices = runs or RunChoices()
    house = _house(rig, building, device)
    levels = None if house is None else house.levels()
    studied = "" if house is None else house.studied
    devices = [] if house is None else [one.name for one in house.devices]
    _refuse_no_device(channels or {}, devices)
    split = choices.split
    tables = [read_table(Path(file), split) for file in counted(files, "reading file")]
    found_split = {table.split for table in tables}
    if not split and len(found_split) == 1 and found_split != {""}:
        split = found_split.pop()
    closed = for_test([Path(file) for file in files], choices)
    first = tables[closed.index(False)]  # a guess is a choice, which no test run may see
    seen = guess_channels(first, rig, levels, devices)
    guesses = _chosen(first, _read(seen, without), channels or {})
    _refuse_incomplete(first, guesses, rig, channels or {})
    specs = {
        guess.channel: ChannelSpec(guess.column, guess.unit, guess.sign) for guess in guesses
    } | {name: spec for name, spec in (channels or {}).items() if spec.step is not None}
    for table in tables:
        refuse_other_columns(table, guesses, first)
    taken = [guess.column for guess in guesses]
    ignored = [guess.column for guess in seen if guess.channel in without]
    told, of_runs, still = (
        of_columns(tables, {*taken, *ignored}, closed)
        if rig == "bench" and not holds_several(split)
        else ((), [], [])
    )
    extra = found_in(first, [*taken, *ignored, *still], specs)
    names = _names([Path(file) for file in files])
    is_test = dict(zip(names, closed, strict=True))
    specs, centred = _centred(specs, tables, closed) if rig == "bench" else (specs, "")
    found = _parts(names, tables, specs, split)
    about, notes = facts_of(
        [Path(file) for file in files], choices, _commanded(specs, studied),
        _tones(names, found, is_test), columns=told,
    )  # fmt: skip
    notes += of_runs
    notes += remarks_on(names, tables, guesses, first)
    of_file = dict(zip(names, about, strict=True))
    copies = _copies(found, is_test)
    kept = [one for one in found if one not in copies]
    roles, said = roles_of([one.name for one in kept], [is_test[one.file] for one in kept])
    of_part = dict(zip(kept, roles, strict=True))
    every = [_with_facts(one, of_part.get(one, EXCLUDE), of_file) for one in found]
    settings = Settings(
        title or folder.name, rig, tuple(run for run in every if run.role != EXCLUDE),
        specs, comments={guess.channel: _comment(guess) for guess in guesses},
        mask=choices.mask, split=split, law=ALL if law is None and rig == "bench" else "",
        excluded=tuple(run for run in every if run.role == EXCLUDE),
        rate=_rate([one for one in found if not is_test[one.file]], choices, notes), extra=extra,
        device=studied,
    )  # fmt: skip
    _refuse_one_role(settings.runs)
    notes += [centred] if centred else []
    if rig == "bench" and not settings.drive:
        tried = ", and laws of such devices are tried as well"
        notes.append(_NO_COMMAND.format(tried if law is None else ""))
    if settings.excluded:
        notes.append(settings.excluded_text.removesuffix("."))
    raw = [(one, of) for one, of in raw_signals(first).items() if one not in taken]
    if raw:
        pairs = ", ".join(f'"{one}" of "{of}"' for one, of in raw)
        notes.append(f"raw signals beside calibrated columns are not used: {pairs}")
    notes += said if not any(one.role for one in about) else []
    notes += _copies_text(folder, copies, settings)
    data = dict(zip(names, map(Path, files), strict=True))
    _write(folder, settings, data, building, law or DEFAULT)
    taken += [*still, *(spec.column for spec in extra.values())]
    unused = tuple(text for text in left_out(first, guesses) if text not in taken)
    return NewStudy(tuple(guesses), extra, unused, tuple(notes))


def _centred(
    specs: dict[str, ChannelSpec], tables: Sequence[Table], closed: Sequence[bool]
) -> tuple[dict[str, ChannelSpec], str]:
    """Return where channels are, the displacement's zero in the middle of its range, and that.

    Only where its range, over all runs but test runs, does not hold its zero: springs and stops
    are then those of a rod that never comes there.
    """
    spec = specs.get("displacement")
    if spec is None:
        return specs, ""
    seen = [
        in_si(table, "displacement", replace(spec, sign=1))
        for table, is_test in zip(tables, closed, strict=True)
        if not is_test
    ]
    ends = [np.quantile(x, ENDS) for x in (one[np.isfinite(one)] for one in seen) if x.size]
    low = min((float(low) for low, _ in ends), default=0.0)
    high = max((float(high) for _, high in ends), default=0.0)
    span, middle = high - low, 0.5 * (high + low)
    if not 0.0 < NEAR_ZERO * span < abs(middle):
        return specs, ""
    unit = spec.unit or "m"
    zero = round(convert(middle, "m", unit), max(0, 4 - ceil(log10(convert(span, "m", unit)))))
    text = (
        f"the displacement is counted from the middle of its range, {zero:g} {unit} as recorded: "
        "zero in study.toml, under [channels.displacement]"
    )
    return {**specs, "displacement": replace(spec, zero=zero)}, text


@dataclass(frozen=True)
class _Part:
    """A run of a new study.

    Its file in data/, its number there or 0, digests, samples per s, length in s, and the tone of
    its motion.
    """

    file: str
    piece: int
    digests: tuple[str, ...]
    rate: float
    lasts: float
    tone: Tone | None = None

    @property
    def name(self) -> str:
        return f"{self.file}, run {self.piece}" if self.piece else self.file


def remarks_on(
    names: Sequence[str], tables: Sequence[Table], columns: Iterable[Guess], first: Table
) -> list[str]:
    """Return what is to be known at once of files: each remark once, with the file it is of.

    Parameters
    ----------
    names : of the files
    tables : what is read of each
    columns : those that are used, whose units a file may lack
    first : the table of the first run
    """
    of: dict[str, list[str]] = {}
    told = [one for one in columns if first.find(one.column).unit is not None]
    for name, table in zip(names, tables, strict=True):
        bare = [one for one in told if table.find(one.column).unit is None]
        assumed = ", ".join(f'{one.unit} for "{one.column}"' for one in bare)
        lacking = f"no units: {assumed} are taken, as in {Path(first.source).name}"
        for remark in (*table.remarks, *([lacking] if bare else [])):
            of.setdefault(remark, []).append(name)
    said = [
        f"{files[0]}{f' and {len(files) - 1} more' if len(files) > 1 else ''}: {remark}"
        for remark, files in of.items()
    ]
    rest = len(said) - _REMARKS
    if rest > 0:
        said[_REMARKS:] = [f"{rest} more remarks of this kind on the files; study check has all"]
    return said


def _parts(
    names: Sequence[str], tables: Sequence[Table], specs: Mapping[str, ChannelSpec], split: str
) -> list[_Part]:
    """Return the runs in the files, each read once, so that what is wrong is told now."""
    out = []
    for name, table in zip(names, tables, strict=True):
        for number, piece in enumerate(pieces_of(table, split, specs), 1):
            read = measurements_of(piece, specs, estimate=False)
            digests = tuple(one.digest() for one in read)
            tone = tone_of(read[0]) if len(read) == 1 else None
            rate, lasts = read[0].sampling.rate, sum(float(np.ptp(one.time)) for one in read)
            place = number if holds_several(split) else 0
            out.append(_Part(name, place, digests, rate, lasts, tone))
    return out


def _tones(
    names: Sequence[str], parts: Sequence[_Part], is_test: Mapping[str, bool]
) -> list[Tone | None]:
    """Return the tone of each file that holds one run; a choice must not see those of tests."""
    own: dict[str, list[_Part]] = {
        name: [one for one in parts if one.file == name] for name in names
    }
    return [
        own[name][0].tone if len(own[name]) == 1 and not is_test[name] else None for name in names
    ]


def _with_facts(part: _Part, role: str, facts: Mapping[str, Facts]) -> RunFile:
    about = facts[part.file]
    role = role if role in (TEST, EXCLUDE) else about.role or role
    return RunFile(f"data/{part.file}", role, about.levels, about.labels, part.piece)


def _refuse_one_role(runs: Sequence[RunFile]) -> None:
    seen = [run for run in runs if run.role != TEST]
    roles = {run.role for run in seen}
    if len(seen) > 1 and roles != {"train", "holdout"} and len(roles) == 1:
        raise StudyError(
            f'all runs have the role "{roles.pop()}": some for training, some held out are right.'
        )


def _rate(parts: Sequence[_Part], choices: RunChoices, notes: list[str]) -> float:
    """Return the rate to which runs are decimated, 0 where none is fast enough."""
    slowest, fastest = min(part.rate for part in parts), max(part.rate for part in parts)
    rate = RATE if choices.rate is None else choices.rate
    if rate <= 0.0 or fastest < FAST * rate * (1.0 - 1e-6):
        return 0.0
    longest = max(part.lasts for part in parts)
    if longest * rate < SHORTEST:
        other = " If the times are in another unit, --channel time=COLUMN@UNIT gives it."
        other = other if fastest >= 1e3 * SLOW else ""  # a thousand times slower is too slow
        raise StudyError(
            f"the runs last {plain(longest, 3)} s at most, with {plain(fastest, 4)} samples per "
            f"second: a fit needs {plain(SHORTEST / rate, 3)} s at least, and several cycles of "
            f"motion.{other}"
        )
    held = plain(fastest, 4)
    if plain(slowest, 4) != held:
        held = f"{plain(slowest, 4)} to {held}"
    some = "runs" if slowest >= FAST * rate * (1.0 - 1e-6) else "the faster ones"
    notes.append(
        f"the files hold {held} samples per second: {some} are decimated to about "
        f"{plain(rate, 4)} Hz behind an anti-alias filter, which a fit needs; rate in study.toml "
        "changes that, and rate = 0 keeps all"
    )
    return rate


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


def _house(rig: str, building: Path | str | None, device: str | None) -> Building | None:
    """Return the building of a new study with its device; None where no file is given."""
    if rig == "structure" and building is not None:
        return with_damper(read_building(building), device or "")
    if building is not None:
        raise StudyError("--building goes with --rig structure alone.")
    if device:
        raise StudyError("--device goes with --building: it names one of the building's devices.")
    return None


def _refuse_no_device(channels: Iterable[str], devices: Sequence[str]) -> None:
    """Refuse channels that were given of devices that the building does not have."""
    for channel in channels:
        if wrong := no_device(channel, devices):
            raise StudyError(f"--channel {channel}=...: {wrong}.")


def _commanded(channels: Iterable[str], device: str) -> bool:
    """Return whether a channel commands the damper, which may be a device of a building."""
    return any(at_device(name, device) in DRIVE for name in channels)


def _read(guesses: list[Guess], without: Sequence[str]) -> list[Guess]:
    """Return the guesses that are not to be left out."""
    there = [guess.channel for guess in guesses]
    if wrong := next((name for name in without if name not in there), ""):
        raise StudyError(f"--without {wrong}: no column was taken for it; {', '.join(there)} were.")
    return [guess for guess in guesses if guess.channel not in without]


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
    if "time" not in there and (why := too_few_rows(table)):
        raise StudyError(f"{table.source}: {why}. A measurement has {SHORTEST} at least.")
    wrong = []
    free = _free(table, guesses)
    if "time" not in there:
        rising = may_be_time(table, free)
        way = f"{in_unit('time', rising[0])}; or " if len(rising) == 1 else ""
        wrong.append(f"no column can be the time: {way}--step S, the sampling step in s")

    def lacks(what: str, *able: str) -> None:
        """Say what no column can be, and how one is named of those whose unit allows it."""
        way = "no other column of numbers is left"
        for channel in able:
            fit = [text for text in free if _has_unit(table, text, channel_unit(channel))]
            if fit:
                way = in_unit(channel, fit[0] if len(fit) == 1 else "COLUMN")
                way += f", and COLUMN one of {listed(fit)}" if len(fit) > 1 else ""
                break
        for text in free:
            own = table.find(text).stated
            if np.isnan(table.values[text]).all() and _may_be(table, text, what.split()[-1]):
                way = f'"{text}" holds no number at all'
            elif own and any(_may_be(table, text, quantity) for quantity in what.split()):
                way = f'"{text}" is in {own}, which is no unit of it'
                if own == "kg":
                    way += f'; a load cell shows kgf: --channel "force={text}@kgf"'
        wrong.append(f"no column can be {what}: {way}")

    if rig == "bench":
        if not there & {"displacement", "velocity"}:
            lacks("a displacement or velocity", "displacement", "velocity")
        words = next((text for text in table.not_numeric if _may_be(table, text, "force")), "")
        if "force" not in there and words:
            wrong.append(
                f'no column can be the force: "{words}" is not all numbers: '
                f"{table.not_numeric[words]}"
            )
        elif "force" not in there:
            lacks("the force", "force")
    elif not any(name.startswith(("base_", "floor", "drift")) for name in there):
        response = ("displacement", "velocity", "acceleration_absolute")
        lacks("the response of a level", *(f"base_{one}" for one in response))
    for guess in guesses:
        if not guess.unit:
            problem = table.find(guess.column).problem.removesuffix(".")
            why = (
                f'"{guess.column}": {problem}'
                if problem
                else (f'the unit of "{guess.column}" is not given')
            )
            wrong.append(f"{guess.channel}: {why}: {in_unit(guess.channel, guess.column)}")
    if wrong:
        seen = "".join(f"\n    {guess}" for guess in guesses)
        unused = [
            f"{text} ({table.not_numeric[text]})" if text in table.not_numeric else text
            for text in left_out(table, guesses)
        ]
        rest = f"\n  Not used: {listed(unused)}." if unused else ""
        raise StudyError(
            f"{table.source}: some channels cannot be guessed."
            + "".join(f"\n  {line}" for line in wrong)
            + (f"\n  The guess so far:{seen}" if seen else "")
            + rest
            + "".join(f"\n  {capital(remark, [])}." for remark in table.remarks)
        )


def _free(table: Table, guesses: Iterable[Guess]) -> list[str]:
    """Return the columns of numbers that change and are no channel."""
    taken = {guess.column for guess in guesses}
    return [
        text
        for text, values in table.values.items()
        if text not in taken and text not in table.not_numeric and len({*values.tolist()}) > 1
    ]


def _has_unit(table: Table, text: str, right: str) -> bool:
    """Return whether a column may be in a unit: it states one that converts, or none."""
    unit = table.find(text).stated
    return not unit or same_dimension(unit, right)


def _may_be(table: Table, text: str, quantity: str) -> bool:
    """Return whether a column is called a quantity."""
    column = table.find(text)
    meant = meaning(column.name, column.unit.name if column.unit else None)
    return meant is not None and meant.quantity == quantity


def refuse_other_columns(table: Table, guesses: Iterable[Guess], first: Table) -> None:
    """Refuse a table that lacks columns of the first, or has them in other units.

    Parameters
    ----------
    table : of a further run
    guesses : the columns that are used
    first : the table of the first run

    Raises
    ------
    StudyError
        Naming the column.
    """
    there = {column.text: column for column in table.columns}
    for guess in guesses:
        if guess.column not in there:
            raise StudyError(
                f'{table.source}: there is no column "{guess.column}" ({guess.channel}), as in '
                f"{first.source}; there are {listed(there)}. All runs of a study have the same "
                "columns."
            )
        doubt, of_first = there[guess.column].doubt, first.find(guess.column).doubt
        if bool(doubt) != bool(of_first):
            where, other = (table, first) if doubt else (first, table)
            raise StudyError(
                f'{where.source}: "{guess.column}": {doubt or of_first}. In {other.source} the '
                "numbers tell it. Write all files without groups of thousands."
            )
        stated, unit = there[guess.column].unit, guess.unit
        problem = there[guess.column].problem
        if problem and first.find(guess.column).unit is not None:
            raise StudyError(
                f'{table.source}: "{guess.column}": {problem} In {first.source} it is in {unit}; '
                "all runs of a study have the same units."
            )
        if stated is not None:
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


def _copies(parts: Sequence[_Part], is_test: Mapping[str, bool]) -> dict[_Part, _Part]:
    """Return the runs that repeat an earlier one, with that one: a copy tests and adds nothing.

    Parameters
    ----------
    parts : the runs
    is_test : whether the runs of a file are test runs, which must be none of the others
    """
    first: dict[tuple[str, ...], _Part] = {}
    copies: dict[_Part, _Part] = {}
    for one in parts:
        other = first.setdefault(one.digests, one)
        if other is one:
            continue
        if is_test[one.file] != is_test[other.file]:
            raise StudyError(
                f"{one.name} and {other.name} are the same measurement, and one of them is a test "
                "run: it tests nothing. Use another run, or remove one."
            )
        copies[one] = other
    if len(parts) > 1 and len(first) == 1:
        raise StudyError(
            f"{listed(one.name for one in parts)} hold the same measurement: "
            "nothing can be held out. Take runs with different motions, or one file alone."
        )
    return copies


def _copies_text(folder: Path, copies: Mapping[_Part, _Part], settings: Settings) -> Iterator[str]:
    """Yield what is done about each copy, and the command that changes it."""
    names = names_of_runs(settings)
    roles = {run.place: run.role for run in settings.runs}
    for one, other in copies.items():
        places = [(f"data/{part.file}", part.piece) for part in (one, other)]
        copy, first = (names[place] for place in places)
        role = roles.get(places[1], ROLES[0])
        swap = command("study", "roles", folder, "--exclude", first, f"--{role}", copy)
        yield (
            f"{one.name} is the same measurement as {other.name}, and is left out. To use it "
            f"instead:  {swap}"
        )


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
    model = new_model(law, drive=settings.drive or VOLTAGE.name)
    with new_folder(folder) as draft:
        for sub in ("data", "effects", "history", "reports"):
            (draft / sub).mkdir()
        for name, source in data.items():
            shutil.copyfile(source, draft / "data" / name)
        if building is not None:
            shutil.copyfile(building, draft / Path(building).name)
            model = replace(model, building=Path(building).name)
        write_settings(draft / "study.toml", settings)
        History(draft).add(Step(0, f"begin with {law}", "the study was made"), model_text(model))

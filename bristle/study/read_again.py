"""Channels of a study read in another way: proposed, checked, and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.config import toml_content
from ..core.progress import tell
from ..data.building_file import read_building
from ..data.channels import (
    ChannelSpec,
    at_device,
    channel_unit,
    device_channel,
    in_unit,
    is_channel,
    no_device,
)
from ..data.extra_channels import found_in
from ..data.guess import Guess
from ..data.read import read_table
from ..data.table import Table
from ..errors import RecordError, StudyError
from ..physics.building import paper_building
from ..units import canonical, same_dimension
from .history import Step
from .new import refuse_other_columns
from .runs import read_runs
from .study_file import TEST, RunFile, Settings, draft_of, read_settings, spec_text, with_channels

if TYPE_CHECKING:
    from .study import Study


_RESPONSE = ("base_", "floor", "drift")


@dataclass(frozen=True)
class ChannelChange:
    """A channel that is read in another way; `before`, `after` are None where it is not read."""

    channel: str
    before: ChannelSpec | None
    after: ChannelSpec | None

    @property
    def text(self) -> str:
        """How it was read and how it is from now on."""
        return f"{spec_text(self.before)} -> {spec_text(self.after)}"


@dataclass(frozen=True)
class Proposal:
    """A change of channels that is checked by one file: nothing is written yet.

    `settings` and `text` are those of the study.toml that it makes; `notes` what goes with it.
    """

    changes: tuple[ChannelChange, ...]
    settings: Settings
    text: str
    notes: tuple[str, ...]


def proposed(
    folder: Path,
    settings: Settings,
    channels: Mapping[str, ChannelSpec],
    without: Sequence[str] = (),
) -> Proposal:
    """Return what a change of channels would make of a study.toml, checked by its first run.

    Parameters
    ----------
    folder : of the study
    settings : the content of its study.toml
    channels, without : see `channel_changes.correct_channels`

    Raises
    ------
    StudyError, RecordError
        As `channel_changes.correct_channels`.
    """
    table = first_table(folder, settings)
    before = settings.channels
    asked: dict[str, ChannelSpec] = {}
    for name, spec in channels.items():
        _refuse_no_channel(folder, settings, name)
        own = at_device(name, settings.device)
        if own in asked:
            raise StudyError(f"{name} and {own} are one channel here: one of the two is right.")
        asked[own] = _resolved(table, name, spec, before.get(own))
    left_out = [_read_before(settings, name) for name in without]
    if both := [name for name in left_out if name in asked]:
        raise StudyError(f"{both[0]} is both given and left out; one of the two is right.")
    other = {name: spec for name, spec in asked.items() if not _same(table, before, name, spec)}
    after = {name: spec for name, spec in before.items() if name not in left_out} | other
    changes = tuple(
        ChannelChange(name, before.get(name), after.get(name)) for name in (*left_out, *other)
    )
    _refuse_shared(table, after, [one.channel for one in changes])
    _refuse_lacking(folder, settings, after)
    _refuse_levels(settings, after)
    extra, said = _extra(table, settings, after)
    names = [one.channel for one in changes]
    runs, excluded = (_uncorrected(some, names) for some in (settings.runs, settings.excluded))
    every = (*settings.runs, *settings.excluded)
    fewer = {
        new.place: new.corrections
        for old, new in zip(every, (*runs, *excluded), strict=True)
        if old.corrections != new.corrections
    }
    file = folder / "study.toml"
    text = with_channels(
        file.read_text(encoding="utf-8-sig"), {one.channel: one.after for one in changes}, extra,
        fewer, settings.device,
    )  # fmt: skip
    others = {**settings.extra, **extra}
    kept = {name: spec for name, spec in others.items() if spec is not None}
    made = replace(settings, channels=after, extra=kept, runs=runs, excluded=excluded)
    notes = (*_noise_notes(changes), *said, *_corrections_notes(every, names))
    return Proposal(changes, made, text, notes)


def first_table(folder: Path, settings: Settings) -> Table:
    """Return the first file of a study that is no test run's, as it is read."""
    runs = [run for run in settings.runs if run.role != TEST]
    return read_table(folder / (runs or settings.runs)[0].file, settings.split)


def devices_of(folder: Path, settings: Settings) -> tuple[list[str], list[str]]:
    """Return the levels of a study's building and its devices; none on a bench."""
    if not settings.has_building:
        return [], []
    building = toml_content(folder / "model.toml").get("building")
    if not building:
        return paper_building().levels(), []
    house = read_building(folder / str(building))
    return house.levels(), [one.name for one in house.devices]


def _refuse_no_channel(folder: Path, settings: Settings, name: str) -> None:
    if not (is_channel(name) or device_channel(name)):
        channel_unit(name)  # tells the nearest that there is
    if device_channel(name) and (wrong := no_device(name, devices_of(folder, settings)[1])):
        raise StudyError(f"--channel {name}=...: {wrong}.")


def _resolved(
    table: Table, name: str, spec: ChannelSpec, before: ChannelSpec | None
) -> ChannelSpec:
    """Return where a channel is, with the column's title and a unit."""
    if spec.step is not None:
        if name != "time" or not spec.step > 0.0:
            raise StudyError(f"{name}: a step of {spec.step:g} s; only the time has one, above 0.")
        return ChannelSpec(step=spec.step)
    column = table.find(spec.column)
    stays = before is not None and before.step is None and _column(table, before) == column.text
    unit = spec.unit or (before.unit if before is not None and stays else "")
    unit = unit or (column.unit.name if column.unit else "")
    right = channel_unit(name)
    if not unit:
        raise StudyError(
            f'{name}: the unit of "{column.text}" is not given: {in_unit(name, column.text)}'
        )
    if not same_dimension(unit, right):
        raise StudyError(
            f'{name}: "{column.text}" in {unit}: that is no unit of this quantity; {right} or the '
            "like is right."
        )
    kept = before if before is not None and stays else ChannelSpec()
    return ChannelSpec(column.text, canonical(unit), spec.sign, kept.noise, zero=kept.zero)


def _column(table: Table, spec: ChannelSpec) -> str:
    """Return the title of a channel's column, "" where it has none that is there."""
    if spec.step is not None:
        return ""
    try:
        return table.find(spec.column).text
    except RecordError:
        return ""


def _same(table: Table, channels: Mapping[str, ChannelSpec], name: str, new: ChannelSpec) -> bool:
    """Return whether a channel is read so already, in whatever words study.toml says it."""
    old = channels.get(name)
    if old is None or None not in (old.step, new.step):
        return old == new
    if old.step is not None or new.step is not None or _column(table, old) != new.column:
        return False
    stated = table.find(new.column).unit
    unit = canonical(old.unit) if old.unit else stated.name if stated else ""
    return (unit, old.sign, old.noise) == (new.unit, new.sign, new.noise)


def _read_before(settings: Settings, name: str) -> str:
    own = at_device(name, settings.device)
    if own not in settings.channels:
        raise StudyError(
            f"--without {name}: this channel is not read; those that are: "
            f"{', '.join(settings.channels)}."
        )
    return own


def _refuse_shared(
    table: Table, channels: Mapping[str, ChannelSpec], changed: Sequence[str]
) -> None:
    """Refuse a column that two channels claim, one of them anew."""
    for name in changed:
        text = _column(table, channels[name]) if name in channels else ""
        others = [one for one in channels if one != name and _column(table, channels[one]) == text]
        if text and others:
            raise StudyError(
                f'{name} and {others[0]} both claim the column "{text}". Give {others[0]} another '
                f"one, or leave it out: --without {others[0]}"
            )


def _refuse_lacking(folder: Path, settings: Settings, channels: Mapping[str, ChannelSpec]) -> None:
    """Refuse channels without one that the rig needs."""
    lacking = ""
    if "time" not in channels:
        lacking = "time, a column or a step"
    elif settings.has_building:
        if not any(name.startswith(_RESPONSE) for name in channels):
            lacking = "the response of a level, such as base_displacement"
    elif not {"displacement", "velocity"} & {*channels}:
        lacking = "displacement or velocity"
    elif "force" not in channels:
        lacking = "force"
    if lacking:
        raise StudyError(f"{folder / 'study.toml'}: the study needs {lacking}.")


def _refuse_levels(settings: Settings, channels: Mapping[str, ChannelSpec]) -> None:
    given = {name: run.name for run in settings.runs for name in run.levels}
    for name in given:
        if name in channels:
            raise StudyError(
                f"{name}: {given[name]} has a level of it in study.toml, so that it cannot be a "
                "channel as well. Remove the levels of the runs first."
            )


def _extra(
    table: Table, settings: Settings, channels: Mapping[str, ChannelSpec]
) -> tuple[dict[str, ChannelSpec | None], list[str]]:
    """Return the extra channels that come and, as None, go, and what to say of them.

    A column that is a channel now is no extra one, and one that no longer is may be, as in a study
    that is made anew.
    """

    def used(specs: Mapping[str, ChannelSpec]) -> list[str]:
        return [text for one in specs.values() if (text := _column(table, one))]

    taken = used(channels)
    gone = [name for name, spec in settings.extra.items() if _column(table, spec) in taken]
    kept = [name for name in settings.extra if name not in gone]
    known = {_column(table, settings.extra[name]) for name in kept}
    known |= {one.column for one in found_in(table, used(settings.channels), ()).values()}
    free = found_in(table, taken, (*channels, *kept))
    fresh = {name: spec for name, spec in free.items() if spec.column not in known}
    said = [f"the extra channel {name} goes: its column is a channel now" for name in gone]
    said += [
        f"{spec_text(spec)} is the extra channel {name} from now on" for name, spec in fresh.items()
    ]
    return {**dict.fromkeys(gone), **fresh}, said


def _uncorrected(runs: Sequence[RunFile], changed: Sequence[str]) -> tuple[RunFile, ...]:
    """Return runs without the corrections of channels that change: they were found in others."""
    return tuple(
        replace(run, corrections=tuple(c for c in run.corrections if c.channel not in changed))
        for run in runs
    )


def _corrections_notes(runs: Sequence[RunFile], changed: Sequence[str]) -> list[str]:
    said = []
    for run in runs:
        texts = [one.text for one in run.corrections if one.channel in changed]
        if texts:
            said.append(
                f"{run.name} is no longer corrected ({'; '.join(texts)}): that was found in the "
                "channel as it was read; bristle study check finds what is wrong now"
            )
    return said


def _noise_notes(changes: Sequence[ChannelChange]) -> list[str]:
    said = []
    for one in changes:
        if one.before is None or one.after is None or one.before.noise is None:
            continue
        if one.after.noise is None:
            said.append(f"noise of {one.channel} was given for another column: it is estimated")
        elif one.before.unit != one.after.unit:
            said.append(f"noise of {one.channel} is {one.after.noise:g} {one.after.unit} now")
    return said


# Channels of a study that exists are read in another way: columns, units and signs corrected.


@dataclass(frozen=True)
class CorrectedChannels:
    """Channels that are read in another way now, and the steps of the history `of_before`.

    `step` is the one with which the model begins anew; None where no model was from the data, or
    nothing was written.
    """

    changes: tuple[ChannelChange, ...]
    notes: tuple[str, ...]
    of_before: tuple[Step, ...] = ()
    step: Step | None = None


def correct_channels(
    study: Study,
    channels: Mapping[str, ChannelSpec],
    *,
    without: Sequence[str] = (),
    write: bool = True,
) -> CorrectedChannels:
    """Read channels of a study in another way; where anything is wrong it stays as it was.

    Fits and verdict were of the data as they were read: they stay in the history alone, and the
    model is the last one that was from no data, as a new step.

    Parameters
    ----------
    study : Study
        The folder, opened.
    channels : mapping
        Where channels are from now on: column, unit, sign. A unit that is not given is that of the
        column's title, or stays where the column does.
    without : sequence of str
        Channels that are no longer read.
    write : bool
        Whether study.toml is written; else it is told what would change.

    Raises
    ------
    StudyError
        If there is no such channel, a unit is not that of its quantity, two channels claim one
        column, or a channel that the rig needs would be missing.
    RecordError
        If a file has no such column, or cannot be read by it.
    """
    with study.writing():
        file = study.folder / "study.toml"
        made = proposed(study.folder, read_settings(file), channels, without)
        gone = tuple(study.history.of_data())
        if made.changes:
            _refuse_unreadable(study.folder, made)
        if not (made.changes and write):
            return CorrectedChannels(made.changes, made.notes, gone)
        with draft_of(file, made.text) as draft:
            _refuse_other(draft, made)
        step = study.history.begin_anew(", ".join(one.channel for one in made.changes))
    return CorrectedChannels(made.changes, made.notes, gone, step)


def _refuse_unreadable(folder: Path, made: Proposal) -> None:
    """Refuse channels by which a run of the study cannot be read."""
    tell("reading all runs")
    settings = made.settings
    first = first_table(folder, settings)
    columns = [
        Guess(one.channel, one.after.column, one.after.unit, one.after.sign, "")
        for one in made.changes
        if one.after is not None and one.after.step is None
    ]
    for file in dict.fromkeys(run.file for run in settings.runs):
        refuse_other_columns(read_table(folder / file, settings.split), columns, first)
    read_runs(folder, settings)


def _refuse_other(draft: Path, made: Proposal) -> None:
    """Refuse a study.toml that says anything else than what was checked."""
    there, right = read_settings(draft), made.settings
    same = (
        there.channels == right.channels and there.extra == right.extra
        and there.runs == right.runs and there.excluded == right.excluded
    )  # fmt: skip
    if not same:
        raise StudyError(
            f"{draft.with_name('study.toml')}: its tables stand in an order in which the channels "
            "cannot be changed by a command. Change [channels] by hand."
        )

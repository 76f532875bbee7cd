"""What a researcher has at hand, as runs and a model: files, frames, arrays, measurements."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

import numpy as np
from numpy.typing import ArrayLike

from ..core.text import listed, unknown, written
from ..data.building_file import read_building
from ..data.channels import ChannelSpec, channel_unit, device_channel, is_channel
from ..data.guess import Guess, guess_channels, specs
from ..data.measurement import Measurement, is_part, measurements_of, names_of_files, stem_of
from ..data.read import files_in, read_table
from ..data.table import Table, from_arrays, table_from_frame
from ..errors import RecordError, StudyError
from ..model.model import Model, new_model
from ..model.model_file import read_model
from ..physics.building import Building, with_damper
from ..physics.effect import EFFECTS
from ..physics.laws import law_names
from .identify import Identified, refuse_effect
from .new import parse_channel
from .run_facts import a_third
from .runs import Runs, refuse_twins, split_in_time, twins_within, usable

if TYPE_CHECKING:
    import pandas as pd

Source: TypeAlias = Union[str, Path, "pd.DataFrame", Mapping[str, ArrayLike], Measurement]
"""One run, or of a pattern such as "lab/*.csv" several."""
Data: TypeAlias = Source | Sequence[Source] | Mapping[str, Source]
"""One run or several; the keys of a mapping are then their names."""
Channels: TypeAlias = Mapping[str, str | ChannelSpec]
"""Where channels are: {"force": "-Ch3@kN"}, as `--channel force=-Ch3@kN` says it."""
Given: TypeAlias = str | Path | Model | Identified
"""A law by its name, a model.toml, or a model."""

_RIGHT = (
    "a file, a pattern of files, a pandas frame, a mapping of channels to arrays, a Measurement, "
    "or a list of them"
)


def measurements(
    data: Data,
    channels: Channels | None = None,
    called: str = "run",
    building: Building | None = None,
) -> list[Measurement]:
    """Return the measurements in what was given, in SI.

    Parameters
    ----------
    data : path, pattern, frame, mapping of arrays, Measurement, or several
        Columns and keys are named by channel: `time`, `displacement`, `velocity`, `voltage` or
        `current`, `force` ..., with the unit in brackets, "force [kN]", or in SI. What other
        columns are is guessed, and the measurement's notes say how.
    channels : mapping, optional
        Channel to "COLUMN@UNIT", a minus before it turns the sign; then nothing is guessed.
    called : str
        What runs without a name of their own are called.
    building : Building, optional
        The building whose levels channels may be of, where they are guessed.

    Raises
    ------
    RecordError
        If there is nothing, a type is not one that is read, or a file cannot be read.
    StudyError
        If `channels` cannot be read.
    """
    given = _specs(channels)
    found: list[Measurement] = []
    for name, source in _sources(data, called):
        if isinstance(source, Measurement):
            found.append(source)
            continue
        for table in _tables(name, source):
            found += _read(table, given, building)
    if not found:
        raise RecordError("no run is given; one run or more is right.")
    return found if building is None else [one.at_device(building.studied) for one in found]


def _read(
    table: Table, given: dict[str, ChannelSpec] | None, building: Building | None
) -> list[Measurement]:
    """Return the measurements of a table; what is wrong is told in terms of Python."""
    guesses: list[Guess] = []
    if given is None:
        given = _by_name(table, building)
        guesses = _others(table, given, building)
        given = {**given, **specs(table, guesses)}
    try:
        found = measurements_of(table, given)
    except RecordError as error:
        if "[channels" not in str(error):
            raise
        hint = 'Here channels={"force": "COLUMN@UNIT"} replaces [channels.force] of a study.'
        raise RecordError(f"{error} {hint}") from None
    notes = [f"guessed: {guess}" for guess in guesses]
    return [replace(one, notes=(*one.notes, *notes)) for one in found]


def _others(
    table: Table, named: Mapping[str, ChannelSpec], building: Building | None
) -> list[Guess]:
    """Return what the columns seem to be that are not named by channel."""
    taken = {spec.column for spec in named.values()}
    if taken == {column.text for column in table.columns}:
        return []
    levels = None if building is None else building.levels()
    rig = "bench" if building is None else "structure"
    guesses = guess_channels(table, rig, levels, None if building is None else names_in(building))
    # Beside channels by name a column without a unit is no channel, as likely as not.
    alone = "time" not in named or len(named) == 1
    return [
        guess
        for guess in guesses
        if guess.channel not in named and guess.column not in taken and (guess.unit or alone)
    ]


def runs_of(train: list[Measurement], holdout: list[Measurement]) -> Runs:
    """Return runs to fit to and runs to judge on.

    Where none is given to judge on, a single run is split in time, 70 to 30 %, and of several a
    third is held out, as in a new study.

    Raises
    ------
    StudyError
        If a run that is held out is also one to fit to.
    """
    named = _with_own_names([*train, *holdout])
    train, idle = usable(named[: len(train)])
    holdout, other = usable(named[len(train) :])
    notes = (*idle, *other, *_guessed([*train, *holdout]))
    if not holdout:
        sources = list(dict.fromkeys(one.source for one in train))
        if len(sources) == 1:
            split = split_in_time(train)
            return Runs(split.train, split.holdout, (*split.notes, *notes))
        held, which = a_third(sources)
        judged = {sources[k] for k in held}
        holdout = [one for one in train if one.source in judged]
        train = [one for one in train if one.source not in judged]
        names = listed(one.name for one in holdout)
        note = f"{which} is held out: {names}. holdout=... names others."
        notes = (note[0].upper() + note[1:], *notes)
    refuse_twins(train, holdout)
    return Runs(train, holdout, (*notes, *twins_within(train), *twins_within(holdout)))


def _with_own_names(runs: Sequence[Measurement]) -> list[Measurement]:
    """Return runs of which no two have one name, as far as their files have other ones."""
    files = list(dict.fromkeys(run.source for run in runs))
    names = dict(zip(files, names_of_files(files), strict=True))
    return [
        replace(run, name=names[run.source] + run.name.removeprefix(stem))
        if is_part(run.name, stem := stem_of(run.source))
        else run
        for run in runs
    ]


def model_of(given: Given | None, effects: str | Sequence[str], default: str) -> Model:
    """Return the model that was named or given, with more effects.

    Parameters
    ----------
    given : a law's name, the path of a model.toml, a Model, what `identify` returned, or None
    effects : names of effects that come on top
    default : the law where nothing is given

    Raises
    ------
    StudyError
        If there is no such law or effect, it cannot join, or the file is wrong.
    """
    model = _model(default if given is None else given)
    for name in names_of(effects):
        refuse_effect(model, name, bench=not model.building)
        model = model.with_effect(name)
    return model


def names_of(effects: str | Sequence[str]) -> tuple[str, ...]:
    """Return names of effects, one or several, that are known; StudyError with the nearest."""
    names = (effects,) if isinstance(effects, str) else effects
    if not isinstance(names, Sequence):
        raise StudyError(f"effects is {told(names)}; a list of names is right.")
    for name in names:
        if not isinstance(name, str) or name not in EFFECTS:
            raise StudyError(unknown("effect", str(name), sorted(EFFECTS)))
    return tuple(names)


def building_from(
    given: str | Path | Building | None, device: str | None = None
) -> Building | None:
    """Return the building that was given, or that in a file, with the device that is identified.

    Parameters
    ----------
    given : a building or its file; None for a test bench
    device : name of one of its devices; None for the only one, or the damper on the first level

    Raises
    ------
    StudyError
        If the building is of another type, or a device is named without one.
    PhysicsError
        If the file is wrong, or it is not clear which device is meant.
    """
    if given is None:
        if device:
            raise StudyError(
                f"device is {told(device)}: it names one of a building, and none is given."
            )
        return None
    if device is not None and not isinstance(device, str):
        raise StudyError(f"device is {told(device)}; the name of one of the building's is right.")
    if isinstance(given, Building):
        return with_damper(given, device or "")
    if not isinstance(given, str | Path):
        raise StudyError(f"building is {told(given)}; a building's file is right.")
    return with_damper(read_building(given), device or "")


def names_in(building: Building) -> list[str]:
    """Return the names of a building's devices, the one that is identified first."""
    names = [device.name for device in building.devices]
    return sorted(names, key=lambda name: name != building.studied)


def _model(given: object) -> Model:
    if isinstance(given, Identified):
        return given.model
    if isinstance(given, Model):
        return given
    if isinstance(given, Path) or (isinstance(given, str) and given.endswith(".toml")):
        return read_model(Path(given))
    if not isinstance(given, str):
        raise StudyError(
            f"a model is {told(given)}; a law's name, a model.toml or what identify returned "
            "is right."
        )
    if given not in law_names():
        raise StudyError(unknown("law", given, law_names()))
    return new_model(given)


def _sources(data: object, called: str) -> Iterable[tuple[str, Any]]:
    """Yield the runs with their names."""
    if isinstance(data, Mapping) and data and all(map(_is_run, data.values())):
        yield from ((str(name), source) for name, source in data.items())
    elif isinstance(data, list | tuple):
        yield from ((f"{called} {number}", source) for number, source in enumerate(data, 1))
    else:
        yield called, data


def _is_run(value: object) -> bool:
    """Return whether a mapping's value is a run of its own, and no channel."""
    return isinstance(value, str | Path | Mapping | Measurement) or hasattr(value, "columns")


def _tables(name: str, source: object) -> list[Table]:
    if isinstance(source, str | Path):
        return [read_table(file) for file in _files(source)]
    if isinstance(source, Mapping):
        return [_of_arrays(source, name)]
    if hasattr(source, "columns") and hasattr(source, "to_numpy"):
        return [table_from_frame(source, name)]  # type: ignore[arg-type]  # pandas stays unloaded
    raise RecordError(f"{name} is {told(source)}; {_RIGHT} is right.")


def _files(given: str | Path) -> list[Path]:
    """Return the file, or the files of a pattern in order."""
    path = Path(given)
    if path.is_dir():
        return files_in(path)
    if path.exists() or not glob.has_magic(str(given)):
        return [path]
    # Path.glob takes no absolute pattern.
    found = sorted(Path(one) for one in glob.glob(str(given)))  # noqa: PTH207
    if not found:
        raise RecordError(f"{given}: no file has a name of this pattern.")
    return found


def _of_arrays(columns: Mapping[str, ArrayLike], name: str) -> Table:
    """Return the table of named arrays; RecordError if they are not rows of one table."""
    arrays = {}
    for title, values in columns.items():
        try:
            arrays[str(title)] = np.asarray(values)
        except ValueError as error:
            raise RecordError(f'{name}: "{title}" is no array of numbers ({error}).') from None
    if not arrays:
        raise RecordError(f"{name}: there is no channel; time and force, at the least, are right.")
    for title, array in arrays.items():
        if array.ndim != 1:
            raise RecordError(
                f'{name}: "{title}" has the shape {array.shape}; one number per sample is right.'
            )
    sizes = {title: len(array) for title, array in arrays.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{title} {size}" for title, size in sizes.items())
        raise RecordError(f"{name}: channels differ in their number of samples: {listed}.")
    return from_arrays(arrays, name)


def _by_name(table: Table, building: Building | None) -> dict[str, ChannelSpec]:
    """Return where the channels are that columns are named by; RecordError for an unknown unit."""
    found = {}
    devices = [] if building is None else names_in(building)
    for column in table.columns:
        of_device = device_channel(column.name)
        if not (is_channel(column.name) or (of_device and of_device[0] in devices)):
            continue
        unit = "" if column.unit else channel_unit(column.name)
        if unit and column.text.strip() != column.name:
            raise RecordError(
                f'{table.source}: "{column.text}": its unit is not known; '
                f'"{column.name} [{unit}]" is right, or another unit of that kind.'
            )
        found[column.name] = ChannelSpec(column.text, unit)
    return found


def _specs(channels: Channels | None) -> dict[str, ChannelSpec] | None:
    if channels is None:
        return None
    if not isinstance(channels, Mapping):
        raise StudyError(
            f'channels is {told(channels)}; a mapping such as {{"force": "Ch3@kN"}} is right.'
        )
    found = {}
    for channel, place in channels.items():
        if isinstance(place, ChannelSpec):
            found[channel] = place
            continue
        if not isinstance(place, str):
            raise StudyError(
                f"channels: {channel} is {told(place)}; a text such as Ch3@kN is right."
            )
        text = f"{channel}={place}"
        try:
            found[channel] = parse_channel(text)[1]
        except StudyError as error:
            raise StudyError(str(error).replace("--channel", "channels:", 1)) from None
    return found


def told(value: object) -> str:
    """Return the words for a value of a wrong type: itself, or its type where it is large."""
    plain = value is None or isinstance(value, bool | int | float | str)
    return written(value) if plain else f"of the type {type(value).__name__}"


def _guessed(runs: Sequence[Measurement]) -> list[str]:
    """Return the guesses of channels, each once."""
    texts = [note for run in runs for note in run.notes if note.startswith("guessed: ")]
    return list(dict.fromkeys(texts))

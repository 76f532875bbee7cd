"""View 1, Data: the runs as time traces, their channels and roles, where they have been."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..core.finding import grouped, sentence
from ..core.text import scale
from ..data.building_file import read_building
from ..data.channels import channel_unit
from ..data.checks.motion import velocity_of_run
from ..data.cut_off import LONG
from ..data.guess import Guess, guess_channels, left_out
from ..data.measurement import Measurement
from ..data.noise import stretches
from ..data.read import files_in, read_table
from ..data.table import Table
from ..errors import BristleError, RecordError, StudyError
from ..physics.building import with_damper
from ..study.data_check import check_data
from ..study.new import parse_channel
from ..study.read_again import devices_of, first_table, proposed
from ..study.rig import Place, place_of_damper
from ..study.runs import place_of_run, read_runs
from ..study.study import Study
from ..study.study_file import TEST, Settings, spec_text
from ..study.view import channel_ranges
from ..units import same_dimension

POINTS = 2400
"""Points of a trace that are sent: more than a screen has columns to show them."""
DOTS = 4000
"""Points of the excitation map over all runs."""


def data_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 1 shows of a study before anything is checked: `check_view` tells the rest.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError
        If the study or a file of it cannot be read.
    """
    study = Study(folder)
    runs = study.read()
    place = place_of_damper(study, runs) if study.settings.has_building else Place()
    settings = study.settings
    return {
        "title": settings.title, "rig": settings.rig, "notes": settings.notes,
        "channels": _channel_rows(study, runs),
        "files": [
            {"name": run.name, "file": run.file, "role": run.role}
            for run in (*settings.runs, *settings.excluded)
        ],
        "runs": [
            {**_run(run), "role": _role(study, run), "excitation": _excitation(run, place)}
            for run in runs
        ],
    }  # fmt: skip


def _channel_rows(study: Study, runs: Sequence[Measurement]) -> list[dict[str, Any]]:
    """Return a row per channel: where it is in the files, its range and noise in the unit shown."""
    specs = study.settings.channels
    return [
        {
            **one._asdict(), "column": spec.column if (spec := specs.get(one.name)) else "",
            "in_file": spec.unit if spec else "", "turned": spec is not None and spec.sign < 0,
        }
        for one in channel_ranges(runs)
    ]  # fmt: skip


def _role(study: Study, run: Measurement) -> str:
    """Return the role of a measured run; that of the file where one run is split in time."""
    place = place_of_run(study.folder, study.settings, run.name)
    roles = [one.role for one in study.settings.runs if one.place == place]
    return roles[0] if roles else TEST


def _run(run: Measurement) -> dict[str, Any]:
    rows = thinned(run.time, run.channels)
    return {
        "name": run.name, "seconds": run.duration, "rate": run.sampling.rate,
        "samples": len(run.time), "time": run.time[rows],
        "channels": {name: values[rows] for name, values in run.channels.items()},
        "gaps": spans(run.time, ~run.measured),
    }  # fmt: skip


def spans(time: Array, flags: NDArray[np.bool_]) -> list[list[float]]:
    """Return the first and last time [s] of each stretch of samples that are flagged."""
    return [[float(time[a]), float(time[b - 1])] for a, b in stretches(flags)]


def thinned(time: Array, channels: Mapping[str, Array], points: int = POINTS) -> NDArray[np.int64]:
    """Return the rows of a run that a trace needs: all, or the extremes of each channel in bins.

    Parameters
    ----------
    time : (n,) s
    channels : (n,) each
    points : how many a trace may have, about
    """
    count = len(time)
    if count <= points:
        return np.arange(count)
    bins = max(2, points // (2 * max(1, len(channels))))
    edges = np.linspace(0, count, bins + 1).astype(np.int64)
    rows = {0, count - 1}
    for values in channels.values():
        for a, b in itertools.pairwise(edges):
            rows |= {int(a + np.argmin(values[a:b])), int(a + np.argmax(values[a:b]))}
    return np.array(sorted(rows))


def _excitation(run: Measurement, place: Place) -> dict[str, Any] | None:
    """Return where a run has been: displacement, velocity and command; None without motion."""
    level = "" if not place.level else place.level
    seen = place.seen(run)
    x = seen.channels.get(f"{level}_displacement" if level else "displacement")
    v = velocity_of_run(seen, level)
    if x is None or v is None:
        return None
    rows = np.linspace(0, len(x) - 1, min(len(x), DOTS // 4)).astype(np.int64)
    drive = run.channels.get(run.drive) if run.drive else None
    return {
        "x": x[rows], "v": v[rows], "drive": run.drive,
        "level": drive[rows] if drive is not None else None,
    }  # fmt: skip


# View 1, Data: what the data check finds, and where in the runs a channel is cut off.


def check_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the data check of a study finds.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError
        As `check_data`.
    """
    found = check_data(Study(folder))
    clipped = {(one.run, one.channel) for one in found.findings if one.kind == "clipping"}
    return {
        "ok": found.ok,
        "findings": [
            {
                "kind": finding.kind, "level": finding.level, "channel": finding.channel,
                "run": finding.run, "text": sentence(finding, runs), "do": finding.do,
                "can_correct": bool(finding.fixes),
            }
            for finding, runs in grouped(found.findings)
        ],
        "clipped": [
            {
                "run": run.name, "channel": channel,
                "spans": spans(run.time, at_extreme(run[channel])),
            }
            for run in found.runs
            for channel in run.channels if (run.name, channel) in clipped
        ],
    }  # fmt: skip


def at_extreme(values: Array) -> NDArray[np.bool_]:
    """Return the samples (n,) in stretches of equal ones at an extreme, of a clipped channel."""
    flags = np.zeros(len(values), dtype=np.bool_)
    for extreme in (values.max(), values.min()):
        for a, b in stretches(values == extreme):
            flags[a:b] |= b - a >= LONG
    return flags


# The channels of a study: its columns as traces, and what another choice would make of them.
#
# It is what `bristle study channels` would read and refuse, without writing anything.


def channels_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a study's first run, as its study.toml reads them.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError
        If the study or its first file cannot be read.
    """
    study = Study(folder)
    settings = study.settings
    table = first_table(folder, settings)
    levels, devices = devices_of(folder, settings)
    rig = "structure" if settings.has_building else "bench"
    guessed = {one.column: one for one in guess_channels(table, rig, levels or None, devices)}
    taken = {}
    for name, spec in settings.channels.items():
        if spec.step is not None:
            continue
        column = table.find(spec.column)
        unit = spec.unit or (column.unit.name if column.unit else "")
        guess = guessed.get(column.text)
        own = Guess(name, column.text, unit, spec.sign, "")
        alike = guess is not None and replace(guess, reason="", doubt="") == own
        taken[column.text] = guess if guess is not None and alike else own
    known = known_channels(levels, devices)
    return {
        "first": Path(table.source).name, "columns": columns_of(table, taken), "known": known,
        "extra": {spec.column: name for name, spec in settings.extra.items()},
    }  # fmt: skip


def preview_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what other channels would change: each before and after, as a trace of the first run.

    Parameters
    ----------
    folder : of the study
    arguments : `channels` as --channel takes them, `without` those that are left out

    Raises
    ------
    StudyError, RecordError
        As `bristle study channels`, as far as the first run tells.
    """
    study = Study(folder)
    given = [parse_channel(text) for text in _texts(arguments, "channels")]
    channels = dict(given)
    if len(channels) < len(given):
        raise StudyError("a channel is given twice; once is right.")
    made = proposed(folder, study.settings, channels, _texts(arguments, "without"))
    before, after = (_first_run(folder, one) for one in (study.settings, made.settings))
    return {
        "changes": [
            {
                "channel": one.channel, "before": spec_text(one.before),
                "after": spec_text(one.after),
                "traces": [_trace(run, one.channel) for run in (before, after)],
            }
            for one in made.changes
        ],
        "notes": list(made.notes), "results": [one.what for one in study.history.of_data()],
    }  # fmt: skip


def _texts(arguments: Mapping[str, Any], key: str) -> list[str]:
    texts = arguments.get(key, [])
    if not isinstance(texts, list) or not all(isinstance(one, str) for one in texts):
        raise StudyError(f"{key}: a list of texts is right.")
    return texts


def _first_run(folder: Path, settings: Settings) -> Measurement:
    """Return the first run of a study, or its first piece, as these settings read it."""
    run = next((one for one in settings.runs if one.role != TEST), settings.runs[0])
    return read_runs(folder, replace(settings, runs=(run,)))[0]


def _trace(run: Measurement, channel: str) -> dict[str, Any] | None:
    """Return a channel over time in the unit that it is shown in; None where it is not read."""
    if channel not in run.channels:
        return None
    values = run[channel]
    rows = thinned(run.time, {channel: values})
    factor, unit = scale(run.units[channel], float(abs(values).max()))
    return {
        "time": run.time[rows], "values": values[rows], "factor": factor, "unit": unit,
        "low": factor * float(values.min()), "high": factor * float(values.max()),
    }  # fmt: skip


# Files before they are a study: their columns as traces, and which channel each is guessed to be.
#
# It is what `bristle study new` would read, without making anything.


SHOWN = 24
"""Columns that are drawn of a file."""
USUAL = (
    "s", "ms", "min", "m", "mm", "cm", "um", "in", "ft", "m/s", "mm/s", "cm/s", "in/s", "m/s2",
    "mm/s2", "cm/s2", "g", "N", "kN", "MN", "lbf", "kip", "V", "mV", "A", "mA", "%", "1", "T", "mT",
)  # fmt: skip
"""Units that a menu offers, each where it is one of the quantity; any other may be written."""


def columns_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is read of dropped files.

    Parameters
    ----------
    folder : of the files
    arguments : `building` the name of a building's file among them, "" on a bench

    Raises
    ------
    RecordError, PhysicsError
        If no file can be read, or the building cannot.
    """
    files = files_in(folder)
    levels: list[str] | None = None
    devices: list[str] = []
    if name := str(arguments.get("building", "")):
        house = with_damper(read_building(folder / "building" / Path(name).name), "")
        levels, devices = house.levels(), [one.name for one in house.devices]
    tables: list[Table] = []
    read: list[dict[str, Any]] = []
    for file in files:
        try:
            table = read_table(file)
        except BristleError as error:
            read.append({"name": file.name, "rows": 0, "error": _plainly(str(error), folder)})
            continue
        tables.append(table)
        read.append({"name": file.name, "rows": table.rows, "error": ""})
    if not tables:
        raise RecordError(read[0]["error"])
    first = tables[0]
    rig = "structure" if levels else "bench"
    guesses = guess_channels(first, rig, levels, devices)
    chosen = {guess.column: guess for guess in guesses}
    return {
        "files": read, "first": Path(first.source).name, "rig": rig,
        "columns": columns_of(first, chosen), "unused": left_out(first, guesses),
        "known": known_channels(levels or [], devices),
    }  # fmt: skip


def columns_of(table: Table, taken: Mapping[str, Guess]) -> list[dict[str, Any]]:
    """Return a row per column of a file: its trace, and what it is taken for and why.

    Parameters
    ----------
    table : what the file holds
    taken : by the title of the column, which channel it is
    """
    numeric = {
        column.text: np.asarray(table.values[column.text], dtype=float)
        for column in table.columns if column.text in table.values
    }  # fmt: skip
    rows = thinned(np.arange(table.rows, dtype=float), dict(list(numeric.items())[:SHOWN]))
    return [
        {
            "text": column.text, "unit": column.unit.name if column.unit else "",
            "values": numeric[column.text][rows] if column.text in numeric else None,
            "channel": guess.channel if (guess := taken.get(column.text)) else "",
            "guessed_unit": guess.unit if guess else "", "sign": guess.sign if guess else 1,
            "reason": guess.reason if guess else "", "doubt": guess.doubt if guess else "",
        }
        for column in table.columns
    ]  # fmt: skip


def _plainly(text: str, folder: Path) -> str:
    """Return a message without the folder that dropped files are kept in."""
    return text.replace(f"{folder}/", "")


def known_channels(levels: list[str], devices: list[str]) -> list[dict[str, Any]]:
    """Return the channels that a column may be: name, SI unit, and the units to choose from."""
    names = ["time", "displacement", "velocity", "acceleration", "force", "voltage", "current"]
    if levels:
        own = [f"{level}_{what}" for level in levels for what in
               ("displacement", "velocity", "acceleration_absolute")]  # fmt: skip
        of_devices = [f"{one}_{what}" for one in devices for what in ("force", "voltage")]
        names = ["time", "ground_acceleration", *own, "force", "voltage", "current", *of_devices]
    return [{"name": name, **_units(channel_unit(name))} for name in names]


def _units(unit: str) -> dict[str, Any]:
    """Return the SI unit of a channel, and the ones that its files are in now and then."""
    usual = [one for one in USUAL if same_dimension(one, unit)]
    return {"unit": unit, "units": list(dict.fromkeys((unit, *usual)))}

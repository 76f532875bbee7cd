"""The channels of a study: its columns as traces, and what another choice would make of them.

It is what `bristle study channels` would read and refuse, without writing anything.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.text import scale
from ..data.guess import Guess, guess_channels
from ..data.measurement import Measurement
from ..errors import StudyError
from ..study.history import results_of
from ..study.new import parse_channel
from ..study.read_again import devices_of, first_table, proposed
from ..study.runs import read_runs
from ..study.study import Study
from ..study.study_file import TEST, Settings, spec_text
from .columns_view import columns_of, known_channels
from .data_view import thinned


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
        "results": results_of(folder).sentences(),
    }  # fmt: skip


def preview(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
    results = results_of(folder)
    return {
        "changes": [
            {
                "channel": one.channel, "before": spec_text(one.before),
                "after": spec_text(one.after),
                "traces": [_trace(run, one.channel) for run in (before, after)],
            }
            for one in made.changes
        ],
        "notes": list(made.notes), "results": results.sentences(), "beside": results.beside_text(),
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

"""The tables of a study's report: parameters, data, noise, errors, evidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..data.labels import label_text
from ..physics.laws import LAWS
from ..quantity import percent, plain, quantity
from ..quantity import with_interval as with_interval
from ..study.reading import names_of_runs, place_of_run
from ..study.run_file import TEST

if TYPE_CHECKING:
    from ..data.measurement import Measurement
    from ..data.model import StudyModel, Value
    from ..study.study import Study

_RANKED = 8
_COLOURS = {
    "white": "estimated from the samples: white",
    "low-passed": "estimated from the samples: white, low-passed above",
    "blue": "estimated from the samples: it grows with frequency, so this is an upper limit",
    "resting": "estimated where the channel is at rest",
    "slow": "estimated where the channel moves slowest: hard to separate from the signal",
    "hidden": "estimated: hard to separate from the signal, so this is a lower limit",
    "rough": "estimated: the signal itself is rough, so this is an upper limit",
    "none": "none seen",
}


def parameter_table(model: StudyModel, drive: str) -> tuple[list[str], list[list[str]], list[str]]:
    """Return header, rows and notes of a model's parameters with their 95 % intervals.

    Without a command (`drive` "") those that act through one alone are left out.
    """
    header = ["parameter", "value", "95 % interval", "unit", "origin", "what it is"]
    rows, edges = [], []
    driven = LAWS[model.law].driven() if not drive and model.law in LAWS else ()
    flat = {name: value for name, value in model.flat().items() if name not in driven}
    for name, value in flat.items():
        text, half = with_interval(value.value, value.std)
        origin = value.origin if value.free else f"{value.origin}, held"
        rows.append([name, text, half, "" if value.unit == "1" else value.unit, origin,
                     model.declared(name).text])  # fmt: skip
        if value.free and value.std is not None and _at_bound(value):
            edges.append(name)
    notes = [
        "Intervals: 1.96 standard deviations, the noise of force and measured motion both counted."
    ]
    if edges:
        notes.append(f"{', '.join(edges)}: at a bound of the fit, so the interval means little.")
    silent = [n for n, v in flat.items() if v.free and v.std is None and v.origin == "assumed"]
    if silent:
        notes.append(f"Not identified by these data: {', '.join(silent)}.")
    return header, rows, notes


def _at_bound(value: Value) -> bool:
    """Return whether a value stands at a bound, as far as its own size and interval can tell.

    The range tells nothing: that of a stiffness spans nine orders of magnitude.
    """
    room = max(1e-6 * abs(value.value), 1e-2 * (value.std or 0.0))
    return value.value <= value.low + room or value.value >= value.high - room


def data_table(study: Study, measured: Sequence[Measurement]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows: a line per run, or per piece where gaps have cut it."""
    roles = _roles(study, measured)
    labelled = any(run.labels or run.levels for run in study.settings.runs)
    header = ["run", "role", "duration [s]", "rate [Hz]", "samples", "channels"]
    header += ["known"] if labelled else []
    rows = []
    for run in measured:
        rows.append(
            [
                run.name, roles[run.name], plain(run.duration, 4),
                plain(run.sampling.rate, 5), str(len(run.time)), ", ".join(run.channels),
                *([_known(study, run)] if labelled else []),
            ]
        )  # fmt: skip
    names = names_of_runs(study.settings)
    for one in study.settings.excluded:
        rows.append([names[one.file, one.piece], "left out", *["-"] * (len(header) - 2)])
    return header, rows


def _roles(study: Study, measured: Sequence[Measurement]) -> dict[str, str]:
    """Return what each measurement is for, by its name, as the report calls it."""
    settings = study.settings
    listed = {(run.file, run.piece): run.role for run in settings.runs}
    roles = {one.name: listed[place_of_run(study.folder, settings, one.name)] for one in measured}
    if sum(role != TEST for role in listed.values()) == 1:  # it is split in time
        split = study.runs()
        roles |= {one.name: "train" for one in split.train}
        roles |= {one.name: "holdout" for one in split.holdout}
    return {name: "held out" if role == "holdout" else role for name, role in roles.items()}


def _known(study: Study, run: Measurement) -> str:
    """Return what is known of a whole run: "current 1 A, temperature 40 °C"."""
    levels = {name for one in study.settings.runs for name in one.levels}
    own = {name: float(run[name][0]) for name in sorted(levels) if run.has(name)}
    texts = [f"{name} {label_text(name, level, run.units[name])}" for name, level in own.items()]
    return ", ".join([*texts, *(f"{n} {label_text(n, y)}" for n, y in run.labels.items())])


def data_words(measured: Sequence[Measurement]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows: the noise of each channel over all runs, and how it was found."""
    header = ["channel", "noise", "of its RMS", "how it was found"]
    rows = []
    for channel in dict.fromkeys(name for run in measured for name in run.channels):
        having = [run for run in measured if channel in run.channels]
        noise = float(np.median([run.noise.get(channel, 0.0) for run in having]))
        size = float(np.median([np.std(run[channel]) for run in having]))
        facts = [run.noise_facts.get(channel) for run in having]
        found = dict.fromkeys(
            "given" if f is None else _COLOURS.get(f.colour, f.colour) for f in facts
        )
        unit = having[0].units[channel]
        of = percent(noise / size, 2) if size > 0.0 else "-"
        rows.append([channel, quantity(noise, unit, fine=True), of, "; ".join(found)])
    return header, rows

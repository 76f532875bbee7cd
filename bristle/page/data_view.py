"""View 1, Data: the runs as time traces, their channels and roles, where they have been."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.text import scale
from ..data.checks.motion import velocity_of_run
from ..data.measurement import Measurement
from ..data.noise import stretches
from ..study.rig import Place, place_of_damper
from ..study.runs import place_of_run
from ..study.study import Study
from ..study.study_file import TEST

Array = NDArray[np.float64]

POINTS = 2400
"""Points of a trace that are sent: more than a screen has columns to show them."""
DOTS = 4000
"""Points of the excitation map over all runs."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
        "channels": _channels(study, runs),
        "files": [
            {"name": run.name, "file": run.file, "role": run.role}
            for run in (*settings.runs, *settings.excluded)
        ],
        "runs": [
            {**_run(run), "role": _role(study, run), "excitation": _excitation(run, place)}
            for run in runs
        ],
    }  # fmt: skip


def _channels(study: Study, runs: Sequence[Measurement]) -> list[dict[str, Any]]:
    """Return a row per channel: where it is in the files, its range and noise in the unit shown."""
    rows = []
    for name in dict.fromkeys(name for run in runs for name in run.channels):
        there = [run for run in runs if name in run.channels]
        low = min(float(run[name].min()) for run in there)
        high = max(float(run[name].max()) for run in there)
        factor, unit = scale(there[0].units[name], max(abs(low), abs(high)))
        spec = study.settings.channels.get(name)
        noise = float(np.median([run.noise.get(name, 0.0) for run in there]))
        rows.append(
            {
                "name": name, "unit": unit, "factor": factor, "low": factor * low,
                "high": factor * high, "noise": factor * noise,
                "column": spec.column if spec else "", "in_file": spec.unit if spec else "",
                "turned": spec is not None and spec.sign < 0,
            }
        )  # fmt: skip
    return rows


def _role(study: Study, run: Measurement) -> str:
    """Return the role of a measured run; that of the file where one run is split in time."""
    file, piece = place_of_run(study.folder, study.settings, run.name)
    roles = [one.role for one in study.settings.runs if (one.file, one.piece) == (file, piece)]
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

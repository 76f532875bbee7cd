"""Runs of a building to predict: what drives it, what was measured, where it begins."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..core.text import command
from ..data.building_file import read_building
from ..data.channels import Labels
from ..data.ground_motion import read_ground_motion
from ..data.measurement import Measurement
from ..errors import StudyError
from ..identification.smoothing import smooth_steps
from ..physics.building import with_damper
from ..study.inputs import measurements
from .model_system import BuildingWithFile, Excitation, shaking_of

REST = 0.1
"""Share of a response's peak up to which it counts as at rest when the run begins."""
BEGIN = 0.02
"""Seconds over which the start of a run is averaged."""


@dataclass(frozen=True)
class PredictedRun:
    """A run to predict: what drives it, what was measured, and the samples that count.

    `measured` maps a response to its values (n,) and their noise; `window` (n,) says which samples
    are judged; `noise` are standard deviations of the ground's acceleration and of the command;
    `labels` is what is known of the whole run.
    """

    shaking: Excitation
    measured: dict[str, tuple[Array, float]]
    window: NDArray[np.bool_]
    noise: tuple[float, float]
    labels: Labels = field(default_factory=dict)


def trial_of(
    run: Measurement, name: str = "", judged: tuple[float, float] = (-np.inf, np.inf)
) -> PredictedRun:
    """Return a measurement as a run to predict.

    Parameters
    ----------
    run : with the ground's acceleration
    name : what it is called; its own name by default
    judged : times [s] between which samples are judged
    """
    shaking = replace(shaking_of(run), name=name or run.name)
    drive, left = run.drive, 0.0
    if drive:
        smooth, left = smooth_steps(run[drive], run.noise.get(drive, 0.0), run.step)
        shaking = replace(shaking, command=smooth)
    window = (run.time >= judged[0]) & (run.time <= judged[1])
    ground = run.noise.get("ground_acceleration", 0.0)
    return PredictedRun(shaking, _measured(run), window, (ground, left), run.labels)


def _measured(run: Measurement) -> dict[str, tuple[Array, float]]:
    """Return the responses that a run shows, and drifts from the displacements beside them."""
    found = {
        name: (run[name], run.noise.get(name, 0.0))
        for name in run.channels
        if name == "force" or name.startswith("drift") or _is_response(run, name)
    }
    floors = sorted(
        int(name.removeprefix("floor").partition("_")[0])
        for name in run.channels
        if name.startswith("floor") and name.endswith("_displacement")
    )
    for floor in floors:
        below = "base_displacement" if floor == 1 else f"floor{floor - 1}_displacement"
        if f"drift{floor}" in found or not run.has(below):
            continue
        above = f"floor{floor}_displacement"
        noise = np.hypot(run.noise.get(above, 0.0), run.noise.get(below, 0.0))
        found[f"drift{floor}"] = (run[above] - run[below], float(noise))
    return found


def _is_response(run: Measurement, name: str) -> bool:
    """Return whether a channel is compared: a velocity only where it stands for a displacement."""
    if not name.startswith(("base_", "floor")):
        return False
    level, _, what = name.partition("_")
    if what == "velocity":
        return not run.has(f"{level}_displacement")
    return what in ("displacement", "acceleration_absolute")


def begins_in_motion(trial: PredictedRun) -> str:
    """Return the displacement or velocity that is not at rest when a run begins, "" for none."""
    first = max(1, round(BEGIN / trial.shaking.spacing))
    for name, (values, noise) in trial.measured.items():
        if not name.endswith(("_displacement", "_velocity")):
            continue
        begin = abs(float(np.mean(values[:first])))
        if begin > REST * float(np.max(np.abs(values))) + 4.0 * noise / np.sqrt(first):
            return name
    return ""


# Ground motions for a building that a study has not measured: from a file, or a record by name.


def house_of(file: Path) -> BuildingWithFile:
    """Return the building of a file, for a damper in it.

    Raises
    ------
    PhysicsError
        For what is wrong with the file.
    StudyError
        If it has places for several dampers.
    """
    building = read_building(file)
    if len(building.devices) > 1:
        names = ", ".join(device.name for device in building.devices)
        raise StudyError(
            f"{file}: places for {len(building.devices)} dampers ({names}), and a study is of one. "
            "Leave one [[devices]] in it, or none for the damper on the first level."
        )
    return BuildingWithFile(with_damper(building), file)


def trials_in(
    house: BuildingWithFile, data: Path | None, ground: str | None, level: float | None
) -> list[PredictedRun]:
    """Return the runs to predict.

    Parameters
    ----------
    house : whose levels the columns of `data` may be of
    data : a measurement of the building: ground motion, and responses and command if there are any
    ground : a record by name or file, in place of `data`
    level : the command in its unit, constant, where `data` has none; 0 by default

    Raises
    ------
    StudyError
        If neither or both are given, the command is given twice, or a run begins in motion.
    RecordError
        If a file cannot be read.
    """
    if (data is None) == (ground is None):
        raise StudyError(
            "--building needs the ground motion: a record, or measured responses of the building "
            f"with it, as in  {command('predict', 'RIG', '--building', 'house.toml')} "
            "--record el_centro_1940_ns --level 3, or --data shake.csv"
        )
    if ground is not None:
        record = read_ground_motion(ground, Path.cwd())
        return [_of_record(record.name, record.time, record.acceleration, level or 0.0)]
    assert data is not None
    trials = [trial_of(run) for run in measurements(data, building=house.building)]
    for trial in trials:
        name = trial.shaking.name
        if trial.shaking.command is not None and level is not None:
            raise StudyError(f"--level: {name} has a command of its own; leave one of the two out.")
        moving = begins_in_motion(trial)
        if moving:
            raise StudyError(
                f"{name}: {moving} is not at rest when the run begins, and what was before is not "
                "known. Give a record that begins at rest."
            )
    return [replace(one, shaking=replace(one.shaking, level=level or 0.0)) for one in trials]


def _of_record(name: str, time: Array, ground: Array, level: float) -> PredictedRun:
    """Return a record at even times from 0, with nothing measured."""
    spacing = float(np.median(np.diff(time)))
    count = int((time[-1] - time[0]) / spacing + 1e-6) + 1
    even = np.asarray(spacing * np.arange(count), dtype=np.float64)
    shaken = np.asarray(np.interp(even, time - time[0], ground), dtype=np.float64)
    shaking = Excitation(name, even, shaken, level=level)
    return PredictedRun(shaking, {}, np.ones(len(even), dtype=bool), (0.0, 0.0))

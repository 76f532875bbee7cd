"""Ground motions for a building that a study has not measured: from a file, or a record by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data.building_file import read_building
from ..data.motion import read_ground_motion
from ..errors import StudyError
from ..findings import command
from ..physics.building import with_damper
from ..study.inputs import measurements
from .closed_loop_runs import Trial, begins_in_motion, trial_of
from .in_building import House, Shaking

Array = NDArray[np.float64]


def house_of(file: Path) -> House:
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
    return House(with_damper(building), file)


def trials_in(
    house: House, data: Path | None, ground: str | None, level: float | None
) -> list[Trial]:
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
            "--in needs the ground motion: a record, or measured responses of the building with "
            f"it, as in  {command('predict', 'RIG', '--in', 'house.toml')} "
            "--ground el_centro_1940_ns --level 3, or --data shake.csv"
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
    return [_at_level(trial, level or 0.0) for trial in trials]


def _at_level(trial: Trial, level: float) -> Trial:
    return replace(trial, shaking=replace(trial.shaking, level=level))


def _of_record(name: str, time: Array, ground: Array, level: float) -> Trial:
    """Return a record at even times from 0, with nothing measured."""
    spacing = float(np.median(np.diff(time)))
    count = int((time[-1] - time[0]) / spacing + 1e-6) + 1
    even = np.asarray(spacing * np.arange(count), dtype=np.float64)
    shaken = np.asarray(np.interp(even, time - time[0], ground), dtype=np.float64)
    shaking = Shaking(name, even, shaken, level=level)
    return Trial(shaking, {}, np.ones(len(even), dtype=bool), (0.0, 0.0))

"""A study's present model as an FMU with its values baked in, and a scenario that uses it."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from shutil import copyfile
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.files import writing
from ..core.text import percent, plain
from ..data.channels import channel_unit, label_name, label_text
from ..data.checks.motion import ACROSS, with_motion_across
from ..data.measurement import Measurement
from ..data.run_labels import labels_of
from ..errors import RecordError, StudyError
from ..fmu.build import BuildPlan, build, plan
from ..fmu.catalogue import component_of_law
from ..identification.problem import following
from ..identification.rig import DAMPER
from ..model.model import Model
from ..physics.building import GROUND
from ..physics.drive import VOLTAGE, Drive, drive_named
from ..physics.effect import EFFECTS
from ..study.history import history_steps
from ..study.rig import building_of, rig_of
from ..study.runs import Runs
from ..study.study import Study
from ..system.from_model import DamperTable, Parameters, source_of, values_of
from ..system.toml import save
from ..user_code.load import own_effects
from ..view import Viewable
from .held_out import FOLDER, HeldOut, Proof, held_out, prove, step_for, write_inputs, write_proof
from .model_system import (
    BuildingWithFile,
    Excitation,
    bench_system,
    building_system,
    loads,
    shaking_of,
)

Build = Callable[[BuildPlan, Path], Path]


@dataclass(frozen=True, repr=False)
class Exported(Viewable):
    """What was written: the FMU, the scenario, the files it reads; what was left out, and why.

    `proof` is what the FMU gives on the held-out runs, whose inputs are among the files; None where
    the study has no damper that a force is known of.
    """

    fmu: Path
    scenario: Path
    files: tuple[Path, ...]
    run: str
    notes: tuple[str, ...] = ()
    proof: Proof | None = None


class Editable(NamedTuple):
    """A scenario whose damper has its values in the file, and what was left out.

    `run` is the run that it plays, `numbers` the parameters that the model gives its damper, and
    `force` tells whether the signal `measured` holds the measured force.
    """

    scenario: Path
    run: str
    numbers: tuple[str, ...]
    force: bool
    notes: tuple[str, ...]


def export_study(study: Study, out: Path | None = None, build: Build = build) -> Exported:
    """Write a study's present model as an FMU and a scenario into a folder.

    Parameters
    ----------
    study : the folder, opened, with a model
    out : the folder, made if it is not there; None takes export/ in the study
    build : what builds a planned FMU into a folder and returns its path

    Raises
    ------
    StudyError
        If the model cannot be read, or the folder cannot be written.
    BuildError, RecordError
        If the FMU cannot be built, or no run can be read.
    """
    model = study.model()
    runs = study.runs()
    measurement = _one_run(study, runs)
    folder = study.folder / "export" if out is None else out
    notes: list[str] = []
    held = _held_out(study, model, runs, notes)
    step = step_for(held) if held else None
    with writing(folder, StudyError):
        folder.mkdir(parents=True, exist_ok=True)
        fmu = build(_damper(study, model, runs, notes, step), folder)

        def damper(parameters: Parameters) -> dict[str, Any]:
            return {"fmu": str(fmu.absolute()), "parameters": parameters}

        drive = drive_named(measurement.drive)
        scenario, files = _scenario(study, model, measurement, drive, folder, damper, notes)
        proof = None
        if held and step:
            files += write_inputs(held, step, folder / FOLDER)
            proof = prove(held, fmu, step)
            files += write_proof(proof, held, fmu, folder / FOLDER)
    return Exported(fmu, scenario, tuple(files), measurement.name, tuple(notes), proof)


def _held_out(study: Study, model: Model, runs: Runs, notes: list[str]) -> HeldOut | None:
    """Return what the damper is held against; None, and a note, where the runs do not tell it."""
    try:
        rig = rig_of(study, model, runs)
        there = DAMPER in rig.sites(model)
    except RecordError as error:
        notes.append(f"the FMU was not held against the runs: {error}")
        return None
    if not there:
        notes.append("the FMU was not held against the runs: they do not tell the damper's force.")
        return None
    bare = model.at("damper", bench=not study.settings.has_building)
    known = [_with_stroke(study, model, one) for one in runs.holdout or runs.train]
    return held_out(bare, model, rig, known)


def write_editable(study: Study, folder: Path) -> Editable:
    """Write the scenario of `export_study` with the model's values in it, in place of an FMU.

    Its damper is a built-in component, so every number of the model can be changed in the scenario.
    A current or a field drives it as a voltage of the same number: the law is the same.

    Parameters
    ----------
    study : the folder, opened, with a model
    folder : where to write, made if it is not there

    Raises
    ------
    StudyError, RecordError
        If the model or the run cannot be read, or the folder cannot be written.
    """
    model = study.model()
    runs = study.runs()
    measurement = _one_run(study, runs)
    notes: list[str] = []
    own = _bare(study, model, notes)
    values = {name: value for name, value in values_of(own).items() if name not in _signals(own)}
    found = _range(study, model, runs, notes)
    limit = drive_named(measurement.drive).limit
    values |= {VOLTAGE.limit if name == limit else name: value for name, value in found.items()}

    def damper(parameters: Parameters) -> dict[str, Any]:
        return {**source_of(own), "parameters": {**values, **parameters}}

    with writing(folder, StudyError):
        folder.mkdir(parents=True, exist_ok=True)
        scenario, _ = _scenario(study, model, measurement, VOLTAGE, folder, damper, notes)
    numbers = tuple(name for name in values if name in own.values)
    return Editable(scenario, measurement.name, numbers, measurement.has("force"), tuple(notes))


def _scenario(
    study: Study, model: Model, measurement: Measurement, drive: Drive, folder: Path,
    damper: DamperTable, notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario of a study's damper, on the bench or in its building, and its files."""
    if not study.settings.has_building:
        system, about = bench_system(study.name, model, measurement, drive, damper)
        scenario, *files = save(system, folder / "bench.toml", about)
        return scenario, files
    shaking = replace(shaking_of(measurement), drive=drive)
    return _structure(study, model, shaking, folder, damper, notes)


def _one_run(study: Study, runs: Runs) -> Measurement:
    """Return the run that the scenario plays: the first that is held out.

    On a bench it is the first whose command reaches half of the largest: without one, a scenario
    shows nothing of what the damper is for.
    """
    able = runs.holdout or runs.train
    if study.settings.has_building or not able[0].drive:
        return able[0]
    tops = [float(np.max(np.abs(one[one.drive]))) if one.drive else 0.0 for one in able]
    return next(one for one, top in zip(able, tops, strict=True) if 2.0 * top >= max(tops))


def _bare(study: Study, model: Model, notes: list[str]) -> Model:
    """Return the damper's own law and effects; note what is an instrument's."""
    bench = not study.settings.has_building
    sensors = model.at("sensor", bench).effects
    if sensors:
        notes.append(
            f"{', '.join(sensors)} left out: an instrument's effect is not in the damper. The "
            "scenario's force is the one before the instrument."
        )
    return model.at("damper", bench)


def _signals(damper: Model) -> Collection[str]:
    """Return the parameters that follow a measured channel: they are inputs of the damper."""
    return following(damper.effects)


def _damper(
    study: Study, model: Model, runs: Runs, notes: list[str], step: float | None
) -> BuildPlan:
    """Plan the damper with the model's values as its defaults."""
    own = _bare(study, model, notes)
    starts = {name: value for name, value in values_of(own).items() if name not in _signals(own)}
    starts |= _range(study, model, runs, notes)
    files = own_effects()
    return plan(
        component_of_law(own.base_law),
        name=_model_name(study.name),
        starts=starts,
        effects=[files[name] for name in own.effects if EFFECTS[name].own],
        offers=own.effects,
        drive=drive_named(runs.all[0].drive).name,
        step=step,
        about=_reach(study, model, runs),
    )


_APART = 8
"""Samples between which a displacement's difference counts as its speed: over fewer it is noise."""


def _reach(study: Study, model: Model, runs: Runs) -> str:
    """Return what the model was fitted to, over which range, and how far off it is elsewhere."""
    train = [_with_stroke(study, model, run) for run in runs.train]
    seen: dict[str, list[Array]] = {}
    for run in train:
        for channel in ("displacement", run.drive):
            if channel and run.has(channel):
                seen.setdefault(channel, []).append(run[channel])
        if run.has("velocity"):
            seen.setdefault("velocity", []).append(run["velocity"])
        elif run.has("displacement"):
            x = run["displacement"]
            moved = (x[_APART:] - x[:-_APART]) / (_APART * run.step)
            seen.setdefault("velocity", []).append(moved)
    ranges = []
    for channel, values in seen.items():
        low, high = (plain(float(end(np.concatenate(values))), 4) for end in (np.nanmin, np.nanmax))
        ranges.append(f"{channel} {low} to {high} {channel_unit(channel)}")
    for label in labels_of([run.labels for run in train]):
        texts = [label_text(label.name, one) for one in label.levels]
        told = f"{texts[0]} to {texts[-1]}" if label.is_number else ", ".join(texts)
        ranges.append(f"{label_name(label.name)} {told}")
    share = history_steps(study.steps())[-1].share
    off = "" if share is None else f" Held-out error: {percent(share)} of the force (RMS)."
    counted = f"{len(train)} run{'s' * (len(train) > 1)}"
    return f"Fitted to {counted} (data {study.data[:14]}): {'; '.join(ranges)}.{off}"


def _with_stroke(study: Study, model: Model, measurement: Measurement) -> Measurement:
    """Return a run with the displacement across the damper, where it is a building's device."""
    building = building_of(study, model)
    if building is None or not building.studied:
        return measurement
    levels = building.levels()
    lower, upper = (
        "" if i == GROUND else levels[i] for i in building.device(building.studied).levels
    )
    seen = with_motion_across(measurement, lower, upper)
    channels = {n: v for n, v in seen.channels.items() if not n.endswith("_displacement")}
    stroke = seen.channels.get(f"{ACROSS}_displacement")
    return replace(
        seen, channels=channels if stroke is None else {**channels, "displacement": stroke}
    )


def _range(study: Study, model: Model, runs: Runs, notes: list[str]) -> dict[str, float]:
    """Return the command's limit and stroke [m] that hold what was measured in all runs.

    Where the defaults do they are left out. The run that is played alone does not tell: another
    one, to which the model was fitted, may go further.
    """
    found = {}
    drive = drive_named(runs.all[0].drive)  # that of all runs
    if not runs.all[0].drive and study.settings.has_building:
        notes.append("neither voltage nor current was measured: the scenario holds 0 V.")
    tops = [float(one[drive.name].max()) for one in runs.all if one.has(drive.name)]
    if max(tops, default=0.0) > drive.largest:
        found[drive.limit] = float(ceil(1.05 * max(tops)))
    moved = [
        float(np.abs(one[channel]).max())
        for one in (_with_stroke(study, model, run) for run in runs.all)
        for channel in ("displacement", "base_displacement") if one.has(channel)
    ]  # fmt: skip
    if max(moved, default=0.0) > 0.02:
        found["stroke"] = float(f"{1.05 * max(moved):.3g}")
    return found


def _model_name(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"{plain if plain[:1].isalpha() else 'study_' + plain}_damper"


def _structure(
    study: Study, model: Model, shaking: Excitation, folder: Path, damper: DamperTable,
    notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario of the study's building with the damper, under a run's ground motion."""
    file = study.folder / model.building if model.building else None
    building = building_of(study, model)
    assert building is not None  # `_scenario` asked
    copied = [] if file is None else [Path(copyfile(file, folder / "building.toml"))]
    house = BuildingWithFile(building, copied[0] if copied else None)
    own = loads(model, house.building)
    notes += own.notes
    if channels := dict.fromkeys(following(model.effects).values()):
        notes.append(
            f"{', '.join(channels)}: the damper's input keeps its mean in the scenario, for a "
            "building under a ground motion does not give it. Connect it to a signal."
        )
    title = f"{study.name}: the building with the model's damper, ground of {shaking.name}"
    effects = [Path(copyfile(one, folder / one.name)) for one in own.effects]
    system = building_system(title, house, shaking, own._replace(effects=tuple(effects)), damper)
    about = "# The model's damper in the study's building."
    scenario, *files = save(system, folder / "structure.toml", about)
    return scenario, [*copied, *files, *effects]

"""A study's present model as an FMU with its values baked in, and a scenario that uses it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from shutil import copyfile

import numpy as np
from numpy.typing import NDArray

from ..data.checks.motion import ACROSS, with_motion_across
from ..data.files import write_whole
from ..data.measurement import Measurement
from ..data.model import StudyModel
from ..errors import StudyError
from ..fmu.build import Plan, build, plan
from ..fmu.catalogue import component_of_law
from ..fmu.damper import input_of
from ..identify.fit import Problem, Run
from ..identify.instruments import true_motion
from ..identify.prepare import prepare
from ..identify.run_labels import following, values_of_labels
from ..physics.device import GROUND
from ..physics.drive import drive_named, states_for
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..physics.user import own_effects
from ..study.identification import as_model
from ..study.rig import building_of
from ..study.study import Study
from .in_building import House, Parameters, loads, shaking_of, write_scenario
from .scenario_files import part_text, scenario_text, signal_file

Array = NDArray[np.float64]
Build = Callable[[Plan, Path], Path]

STEP = 5e-4
"""Longest step [s] of a bench scenario: an FMU holds its inputs over a step, a prediction does not.

At 0.5 ms the two differ by less than `AGREEMENT`.
"""
AGREEMENT = 0.01
"""RMS difference of the exported FMU on the bench from the prediction, by the RMS of the force."""


@dataclass(frozen=True)
class Exported:
    """What was written: the FMU, the scenario, the files it reads; what was left out, and why."""

    fmu: Path
    scenario: Path
    files: tuple[Path, ...]
    run: str
    notes: tuple[str, ...] = ()


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
    measurement = _one_run(study)
    folder = study.folder / "export" if out is None else out
    notes: list[str] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        what = _damper(study, model, measurement, notes)
        fmu = build(what, folder)
        write = _structure if study.settings.has_building else _bench
        scenario, files = write(study, model, measurement, fmu, folder, notes)
    except OSError as error:
        raise StudyError(
            f"{error.filename or folder}: cannot be written ({error.strerror or error})."
        ) from None
    return Exported(fmu, scenario, tuple(files), measurement.name, tuple(notes))


def _one_run(study: Study) -> Measurement:
    """Return the run that the scenario plays: the first that is held out."""
    runs = study.runs()
    return (runs.holdout or runs.train)[0]


def _damper(study: Study, model: StudyModel, measurement: Measurement, notes: list[str]) -> Plan:
    """Plan the damper with the model's values as its defaults."""
    bench = not study.settings.has_building
    sensors = model.at("sensor", bench).effects
    model = model.at("damper", bench)
    effects = list(model.effects)
    if sensors:
        notes.append(
            f"{', '.join(sensors)} left out: an instrument's effect is not in the damper. The "
            "scenario's force is the one before the instrument."
        )
    values = model.values()
    starts: dict[str, float | bool] = {
        name: value
        for name, value in values.items()
        if ("." not in name or name.partition(".")[0] in effects)
        and name not in following(model.effects)
    }
    starts |= {f"{effect}.on": True for effect in effects}
    starts |= _range(_with_stroke(study, model, measurement), notes)
    own = own_effects()
    return plan(
        component_of_law(model.base_law),
        name=_model_name(study.name),
        starts=starts,
        effects=[own[name] for name in effects if EFFECTS[name].own],
        drive=drive_named(measurement.drive).name,
    )


def _with_stroke(study: Study, model: StudyModel, measurement: Measurement) -> Measurement:
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


def _range(measurement: Measurement, notes: list[str]) -> dict[str, float]:
    """Return the command's limit and stroke [m] that hold what was measured.

    Where the defaults do they are left out.
    """
    found = {}
    drive = drive_named(measurement.drive)
    if not measurement.drive:
        notes.append("neither voltage nor current was measured: the scenario holds 0 V.")
    elif float(measurement[drive.name].max()) > drive.largest:
        found[drive.limit] = float(ceil(1.05 * measurement[drive.name].max()))
    for channel in ("displacement", "base_displacement"):
        if measurement.has(channel):
            most = float(np.abs(measurement[channel]).max())
            if most > 0.02:
                found["stroke"] = float(f"{1.05 * most:.3g}")
    return found


def _model_name(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"{plain if plain[:1].isalpha() else 'study_' + plain}_damper"


# -- the bench: a run's motion played, its measured force beside the model's


def _bench(
    study: Study, model: StudyModel, measurement: Measurement, fmu: Path, folder: Path,
    notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario that moves the damper as in a measured run, and its files."""
    fitted = as_model(model)
    run = prepare(measurement)
    v, a = true_motion(fitted.effects, fitted.values, run.v, run.a, run.dt)
    run = replace(run, v=v, a=a)
    fine = max(1, ceil(run.dt / STEP - 1e-9))
    step = float(f"{run.dt / fine:.12g}")
    stop = float(f"{(len(run.x) - 1) * fine * step:.12g}")
    time = run.dt * np.arange(len(run.x))
    files = [_motion_file(run, fine, folder / "motion.csv")]
    rows = {"measured": ("force", "N", run.force)}
    wires = {"damper.displacement": "rod.displacement", "damper.velocity": "rod.velocity"}
    drive = drive_named(measurement.drive)
    if measurement.drive:
        rows["drive"] = (drive.name, drive.unit, run.V)
        wires[f"damper.{drive.name}"] = "drive.value"
    damper = model.at("damper", bench=True)
    for name in dict.fromkeys(following(damper.effects).values()):
        rows[name] = (name, run.extra[name].known_unit, run.extra[name].values)
        wires[f"damper.{input_of(name, damper.base_law, drive)}"] = f"{name}.value"
    effects = [EFFECTS[name] for name in damper.effects]
    if any("a" in effect.needs for effect in effects):
        rows["acceleration"] = ("acceleration", "m/s2", run.a)
        wires["damper.acceleration"] = "acceleration.value"
    motion = {"kind": "csv", "file": files[0].name}
    parts = [part_text("rod", {"fmu": "PrescribedMotion"}, motion)]
    for name, (title, unit, values) in rows.items():
        files.append(signal_file(time, values, title, unit, folder / f"{name}.csv"))
        signal = {"kind": "csv", "file": files[-1].name}
        parts.append(part_text(name, {"fmu": "SignalSource"}, signal))
    starts = _start_values(damper, run) | values_of_labels(damper.effects, run.labels)
    if not measurement.drive:
        starts[drive.name] = 0.0
    parts.append(part_text("damper", {"fmu": fmu.name}, starts))
    head = (
        f"{study.name}: the model on the bench, motion of {measurement.name}",
        f"# damper.force is the model's, measured.value the measured one [N]. Sampled at "
        f"{run.dt:g} s; the step is finer\n# because an FMU holds its inputs over a step.",
    )
    scenario = folder / "bench.toml"
    write_whole(scenario, scenario_text(head, (stop, step), parts, wires))
    return scenario, files


def _motion_file(run: Run, fine: int, path: Path) -> Path:
    """Write a displacement whose slope at every step is the run's velocity there.

    PrescribedMotion gives the slope of the interval at hand: so the nodes lie half a step beside
    the steps, and the displacement between them is the integral of the velocity.
    """
    h = run.dt / fine
    count = (len(run.x) - 1) * fine + 1
    steps = h * np.arange(count)
    v = np.interp(steps, run.dt * np.arange(len(run.v)), run.v)
    nodes: Array = np.concatenate([[0.0], steps + 0.5 * h])
    x: Array = run.x[0] + np.concatenate([[0.0], np.cumsum(v * np.diff(nodes))])
    return signal_file(nodes, x, "displacement", "m", path)


def _start_values(damper: StudyModel, run: Run) -> dict[str, float]:
    """Return the start values of states that begin with a signal or the load of the run."""
    drive = drive_named(run.drive)
    first = {"x": run.x[0], "v": run.v[0], "a": run.a[0], "V": run.V[0]}
    states = dict(LAWS[damper.base_law].starts)
    for name in damper.effects:
        called = states_for(EFFECTS[name].states, drive)
        starts = EFFECTS[name].starts
        states |= {f"{name}.{called[state]}": signal for state, signal in starts.items()}
    begun = {f"{name}_0": float(first[s]) for name, s in states.items() if s in first}
    return begun | Problem([run]).carrying(as_model(damper), run)


def prediction(model: StudyModel, run: Run, bench: bool = True) -> Array:
    """Return the force (n,) [N] that the damper of a model gives in a run, before instruments.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    run : its motion and voltage
    bench : whether the model is of a damper on a bench
    """
    fitted, bare = as_model(model), as_model(model.at("damper", bench))
    v, a = true_motion(fitted.effects, fitted.values, run.v, run.a, run.dt)
    return Problem([run]).predict(bare, replace(run, v=v, a=a))


# -- the building: ground motion of a run, the structure, the damper


def _structure(
    study: Study, model: StudyModel, measurement: Measurement, fmu: Path, folder: Path,
    notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario of the study's building with the damper, under a run's ground motion."""
    file = study.folder / model.building if model.building else None
    building = building_of(study, model)
    assert building is not None  # `export_study` asked
    house = House(building, file)
    own = loads(model, house.building)
    notes += own.notes
    if channels := dict.fromkeys(following(model.effects).values()):
        notes.append(
            f"{', '.join(channels)}: the damper's input keeps its mean in the scenario, for a "
            "building under a ground motion does not give it. Connect it to a signal."
        )
    head = (
        f"{study.name}: the building with the model's damper, ground of {measurement.name}",
        "# The model's damper in the study's building.",
    )

    def damper(parameters: Parameters) -> str:
        return part_text("damper", {"fmu": fmu.name}, parameters)

    copied = [Path(copyfile(one, folder / one.name)) for one in own.effects]
    own = own._replace(effects=tuple(Path(one.name) for one in copied))
    scenario, files = write_scenario(folder, head, house, shaking_of(measurement), own, damper)
    return scenario, [*files, *copied]

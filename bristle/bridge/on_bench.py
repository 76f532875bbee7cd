"""A model's damper on the bench, moved as in a measured run, as a scenario."""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data.files import write_whole
from ..data.measurement import Measurement
from ..data.model import StudyModel
from ..fmu.damper import input_of
from ..identify.instruments import true_motion
from ..identify.model import Fed, Problem, Run
from ..identify.prepare import prepare
from ..identify.run_labels import following, values_of_labels
from ..physics.drive import Drive, drive_named, states_for
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..study.identification import as_model
from .scenario_files import DamperText, part_text, scenario_text, signal_file

Array = NDArray[np.float64]

STEP = 5e-4
"""Longest step [s] of a bench scenario: an FMU holds its inputs over a step, a prediction does not.

At 0.5 ms the two differ by less than `AGREEMENT`.
"""
AGREEMENT = 0.01
"""RMS difference of the exported FMU on the bench from the prediction, by the RMS of the force."""


def write_scenario(
    folder: Path, title: str, model: StudyModel, measurement: Measurement, drive: Drive,
    damper: DamperText,
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario that moves a damper as in a measured run, and its files.

    Parameters
    ----------
    folder : where they go
    title : of the study
    model : the damper's law with the effects of all sites
    measurement : the run
    drive : what the damper's command is called
    damper : parameters to the text of the component that is called damper

    Returns
    -------
    scenario, files : the path of bench.toml, and of the files that it reads
    """
    fitted = as_model(model)
    run = prepare(measurement)
    fed = Problem([run]).fed(fitted, run)
    v, a = true_motion(fitted.effects, fitted.values, run.v, run.a, run.dt)
    run = replace(run, v=v, a=a)
    fine = max(1, ceil(run.dt / STEP - 1e-9))
    step = float(f"{run.dt / fine:.12g}")
    stop = float(f"{(len(run.x) - 1) * fine * step:.12g}")
    time = run.dt * np.arange(len(run.x))
    files = [_motion_file(run, fine, folder / "motion.csv")]
    rows = {"measured": ("force", "N", run.force)}
    wires = {"damper.displacement": "rod.displacement", "damper.velocity": "rod.velocity"}
    if measurement.drive:
        rows["drive"] = (drive.name, drive.unit, run.V)
        wires[f"damper.{drive.name}"] = "drive.value"
    own = model.at("damper", bench=True)
    for name in dict.fromkeys(following(own.effects).values()):
        rows[name] = (name, run.extra[name].known_unit, run.extra[name].values)
        wires[f"damper.{input_of(name, own.base_law, drive)}"] = f"{name}.value"
    effects = [EFFECTS[name] for name in own.effects]
    if any("a" in effect.needs for effect in effects):
        rows["acceleration"] = ("acceleration", "m/s2", run.a)
        wires["damper.acceleration"] = "acceleration.value"
    motion = {"kind": "csv", "file": files[0].name}
    parts = [part_text("rod", {"fmu": "PrescribedMotion"}, motion)]
    # A signal is 0 after its file, and the last step may end a rounding error later.
    time, last = np.append(time, time[-1] + run.dt), slice(-1, None)
    for name, (quantity, unit, values) in rows.items():
        values = np.append(values, values[last])
        files.append(signal_file(time, values, quantity, unit, folder / f"{name}.csv"))
        signal = {"kind": "csv", "file": files[-1].name}
        parts.append(part_text(name, {"fmu": "SignalSource"}, signal))
    starts = start_values(own, fed, run)
    if not measurement.drive:
        starts[drive.name] = 0.0
    parts.append(damper(starts))
    head = (
        f"{title}: the model on the bench, motion of {measurement.name}",
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


def start_values(damper: StudyModel, fed: Fed, run: Run) -> dict[str, float]:
    """Return the parameters that a run sets: states that begin with a signal, labels, its load."""
    drive = drive_named(run.drive)
    moments = fed.moments
    first = {name: float(getattr(moments, name)[0]) for name in ("x", "v", "a", "V")}
    states = dict(LAWS[damper.base_law].starts)
    for name in damper.effects:
        called = states_for(EFFECTS[name].states, drive)
        starts = EFFECTS[name].starts
        states |= {f"{name}.{called[state]}": signal for state, signal in starts.items()}
    begun = {f"{name}_0": first[signal] for name, signal in states.items() if signal in first}
    begun |= Problem([run]).carrying(as_model(damper), run)
    return begun | values_of_labels(damper.effects, run.labels)


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

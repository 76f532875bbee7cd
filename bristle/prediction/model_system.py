"""A study's damper in a building or on the bench, as a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..core.text import quantity
from ..data.channels import device_channel
from ..data.measurement import Measurement
from ..errors import StudyError
from ..fmu.damper import input_of
from ..identification.prepare import prepare
from ..identification.problem import Fed, Problem, Run, following, true_motion, values_of_labels
from ..model.model import Model
from ..physics.building import Building, Ports, driven_mass
from ..physics.drive import VOLTAGE, Drive, drive_named, states_for
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..system.from_model import DamperTable, Parameters
from ..system.model import Signal, System
from ..system.scenario import make_system
from ..user_code.load import own_effects

STEP = 2e-3
"""Longest step [s] of a building's scenario."""


@dataclass(frozen=True)
class BuildingWithFile:
    """A building, and the file that describes it; None for the paper's."""

    building: Building
    file: Path | None = None


@dataclass(frozen=True)
class Excitation:
    """What drives a building with its damper.

    `time` (n,) s from 0 and the `ground`'s acceleration (n,) m/s2; the `command` (n,) in the unit
    of the `drive`, None where it stays at `level`; the measured `force` (n,) N, None where there is
    none; `others` the measured forces (n,) N of other devices of the building, by name.
    """

    name: str
    time: Array
    ground: Array
    command: Array | None = None
    level: float = 0.0
    force: Array | None = None
    drive: Drive = VOLTAGE
    others: Mapping[str, Array] = field(default_factory=dict)

    @property
    def fine(self) -> int:
        """Into how many steps the samples' spacing is cut."""
        return max(1, ceil(self.spacing / STEP - 1e-9))

    @property
    def spacing(self) -> float:
        """Spacing of the samples [s]."""
        return float(np.median(np.diff(self.time)))


def shaking_of(measurement: Measurement) -> Excitation:
    """Return what drives the building in a measurement.

    Raises
    ------
    StudyError
        If the ground's acceleration was not measured.
    """
    if not measurement.has("ground_acceleration"):
        raise StudyError(
            f"{measurement.name}: no ground_acceleration was measured, which a structure's "
            "scenario needs."
        )
    drive = measurement.drive
    return Excitation(
        measurement.name, measurement.time - measurement.time[0],
        measurement["ground_acceleration"], measurement[drive] if drive else None,
        force=measurement["force"] if measurement.has("force") else None,
        drive=drive_named(drive), others=_forces_of_devices(measurement),
    )  # fmt: skip


def _forces_of_devices(measurement: Measurement) -> dict[str, Array]:
    """Return the measured forces (n,) [N] of devices by name."""
    found = {name: device_channel(name) for name in measurement.channels}
    return {one[0]: measurement[name] for name, one in found.items() if one and one[1] == "force"}


class ModelLoads(NamedTuple):
    """What a model makes of a building beside its damper.

    Parameters of the `structure` and of the `damper` that follow from their joint; `notes`; and the
    files of the structure's `effects` that are the user's own.
    """

    structure: Parameters
    damper: Parameters
    notes: tuple[str, ...]
    effects: tuple[Path, ...] = ()


def loads(model: Model, building: Building, bench: bool = False) -> ModelLoads:
    """Return what a model's effects make of the structure, and what the damper has to know of it.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    building : what the damper acts in
    bench : whether the model was identified on a bench, where all effects are the damper's
    """
    layer = model.at("structure", bench)
    own = {f"{name}.on": True for name in layer.effects}
    device = building.device(building.studied)
    structure: Parameters = {**own, **{n: v for n, v in layer.values.items() if "." in n}}
    damper: Parameters = {}
    mass, notes = driven_mass(building.M, device), []
    for name in masses(model.at("damper", bench)):
        moved = model.values.get(name, 0.0)
        if moved > 0.0 and not device.on_first:
            notes.append(
                f"{name} = {moved:g} kg stays in the damper, which takes it from differences of "
                f"velocity: keep it well below the {mass:.3g} kg that the damper moves."
            )
        elif moved > 0.0:
            structure["attached_mass"] = float(structure.get("attached_mass", 0.0)) + moved
            damper[name] = 0.0
            mass += moved
            notes.append(
                f"{name} = {moved:g} kg is structure.attached_mass in the scenario: from "
                "differences of velocity it would diverge near the mass that it moves."
            )
    if LAWS[model.base_law].has("sign"):
        damper["moving_mass"] = mass
    files = own_effects()
    effects = tuple(files[name] for name in layer.effects if EFFECTS[name].own)
    return ModelLoads(structure, damper, tuple(notes), effects)


def masses(damper: Model) -> list[str]:
    """Return the parameters of a damper's effects that are a mass which moves with the rod."""
    return [f"{name}.{EFFECTS[name].mass}" for name in damper.effects if EFFECTS[name].mass]


def building_system(
    title: str, house: BuildingWithFile, shaking: Excitation, own: ModelLoads, damper: DamperTable
) -> System:
    """Return a building with its damper under a ground motion, as a system.

    Parameters
    ----------
    title : of figures
    house, shaking : the building, and what drives it
    own : what the model makes of the building
    damper : parameters to the table of the component that is called damper
    """
    structure: dict[str, Any] = {"fmu": "Structure", "parameters": own.structure}
    if house.file is not None:
        structure["building"] = str(house.file.absolute())
    if own.effects:
        structure["effects"] = [str(file.absolute()) for file in own.effects]
    ports = studied_ports(house.building)
    wires: dict[str, Any] = {
        "structure.ground_acceleration": "ground.ground_acceleration",
        f"structure.{ports.force}": "damper.force",
        "damper.displacement": f"structure.{ports.displacement}",
        "damper.velocity": f"structure.{ports.velocity}",
    }
    if "moving_mass" in own.damper:
        wires["damper.holding_force"] = f"structure.{ports.holding_force}"
    signals, moving = signals_of(shaking), dict(own.damper)
    record = {"record": signals["ground.record"]}
    parts = {"ground": {"fmu": "GroundMotion", "parameters": record}, "structure": structure}
    if shaking.command is None:
        moving[shaking.drive.name] = shaking.level
    else:
        parts["drive"] = _source(signals["drive.file"])
        wires[f"damper.{shaking.drive.name}"] = _as_it_is("drive")
    for name in others_of(house.building, shaking):
        force = signal_of(shaking.time, shaking.others[name], "force", "N", f"{name}_force")
        parts[f"{name}_measured"] = _source(force)
        wires[f"structure.{name}_force"] = _as_it_is(f"{name}_measured")
    if shaking.force is not None:
        parts["measured"] = _source(signal_of(shaking.time, shaking.force, "force", "N"))
    step = float(f"{shaking.spacing / shaking.fine:.12g}")
    stop = float(f"{(len(shaking.time) - 1) * shaking.fine * step:.12g}")
    run = {"stop": stop, "step": step, "algorithm": "gauss-seidel"}
    return make_system(title, run, {**parts, "damper": damper(moving)}, wires)


def studied_ports(building: Building) -> Ports:
    """Return the ports of a structure at the damper that is identified."""
    return building.ports(building.device(building.studied))


def others_of(building: Building, shaking: Excitation) -> list[str]:
    """Return the devices of a building beside the damper, whose forces must be known.

    Parameters
    ----------
    building : which knows the damper that is identified
    shaking : what drives it

    Raises
    ------
    StudyError
        If the force of one is not known.
    """
    names = [device.name for device in building.devices if device.name != building.studied]
    unknown = [name for name in names if name not in shaking.others]
    if unknown:
        raise StudyError(
            f"{shaking.name}: the force of {', '.join(unknown)} is not known, and a study's model "
            f"is that of one damper. A measurement with {unknown[0]}_force is right; in a scenario "
            "of your own each device can have its damper."
        )
    return names


def signals_of(shaking: Excitation) -> dict[str, Signal]:
    """Return the ground motion, and the command where it moves, as values of such a system."""
    ground = signal_of(shaking.time, shaking.ground, "acceleration", "m/s2")
    if shaking.command is None:
        return {"ground.record": ground}
    name, unit = shaking.drive.name, shaking.drive.unit
    return {
        "ground.record": ground,
        "drive.file": signal_of(shaking.time, shaking.command, name, unit),
    }


def signal_of(
    time: NDArray[Any], values: NDArray[Any], quantity: str, unit: str, name: str = ""
) -> Signal:
    """Return a signal at times that have twelve digits: what k dt has beyond them is rounding.

    Parameters
    ----------
    time, values : instants [s] and samples, (n,)
    quantity, unit : of the values
    name : of their column; "" where the quantity is enough
    """
    rounded = np.array([float(f"{t:.12g}") for t in time.tolist()])
    return Signal(rounded, values, unit, quantity, name)


def _source(signal: Signal, fmu: str = "SignalSource") -> dict[str, Any]:
    return {"fmu": fmu, "parameters": {"kind": "csv", "file": signal}}


def _as_it_is(source: str) -> dict[str, Any]:
    """Return a connection from a SignalSource, which names no unit: its signal is the input's."""
    return {"from": f"{source}.value", "factor": 1.0, "offset": 0.0}


# A model's damper on the bench, moved as in a measured run, as a scenario.

BENCH_STEP = 5e-4
"""Longest step [s] of a bench scenario: an FMU holds its inputs over a step, a prediction does not.

At 0.5 ms the two differ by less than `AGREEMENT`.
"""
AGREEMENT = 0.01
"""RMS difference of the exported FMU on the bench from the prediction, by the RMS of the force."""


def bench_system(
    title: str, model: Model, measurement: Measurement, drive: Drive, damper: DamperTable,
    zero: float,
) -> tuple[System, str]:  # fmt: skip
    """Return a damper that is moved as in a measured run, as a system, and what is to know of it.

    Parameters
    ----------
    title : of the study
    model : the damper's law with the effects of all sites
    measurement : the run
    drive : what the damper's command is called
    damper : parameters to the table of the component that is called damper
    zero : what the load cell shows more [N]
    """
    run = prepare(measurement)
    problem = Problem([run]).with_free_zero(zero)
    fed = problem.fed(model, run)
    v, a = true_motion(model.effects, model.values, run.v, run.a, run.dt)
    run = replace(run, v=v, a=a)
    fine = max(1, ceil(run.dt / BENCH_STEP - 1e-9))
    step = float(f"{run.dt / fine:.12g}")
    stop = float(f"{(len(run.x) - 1) * fine * step:.12g}")
    time = run.dt * np.arange(len(run.x))
    rows = {"measured": ("force", "N", run.force - zero)}
    wires: dict[str, Any] = {
        "damper.displacement": "rod.displacement", "damper.velocity": "rod.velocity",
    }  # fmt: skip
    if measurement.drive:
        rows["drive"] = (drive.name, drive.unit, run.V)
        wires[f"damper.{drive.name}"] = _as_it_is("drive")
    own = model.at("damper", bench=True)
    for name in dict.fromkeys(following(own.effects).values()):
        rows[name] = (name, run.extra[name].known_unit, run.extra[name].values)
        wires[f"damper.{input_of(name, own.base_law, drive)}"] = _as_it_is(name)
    effects = [EFFECTS[name] for name in own.effects]
    if any("a" in effect.needs for effect in effects):
        rows["acceleration"] = ("acceleration", "m/s2", run.a)
        wires["damper.acceleration"] = _as_it_is("acceleration")
    parts = {"rod": _source(_motion(run, fine), "PrescribedMotion")}
    # A signal is 0 after its file, and the last step may end a rounding error later.
    time, last = np.append(time, time[-1] + run.dt), slice(-1, None)
    for name, (what, unit, values) in rows.items():
        parts[name] = _source(signal_of(time, np.append(values, values[last]), what, unit))
    starts = start_values(own, fed, run, problem)
    if not measurement.drive:
        starts[drive.name] = 0.0
    title = f"{title}: the model on the bench, motion of {measurement.name}"
    settings = {"stop": stop, "step": step, "algorithm": "gauss-seidel"}
    about = (
        f"# damper.force is the model's, measured.value the measured one [N]. Sampled at "
        f"{run.dt:g} s; the step is finer\n# because an FMU holds its inputs over a step."
    )
    if zero:
        about += f"\n# measured.value is less {quantity(zero, 'N')}, the zero of the load cell."
    return make_system(title, settings, {**parts, "damper": damper(starts)}, wires), about


def _motion(run: Run, fine: int) -> Signal:
    """Return a displacement whose slope at every step is the run's velocity there.

    PrescribedMotion gives the slope of the interval at hand: so the nodes lie half a step beside
    the steps, and the displacement between them is the integral of the velocity.
    """
    h = run.dt / fine
    count = (len(run.x) - 1) * fine + 1
    steps = h * np.arange(count)
    v = np.interp(steps, run.dt * np.arange(len(run.v)), run.v)
    nodes: Array = np.concatenate([[0.0], steps + 0.5 * h])
    x: Array = run.x[0] + np.concatenate([[0.0], np.cumsum(v * np.diff(nodes))])
    return signal_of(nodes, x, "displacement", "m", "motion")


def start_values(damper: Model, fed: Fed, run: Run, problem: Problem) -> dict[str, float]:
    """Return the parameters that a run sets: states that begin with a signal, labels, its load.

    Parameters
    ----------
    damper : Model
    fed : what its force function is fed in the run
    run : that it is played in
    problem : tells the load that it carries
    """
    drive = drive_named(run.drive)
    moments = fed.moments
    first = {name: float(getattr(moments, name)[0]) for name in ("x", "v", "a", "V")}
    states = dict(LAWS[damper.base_law].starts)
    for name in damper.effects:
        called = states_for(EFFECTS[name].states, drive)
        starts = EFFECTS[name].starts
        states |= {f"{name}.{called[state]}": signal for state, signal in starts.items()}
    begun = {f"{name}_0": first[signal] for name, signal in states.items() if signal in first}
    begun |= problem.carrying(damper, run)
    return begun | values_of_labels(damper.effects, run.labels)


def prediction(model: Model, run: Run, bench: bool = True) -> Array:
    """Return the force (n,) [N] that the damper of a model gives in a run, before instruments.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    run : its motion and voltage
    bench : whether the model is of a damper on a bench
    """
    v, a = true_motion(model.effects, model.values, run.v, run.a, run.dt)
    return Problem([run]).predict(model.at("damper", bench), replace(run, v=v, a=a))

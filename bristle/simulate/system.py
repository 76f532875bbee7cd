"""Lays a scenario of built-in components out in records of numbers for the time march."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data import ground_motion_file
from ..errors import ScenarioError
from ..fmu import catalogue
from ..fmu.slave import Slave
from ..physics.signals import CONSTANT, CSV, PARAMETERS
from ..physics.structure import step_matrices
from ..scenario.scenario import Component, Scenario
from . import layout, sampled
from .clocks import Clocks

Array = NDArray[Any]
Port = tuple[str, str]

KINDS = {
    "Structure": "structure",
    "LuGreDamper": "damper",
    "BinghamDamper": "damper",
    "ConstantVoltage": "source",
    "GroundMotion": "source",
    "PrescribedMotion": "source",
    "SignalSource": "source",
    **dict.fromkeys(sampled.KINDS, "sampled"),
}


class System:
    """A scenario's components as configured objects, and the slots of their signals.

    Attributes
    ----------
    outputs, kinds : dict
        `component.port` to the slot of the signal, and to the kind of the variable.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.names: dict[str, list[str]] = {
            kind: [] for kind in ("source", "damper", "structure", "sampled")
        }
        for component in scenario.components:
            self.names[kind_of(component, scenario)].append(component.name)
        self.slaves: dict[str, Any] = {
            component.name: configured(component, scenario) for component in scenario.components
        }
        self.source_of: dict[Port, Port] = {
            (c.target, c.input): (c.source, c.output) for c in scenario.connections
        }
        self.names["structure"] = self._followed_first(scenario)
        self.slots: dict[Port, int] = {}
        self.outputs: dict[str, int] = {}
        self.kinds: dict[str, str] = {}
        for component in scenario.components:
            for variable in component.description.variables.values():
                if variable.causality in ("input", "output"):
                    self.slots[component.name, variable.name] = len(self.slots)
                if variable.causality == "output":
                    name = f"{component.name}.{variable.name}"
                    self.outputs[name] = self.slots[component.name, variable.name]
                    self.kinds[name] = variable.kind
        self.size = len(self.slots)
        self.slots.update({end: self.slots[begin] for end, begin in self.source_of.items()})
        # The friction in each damper's force has a slot of its own, and no friction has one.
        self.friction = {
            (name, "force"): self.size + i for i, name in enumerate(self.names["damper"])
        }
        self.no_friction = self.size + len(self.friction)

    def _followed_first(self, scenario: Scenario) -> list[str]:
        """Return the structures so that one whose ground is another's floor comes after it."""
        ordered: list[str] = []
        left = list(self.names["structure"])
        while left:
            grounds = {
                name: self.source_of.get((name, "ground_acceleration"), ("",))[0] for name in left
            }
            free = [name for name in left if grounds[name] not in left]
            if not free:
                raise ScenarioError(
                    f"{scenario.file}: {', '.join(left)} are each other's ground, which cannot be "
                    "solved. One of them must stand on a ground motion."
                )
            ordered += free
            left = [name for name in left if name not in free]
        return ordered

    def start_values(self) -> Array:
        """Return the signals before the run: what the scenario holds constant, friction 0."""
        signals = np.zeros(self.no_friction + 1)
        for name, slave in self.slaves.items():
            for index in slave._inputs:
                key = (name, slave.vars[index].name)
                if key not in self.source_of:
                    signals[self.slots[key]] = slave._values[index]
        for name in self.names["source"]:
            signal = source_signal(self.slaves[name])
            if signal["kind"] == CONSTANT:
                signals[self.slots[name, signal["value"]]] = signal["p"][0]
        return signals

    def arrays(self, h: float) -> tuple[Array, Array, Array, Array, Array]:
        """Return sources, their times and samples, dampers and structures for substeps of h [s]."""
        return (*self._sources(), self._dampers(), self._structures(h))

    def periods(self) -> list[float]:
        """Return the sample periods [s] of the components that have a clock."""
        return [self.slaves[name]["sample_period"] for name in self.names["sampled"]]

    def sampled(self, h: float, substeps: int) -> tuple[Array, Array, Array]:
        """Return sampled components, their constants and memory for so many substeps of h [s]."""
        slaves = {name: self.slaves[name] for name in self.names["sampled"]}
        clocks = Clocks(slaves, lambda *port: self.slots[port], h, substeps)
        return clocks.records, clocks.constants, clocks.memory

    def _sources(self) -> tuple[Array, Array, Array]:
        """Return the sources that change, as records, and the samples of all of them."""
        signals = {name: source_signal(self.slaves[name]) for name in self.names["source"]}
        changing = {name: one for name, one in signals.items() if one["kind"] != CONSTANT}
        records = np.zeros(len(changing), layout.source_record())
        times: list[float] = []
        samples: list[float] = []
        for record, (name, signal) in zip(records, changing.items(), strict=True):
            record["begin"] = len(times)
            times.extend(signal["times"])
            samples.extend(signal["samples"])
            record["end"] = len(times)
            for field in ("kind", "delay", "scale", "p"):
                record[field] = signal[field]
            record["out"] = self.slots[name, signal["value"]]
            record["rate_out"] = self.slots[name, signal["rate"]] if signal["rate"] else -1
        return records, np.array(times), np.array(samples)

    def _dampers(self) -> Array:
        names = self.names["damper"]
        records = np.zeros(len(names), layout.damper_record())
        ports = {
            "x": "displacement", "v": "velocity", "V": "voltage", "force": "force",
            "energy": "dissipated_energy", "stroke_ratio": "stroke_ratio",
        }  # fmt: skip
        for record, name in zip(records, names, strict=True):
            slave = self.slaves[name]
            model = slave.model
            for field, port in ports.items():
                record[field] = self.slots[name, port]
            record["friction"] = self.friction[name, "force"]
            given = (name, "acceleration") in self.source_of or slave.was_set("acceleration")
            record["a"] = self.slots[name, "acceleration"] if given else -1
            for field in ("law", "n_moving", "advances", "n_own", "signed", "active"):
                record[field] = getattr(model.setup, field)
            record["n_states"] = len(model.z) if model.active else model.setup.n_own
            record["v_max"], record["stroke"] = slave["v_max"], slave["stroke"]
            record["on_structure"] = self._pushed_by(name)
            _fill(record, z=model.z, z1=model.z, p=model.p, on=model.on, moving=model.moving)
        records["halts"] = records["on_structure"] >= 0
        sticking = records["on_structure"][records["signed"]]
        for record in records:
            together = int(np.count_nonzero(sticking == record["on_structure"]))
            record["sharing"] = max(1, together)
        return records

    def _pushed_by(self, damper: str) -> int:
        """Return the structure whose first level a damper both feels and pushes, or -1."""
        structures = self.names["structure"]
        name, port = self.source_of.get((damper, "velocity"), ("", ""))
        if name in structures and port == f"{self._levels(name)[0]}_velocity":
            for force in ("damper_force", "extra_force"):
                if self.source_of.get((name, force)) == (damper, "force"):
                    return structures.index(name)
        return -1

    def _structures(self, h: float) -> Array:
        names = self.names["structure"]
        records = np.zeros(len(names), layout.structure_record())
        for record, name in zip(records, names, strict=True):
            model = self.slaves[name].model
            m = model.m
            step = step_matrices(m, h)
            for field, port in (
                ("ground", "ground_acceleration"), ("force", "damper_force"),
                ("extra", "extra_force"), ("holding", "holding_force"),
                ("first_output", f"{self._levels(name)[0]}_displacement"),
            ):  # fmt: skip
                record[field] = self.slots[name, port]
            for field, port in (("friction", "damper_force"), ("extra_friction", "extra_force")):
                source = self.source_of.get((name, port), ("", ""))
                record[field] = self.friction.get(source, self.no_friction)
            ground = self.source_of.get((name, "ground_acceleration"), ("", ""))[0]
            record["follows"], record["followed"] = ground in names, self._followed(name)
            record["n"], record["isolated"], record["mass"] = m.n, m.isolated, m.mass
            record["active"] = model.active
            record["gain"] = step.held[m.n * (m.n + 1)]
            _fill(
                record, phi=step.phi, held=step.held, ramp=step.ramp, m_inverse=m.M_inverse, c=m.C,
                k=m.K, stiffness=m.stiffnesses, x=model.x, z=model.z, p=model.p, on=model.on,
            )  # fmt: skip
        return records

    def _followed(self, structure: str) -> bool:
        """Return whether a component reads more of a structure than displacement and velocity."""
        read = {port for name, port in self.source_of.values() if name == structure}
        motion = {
            f"{level}_{what}"
            for level in self._levels(structure)
            for what in ("displacement", "velocity")
        }
        return bool(read - motion)

    def _levels(self, structure: str) -> list[str]:
        levels: list[str] = self.slaves[structure].building.levels()
        return levels


def kind_of(component: Component, scenario: Scenario) -> str:
    """Return "source", "damper" or "structure".

    Raises
    ------
    ScenarioError
        Naming a component that cannot be compiled.
    """
    if component.path is None and component.fmu in KINDS:
        return KINDS[component.fmu]
    raise ScenarioError(
        f"{scenario.file} [components.{component.name}]: {component.fmu} cannot be compiled. "
        f"Compiled are {', '.join(sorted(KINDS))}; run it with the engine fmu."
    )


def configured(component: Component, scenario: Scenario) -> Slave:
    """Return the component's Python object with the scenario's values, its model built."""
    slave = catalogue.instantiate(
        component.fmu,
        component.building,
        component.name,
        component.controller,
        component.effects,
    )
    for name, value in component.parameters.items():
        if name == "record":
            value = ground_motion_file(str(value), scenario.file.parent)
        elif name == "file":
            value = str((scenario.file.parent / Path(str(value))).absolute())
        index = slave._index[name]
        slave._values[index] = type(slave._values[index])(value)
        slave._set.add(index)
    try:
        slave._check_parameters()
        slave.configure()
    except (ValueError, OSError, RuntimeError) as error:
        raise ScenarioError(f"{scenario.file} [components.{component.name}]: {error}") from error
    return slave


def source_signal(slave: Any) -> dict[str, Any]:
    """Return the signal of a source: kind, numbers, samples, and the ports of value and rate."""
    signal: dict[str, Any] = {
        "kind": CSV, "p": [0.0] * len(PARAMETERS), "times": [0.0], "samples": [0.0],
        "delay": 0.0, "scale": 1.0, "value": "value", "rate": "",
    }  # fmt: skip
    name = type(slave).__name__
    if name == "ConstantVoltage":
        signal.update(kind=CONSTANT, p=[slave["level"], *signal["p"][1:]], value="voltage")
    elif name == "GroundMotion":
        motion = slave.motion
        signal.update(times=motion.times, samples=motion.values, value="ground_acceleration")
        signal.update(delay=slave["start"], scale=slave.scale)
    else:
        signal.update(kind=slave.code, p=slave.numbers, times=slave.times, samples=slave.samples)
        if name == "PrescribedMotion":
            signal.update(value="displacement", rate="velocity")
    return signal


def _fill(record: Any, **values: Any) -> None:
    """Write sequences to the begin of array fields."""
    for name, value in values.items():
        record[name][: len(value)] = value

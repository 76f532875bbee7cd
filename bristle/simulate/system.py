"""Lays a scenario of built-in components out in records of numbers for the time loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import controller, damper, sensors, source, structure
from ..component.devices import DEVICE_FORCES
from ..data import ground_motion_file
from ..errors import ScenarioError
from ..fmu import catalogue
from ..fmu.slave import Slave
from ..physics.signals import CONSTANT
from ..scenario.scenario import Component, Scenario
from . import records
from .clocks import Clocks
from .pushed import pushed_by, sharing, velocity_per_force

Array = NDArray[Any]
Port = tuple[str, str]

KINDS: dict[Any, str] = {
    structure: "structure",
    damper: "damper",
    source: "source",
    controller: "sampled",
    sensors: "sampled",
}
"""What the functions of a component make it in the time loop."""


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
        for c in scenario.connections:
            if (c.factor, c.offset) != (1.0, 0.0):
                raise ScenarioError(
                    f'{scenario.file}: "{c.target}.{c.input}" has a factor or an offset, which is '
                    "not compiled. Run it with the engine fmu."
                )
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
            self._add_slots(component)
        self.slots.update({end: self.slots[begin] for end, begin in self.source_of.items()})

    def _add_slots(self, component: Component) -> None:
        """Give every input and output a slot; hidden outputs stand behind the others."""
        for variable in component.description.variables.values():
            name = f"{component.name}.{variable.name}"
            if variable.name == "fault":
                for k in range(self.slaves[component.name].hidden):
                    self.slots[component.name, f"hidden {k}"] = len(self.slots)
            if variable.causality in ("input", "output"):
                self.slots[component.name, variable.name] = len(self.slots)
            if variable.causality == "output":
                self.outputs[name] = self.slots[component.name, variable.name]
                self.kinds[name] = variable.kind

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
        signals = np.zeros(len(self.slots) + 1)  # the last one is no friction
        for name, slave in self.slaves.items():
            for index in slave._inputs:
                key = (name, slave.vars[index].name)
                if key not in self.source_of:
                    signals[self.slots[key]] = slave._values[index]
        for name in self.names["source"]:
            constants = self.slaves[name].constants
            if constants.kind == CONSTANT:
                signals[self._first(name)] = constants.scale * constants.p[0]
        return signals

    def _first(self, name: str) -> int:
        """Return the slot of a component's first output; the others follow."""
        slave = self.slaves[name]
        return self.slots[name, slave.vars[slave._outputs[0]].name]

    def _inputs(self, name: str) -> list[int]:
        """Return the slots of a component's inputs."""
        slave = self.slaves[name]
        return [self.slots[name, slave.vars[index].name] for index in slave._inputs]

    def coupled(self, h: float) -> tuple[Array, Array]:
        """Return dampers and structures for substeps of h [s]."""
        structures = self._structures(h)
        return self._dampers(structures, h), structures

    def periods(self) -> list[float]:
        """Return the sample periods [s] of the components that have a clock."""
        return [self.slaves[name]["sample_period"] for name in self.names["sampled"]]

    def sampled(self, h: float) -> tuple[Array, Array, Array]:
        """Return sampled components, their constants and memory for substeps of h [s]."""
        slaves = {name: self.slaves[name] for name in self.names["sampled"]}
        clocks = Clocks(slaves, lambda *port: self.slots[port], h)
        return clocks.records, clocks.constants, clocks.memory

    def sources(self) -> tuple[Array, Array, Array]:
        """Return the sources that change, as records, and the samples of all of them."""
        constants = {name: self.slaves[name].constants for name in self.names["source"]}
        changing = {name: c for name, c in constants.items() if c.kind != CONSTANT}
        found = np.zeros(len(changing), records.source_record())
        times: list[float] = []
        samples: list[float] = []
        for record, (name, c) in zip(found, changing.items(), strict=True):
            record["first"], record["begin"] = self._first(name), len(times)
            times.extend(c.times)
            samples.extend(c.samples)
            record["end"] = len(times)
            for field in ("kind", "scale", "delay", "rated"):
                record[field] = getattr(c, field)
            _fill(record, p=c.p)
        return found, np.array(times), np.array(samples)

    def _dampers(self, structures: Array, h: float) -> Array:
        """Return the dampers; one that sticks does so with the structure that it pushes."""
        names = self.names["damper"]
        found = np.zeros(len(names), records.damper_record())
        buildings = {name: self.slaves[name].building for name in self.names["structure"]}
        pushed = [pushed_by(name, buildings, self.source_of, self.slots) for name in names]
        signs = [self.slaves[name].constants.setup.signed for name in names]
        sticking = [at for at, signed in zip(pushed, signs, strict=True) if at and signed]
        for record, name, at in zip(found, names, pushed, strict=True):
            c, state = self.slaves[name].constants, self.slaves[name].state
            _copy(record, c.setup, ("law", "n_moving", "n_own"))
            _copy(record, c.setup, ("active", "advances", "signed", "lags"))
            _copy(record, c, ("v_max", "stroke"))
            own = c.setup
            _fill(record, state=state, new_state=state, p=own.p, on=own.on, moving=own.moving)
            record["inputs"], record["first"] = self._inputs(name), self._first(name)
            given = (name, "acceleration") in self.source_of
            record["measured"] = c.measured or given
            record["on_structure"], record["sharing"] = -1, 1.0
            if at:
                there = structures[at.structure]
                gain = velocity_per_force(there, at.device, at.device)
                beside = [other.device for other in sticking if other.structure == at.structure]
                record["on_structure"], record["holding"] = at.structure, at.holding
                record["sharing"] = sharing(there, beside)
                record["moving_mass"] = -h / (gain * record["sharing"])
        return found

    def _structures(self, h: float) -> Array:
        names = self.names["structure"]
        found = np.zeros(len(names), records.structure_record())
        for record, name in zip(found, names, strict=True):
            c, state = self.slaves[name].constants_of(h), self.slaves[name].state
            _copy(record, c, ("n", "mass", "h", "active", "touches", "isolated"))
            _fill(
                record, stiffnesses=c.stiffnesses, m_inverse=c.m_inverse, damping=c.damping,
                stiffness=c.stiffness, phi=c.phi, held=c.held, ramp=c.ramp, p=c.p, on=c.on,
                state=state, new_state=state,
            )  # fmt: skip
            inputs = self._inputs(name)
            _fill(record, inputs=inputs[:DEVICE_FORCES], forces=inputs[DEVICE_FORCES:], ends=c.ends)
            record["first"], record["devices"] = self._first(name), c.devices
            record["n_states"], record["followed"] = len(state), self._followed(name)
            for field, port in (("friction", "damper_force"), ("extra_friction", "extra_force")):
                record[field] = self._friction_at(name, port)
            for k, device in enumerate(self.slaves[name].building.devices):
                record["frictions"][k] = self._friction_at(name, device.ports.force)
        return found

    def _friction_at(self, structure: str, port: str) -> int:
        """Return the slot of the friction in a force on a structure; the last one is none."""
        begin = self.source_of.get((structure, port), ("", ""))
        pushes = begin[0] in self.names["damper"] and begin[1] == "force"
        return self.slots[begin[0], "hidden 0"] if pushes else len(self.slots)

    def _followed(self, structure: str) -> bool:
        """Return whether a component reads more of a structure than displacement and velocity."""
        read = {port for name, port in self.source_of.values() if name == structure}
        motion = {
            f"{level}_{what}"
            for level in self._levels(structure)
            for what in ("displacement", "velocity")
        }
        for device in self.slaves[structure].building.devices:
            motion |= {device.ports.displacement, device.ports.velocity}
        return bool(read - motion)

    def _levels(self, structure: str) -> list[str]:
        levels: list[str] = self.slaves[structure].building.levels()
        return levels


def kind_of(component: Component, scenario: Scenario) -> str:
    """Return "source", "damper", "structure" or "sampled".

    Raises
    ------
    ScenarioError
        Naming a component that cannot be compiled.
    """
    known = catalogue.component_names()
    if component.path is None and (component.law or component.fmu in known):
        kind: Any = catalogue.component_class(catalogue.source(component.made_of()))
        return KINDS[kind.functions]
    raise ScenarioError(
        f"{scenario.file} [components.{component.name}]: {component.fmu} cannot be compiled. "
        f"Compiled are {', '.join(known)}; run it with the engine fmu."
    )


def configured(component: Component, scenario: Scenario) -> Slave:
    """Return the component's Python object with the scenario's values, its model built."""
    slave = catalogue.instantiate(
        component.made_of(),
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
    if following := getattr(slave, "following", {}):
        raise ScenarioError(
            f"{scenario.file} [components.{component.name}]: an effect follows "
            f"{', '.join(following)}, which is not compiled. Run it with the engine fmu."
        )
    return slave


def _copy(record: Any, constants: Any, fields: tuple[str, ...]) -> None:
    """Copy numbers of a component's constants."""
    for field in fields:
        record[field] = getattr(constants, field)


def _fill(record: Any, **values: Any) -> None:
    """Write sequences to the begin of array fields."""
    for name, value in values.items():
        record[name][: len(value)] = value

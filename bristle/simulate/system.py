"""Lays a scenario of built-in components out in records of numbers for the time loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import controller, damper, sensors, source, structure
from ..data import ground_motion_file
from ..errors import ScenarioError
from ..fmu import catalogue
from ..fmu.slave import Slave
from ..physics import damper as damper_laws
from ..physics import structure as structure_laws
from ..physics.codegen import Functions, Owner
from ..physics.device import GROUND
from ..physics.laws import LAWS
from ..physics.signals import CONSTANT
from ..scenario.scenario import Component, Scenario
from . import records
from .clocks import Clocks
from .layout import NOWHERE, lay_damper, lay_source, lay_structure
from .pushed import couple, pushed_by, room

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

SITES = {"damper": damper_laws.SETS, "structure": structure_laws.SETS}
"""Where effects are in the time loop, with the functions that there are."""


class System:
    """A scenario's components as configured objects, and the slots of their signals.

    Attributes
    ----------
    dampers, structures : Functions
        The library's, or where a component has a law or effect that is not in it, those of all
        that the components have.
    outputs, kinds : dict
        `component.port` to the slot of the signal, and to the kind of the variable.

    Parameters
    ----------
    scenario : Scenario
    offered : bool
        Whether a component has all effects that it offers, or those that are on.
    """

    def __init__(self, scenario: Scenario, offered: bool = False) -> None:
        self.names: dict[str, list[str]] = {
            kind: [] for kind in ("source", "damper", "structure", "sampled")
        }
        for c in scenario.connections:
            if (c.factor, c.offset) != (1.0, 0.0):
                raise ScenarioError(
                    f'{scenario.file}: "{c.target}.{c.input}" has a factor or an offset, which is '
                    "not compiled. Run it with the engine fmu."
                )
            given, wanted = (
                scenario.component(name).description.variables[port]
                for name, port in ((c.source, c.output), (c.target, c.input))
            )
            if given.kind != wanted.kind:
                raise ScenarioError(
                    f'{scenario.file}: "{c.target}.{c.input}" is {wanted.kind} and is fed by '
                    f"{given.kind}, which is not compiled. Run it with the engine fmu."
                )
        for component in scenario.components:
            self.names[kind_of(component, scenario)].append(component.name)
        self.slaves: dict[str, Any] = {
            component.name: instantiated(component, scenario) for component in scenario.components
        }
        self.dampers, self.structures = self._functions(offered)
        for component in scenario.components:
            configure(self.slaves[component.name], component, scenario)
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

    def _functions(self, offered: bool) -> tuple[Functions, Functions]:
        """Let dampers compute with the same functions, and structures."""
        slaves = {site: [self.slaves[name] for name in self.names[site]] for site in SITES}
        own = any(one.made is not SITES[site].library for site in SITES for one in slaves[site])
        found = []
        for site, sets in SITES.items():
            owners: set[Owner] = {LAWS[one.law].base for one in slaves[site] if site == "damper"}
            for one in slaves[site]:
                owners |= {e for e in one._effects if offered or one[e.name + ".on"]}
            found.append(sets.of(*owners) if own else sets.library)
            for one in slaves[site]:
                one.take(found[-1])
        return found[0], found[1]

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
        structures, dampers = self._structures(h), self._dampers()
        couple(dampers, structures, h, np.zeros(room(len(dampers))))
        return dampers, structures

    def periods(self) -> list[float]:
        """Return the sample periods [s] of the components that have a clock."""
        return [self.slaves[name]["sample_period"] for name in self.names["sampled"]]

    def sampled(self, h: float) -> tuple[Array, Array, Array]:
        """Return sampled components, their constants and memory for substeps of h [s]."""
        names = self.names["sampled"]
        wirings = [self.wiring(name) for name in names]
        clocks = Clocks([self.slaves[name] for name in names], wirings, h)
        return clocks.records, clocks.constants, clocks.memory

    def sources(self) -> tuple[Array, Array, Array]:
        """Return the sources that change, as records, and the samples of all of them."""
        constants = {name: self.slaves[name].constants for name in self.names["source"]}
        changing = {name: c for name, c in constants.items() if c.kind != CONSTANT}
        found = np.zeros(len(changing), records.source_record())
        times: list[float] = []
        samples: list[float] = []
        for record, (name, c) in zip(found, changing.items(), strict=True):
            lay_source(record, c, self._first(name), len(times))
            times.extend(c.times)
            samples.extend(c.samples)
        return found, np.array(times), np.array(samples)

    def _dampers(self) -> Array:
        names = self.names["damper"]
        found = np.zeros(len(names), records.damper_record(self.dampers.slots))
        for record, name in zip(found, names, strict=True):
            slave = self.slaves[name]
            lay_damper(record, slave.constants, slave.state, self.wiring(name))
        return found

    def _structures(self, h: float) -> Array:
        names = self.names["structure"]
        found = np.zeros(len(names), records.structure_record(self.structures.slots))
        for record, name in zip(found, names, strict=True):
            slave = self.slaves[name]
            lay_structure(record, slave.constants_of(h), slave.state, self.wiring(name))
        return found

    # -- where the signals of a component are, as `layout` takes it

    def wiring(self, name: str) -> list[float]:
        """Return where the signals of a component are, and what they are to the others."""
        if name in self.names["source"]:
            return [self._first(name)]
        if name in self.names["sampled"]:
            return [self._first(name), *self._inputs(name)]
        if name in self.names["damper"]:
            return [self._first(name), *self._pushed(name), *self._inputs(name)]
        inputs, devices = self._inputs(name), self.slaves[name].building.devices
        frictions = [self._friction_at(name, device.ports.force) for device in devices]
        first = [self._friction_at(name, port) for port in ("damper_force", "extra_force")]
        return [self._first(name), self._followed(name), *first, *inputs, *frictions]

    def _pushed(self, name: str) -> list[float]:
        buildings = {one: self.slaves[one].building for one in self.names["structure"]}
        at = pushed_by(name, buildings, self.source_of, self.slots)
        measured = (name, "acceleration") in self.source_of
        if at is None:
            return [NOWHERE, NOWHERE, measured, GROUND, GROUND]
        return [at.structure, at.holding, measured, at.device.lower, at.device.upper]

    def _friction_at(self, structure: str, port: str) -> int:
        """Return the slot of the friction in a force on a structure; the last one is none."""
        begin = self.source_of.get((structure, port), ("", ""))
        pushes = begin[0] in self.names["damper"] and begin[1] == "force"
        return self.slots[begin[0], "hidden 0"] if pushes else len(self.slots)

    def _followed(self, structure: str) -> bool:
        """Return whether a component reads more of a structure than displacement and velocity."""
        read = {port for name, port in self.source_of.values() if name == structure}
        building = self.slaves[structure].building
        motion = {
            f"{level}_{what}"
            for level in building.levels()
            for what in ("displacement", "velocity")
        }
        for device in building.devices:
            motion |= {device.ports.displacement, device.ports.velocity}
        return bool(read - motion)


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


def instantiated(component: Component, scenario: Scenario) -> Slave:
    """Return the component's Python object with the scenario's values."""
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
    return slave


def configure(slave: Slave, component: Component, scenario: Scenario) -> None:
    """Build the model of a component's Python object."""
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

"""Lays a scenario of built-in components out in arrays, marches it, hands back named columns."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..cosim.scenario import Component, Scenario
from ..errors import RunError, ScenarioError
from ..fmu import catalogue
from ..fmu.damper import DamperSlave
from ..fmu.slave import Slave
from ..physics import damper as damper_laws
from ..physics.signals import CONSTANT, CSV, PARAMETERS
from ..physics.structure import step_matrices, work_size
from ..records import ground_motion_file

LONGEST_SUBSTEP = 2e-4
"""Longest substep [s]; half-sine peaks are then within 0.001 % of a tight integration."""

Array = NDArray[Any]
Slots = dict[tuple[str, str], int]


class Sources(NamedTuple):
    """Signals that depend on time alone, one row each."""

    kind: Array
    p: Array
    begin: Array
    end: Array
    delay: Array
    scale: Array
    out: Array
    rate_out: Array
    times: Array
    samples: Array


class Dampers(NamedTuple):
    """Dampers, one row each; x, v, V, a and the outputs are slots of signals (-1: none)."""

    law: Array
    p: Array
    on: Array
    z: Array
    moving: Array
    n_moving: Array
    advances: Array
    v_max: Array
    stroke: Array
    on_structure: Array
    x: Array
    v: Array
    V: Array
    a: Array
    force: Array
    energy: Array
    stroke_ratio: Array
    work: Array


class Structures(NamedTuple):
    """Structures, one row each, their matrices flat and padded to the largest."""

    n: Array
    isolated: Array
    active: Array
    phi: Array
    held: Array
    ramp: Array
    m_inverse: Array
    c: Array
    k: Array
    stiffness: Array
    mass: Array
    x: Array
    z: Array
    p: Array
    on: Array
    ground: Array
    force: Array
    extra: Array
    first_output: Array
    feeds_acceleration: Array
    work: Array


def simulate(scenario: Scenario) -> dict[str, Array]:
    """Return the columns of a run, time [s] first, then every output as `component.port`.

    Parameters
    ----------
    scenario : Scenario
        Of built-in components only.

    Returns
    -------
    dict
        Name to (steps + 1,) array in SI units; Integer outputs as int32.

    Raises
    ------
    ScenarioError
        Naming a component that cannot be compiled.
    RunError
        If a value stops being finite; the text says when.
    """
    system = System(scenario)
    rows, substeps = scenario.steps, max(1, ceil(scenario.step / LONGEST_SUBSTEP - 1e-9))
    table = np.zeros((rows + 1, len(system.outputs)))
    march = compiled_march()
    wrong, unsettled = march(
        rows, substeps, scenario.step / substeps, *system.arrays(scenario.step / substeps),
        system.start_values(), np.array(list(system.outputs.values()), dtype=np.int64), table,
    )  # fmt: skip
    if wrong >= 0:
        raise RunError(
            f"{scenario.file}: a value is not finite at {wrong * scenario.step:g} s. "
            "A shorter step or parameters within their bounds would be right."
        )
    system.unsettled = int(unsettled)
    columns: dict[str, Array] = {"time": np.arange(rows + 1) * scenario.step}
    for j, name in enumerate(system.outputs):
        integer = system.kinds[name] == "Integer"
        columns[name] = table[:, j].astype(np.int32) if integer else table[:, j]
    return columns


@cache
def compiled_march() -> Callable[..., tuple[int, int]]:
    """Return the compiled time march; the first call on a machine takes seconds."""
    from . import march
    from .jit import compiled

    function: Callable[..., tuple[int, int]] = compiled(march.march)
    return function


class System:
    """A scenario's components as configured objects, and the slots of their signals."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.unsettled = 0
        self.slaves = {component.name: _configured(component, scenario) for component in scenario.components}
        self.slots: Slots = {}
        for component in scenario.components:
            for variable in component.description.variables.values():
                if variable.causality in ("input", "output"):
                    self.slots[component.name, variable.name] = len(self.slots)
        self.size = len(self.slots)
        self.connected = {(c.target, c.input): (c.source, c.output) for c in scenario.connections}
        for target, source in self.connected.items():
            self.slots[target] = self.slots[source]
        self.outputs: dict[str, int] = {}
        self.kinds: dict[str, str] = {}
        for component in scenario.components:
            for variable in component.description.of("output"):
                name = f"{component.name}.{variable.name}"
                self.outputs[name] = self.slots[component.name, variable.name]
                self.kinds[name] = variable.kind

    def start_values(self) -> Array:
        """Return the signals (size,) before the run: what the scenario holds constant."""
        signals = np.zeros(self.size)
        for name, slave in self.slaves.items():
            for index in slave._inputs:
                key = (name, slave.vars[index].name)
                if key not in self.connected:
                    signals[self.slots[key]] = slave._values[index]
        return signals

    def arrays(self, h: float) -> tuple[Sources, Dampers, Structures]:
        """Return the arrays of sources, dampers and structures for a substep of h [s]."""
        by_kind: dict[str, list[str]] = {"source": [], "damper": [], "structure": []}
        for component in self.scenario.components:
            by_kind[_kind(component, self.scenario)].append(component.name)
        structures = by_kind["structure"]
        return (
            self._sources(by_kind["source"]),
            self._dampers(by_kind["damper"], structures),
            self._structures(structures, h),
        )

    def _sources(self, names: list[str]) -> Sources:
        rows: list[tuple[Any, ...]] = []
        times: list[float] = []
        samples: list[float] = []
        for name in names:
            slave = self.slaves[name]
            kind, numbers, own, delay, scale, out, rate = _source(slave)
            begin = len(times)
            times.extend(own[0])
            samples.extend(own[1])
            rate_slot = self.slots[name, rate] if rate else -1
            slot = self.slots[name, out]
            rows.append((kind, numbers, begin, len(times), delay, scale, slot, rate_slot))
        columns = list(zip(*rows, strict=True)) if rows else [()] * 8
        return Sources(
            _ints(columns[0]), _table(columns[1], len(PARAMETERS)), _ints(columns[2]),
            _ints(columns[3]), _floats(columns[4]), _floats(columns[5]), _ints(columns[6]),
            _ints(columns[7]), _floats(times), _floats(samples),
        )  # fmt: skip

    def _dampers(self, names: list[str], structures: list[str]) -> Dampers:
        layout = damper_laws.LAYOUT
        slaves: list[Any] = [self.slaves[name] for name in names]
        models = [slave.model for slave in slaves]
        moving = np.zeros((len(names), layout.z_size), dtype=np.int64)
        for i, model in enumerate(models):
            moving[i, : len(model.moving)] = model.moving

        def slots(port: str) -> Array:
            return _ints([self.slots[name, port] for name in names])

        accelerations = [
            self.slots[name, "acceleration"]
            if (name, "acceleration") in self.connected or slave.was_set("acceleration")
            else -1
            for name, slave in zip(names, slaves, strict=True)
        ]
        return Dampers(
            law=_ints([model.law for model in models]),
            p=_table([model.p for model in models], layout.p_size),
            on=_table([model.on for model in models], len(layout.effects)).astype(np.bool_),
            z=_table([model.z for model in models], layout.z_size),
            moving=moving,
            n_moving=_ints([len(model.moving) for model in models]),
            advances=np.array([model.advances for model in models], dtype=np.bool_),
            v_max=_floats([slave["v_max"] for slave in slaves]),
            stroke=_floats([slave["stroke"] for slave in slaves]),
            on_structure=_ints([self._halted_by(name, structures) for name in names]),
            x=slots("displacement"),
            v=slots("velocity"),
            V=slots("voltage"),
            a=_ints(accelerations),
            force=slots("force"),
            energy=slots("dissipated_energy"),
            stroke_ratio=slots("stroke_ratio"),
            work=np.zeros(damper_laws.work_size()),
        )

    def _halted_by(self, damper: str, structures: list[str]) -> int:
        """Return the structure whose first level a damper both feels and pushes, or -1."""
        name, port = self.connected.get((damper, "velocity"), ("", ""))
        if name in structures and port == f"{_levels(self.slaves[name])[0]}_velocity":
            for force in ("damper_force", "extra_force"):
                if self.connected.get((name, force)) == (damper, "force"):
                    return structures.index(name)
        return -1

    def _structures(self, names: list[str], h: float) -> Structures:
        slaves: list[Any] = [self.slaves[name] for name in names]
        models = [slave.model for slave in slaves]
        steps = [step_matrices(model.m, h) for model in models]
        n = max((model.m.n for model in models), default=1)
        read = {source for target, source in self.connected.items() if target[1] == "acceleration"}

        def slots(port: str) -> Array:
            return _ints([self.slots[name, port] for name in names])

        return Structures(
            n=_ints([model.m.n for model in models]),
            isolated=np.array([model.m.isolated for model in models], dtype=np.bool_),
            active=np.array([model.active for model in models], dtype=np.bool_),
            phi=_table([step.phi for step in steps], 4 * n * n),
            held=_table([step.held for step in steps], 2 * n * (n + 1)),
            ramp=_table([step.ramp for step in steps], 2 * n * (n + 1)),
            m_inverse=_table([model.m.M_inverse for model in models], n * n),
            c=_table([model.m.C for model in models], n * n),
            k=_table([model.m.K for model in models], n * n),
            stiffness=_table([model.m.stiffnesses for model in models], n),
            mass=_floats([model.m.mass for model in models]),
            x=_table([model.x for model in models], 2 * n),
            z=_table([model.z for model in models], max(1, len(models[0].z) if models else 0)),
            p=_table([model.p for model in models], max(1, len(models[0].p) if models else 0)),
            on=_table(
                [model.on for model in models], max(1, len(models[0].on) if models else 0)
            ).astype(np.bool_),
            ground=slots("ground_acceleration"),
            force=slots("damper_force"),
            extra=slots("extra_force"),
            first_output=_ints(
                [self.slots[name, f"{_levels(self.slaves[name])[0]}_displacement"] for name in names]
            ),
            feeds_acceleration=np.array(
                [any(source == name for source, _ in read) for name in names], dtype=np.bool_
            ),
            work=np.zeros(max(64, work_size(n))),
        )


def _kind(component: Component, scenario: Scenario) -> str:
    names = {"Structure": "structure", "LuGreDamper": "damper", "BinghamDamper": "damper"}
    sources = ("ConstantVoltage", "GroundMotion", "SignalSource", "PrescribedMotion")
    if component.path is None and component.fmu in names:
        return names[component.fmu]
    if component.path is None and component.fmu in sources:
        return "source"
    raise ScenarioError(
        f"{scenario.file} [components.{component.name}]: {component.fmu} cannot be compiled. "
        f"Compiled are {', '.join([*sorted(names), *sources])}; run it with the engine fmu."
    )


def _configured(component: Component, scenario: Scenario) -> Slave:
    """Return the component's Python object with the scenario's values, its model built."""
    _kind(component, scenario)
    slave = catalogue.instantiate(component.fmu, component.building, component.name)
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


def _source(slave: Any) -> tuple[int, list[float], tuple[list[float], list[float]], float, float, str, str]:
    """Return kind, numbers, samples, delay [s], scale, and the names of the value and its rate."""
    none: tuple[list[float], list[float]] = ([0.0], [0.0])
    zeros = [0.0] * len(PARAMETERS)
    name = type(slave).__name__
    if name == "ConstantVoltage":
        return CONSTANT, [slave["level"], *zeros[1:]], none, 0.0, 1.0, "voltage", ""
    if name == "GroundMotion":
        own = (slave.motion.times, slave.motion.values)
        return CSV, zeros, own, slave["start"], slave.scale, "ground_acceleration", ""
    own = (slave.times, slave.samples)
    if name == "PrescribedMotion":
        return slave.code, slave.numbers, own, 0.0, 1.0, "displacement", "velocity"
    return slave.code, slave.numbers, own, 0.0, 1.0, "value", ""


def _levels(slave: Any) -> list[str]:
    levels: list[str] = slave.building.levels()
    return levels


def _ints(values: Any) -> Array:
    return np.array(list(values), dtype=np.int64)


def _floats(values: Any) -> Array:
    return np.array(list(values), dtype=np.float64)


def _table(rows: Any, width: int) -> Array:
    """Return rows of different length as one array, padded with zeros."""
    table = np.zeros((len(rows), width))
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    return table

"""What a limit is computed for: the numbers of a scenario's building, damper and ground motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import source, structure
from ..component.damper import REMEMBERED
from ..component.structure_setup import Constants as StructureConstants
from ..errors import ScenarioError
from ..findings import unknown
from ..physics import damper as damper_laws
from ..physics.building import frequencies
from ..physics.codegen import Functions
from ..physics.inputs import Setup
from ..scenario.scenario import Scenario
from ..simulate.system import System
from .response import Plant

Array = NDArray[np.float64]

STEPS_PER_PERIOD = 200
"""Steps in a period of the first mode, about; whole ones of the scenario's."""
FINER = 4
"""By how much they are finer where friction sticks: its force is then held over a step."""


FEWEST = 50
"""Instants that a ground motion must have."""


@dataclass(frozen=True)
class Case:
    """A scenario with one damper whose voltage is free.

    Attributes
    ----------
    scenario : Scenario
    structure, damper, command : str
        Names of the components, and of the damper's input that is free.
    output, unit : str
        The output that is judged, "component.port", and its unit.
    plant, setup : Plant, Setup
    functions : Functions
        Of the damper.
    ground : (N + 1,) array
        Ground acceleration [m/s2] at 0, h, ...
    states : (k,) array
        Of the damper at the begin.
    v_max : float
        V
    command_unit : str
        That of v_max; A where a current commands the damper.
    frequency : float
        Of the building's first mode [Hz].
    mass, stiffness : (n, n) arrays
        Of the building [kg, N/m].
    plain : bool
        Whether the damper is its law alone, without effects.
    """

    scenario: Scenario
    structure: str
    damper: str
    command: str
    output: str
    unit: str
    plant: Plant
    setup: Setup
    functions: Functions
    ground: Array
    states: Array
    v_max: float
    command_unit: str
    frequency: float
    mass: Array
    stiffness: Array
    plain: bool

    @property
    def time(self) -> Array:
        """The instants 0, h, ... (N + 1,) [s]."""
        found: Array = np.arange(len(self.ground)) * np.float64(self.plant.h)
        return found


def case_of(scenario: Scenario, output: str) -> Case:
    """Return what a limit of a scenario is computed for.

    Raises
    ------
    ScenarioError
        If it has not one structure, one damper that it feels and pushes, and a ground motion; if
        the structure is not linear; if there is no such output of the structure; if a component
        cannot be compiled.
    """
    system = System(scenario)
    building, damper = (_only(system, kind, scenario) for kind in ("structure", "damper"))
    slave, law = system.slaves[building], system.slaves[damper]
    _refuse_effects(slave, scenario, building)
    unit = _unit_of(output, scenario, system, building)
    if system.coupled(scenario.step)[0][0]["on_structure"] < 0:
        raise ScenarioError(
            f"{scenario.file} [components.{damper}]: must feel the motion of the place at "
            f"{building} where its force acts; a limit is computed for one damper at one place."
        )
    v_max = _largest(law, scenario, damper)
    ports = [slave.vars[index].name for index in slave._inputs]
    pushed = next(p for p in ports if system.source_of.get((building, p)) == (damper, "force"))
    felt = [system.source_of[damper, name][1] for name in ("displacement", "velocity")]
    _refuse_other_forces(scenario, system, building, pushed)
    setup, command = _compilable(law.constants.setup), law.vars[law._inputs[2]]
    frequency = frequencies(slave.building)[0]
    h = _step(scenario, frequency) / (FINER if setup.signed else 1)
    return Case(
        scenario, building, damper, command.name, output, unit,
        _plant(slave, h, ports.index(pushed), felt, output.partition(".")[2], bool(setup.signed)),
        setup, law.made, _ground(system, building, h, scenario),
        np.array(law.state[: len(law.state) - REMEMBERED]), v_max,
        scenario.component(damper).description.variables[command.name].unit or "", frequency,
        np.linalg.inv(np.reshape(slave.constants.m_inverse, (slave.constants.n, -1))),
        np.reshape(slave.constants.stiffness, (slave.constants.n, -1)), not setup.active,
    )  # fmt: skip


def _refuse_effects(slave: Any, scenario: Scenario, building: str) -> None:
    if slave.constants.active:
        raise ScenarioError(
            f"{scenario.file} [components.{building}]: effects make the structure nonlinear; a "
            "limit is computed for a linear one. Switch them off."
        )


def _unit_of(output: str, scenario: Scenario, system: System, building: str) -> str:
    """Return the unit of an output of the structure."""
    if output not in system.outputs or not output.startswith(f"{building}."):
        known = [name for name in system.outputs if name.startswith(f"{building}.")]
        raise ScenarioError(f"{scenario.file}: {unknown('output', output, known)}")
    found = scenario.component(building).description.variables[output.partition(".")[2]]
    return found.unit or ""


def _largest(law: Any, scenario: Scenario, damper: str) -> float:
    """Return the largest command, in its own unit."""
    v_max = float(law.constants.v_max)
    if v_max <= 0.0:
        limit = law.drive.limit
        raise ScenarioError(
            f"{scenario.file} [components.{damper}]: {limit} = {v_max:g} leaves nothing to choose; "
            f"{law.drive.largest:g} {law.drive.unit} is usual."
        )
    return v_max


def _compilable(setup: Any) -> Setup:
    """Return a damper's setup as arrays."""
    given: Setup = setup._replace(
        p=np.array(setup.p, dtype=np.float64),
        on=np.array([bool(switch) for switch in setup.on], dtype=np.int8),
        moving=np.array(setup.moving, dtype=np.int64),
    )
    return given


def _only(system: System, kind: str, scenario: Scenario) -> str:
    found = system.names[kind]
    if len(found) != 1:
        listed = f" ({', '.join(found)})" if found else ""
        raise ScenarioError(
            f"{scenario.file}: has {len(found)} components of the kind {kind}{listed}; a limit is "
            "computed for one structure with one damper."
        )
    return found[0]


def _refuse_other_forces(scenario: Scenario, system: System, building: str, pushed: str) -> None:
    """Refuse forces on the structure besides the damper's."""
    slave = system.slaves[building]
    for index in slave._inputs:
        name = slave.vars[index].name
        if name in ("ground_acceleration", pushed):
            continue
        if (building, name) in system.source_of or slave._values[index] != 0.0:
            raise ScenarioError(
                f"{scenario.file} [components.{building}]: {name} acts besides the damper; a limit "
                "is computed for the ground motion and the damper alone."
            )


def _step(scenario: Scenario, frequency: float) -> float:
    """Return the step of the computation: a whole number of the scenario's steps."""
    whole = max(1, round(1.0 / (frequency * STEPS_PER_PERIOD * scenario.step)))
    while scenario.steps % whole:
        whole -= 1
    return whole * scenario.step


def _ground(system: System, building: str, h: float, scenario: Scenario) -> Array:
    name, _ = system.source_of.get((building, "ground_acceleration"), ("", ""))
    if name not in system.names["source"]:
        raise ScenarioError(
            f"{scenario.file} [components.{building}]: no ground motion feeds ground_acceleration; "
            "a limit needs a GroundMotion or another source that is known in advance."
        )
    constants, shown = system.slaves[name].constants, [0.0, 0.0]
    found = np.zeros(round(scenario.stop / h) + 1)
    for k in range(len(found)):
        source.output(k * h, shown, constants, shown, shown, shown)
        found[k] = shown[0]
    if len(found) < FEWEST:
        raise ScenarioError(
            f"{scenario.file}: stop = {scenario.stop:g} s is too short for a limit; "
            f"{FEWEST * h:g} s or more is right."
        )
    if not found.any():
        raise ScenarioError(f"{scenario.file}: the ground does not move: nothing is to be lowered.")
    return found


def _plant(slave: Any, h: float, port: int, felt: list[str], output: str, signed: bool) -> Plant:
    """Return the matrices of a structure, found by trying each state and input in turn."""
    tried = _Tried(slave, h)
    m, names = tried.states, [slave.vars[index].name for index in slave._outputs]
    rows = np.array([tried.shown(j, 0) for j in range(m)]).T
    displacement, velocity = rows[names.index(felt[0])], rows[names.index(felt[1])]
    force_0, force_1 = tried.stepped(-1, port, 0), tried.stepped(-1, port, 1)
    if signed:  # friction that sticks is held at its new value, as the coupled engine has it
        force_0, force_1 = np.zeros(m), force_0 + force_1
    at = names.index(output)
    gain = float(velocity @ (force_0 + force_1))
    return Plant(
        h, np.array([tried.stepped(j, 0, 0) for j in range(m)]).T.copy(), tried.stepped(-1, 0, 0),
        tried.stepped(-1, 0, 1), force_0, force_1, displacement.copy(), velocity.copy(),
        rows[at].copy(), float(tried.shown(-1, port)[at]), float(tried.shown(-1, 0)[at]), -h / gain,
    )  # fmt: skip


class _Tried:
    """A linear structure, one state or one input of which is 1 and all else 0."""

    def __init__(self, slave: Any, h: float) -> None:
        self._slave, self._h, self._work = slave, h, [0.0] * len(slave._work)
        self._c: StructureConstants = slave.constants_of(h)._replace(linear=True)
        self.states = 2 * self._c.n

    def stepped(self, state: int, at: int, end: int) -> Array:
        """Return the motion after a step: of a state, or of an input (-1) at one end of it."""
        c, count = self._c, len(self._slave._inputs)
        given = [[0.0] * count, [0.0] * count]
        begin, after = [0.0] * len(self._slave.state), [0.0] * len(self._slave.state)
        if state >= 0:
            begin[state] = 1.0
        else:
            given[end][at] = 1.0
        outputs, work = [0.0] * len(self._slave._outputs), self._work
        step, clock = self._slave.functions.step, (0.0, self._h, 0)
        step(clock, given[0], given[1], c, begin, after, outputs, work)
        return np.array(after[: self.states])

    def shown(self, state: int, at: int) -> Array:
        """Return the outputs at an instant: of a state, or of an input (-1)."""
        c, given = self._c, [0.0] * len(self._slave._inputs)
        begin = [0.0] * len(self._slave.state)
        if state >= 0:
            begin[state] = 1.0
        else:
            given[at] = 1.0
        outputs, work = [0.0] * len(self._slave._outputs), self._work
        self._slave.functions.settle(c, begin, work)
        structure.show_motion(c, begin, outputs)
        self._slave.functions.output(0.0, given, c, begin, outputs, work)
        return np.array(outputs)


def room(case: Case) -> int:
    """Return how many floats the damper's functions need as room to work."""
    return damper_laws.room(len(case.states)) + 3 * len(case.states)

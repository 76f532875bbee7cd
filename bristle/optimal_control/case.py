"""What a limit is computed for: the numbers of a scenario, and its voltage as a signal."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import source, structure
from ..component.damper import REMEMBERED
from ..component.structure import Constants
from ..core.arrays import Array
from ..core.jit import compiled
from ..core.text import unknown
from ..engine.coupled import RecordLayout
from ..errors import ScenarioError, not_usable
from ..fmu import catalogue
from ..physics import damper as damper_laws
from ..physics.building import frequencies
from ..physics.generate import Functions
from ..physics.tuples import Setup
from ..system.model import Component, Connection, Signal, System
from .horizon import PULL_BACK, RECEDE, RESPOND, SLOPES, START, Horizon, compute
from .response import STATES, TRIED, VOLTAGE_0, X_0, Course, DrivenPlant, Gradient

STEPS_PER_PERIOD = 200
"""Steps in a period of the first mode, about; whole ones of the scenario's."""
FINER = 4
"""By how much they are finer where friction sticks: its force is then held over a step."""


MIN_INSTANTS = 50
"""Instants that a ground motion must have."""


@dataclass(frozen=True)
class Case:
    """A scenario with one damper whose voltage is free.

    Attributes
    ----------
    scenario : System
    structure, damper, command : str
        Names of the components, and of the damper's input that is free.
    output, unit : str
        The output that is judged, "component.port", and its unit.
    plant, setup : DrivenPlant, Setup
    functions : Functions
        Of the damper.
    ground : (N + 1,) array
        Ground acceleration [m/s2] at 0, h, ...
    states : (k,) array
        Of the damper at the start.
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

    scenario: System
    structure: str
    damper: str
    command: str
    output: str
    unit: str
    plant: DrivenPlant
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


def case_of(scenario: System, output: str) -> Case:
    """Return what a limit of a scenario is computed for.

    Raises
    ------
    ScenarioError
        If it has not one structure, one damper that it feels and pushes, and a ground motion; if
        the structure is not linear; if there is no such output of the structure; if a component
        cannot be compiled.
    """
    system = RecordLayout(scenario)
    building, damper = (_only(system, kind, scenario) for kind in ("structure", "damper"))
    slave, law = system.slaves[building], system.slaves[damper]
    _refuse_effects(slave, scenario, building)
    unit = _unit_of(output, scenario, system, building)
    if system.coupled(scenario.step)[0][0]["on_structure"] < 0:
        raise ScenarioError(
            f"{scenario.where} [components.{damper}]: must feel the motion of the place at "
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
        scenario.components[damper].description.variables[command.name].unit or "", frequency,
        np.linalg.inv(np.reshape(slave.constants.m_inverse, (slave.constants.n, -1))),
        np.reshape(slave.constants.stiffness, (slave.constants.n, -1)), not setup.active,
    )  # fmt: skip


def _refuse_effects(slave: Any, scenario: System, building: str) -> None:
    if slave.constants.active:
        raise ScenarioError(
            f"{scenario.where} [components.{building}]: effects make the structure nonlinear; a "
            "limit is computed for a linear one. Switch them off."
        )


def _unit_of(output: str, scenario: System, system: RecordLayout, building: str) -> str:
    """Return the unit of an output of the structure."""
    if output not in system.outputs or not output.startswith(f"{building}."):
        known = [name for name in system.outputs if name.startswith(f"{building}.")]
        raise ScenarioError(f"{scenario.where}: {unknown('output', output, known)}")
    found = scenario.components[building].description.variables[output.partition(".")[2]]
    return found.unit or ""


def _largest(law: Any, scenario: System, damper: str) -> float:
    """Return the largest command, in its own unit."""
    v_max = float(law.constants.v_max)
    if v_max <= 0.0:
        limit = law.drive.limit
        raise ScenarioError(
            f"{scenario.where} [components.{damper}]: {limit} = {v_max:g} leaves nothing to "
            f"choose; {law.drive.largest:g} {law.drive.unit} is usual."
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


def _only(system: RecordLayout, kind: str, scenario: System) -> str:
    found = system.names[kind]
    if len(found) != 1:
        listed = f" ({', '.join(found)})" if found else ""
        raise ScenarioError(
            f"{scenario.where}: has {len(found)} components of the kind {kind}{listed}; a limit is "
            "computed for one structure with one damper."
        )
    return found[0]


def _refuse_other_forces(
    scenario: System, system: RecordLayout, building: str, pushed: str
) -> None:
    """Refuse forces on the structure besides the damper's."""
    slave = system.slaves[building]
    for index in slave._inputs:
        name = slave.vars[index].name
        if name in ("ground_acceleration", pushed):
            continue
        if (building, name) in system.source_of or slave._values[index] != 0.0:
            raise ScenarioError(
                f"{scenario.where} [components.{building}]: {name} acts besides the damper; a "
                "limit is computed for the ground motion and the damper alone."
            )


def _step(scenario: System, frequency: float) -> float:
    """Return the step of the computation: a whole number of the scenario's steps."""
    whole = max(1, round(1.0 / (frequency * STEPS_PER_PERIOD * scenario.step)))
    while scenario.steps % whole:
        whole -= 1
    return whole * scenario.step


def _ground(system: RecordLayout, building: str, h: float, scenario: System) -> Array:
    name, _ = system.source_of.get((building, "ground_acceleration"), ("", ""))
    if name not in system.names["source"]:
        raise ScenarioError(
            f"{scenario.where} [components.{building}]: no ground motion feeds "
            "ground_acceleration; a limit needs a GroundMotion or another source that is known in "
            "advance."
        )
    constants, shown = system.slaves[name].constants, [0.0, 0.0]
    found = np.zeros(round(scenario.stop / h) + 1)
    for k in range(len(found)):
        source.output(k * h, shown, constants, shown, shown, shown)
        found[k] = shown[0]
    if len(found) < MIN_INSTANTS:
        raise ScenarioError(
            f"{scenario.where}: stop = {scenario.stop:g} s is too short for a limit; "
            f"{MIN_INSTANTS * h:g} s or more is right."
        )
    if not found.any():
        raise ScenarioError(
            f"{scenario.where}: the ground does not move: nothing is to be lowered."
        )
    return found


def _plant(
    slave: Any, h: float, port: int, felt: list[str], output: str, signed: bool
) -> DrivenPlant:
    """Return the matrices of a structure, found by trying each state and input in turn."""
    tried = _UnitResponse(slave, h)
    m, names = tried.states, [slave.vars[index].name for index in slave._outputs]
    rows = np.array([tried.shown(j, 0) for j in range(m)]).T
    displacement, velocity = rows[names.index(felt[0])], rows[names.index(felt[1])]
    force_0, force_1 = tried.stepped(-1, port, 0), tried.stepped(-1, port, 1)
    if signed:  # friction that sticks is held at its new value, as the coupled engine has it
        force_0, force_1 = np.zeros(m), force_0 + force_1
    at = names.index(output)
    gain = float(velocity @ (force_0 + force_1))
    return DrivenPlant(
        h, np.array([tried.stepped(j, 0, 0) for j in range(m)]).T.copy(), tried.stepped(-1, 0, 0),
        tried.stepped(-1, 0, 1), force_0, force_1, displacement.copy(), velocity.copy(),
        rows[at].copy(), float(tried.shown(-1, port)[at]), float(tried.shown(-1, 0)[at]), -h / gain,
    )  # fmt: skip


class _UnitResponse:
    """A linear structure, one state or one input of which is 1 and all else 0."""

    def __init__(self, slave: Any, h: float) -> None:
        self._slave, self._h, self._work = slave, h, [0.0] * len(slave._work)
        self._c: Constants = slave.constants_of(h)._replace(linear=True)
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


# A scenario whose damper gets a voltage history in place of what commanded it.

SCENARIO_FILE = "limit.toml"
_NAME = "limit_voltage"


def refuse_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written to, before the work for it is done.

    Raises
    ------
    RunError
        With exit code 2.
    """
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise not_usable(f"{there}: is a file; a limit goes into a folder.")
    if not os.access(there, os.W_OK):
        raise not_usable(f"{there}: cannot be written to; name another folder.")


def with_voltage(case: Case, voltage: Array) -> System:
    """Return the scenario with a source that plays a voltage (N + 1,) [V] as the damper's command.

    What commanded the damper goes where nothing else reads it.
    """
    scenario, port = case.scenario, (case.damper, case.command)
    name = _NAME
    while name in scenario.components:
        name += "_"
    before = {c.source for c in scenario.wires if (c.target, c.input) == port}
    gone = before - {c.source for c in scenario.wires if (c.target, c.input) != port}
    kept = {key: one for key, one in scenario.components.items() if key not in gone}
    damper = kept[case.damper]
    free = replace(damper, values={k: v for k, v in damper.values.items() if k != case.command})
    signal = voltage_signal(case.time, voltage, case.command, case.command_unit)
    kind = "SignalSource"
    source = Component(name, kind, catalogue.describe(kind), {"kind": "csv"}, signal=signal)
    components: dict[str, Component] = {}
    for key, one in kept.items():
        components |= {name: source, key: free} if key == case.damper else {key: one}
    wires = [
        c for c in scenario.wires
        if (c.target, c.input) != port and c.target not in gone and c.source not in gone
    ]  # fmt: skip
    return replace(
        scenario,
        title=f"{scenario.title}, the voltage of the limit",
        components=components,
        wires=(*wires, Connection(*port, name, "value")),
        origin=None,  # it is no longer what a file holds
        package=None,
    )


def voltage_signal(
    time: Iterable[float], voltage: Iterable[float], command: str = "voltage", unit: str = "V"
) -> Signal:
    """Return a command's history to the nine digits that are played and kept.

    Parameters
    ----------
    time, voltage : instants [s] and the command at them, of equal length
    command, unit : the command's column and unit
    """
    times, values = (np.array([float(f"{x:.9g}") for x in row]) for row in (time, voltage))
    return Signal(times, values, unit, command, "voltage")


# The response as a function of the voltage's history, and its derivative.

ROUNDING = 1e-15
"""Least change by which a derivative is told, in the unit of what changes."""


class ControlProblem:
    """The response of a case to a voltage history, within a window from its begin.

    Parameters
    ----------
    case : Case
    every : int
        Steps from one node of the voltage to the next; it is linear between.
    last : int or None
        Last instant of the window; None: that of the case.

    Attributes
    ----------
    course : Course
        The response that was computed last.
    nodes : (n,) array
        Instants of the nodes.
    """

    def __init__(self, case: Case, every: int = 1, last: int | None = None) -> None:
        self.case = case
        self._run = compiled(case.functions.link(compute))
        self.last = len(case.ground) - 1 if last is None else last
        self.nodes = np.unique(np.append(np.arange(0, self.last, every), self.last))
        self._instants = np.arange(self.last + 1)
        self.course = self.course_of(self.last)
        self._gradient = self.gradient_of(0)
        self._idle = Horizon(
            1, 1, 0, 0, 1.0, 2.0, case.v_max, np.zeros(1), np.zeros((5, 2)), np.zeros((4, 2)),
            self.course_of(1), self.gradient_of(0),
        )  # fmt: skip
        self._gradient = self.gradient_of(self.last)

    def respond(self, voltage: Array, last: int | None = None) -> Array:
        """Return the output (N + 1,) under the voltage (N + 1,) [V] at the instants, to `last`."""
        self._compute(START, voltage)
        self._compute(RESPOND, voltage, last)
        y: Array = self.course.y
        return y

    def slopes(self, voltage: Array) -> None:
        """Keep how the response that was computed last follows the voltage."""
        self._compute(SLOPES, voltage)

    def pull_back(self, weights: Array, last: int | None = None) -> Array:
        """Return what the voltages at the instants (N + 1,) do to the sum of weights and outputs.

        After `slopes`; `last` is the last instant with a weight.
        """
        self._compute(PULL_BACK, weights, last, weights)
        found: Array = self._gradient.by_voltage
        return found

    def recede(self, voltage: Array, horizon: Horizon) -> None:
        """Fill in the voltage (N + 1,) [V] of a receding horizon; its first value is given."""
        self._compute(START, voltage)
        self._compute(RECEDE, voltage, horizon=horizon)

    def level(self, voltage: float) -> Array:
        """Return a constant voltage [V] at the instants (N + 1,)."""
        return np.full(self.last + 1, float(voltage))

    def between(self, values: Array) -> Array:
        """Return a voltage at the instants (N + 1,), linear between its values at the nodes."""
        found: Array = np.interp(self._instants, self.nodes, values)
        return found

    def to_nodes(self, by_voltage: Array) -> Array:
        """Return a derivative by the voltages at the nodes (n,) from that at the instants."""
        right = np.searchsorted(self.nodes, self._instants, side="left").clip(1)
        low, high = self.nodes[right - 1], self.nodes[right]
        share = (self._instants - low) / (high - low)
        n = len(self.nodes)
        found: Array = np.zeros(n)
        found += np.bincount(right - 1, (1.0 - share) * by_voltage, n)
        found += np.bincount(right, share * by_voltage, n)
        return found

    def course_of(self, N: int) -> Course:
        """Return room for a response of N steps, the damper's states at its begin given."""
        m, k = len(self.case.plant.phi), len(self.case.states)
        course = Course(
            np.zeros((N + 1, m)), np.zeros((N + 1, k)), np.zeros(N + 1), np.zeros(N + 1),
            np.zeros(N + 1), np.zeros(room(self.case)),
        )  # fmt: skip
        course.z[0] = self.case.states
        return course

    def gradient_of(self, N: int) -> Gradient:
        """Return room for the derivative of a response of N steps; with 0 none can be told."""
        active = self._moving_states() if N else np.zeros(0, dtype=np.int64)
        q = len(active)
        return Gradient(
            active, self._changes(active), np.zeros((N, 1 + q, STATES + q)), np.zeros(N + 1),
            np.zeros((2, len(self.case.plant.phi) + q)),
        )  # fmt: skip

    def _compute(
        self, task: int, voltage: Array, last: int | None = None, weights: Array | None = None,
        horizon: Horizon | None = None,
    ) -> None:  # fmt: skip
        c = self.case
        self._run(
            task, c.plant, c.setup, c.ground, voltage, voltage if weights is None else weights, 0,
            self.last if last is None else last, self.course, self._gradient,
            horizon or self._idle, np.zeros(STATES),
        )  # fmt: skip

    def _moving_states(self) -> NDArray[np.int64]:
        """Return the damper's states that move in a response to a lively voltage."""
        self.respond(self.case.v_max * (0.5 - 0.5 * np.cos(0.3 * self._instants)))
        return np.flatnonzero(np.ptp(self.course.z, axis=0) > 0.0)

    def _changes(self, active: NDArray[np.int64]) -> Array:
        """Return small changes of what a step of the damper follows, by the last response."""
        plant = self.case.plant
        motion = self.course.x @ np.array([plant.displacement, plant.velocity]).T
        changes = np.zeros(STATES + len(active))
        changes[X_0:VOLTAGE_0] = np.tile(np.abs(motion).max(axis=0), 2)
        changes[VOLTAGE_0:TRIED] = self.case.v_max
        changes[TRIED] = np.abs(self.course.force).max()
        changes[STATES:] = np.abs(self.course.z[:, active]).max(axis=0)
        return 1e-6 * changes + ROUNDING

"""The engine that solves a system of built-in components as one: a table of rows comes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..component import controller, damper, sensors, source, structure
from ..core.jit import compiled
from ..errors import BristleError, ScenarioError
from ..fmu import catalogue
from ..fmu.slave import Slave
from ..physics import damper as damper_laws
from ..physics import structure as structure_laws
from ..physics.building import GROUND, Building, Device
from ..physics.generate import Functions, Link, Owner
from ..physics.laws import LAWS
from ..physics.linear import Row
from ..physics.signals import CONSTANT
from ..system.model import Component, System
from . import OnRows, StoppedError, records, time_loop
from .records import (
    NOWHERE,
    lay_controller,
    lay_damper,
    lay_sampled,
    lay_sensors,
    lay_source,
    lay_structure,
    substeps_in,
)
from .results import RunTable, make_columns, times

Array = NDArray[Any]

MATRICES = ("A", "B", "W", "C")
"""What differs in length from controller to controller."""

# What each damper of a coupled system pushes: a device of a structure, whose motion it feels.
#
# `pushed_by` finds it out from names; `couple` and what it calls are flat functions on records, as
# those of `records`.

Port = tuple[str, str]

MOVES = 1e-9
"""Share of the largest eigenvalue below which forces move nothing: they act against each other."""

MOST_ROTATIONS = 50
"""Rounds of rotations after which the search for eigenvalues ends; some ten are enough."""


class Pushed(NamedTuple):
    """What a damper feels and pushes: the device, and the number of its structure.

    `holding` is the slot of the force that would hold it.
    """

    structure: int
    device: Device
    holding: int


def pushed_by(
    damper: str,
    buildings: Mapping[str, Building],
    source_of: Mapping[Port, Port],
    slots: Mapping[Port, int],
) -> Pushed | None:
    """Return what a damper both feels and pushes; None where it is not one and the same.

    Parameters
    ----------
    damper : name of the component
    buildings : those of the structures by the component's name, in their order
    source_of : each connected input to its output
    slots : where the signals are
    """
    name, felt = source_of.get((damper, "velocity"), ("", ""))
    if name not in buildings:
        return None
    building = buildings[name]
    moves = {f"{level}_velocity": (GROUND, i) for i, level in enumerate(building.levels())}
    moves |= {device.ports.velocity: device.levels for device in building.devices}
    first = building.device("")
    forces = dict.fromkeys((building.ports(first).force, "extra_force"), first)
    forces |= {device.ports.force: device for device in building.devices}
    for port, device in forces.items():
        pushes = source_of.get((name, port)) == (damper, "force")
        if pushes and device.levels == moves.get(felt):
            holding = building.ports(device).holding_force
            return Pushed(list(buildings).index(name), device, slots[name, holding])
    return None


def room(dampers: int) -> int:
    """Return how many floats `couple` needs as room to work, with so many dampers."""
    return dampers * dampers + 2 * dampers


def couple(dampers: Any, structures: Any, h: float, work: Row) -> None:
    """Fill in what dampers that stick hold of the structures that they push.

    Parameters
    ----------
    dampers, structures : arrays of records, laid out
    h : substep [s]
    work : (`room(m)`,) for m dampers, room to work
    """
    for i in range(len(dampers)):
        d = dampers[i]
        if d["on_structure"] >= 0:
            there = structures[d["on_structure"]]
            lower, upper = d["lower"], d["upper"]
            gain = velocity_per_force(there, lower, upper, lower, upper)
            d["sharing"] = sharing(dampers, structures, d["on_structure"], work)
            d["moving_mass"] = -h / (gain * d["sharing"])


def velocity_per_force(b: Any, lower: int, upper: int, below: int, above: int) -> float:
    """Return the velocity of a device's ends per force of another over a substep [m/(N.s)].

    Parameters
    ----------
    b : record of the structure
    lower, upper : levels that the device that moves connects
    below, above : levels that the one that pushes connects, or the same
    """
    n = b["n"]
    total = 0.0
    for i, along in ((lower, -1.0), (upper, 1.0)):
        for j, pushes in ((below, -1.0), (above, 1.0)):
            if i != GROUND and j != GROUND:
                total += along * pushes * b["held"][(n + i) * (n + 1) + j]
    return total


def sharing(dampers: Any, structures: Any, where: int, work: Row) -> float:
    """Return by how much dampers that stick together must each hold less than it would alone.

    What one holds moves the others' ends. All correct their forces at once, which is Richardson's
    iteration: it settles soonest at half the sum of its least and largest eigenvalue (Saad 2003,
    Iterative Methods for Sparse Linear Systems, example 4.1). At one place that is their number.

    Parameters
    ----------
    dampers, structures : as in `couple`
    where : number of the structure that they push
    work : as in `couple`
    """
    m = 0
    places = work[0 : len(dampers)]
    apart = False
    for i in range(len(dampers)):
        if dampers[i]["on_structure"] == where and dampers[i]["signed"]:
            places[m] = i
            first = dampers[int(places[0])]
            d = dampers[i]
            apart = apart or first["lower"] != d["lower"] or first["upper"] != d["upper"]
            m += 1
    if not apart:
        return max(1.0, float(m))
    b = structures[where]
    begin = 2 * len(dampers)
    values, matrix = work[len(dampers) : len(dampers) + m], work[begin : begin + m * m]
    for i in range(m):
        felt = dampers[int(places[i])]
        for j in range(m):
            pushed = dampers[int(places[j])]
            matrix[i * m + j] = -velocity_per_force(
                b, felt["lower"], felt["upper"], pushed["lower"], pushed["upper"]
            )
    for i in range(m):
        values[i] = matrix[i * m + i] ** 0.5
    for i in range(m):
        for j in range(m):
            matrix[i * m + j] /= values[i] * values[j]
    symmetric_eigenvalues(m, matrix, values)
    most: float = values[0]
    for i in range(m):
        most = max(most, values[i])
    least = most
    for i in range(m):
        if values[i] > MOVES * most:
            least = min(least, values[i])
    return max(1.0, 0.5 * (least + most))


def symmetric_eigenvalues(n: int, a: Row, values: Row) -> None:
    """Fill in the eigenvalues of a symmetric matrix, in no order.

    Jacobi's rotations, in rounds over all entries beside the diagonal (Golub and Van Loan 2013,
    Matrix Computations, section 8.5).

    Parameters
    ----------
    n : size
    a : (n, n) flat, destroyed
    values : (n,) filled
    """
    for _ in range(MOST_ROTATIONS):
        beside, whole = 0.0, 0.0
        for i in range(n):
            for j in range(n):
                whole += a[i * n + j] ** 2
                if i != j:
                    beside += a[i * n + j] ** 2
        if beside <= 1e-32 * whole:
            break
        for p in range(n - 1):
            for q in range(p + 1, n):
                rotate(n, a, p, q)
    for i in range(n):
        values[i] = a[i * n + i]


def rotate(n: int, a: Row, p: int, q: int) -> None:
    """Turn a symmetric matrix in place so that an entry becomes 0.

    Parameters
    ----------
    n : size
    a : (n, n) flat, changed in place
    p, q : row and column of the entry, p < q
    """
    if a[p * n + q] == 0.0:
        return
    theta = (a[q * n + q] - a[p * n + p]) / (2.0 * a[p * n + q])
    t = 1.0 / (abs(theta) + (theta * theta + 1.0) ** 0.5)
    if theta < 0.0:
        t = -t
    c = 1.0 / (t * t + 1.0) ** 0.5
    s = t * c
    for k in range(n):
        left, right = a[k * n + p], a[k * n + q]
        a[k * n + p], a[k * n + q] = c * left - s * right, s * left + c * right
    for k in range(n):
        left, right = a[p * n + k], a[q * n + k]
        a[p * n + k], a[q * n + k] = c * left - s * right, s * left + c * right


# Lays a scenario of built-in components out in records of numbers for the time loop.

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


class RecordLayout:
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
    scenario : System
    only_on : bool
        Whether a component has the switches and parameters of effects that are on alone.
    """

    def __init__(self, scenario: System, only_on: bool = False) -> None:
        self.names: dict[str, list[str]] = {
            kind: [] for kind in ("source", "damper", "structure", "sampled")
        }
        for c in scenario.wires:
            if (c.factor, c.offset) != (1.0, 0.0):
                raise ScenarioError(
                    f'{scenario.where}: "{c.target}.{c.input}" has a factor or an offset, which is '
                    "not compiled. Run it with the engine fmu."
                )
            given, wanted = (
                scenario.components[name].description.variables[port]
                for name, port in ((c.source, c.output), (c.target, c.input))
            )
            if given.kind != wanted.kind:
                raise ScenarioError(
                    f'{scenario.where}: "{c.target}.{c.input}" is {wanted.kind} and is fed by '
                    f"{given.kind}, which is not compiled. Run it with the engine fmu."
                )
        for component in scenario.components.values():
            self.names[kind_of(component, scenario)].append(component.name)
        self.slaves: dict[str, Any] = {
            one.name: instantiated(one, only_on) for one in scenario.components.values()
        }
        self.dampers, self.structures = self._functions()
        for component in scenario.components.values():
            configure(self.slaves[component.name], component, scenario)
        self.source_of: dict[Port, Port] = {
            (c.target, c.input): (c.source, c.output) for c in scenario.wires
        }
        self.names["structure"] = self._followed_first(scenario)
        self.slots: dict[Port, int] = {}
        self.outputs: dict[str, int] = {}
        self.kinds: dict[str, str] = {}
        for component in scenario.components.values():
            self._add_slots(component)
        self.slots.update({end: self.slots[begin] for end, begin in self.source_of.items()})

    def _functions(self) -> tuple[Functions, Functions]:
        """Let dampers compute with the same functions, and structures."""
        slaves = {site: [self.slaves[name] for name in self.names[site]] for site in SITES}
        owners: dict[str, set[Owner]] = {site: set() for site in SITES}
        for site, own in owners.items():
            own |= {LAWS[one.law].base for one in slaves[site] if site == "damper"}
            own |= {e for one in slaves[site] for e in one._effects if e.name in one.effects_on()}
        whole = all(sets.library.have(*owners[site]) for site, sets in SITES.items())
        found = []
        for site, sets in SITES.items():
            found.append(sets.library if whole else sets.of(*owners[site]))
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

    def _followed_first(self, scenario: System) -> list[str]:
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
                    f"{scenario.where}: {', '.join(left)} are each other's ground, which cannot be "
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
        constants: list[float] = []
        memory: list[float] = []
        found = np.zeros(len(self.names["sampled"]), records.sampled_record())
        for record, name in zip(found, self.names["sampled"], strict=True):
            slave = self.slaves[name]
            lay_sampled(record, slave.constants.period, self.wiring(name), h)
            if slave.functions is sensors:
                lay_sensors(record, slave.constants)
            else:
                lay_controller(record, slave.constants)
                for matrix in MATRICES:
                    record[matrix] = _put(constants, getattr(slave.constants, matrix))
                    record[f"{matrix}_end"] = len(constants)
            record["state"] = _put(memory, slave.state)
            record["work"] = _put(memory, slave._work)
            record["end"] = len(memory)
        return found, np.array(constants), np.array(memory)

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

    # -- where the signals of a component are, as `records` takes it

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
        if not pushes:
            return len(self.slots)
        return self.slots[begin[0], f"hidden {self.slaves[begin[0]].hidden - 1}"]

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


def _put(numbers: list[float], more: list[float]) -> int:
    """Append numbers; return where they begin."""
    begin = len(numbers)
    numbers.extend(more)
    return begin


def kind_of(component: Component, scenario: System) -> str:
    """Return "source", "damper", "structure" or "sampled".

    Raises
    ------
    ScenarioError
        Naming a component that cannot be compiled.
    """
    known = catalogue.component_names()
    if component.path is None and (component.law or component.kind in known):
        kind: Any = catalogue.component_class(catalogue.source(component.made_of()))
        return KINDS[kind.functions]
    raise ScenarioError(
        f"{scenario.where} [components.{component.name}]: {component.kind} cannot be compiled. "
        f"Compiled are {', '.join(known)}; run it with the engine fmu."
    )


def instantiated(component: Component, only_on: bool = False) -> Slave:
    """Return the component's Python object with the values that are set.

    With `only_on` it has the switches and parameters of effects that are on alone.
    """
    slave = catalogue.instantiate(
        component.made_of(),
        instance=component.name,
        offers=component.effects_on() if only_on else None,
        **component.made_with(),
    )
    for name, value in component.taken_values(only_on).items():
        index = slave._index[name]
        slave._values[index] = type(slave._values[index])(value)
        slave._set.add(index)
    if (signal := component.signal) is not None:
        slave.signal = signal.time.tolist(), signal.values.tolist()
    return slave


def configure(slave: Slave, component: Component, scenario: System) -> None:
    """Build the model of a component's Python object."""
    try:
        slave._check_parameters()
        slave.configure()
    except (ValueError, OSError, RuntimeError) as error:
        raise ScenarioError(f"{scenario.where} [components.{component.name}]: {error}") from error
    if following := getattr(slave, "following", {}):
        raise ScenarioError(
            f"{scenario.where} [components.{component.name}]: an effect follows "
            f"{', '.join(following)}, which is not compiled. Run it with the engine fmu."
        )


LONGEST_SUBSTEP = 2e-4
"""Longest substep [s]; half-sine peaks are then within 0.001 % of a tight integration."""
REFERENCE_SUBSTEP = 5e-5
"""The same [s] where the errors of other runs are told by this one: it must be better than they."""


@dataclass(frozen=True)
class Coupled:
    """The engine that solves built-in components together, with no substep above `longest` [s]."""

    longest: float = LONGEST_SUBSTEP
    name: ClassVar[str] = "compiled"

    def refuses(self, system: System) -> str:
        """Return why it cannot run a system, "" if it can."""
        try:
            RecordLayout(system)
        except BristleError as error:
            return str(error)
        return ""

    def run(self, system: System, on_rows: OnRows | None = None) -> RunTable:
        """Return every output at every step; see `Engine`.

        A run stops if a value is not finite any more, or motion and forces do not agree; the text
        names the component and the time.
        """
        layout = RecordLayout(system)
        rows, substeps = system.steps, substeps_of(system, layout, self.longest)
        h = system.step / substeps
        found = np.zeros((rows + 1, len(layout.outputs)))
        slots = np.array(list(layout.outputs.values()), dtype=np.int64)
        loop = linked(layout.dampers, layout.structures)(time_loop.integrate)
        filled, unsettled, _ = compiled(loop, time_loop.INLINE)(
            (rows, substeps, h), layout.sources(), layout.coupled(h), layout.sampled(h),
            layout.start_values(), slots, found,
        )  # fmt: skip
        what = ""
        if unsettled >= 0:
            name = layout.names["damper"][unsettled]
            what = f"{name} before t = {filled * system.step:.9g} s: force and motion do not agree"
        elif not np.isfinite(found[filled - 1]).all():
            filled -= 1
            wrong = [
                n for n, v in zip(layout.outputs, found[filled], strict=True) if not isfinite(v)
            ]
            component = wrong[0].partition(".")[0]
            others = f" (as are {', '.join(wrong[1:4])})" if wrong[1:] else ""
            when = f"at t = {filled * system.step:.9g} s"
            what = f"{component} {when}: {wrong[0]} is not finite{others}"
        columns = make_columns(system)
        of = dict(zip(layout.outputs, found[:filled].T, strict=True))
        values = {c.name: of[c.name].astype(c.dtype, copy=False) for c in columns}
        table = RunTable(times(0, filled, system.step), columns, values)
        if on_rows is not None:
            on_rows(table)
        if what:
            raise StoppedError(
                f"{what}.\n  A shorter step or parameters within their bounds would be right.",
                table,
            )
        return table


def substeps_of(scenario: System, layout: RecordLayout, longest: float = LONGEST_SUBSTEP) -> int:
    """Return into how many substeps a step is cut: at best so that instants fall on their ends.

    Parameters
    ----------
    scenario, layout : what runs, and its numbers
    longest : longest substep [s]
    """
    return substeps_in(scenario.step, longest, layout.periods())


def linked(*sets: Functions, **more: Any) -> Link:
    """Return what lets the time loop call these functions, and puts other globals in place.

    A controller inverts a law of the library, whatever the dampers are.
    """
    made = {name: function for one in sets for name, function in one.made.items()}
    return Link({**made, **more}, [time_loop.take_command])

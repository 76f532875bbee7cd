"""What a macro step consists of: which inputs to set, which outputs to read, and when.

An output whose `dependencies` name an input follows that input without a step. In row k such
outputs are read after the inputs of t_k were set, all others directly after the step. The
schedule is worked out once, from the connections alone, and asks for no call that is not needed:

- Gauss-Seidel: each component in turn gets the inputs that are newer than those it has, steps,
  and is read. At the end of the step, inputs whose source came later are set wherever an output
  follows them, and these outputs are read for the row; what they feed directly follows.
- Midpoint: as Gauss-Seidel, but an input that a component holds over its step has the middle of
  the step there: half-way between the last value and the newest where the source has stepped
  already, ahead of the newest by half its last change where it has not. Before outputs that follow
  it are read it gets the value at the step's end. What a component interpolates or samples, and
  what is discrete, gets the newest value.
- Midpoint, iterated: the components of a loop then go back to the start of the step and make it
  again, with the middle between the values at its begin and those found at its end.
- Jacobi: all step, all are read, all inputs are set; outputs that follow an input are read again
  for the row and not passed on.

A loop of outputs that follow inputs has no order. It is cut where the order of the components
closes it: within a step each value of the loop is taken once. An output without `dependencies`
(None) may follow every input of its component, so it is read again after each of them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ..component import HELD, LINEAR, SAMPLED
from ..core.graph import loop_in, path_between, reached
from ..fmu.description import Description, Value, Variable
from ..system.parameters import as_told, told_over_step

if TYPE_CHECKING:
    from ..system.model import System


# What a macro step is made of: components with their sources, and the operations on them.

Port = tuple[int, str]
"""A component's number in the order of the file, and the name of one of its variables."""

FAULT = "fault"

NEWEST, MIDDLE, AHEAD, END, PAST = "newest", "middle", "ahead", "end", "past"
ALONG = "along"
"""Which value an input is given, of its source's newest u and the kept one p of a step before:
u; (u + p)/2; (3 u - p)/2, the middle of a step that the source has still to make; 2 u - p, its end;
p; and along the step, at the end of each substep, (1 - s) p + s u with the share s that has passed.
"""


@dataclass(frozen=True)
class Node:
    """A component as the schedule sees it: outputs, and the source of each connected input.

    `transformed` has (factor, offset) of the inputs that get factor output + offset.
    `interpolates` names the inputs whose derivative it takes, to follow it over the next step.
    """

    name: str
    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    sources: Mapping[str, Port]
    substeps: int = 1
    transformed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    interpolates: frozenset[str] = frozenset()

    def followed(self, output: str) -> tuple[str, ...]:
        """Return the connected inputs that an output follows without a step."""
        if kind_of(self.outputs[output]) == FAULT:  # changes where a step ends
            return ()
        named = self.outputs[output].dependencies
        if named is None:
            return tuple(self.sources)
        return tuple(name for name in named if name in self.sources)

    def holds(self, name: str) -> bool:
        """Return whether an input is one that the component holds over its step, as far as known.

        Where an FMU does not say how it takes an input, it is taken to hold it if it says at least
        which inputs its outputs follow.
        """
        variable = self.inputs[name]
        if not is_continuous(variable):
            return False
        told = all(v.dependencies is not None for v in self.outputs.values())
        return variable.over_step == HELD or (variable.over_step is None and told)

    def moves(self, name: str) -> bool:
        """Return whether an input is to move on substep by substep towards its newest value.

        Such a component takes it as linear from its own last step: with the newest value from the
        first substep on it would have all of the change there, ahead of time.
        """
        variable = self.inputs[name]
        taken = variable.over_step in (LINEAR, SAMPLED)
        return self.substeps > 1 and taken and variable.kind == "Real"

    def taken(self, name: str, value: Value) -> Value:
        """Return what an input gets where its source gives a value."""
        factor, offset = self.transformed.get(name, (1.0, 0.0))
        if self.inputs[name].kind != "Real":
            return value
        return factor * float(value) + offset

    def jumps(self, output: str) -> bool:
        """Return whether an output may jump: it is discrete, or tells so of itself."""
        variable = self.outputs[output]
        unfed = variable.jumps_without not in (None, *self.sources)
        return unfed or not is_continuous(variable)


@dataclass(frozen=True)
class DoStep:
    """Let a component step.

    `along` sets inputs before each of its substeps, where it has several.
    """

    component: int
    along: tuple[Write, ...] = ()


@dataclass(frozen=True)
class ReadOutputs:
    """Read outputs of one component and kind in one call; they are neighbours in memory."""

    component: int
    kind: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Write:
    """Set inputs of one component and kind in one call, each from the output that feeds it.

    `values` says which value each gets, one of those above; empty: all the newest. `if_changed`
    leaves the call out where each has its value already.
    """

    component: int
    kind: str
    names: tuple[str, ...]
    values: tuple[str, ...] = ()
    if_changed: bool = False


@dataclass(frozen=True)
class Ramp:
    """Set derivatives of inputs over the step: the last change of what feeds each of them.

    An input goes on by it from the value that it has as the step begins.
    """

    component: int
    names: tuple[str, ...]
    kind: str = "Real"


@dataclass(frozen=True)
class Keep:
    """Keep outputs of one component as those of a step before: they are about to be read anew."""

    component: int
    names: tuple[str, ...]


@dataclass(frozen=True)
class Shift:
    """Move kept outputs along with a jump: the newest goes off before it, and on again after it."""

    component: int
    names: tuple[str, ...]
    change: str  # "-=" or "+="


@dataclass(frozen=True)
class Save:
    """Keep the whole state of a component."""

    component: int


@dataclass(frozen=True)
class Restore:
    """Take a component back to the state that was kept, and forget that."""

    component: int


Operation = DoStep | ReadOutputs | Write | Ramp | Keep | Shift | Save | Restore


@dataclass(frozen=True)
class Schedule:
    """The operations of one macro step, and the order of each component's outputs in memory."""

    operations: tuple[Operation, ...]
    layout: tuple[Port, ...]


def is_continuous(variable: Variable) -> bool:
    """Return whether a value may be taken to lie between two others, or to go on from them."""
    return variable.kind == "Real" and variable.variability in ("continuous", None)


def kind_of(variable: Variable) -> str:
    """Return the kind of call that a variable needs: "Real", "Integer", "Boolean" or "fault".

    `fault` has calls of its own, so that the fault codes of all components are neighbours.
    """
    if (variable.name, variable.causality, variable.kind) == (FAULT, "output", "Integer"):
        return FAULT
    return "Integer" if variable.kind == "Enumeration" else variable.kind


def reads(component: int, node: Node, names: Iterable[str]) -> list[Operation]:
    """Return the calls that read these outputs of a component."""
    return [ReadOutputs(component, *group) for group in _by_kind(node.outputs, names)]


def writes(component: int, node: Node, values: Mapping[str, str]) -> list[Write]:
    """Return the calls that set these inputs of a component, each to one of the values above."""
    found: list[Write] = []
    for kind, names in _by_kind(node.inputs, values):
        given = tuple(values[name] for name in names)
        found.append(Write(component, kind, names, given if set(given) != {NEWEST} else ()))
    return found


def _by_kind(
    variables: Mapping[str, Variable], names: Iterable[str]
) -> list[tuple[str, tuple[str, ...]]]:
    groups: dict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[kind_of(variables[name])].append(name)
    return [(kind, tuple(group)) for kind, group in groups.items()]


# Which signal follows which at once, and what is therefore read when in a macro step.


@dataclass
class Refresh:
    """What is set and read once more at the end of a step; the level gives the order."""

    inputs: dict[Port, int] = field(default_factory=dict)
    outputs: dict[Port, int] = field(default_factory=dict)


def signal_graph(nodes: Sequence[Node], only_declared: bool = False) -> dict[Port, list[Port]]:
    """Return which port follows which at once: inputs to outputs, outputs to inputs."""
    graph: dict[Port, list[Port]] = {}
    for c, node in enumerate(nodes):
        graph |= {(c, name): [] for name in (*node.inputs, *node.outputs)}
    for c, node in enumerate(nodes):
        for name, source in node.sources.items():
            graph[source].append((c, name))
        for output, variable in node.outputs.items():
            if only_declared and variable.dependencies is None:
                continue
            for name in node.followed(output):
                graph[c, name].append((c, output))
    return graph


def find_loop(nodes: Sequence[Node]) -> list[Port]:
    """Return the ports of one algebraic loop that the FMUs declare, or an empty list."""
    return loop_in(signal_graph(nodes, only_declared=True))


def find_late(nodes: Sequence[Node], graph: Mapping[Port, Sequence[Port]]) -> Refresh:
    """Return what follows the inputs whose source came later than their component's step."""
    seeds = [
        (c, name) for c, node in enumerate(nodes) for name, (d, _) in node.sources.items() if d >= c
    ]
    refresh = Refresh()
    queue = [(port, 1) for port in seeds]
    while queue:
        port, level = queue.pop()
        if refresh.inputs.get(port, 0) >= level or not graph[port]:
            continue  # nothing follows this input: it is set before the next step
        refresh.inputs[port] = level
        for output in graph[port]:
            if refresh.outputs.get(output, 0) < level:
                refresh.outputs[output] = level
            queue += [
                (target, level + 1)
                for target in graph[output]
                if not path_between(graph, target, output)
            ]
    return refresh


def read_early(
    nodes: Sequence[Node], refresh: Refresh, wanted: Collection[Port] = ()
) -> list[list[str]]:
    """Return what is read directly after each step: all that is final, or that is needed next.

    Parameters
    ----------
    nodes, refresh : the components, and what is read once more at the end of the step
    wanted : what is needed besides by components that have stepped already, and step again
    """
    needed = {
        source for c, node in enumerate(nodes) for source in node.sources.values() if source[0] < c
    }
    needed.update(wanted)
    early = []
    for c, node in enumerate(nodes):
        levels = {level for (d, _), level in refresh.outputs.items() if d == c}
        # With several levels the outputs of one call would not all be neighbours: read all.
        early.append(
            [
                name
                for name in node.outputs
                if len(levels) > 1 or (c, name) not in refresh.outputs or (c, name) in needed
            ]
        )
    return early


def lay_out(
    nodes: Sequence[Node], refresh: Refresh, early: Sequence[Iterable[str]]
) -> tuple[Port, ...]:
    """Return all outputs in an order that makes those of each call neighbours."""
    ports = [
        (refresh.outputs.get((c, name), 0), name not in set(early[c]), place, (c, name))
        for c, node in enumerate(nodes)
        for place, name in enumerate(node.outputs)
    ]
    ports.sort(key=lambda entry: (entry[3][0], *entry[:3]))
    return tuple(entry[3] for entry in ports)


def at_level(levels: Mapping[Port, int], component: int, level: int) -> list[str]:
    """Return the names of a component's ports at a level.

    Parameters
    ----------
    levels : by port
    component : its index
    level : 0 for what follows nothing
    """
    return [name for (c, name), at in levels.items() if c == component and at == level]


def loop_members(nodes: Sequence[Node]) -> tuple[list[int], list[int]]:
    """Return the components that feed each other in a loop, and those that only follow one."""
    feeds: dict[int, set[int]] = {c: set() for c in range(len(nodes))}
    for c, node in enumerate(nodes):
        for d, _ in node.sources.values():
            feeds[d].add(c)
    fed = {c: reached(feeds, c) for c in feeds}
    inside = [c for c in fed if c in fed[c]]
    return inside, sorted(set[int]().union(*(fed[c] for c in inside)) - {*inside})


# Components that step one after another: Gauss-Seidel, midpoint, midpoint with one rollback.


def in_sequence(nodes: Sequence[Node], held: Collection[Port], iterated: bool = False) -> Schedule:
    """Return the schedule in which each component gets the newest values, and then steps.

    Parameters
    ----------
    nodes : sequence of Node
    held : inputs that get the middle of the step; none of them: Gauss-Seidel
    iterated : whether the components of a loop go back once and step again, now that the values
        at the end of the step are known
    """
    plan = _Plan(nodes, held, iterated)
    for _ in range(2):  # the last period is the steady one
        plan.macro_step()
    return Schedule(tuple(plan.operations), lay_out(nodes, plan.refresh, plan.early))


class _Plan:
    """The operations of a macro step while they are worked out."""

    def __init__(self, nodes: Sequence[Node], held: Collection[Port], iterated: bool) -> None:
        self.nodes, self.held = nodes, held
        inside, behind = loop_members(nodes) if iterated else ([], [])
        self.again, self.behind = inside, behind
        self.graph = signal_graph(nodes)
        self.refresh = find_late(nodes, self.graph)
        fed_back = {source for c in inside for source in nodes[c].sources.values()}
        self.early = read_early(nodes, self.refresh, fed_back)
        self.kept = {nodes[c].sources[name] for c, name in held}
        along = {nodes[c].sources[name] for c in range(len(nodes)) for name in self._along(c)}
        self.kept_for_substeps = along - self.kept
        self.jumping = self._jumping()
        self.operations: list[Operation] = []
        # When each output was read and each input written: only inputs that are older are set.
        self._read: dict[Port, int] = defaultdict(int)
        self._written: dict[Port, int] = defaultdict(lambda: 1)
        # When each input had its source's newest value, and when that was read for the last row.
        self._current: dict[Port, int] = defaultdict(lambda: 1)
        self._row: dict[Port, int] = {}
        self._clock = 1

    def macro_step(self) -> None:
        """Work out a macro step that follows on those before."""
        self.operations = []
        self._row = dict(self._read)
        for c in self.again:
            late = [n for n in self._older(c) if self.nodes[c].sources[n][0] >= c]
            self._write(c, dict.fromkeys(late, NEWEST))
            self.operations.append(Save(c))
        for c in range(len(self.nodes)):
            if c not in self.behind:
                self._step(c)
        if self.again:
            self.operations += [Restore(c) for c in self.again]
            for c in self.again:
                self._step_again(c)
            for c in self.behind:
                self._step(c)
        self._refresh()

    def _older(self, c: int) -> list[str]:
        """Return the inputs with the newest value whose source is newer than they are."""
        return [
            name
            for name, source in self.nodes[c].sources.items()
            if (c, name) not in self.held and self._read[source] > self._written[c, name]
        ]

    def _held(self, c: int) -> list[str]:
        return [name for name in self.nodes[c].sources if (c, name) in self.held]

    def _write(self, c: int, values: Mapping[str, str], if_changed: bool = False) -> None:
        self._clock += 1
        self._written.update({(c, name): self._clock for name in values})
        self._give(c, values, if_changed)

    def _give(self, c: int, values: Mapping[str, str], if_changed: bool = False) -> None:
        newest = (name for name, value in values.items() if value == NEWEST)
        self._current.update({(c, name): self._clock for name in newest})
        found = writes(c, self.nodes[c], values)
        self.operations += [replace(one, if_changed=if_changed) for one in found]

    def _read_outputs(self, c: int, names: Iterable[str]) -> None:
        self.operations += reads(c, self.nodes[c], names)

    def _step(self, c: int) -> None:
        node = self.nodes[c]
        stepped = {name: self._has_stepped(node.sources[name][0], c) for name in self._held(c)}
        values = {name: MIDDLE if stepped[name] else AHEAD for name in stepped}
        values.update(dict.fromkeys(self._older(c), NEWEST))
        ramped = self._ramped_by_others(c)
        values.update({name: PAST if stepped[name] else NEWEST for name in ramped})
        own = not ramped and self._ramps_alone(c, stepped)
        if own:
            values, ramped = dict.fromkeys(self._older(c), NEWEST), tuple(stepped)
        along = self._along(c)
        rest = (name for name in node.sources if name in values and name not in along)
        self._write(c, {name: values[name] for name in rest}, own)
        self.operations += [Ramp(c, ramped)] if ramped else []
        kept = self.kept | self.kept_for_substeps
        past = tuple(name for name in node.outputs if (c, name) in kept)
        self.operations += [Keep(c, past)] if past else []
        self._substeps(c, along)
        self._current.update({(c, name): self._clock for name in ramped if stepped[name]})
        self._show(c, {name: known for name, known in stepped.items() if name not in ramped})

    def _along(self, c: int) -> list[str]:
        """Return the inputs that move on substep by substep: their source's end is known."""
        node = self.nodes[c]
        known = (name for name, (d, _) in node.sources.items() if self._has_stepped(d, c))
        return [name for name in known if node.moves(name)]

    def _substeps(self, c: int, along: Sequence[str]) -> None:
        """Let a component step, and have these inputs arrive at their newest value with it."""
        given = writes(c, self.nodes[c], dict.fromkeys(along, ALONG))
        self.operations.append(DoStep(c, tuple(given)))
        self._written.update({(c, name): self._clock for name in along})

    def _ramped_by_others(self, c: int) -> tuple[str, ...]:
        """Return the held inputs that a foreign FMU interpolates over its step.

        It gets value and derivative; how it takes them over the step is its own matter.
        """
        node = self.nodes[c]
        found = (name for name in self._held(c) if node.inputs[name].over_step is None)
        return tuple(name for name in found if name in node.interpolates)

    def _ramps_alone(self, c: int, stepped: Mapping[str, bool]) -> bool:
        """Return whether derivatives in place of the middle save a call, and mean the same.

        They do where end values would be set behind the step, and no value that changes all the
        time is before it. One of bristle's FMUs holds the middle then, and goes on from where the
        step before has brought its inputs.
        """
        held, sources = set(stepped), self.nodes[c].sources
        able = held and held <= self.nodes[c].interpolates and not self.again
        if not able or not self._end_values(c, stepped):
            return False
        feeding = (sources[name] for name in self._older(c))
        if not all(_stands(self.nodes[d].outputs[output]) for d, output in feeding):
            return False
        return all(self._current[c, name] >= self._row.get(sources[name], 0) for name in held)

    def _has_stepped(self, source: int, c: int) -> bool:
        """Return whether a source steps before a component; those behind a loop come last."""
        return source < c or (c in self.behind and source not in self.behind)

    def _step_again(self, c: int) -> None:
        """Step from the restored state: the ends of all inputs are known, if only nearly."""
        node = self.nodes[c]
        before = [n for n, (d, _) in node.sources.items() if d < c and (c, n) not in self.held]
        values, ramped = dict.fromkeys(self._held(c), MIDDLE), self._ramped_by_others(c)
        values.update(dict.fromkeys(ramped, PAST))
        along = self._along(c)
        self._write(c, {**{n: NEWEST for n in before if n not in along}, **values})
        self.operations += [Ramp(c, ramped)] if ramped else []
        self._substeps(c, along)
        self._show(c, dict.fromkeys((name for name in values if name not in ramped), True))

    def _show(self, c: int, known: Mapping[str, bool]) -> None:
        """Give held inputs the end of the step for the outputs that follow them, and read these.

        Where others wait for such an output it is now, from a source that has still to step as far
        as that can be told; else it is when all have stepped, unless nothing else is set then.

        Parameters
        ----------
        c : the component
        known : held inputs, and whether their value at the end is known
        """
        self._give(c, self._end_values(c, known))
        self._read_outputs(c, self.early[c])
        self._read.update({(c, name): self._clock for name in self.early[c]})

    def _end_values(self, c: int, known: Mapping[str, bool]) -> dict[str, str]:
        """Return what is set behind a step, as `_show` says."""
        values = {}
        for name in known:
            following = {output for _, output in self.graph[c, name]}
            wanted = following.intersection(self.early[c])
            if wanted or (known[name] and following and (c, name) not in self.refresh.inputs):
                values[name] = NEWEST if known[name] else END
        return values

    def _refresh(self) -> None:
        """Set what came too late, and read what follows it, link by link."""
        for level in range(1, max(self.refresh.outputs.values(), default=0) + 1):
            for c in range(len(self.nodes)):
                seen = at_level(self.refresh.outputs, c, level)
                moved = tuple(name for name in seen if (c, name) in self.jumping)
                self._write(c, dict.fromkeys(at_level(self.refresh.inputs, c, level), NEWEST))
                self.operations += [Shift(c, moved, "-=")] if moved else []
                self._read_outputs(c, seen)
                self.operations += [Shift(c, moved, "+=")] if moved else []
            changed = [port for port, at in self.refresh.outputs.items() if at == level]
            self._read.update(dict.fromkeys(changed, self._clock))
            self._clock += 1

    def _jumping(self) -> set[Port]:
        """Return the outputs whose change between two reads of a step is a jump, and no slope.

        They follow a discrete signal, as a damper's force does the voltage of a controller that has
        stepped after it.
        """
        discrete = [
            (c, name)
            for c, node in enumerate(self.nodes)
            for name, (d, output) in node.sources.items()
            if d >= c and not is_continuous(self.nodes[d].outputs[output])
        ]
        moved = reached(self.graph, *discrete)
        return {port for port in self.kept & moved if port[1] in self.early[port[0]]}


def _stands(output: Variable) -> bool:
    """Return whether a signal stands over many steps, as the voltage of a sampled controller."""
    return output.kind == "Real" and not is_continuous(output)


def make_schedule(nodes: Sequence[Node], algorithm: str) -> Schedule:
    """Return the schedule of a macro step for one of `system.model.ALGORITHMS`."""
    if algorithm == "jacobi":
        return _jacobi(nodes)
    if algorithm == "gauss-seidel":
        return in_sequence(nodes, ())
    return in_sequence(nodes, held_inputs(nodes), iterated=algorithm == "midpoint-iterated")


def held_inputs(nodes: Sequence[Node]) -> set[Port]:
    """Return the inputs that midpoint gives the middle of the step: held, of signals that go on.

    A continuous output that may jump, as dry friction does where the motion turns, is better off
    with the newest values all round, which is Gauss-Seidel.
    """
    rough = {
        (c, name)
        for c, node in enumerate(nodes)
        for output in node.outputs
        if is_continuous(node.outputs[output]) and node.jumps(output)
        for name in node.followed(output)
    }
    return {
        (c, name)
        for c, node in enumerate(nodes)
        for name, (d, output) in node.sources.items()
        if node.holds(name) and not nodes[d].jumps(output)
    } - rough


def _jacobi(nodes: Sequence[Node]) -> Schedule:
    refresh = Refresh(
        outputs={(c, o): 1 for c, n in enumerate(nodes) for o in n.outputs if n.followed(o)}
    )
    passed_on = {source for node in nodes for source in node.sources.values()}
    early = [
        [o for o in node.outputs if (c, o) in passed_on or (c, o) not in refresh.outputs]
        for c, node in enumerate(nodes)
    ]
    operations: list[Operation] = [DoStep(c) for c in range(len(nodes))]
    for c, node in enumerate(nodes):
        operations += reads(c, node, early[c])
    for c, node in enumerate(nodes):
        operations += writes(c, node, dict.fromkeys(node.sources, NEWEST))
    for c, node in enumerate(nodes):
        operations += reads(c, node, at_level(refresh.outputs, c, 1))
    return Schedule(tuple(operations), lay_out(nodes, refresh, early))


# The components of a scenario as the schedule sees them.


def make_nodes(system: System, descriptions: Mapping[str, Description]) -> list[Node]:
    """Return the components as the schedule sees them, in the order of the file."""
    components = list(system.components.values())
    numbers = {component.name: c for c, component in enumerate(components)}
    sources: list[dict[str, Port]] = [{} for _ in components]
    transformed: list[dict[str, tuple[float, float]]] = [{} for _ in components]
    for connection in system.wires:
        port = numbers[connection.source], connection.output
        sources[numbers[connection.target]][connection.input] = port
        how = connection.factor, connection.offset
        if how != (1.0, 0.0):
            transformed[numbers[connection.target]][connection.input] = how
    nodes = []
    for c, component in enumerate(components):
        description = descriptions[component.name]
        substeps = round(system.step / component.step) if component.step else 1
        told = told_over_step(component)
        outputs = {v.name: as_told(v, told) for v in description.of("output") if v.kind != "String"}
        inputs = {v.name: as_told(v, told) for v in description.of("input")}
        for name, (d, output) in sources[c].items():
            source = descriptions[components[d].name].variables[output]
            if inputs[name].kind == "Real" != source.kind:  # nothing lies between whole numbers
                inputs[name] = replace(inputs[name], variability="discrete", over_step=None)
        takes = _interpolates(description, told) if substeps == 1 else frozenset()
        nodes.append(
            Node(component.name, inputs, outputs, sources[c], substeps, transformed[c], takes)
        )
    return nodes


def _interpolates(description: Description, told: Mapping[str, str]) -> frozenset[str]:
    """Return the inputs whose derivative an FMU takes, but those of which the scenario says how.

    That is a matter of FMI 2.0; FMI 3.0 has no call for it.
    """
    if description.capabilities.get("canInterpolateInputs") not in ("true", "1"):
        return frozenset()
    inputs = (v for v in description.of("input") if is_continuous(v))
    return frozenset(v.name for v in inputs if description.version == "2.0" and v.name not in told)

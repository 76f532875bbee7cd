"""What a macro step consists of: which inputs to set, which outputs to read, and when.

An output whose `dependencies` name an input follows that input without a step. In row k such
outputs are read after the inputs of t_k were set, all others directly after the step. The
schedule is worked out once, from the connections alone, and asks for no call that is not needed:

- Gauss-Seidel: each component in turn gets the inputs that are newer than those it has, steps,
  and is read. At the end of the step, inputs whose source came later are set wherever an output
  follows them, and these outputs are read for the row; what they feed directly follows.
- Jacobi: all step, all are read, all inputs are set; outputs that follow an input are read again
  for the row and not passed on.

A loop of outputs that follow inputs has no order. It is cut where the order of the components
closes it: within a step each value of the loop is taken once. An output without `dependencies`
(None) may follow every input of its component, so it is read again after each of them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from ..fmu.description import Variable

Port = tuple[int, str]
"""A component's number in the order of the file, and the name of one of its variables."""

FAULT = "fault"


@dataclass(frozen=True)
class Node:
    """A component as the schedule sees it: outputs, and the source of each connected input."""

    name: str
    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    sources: Mapping[str, Port]
    substeps: int = 1

    def followed(self, output: str) -> tuple[str, ...]:
        """Return the connected inputs that an output follows without a step."""
        if kind_of(self.outputs[output]) == FAULT:  # changes where a step ends
            return ()
        named = self.outputs[output].dependencies
        if named is None:
            return tuple(self.sources)
        return tuple(name for name in named if name in self.sources)


@dataclass(frozen=True)
class Step:
    """Let a component step."""

    component: int


@dataclass(frozen=True)
class Read:
    """Read outputs of one component and kind in one call; they are neighbours in memory."""

    component: int
    kind: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Write:
    """Set inputs of one component and kind in one call, each from the output that feeds it."""

    component: int
    kind: str
    names: tuple[str, ...]


Operation = Step | Read | Write


@dataclass(frozen=True)
class Schedule:
    """The operations of one macro step, and the order of each component's outputs in memory."""

    operations: tuple[Operation, ...]
    layout: tuple[Port, ...]


@dataclass
class _Refresh:
    """What is set and read once more at the end of a step; the level gives the order."""

    inputs: dict[Port, int] = field(default_factory=dict)
    outputs: dict[Port, int] = field(default_factory=dict)


def kind_of(variable: Variable) -> str:
    """Return the kind of call that a variable needs: "Real", "Integer", "Boolean" or "fault".

    `fault` has calls of its own, so that the fault codes of all components are neighbours.
    """
    if (variable.name, variable.causality, variable.kind) == (FAULT, "output", "Integer"):
        return FAULT
    return "Integer" if variable.kind == "Enumeration" else variable.kind


def make_schedule(nodes: Sequence[Node], algorithm: str) -> Schedule:
    """Return the schedule of a macro step for "gauss-seidel" or "jacobi"."""
    if algorithm == "jacobi":
        return _jacobi(nodes)
    return _gauss_seidel(nodes)


def find_loop(nodes: Sequence[Node]) -> list[Port]:
    """Return the ports of one algebraic loop that the FMUs declare, or an empty list."""
    graph = _graph(nodes, only_declared=True)
    for start in graph:
        path = _path(graph, start, start)
        if path:
            return path
    return []


def _gauss_seidel(nodes: Sequence[Node]) -> Schedule:
    refresh = _gauss_seidel_refresh(nodes)
    early = _early(nodes, refresh)
    # The last period is the steady one: only inputs older than their source are set.
    read: dict[Port, int] = defaultdict(int)
    written: dict[Port, int] = defaultdict(lambda: 1)
    clock = 1
    operations: list[Operation] = []
    for _ in range(2):
        operations = []
        for c, node in enumerate(nodes):
            due = [n for n, source in node.sources.items() if read[source] > written[c, n]]
            clock += 1
            written.update({(c, name): clock for name in due})
            operations += [*_writes(c, node, due), Step(c), *_reads(c, node, early[c])]
            read.update({(c, name): clock for name in early[c]})
        for level in range(1, max(refresh.outputs.values(), default=0) + 1):
            for c, node in enumerate(nodes):
                clock += 1
                due = _at(refresh.inputs, c, level)
                seen = _at(refresh.outputs, c, level)
                written.update({(c, name): clock for name in due})
                operations += [*_writes(c, node, due), *_reads(c, node, seen)]
            read.update({port: clock for port, at in refresh.outputs.items() if at == level})
            clock += 1
    return Schedule(tuple(operations), _layout(nodes, refresh, early))


def _jacobi(nodes: Sequence[Node]) -> Schedule:
    refresh = _Refresh(
        outputs={(c, o): 1 for c, n in enumerate(nodes) for o in n.outputs if n.followed(o)}
    )
    passed_on = {source for node in nodes for source in node.sources.values()}
    early = [
        [o for o in node.outputs if (c, o) in passed_on or (c, o) not in refresh.outputs]
        for c, node in enumerate(nodes)
    ]
    operations: list[Operation] = [Step(c) for c in range(len(nodes))]
    for c, node in enumerate(nodes):
        operations += _reads(c, node, early[c])
    for c, node in enumerate(nodes):
        operations += _writes(c, node, node.sources)
    for c, node in enumerate(nodes):
        operations += _reads(c, node, _at(refresh.outputs, c, 1))
    return Schedule(tuple(operations), _layout(nodes, refresh, early))


def _gauss_seidel_refresh(nodes: Sequence[Node]) -> _Refresh:
    """Return what follows the inputs whose source came later than their component's step."""
    graph = _graph(nodes)
    seeds = [
        (c, name) for c, node in enumerate(nodes) for name, (d, _) in node.sources.items() if d >= c
    ]
    refresh = _Refresh()
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
                (target, level + 1) for target in graph[output] if not _path(graph, target, output)
            ]
    return refresh


def _early(nodes: Sequence[Node], refresh: _Refresh) -> list[list[str]]:
    """Return what is read directly after each step: all that is final, or that is needed next."""
    needed = {
        source for c, node in enumerate(nodes) for source in node.sources.values() if source[0] < c
    }
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


def _layout(
    nodes: Sequence[Node], refresh: _Refresh, early: Sequence[Iterable[str]]
) -> tuple[Port, ...]:
    """Return all outputs in an order that makes those of each call neighbours."""
    ports = [
        (refresh.outputs.get((c, name), 0), name not in set(early[c]), place, (c, name))
        for c, node in enumerate(nodes)
        for place, name in enumerate(node.outputs)
    ]
    ports.sort(key=lambda entry: (entry[3][0], *entry[:3]))
    return tuple(entry[3] for entry in ports)


def _graph(nodes: Sequence[Node], only_declared: bool = False) -> dict[Port, list[Port]]:
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


def _path(graph: Mapping[Port, Sequence[Port]], start: Port, goal: Port) -> list[Port]:
    """Return a path from `start` to `goal` with at least one edge, or an empty list."""
    before: dict[Port, Port] = {}
    queue = [start]
    while queue:
        port = queue.pop()
        for after in graph[port]:
            if after not in before:
                before[after] = port
                queue.append(after)
    if goal not in before:
        return []
    path = [goal, before[goal]]
    while path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]


def _at(levels: Mapping[Port, int], component: int, level: int) -> list[str]:
    return [name for (c, name), at in levels.items() if c == component and at == level]


def _reads(component: int, node: Node, names: Iterable[str]) -> list[Operation]:
    return [Read(component, *group) for group in _by_kind(node.outputs, names)]


def _writes(component: int, node: Node, names: Iterable[str]) -> list[Operation]:
    return [Write(component, *group) for group in _by_kind(node.inputs, names)]


def _by_kind(
    variables: Mapping[str, Variable], names: Iterable[str]
) -> list[tuple[str, tuple[str, ...]]]:
    groups: dict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[kind_of(variables[name])].append(name)
    return [(kind, tuple(group)) for kind, group in groups.items()]

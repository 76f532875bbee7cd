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
- Jacobi: all step, all are read, all inputs are set; outputs that follow an input are read again
  for the row and not passed on.

A loop of outputs that follow inputs has no order. It is cut where the order of the components
closes it: within a step each value of the loop is taken once. An output without `dependencies`
(None) may follow every input of its component, so it is read again after each of them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from .operations import (
    AHEAD,
    END,
    MIDDLE,
    NEWEST,
    Keep,
    Node,
    Operation,
    Port,
    Schedule,
    Shift,
    Step,
    is_continuous,
    reads,
    writes,
)


@dataclass
class _Refresh:
    """What is set and read once more at the end of a step; the level gives the order."""

    inputs: dict[Port, int] = field(default_factory=dict)
    outputs: dict[Port, int] = field(default_factory=dict)


def make_schedule(nodes: Sequence[Node], algorithm: str) -> Schedule:
    """Return the schedule of a macro step for "gauss-seidel", "midpoint" or "jacobi"."""
    if algorithm == "jacobi":
        return _jacobi(nodes)
    return _one_after_another(nodes, held_inputs(nodes) if algorithm == "midpoint" else ())


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


def find_loop(nodes: Sequence[Node]) -> list[Port]:
    """Return the ports of one algebraic loop that the FMUs declare, or an empty list."""
    graph = _graph(nodes, only_declared=True)
    for start in graph:
        path = _path(graph, start, start)
        if path:
            return path
    return []


def _one_after_another(nodes: Sequence[Node], held: Collection[Port]) -> Schedule:
    """Return the schedule in which each component gets the newest values, and then steps.

    Parameters
    ----------
    nodes : sequence of Node
    held : inputs that get the middle of the step; none of them: Gauss-Seidel
    """
    graph = _graph(nodes)
    refresh = _late(nodes, graph)
    early = _early(nodes, refresh)
    kept = {nodes[c].sources[name] for c, name in held}
    jumping = _jumping(nodes, graph, kept, early)
    # The last period is the steady one: only inputs older than their source are set.
    read: dict[Port, int] = defaultdict(int)
    written: dict[Port, int] = defaultdict(lambda: 1)
    clock = 1
    operations: list[Operation] = []
    for _ in range(2):
        operations = []
        for c, node in enumerate(nodes):
            due = [
                name
                for name, source in node.sources.items()
                if (c, name) in held or read[source] > written[c, name]
            ]
            clock += 1
            written.update({(c, name): clock for name in due})
            operations += _step(c, node, _before(c, node, due, held), kept)
            again = [name for name in due if (c, name) in held]
            operations += writes(c, node, _after(c, node, again, graph, early[c], refresh))
            operations += reads(c, node, early[c])
            read.update({(c, name): clock for name in early[c]})
        for level in range(1, max(refresh.outputs.values(), default=0) + 1):
            for c, node in enumerate(nodes):
                clock += 1
                due = _at(refresh.inputs, c, level)
                seen = _at(refresh.outputs, c, level)
                moved = tuple(name for name in seen if (c, name) in jumping)
                written.update({(c, name): clock for name in due})
                operations += writes(c, node, dict.fromkeys(due, NEWEST))
                operations += [Shift(c, moved, "-=")] if moved else []
                operations += reads(c, node, seen)
                operations += [Shift(c, moved, "+=")] if moved else []
            read.update({port: clock for port, at in refresh.outputs.items() if at == level})
            clock += 1
    return Schedule(tuple(operations), _layout(nodes, refresh, early))


def _step(c: int, node: Node, values: Mapping[str, str], kept: Collection[Port]) -> list[Operation]:
    """Return what sets a component's inputs, keeps the outputs that it had, and lets it step."""
    past = tuple(name for name in node.outputs if (c, name) in kept)
    return [*writes(c, node, values), *([Keep(c, past)] if past else []), Step(c)]


def _before(c: int, node: Node, due: Iterable[str], held: Collection[Port]) -> dict[str, str]:
    """Return which value each input that is due has over the component's step."""
    return {
        name: (MIDDLE if node.sources[name][0] < c else AHEAD) if (c, name) in held else NEWEST
        for name in due
    }


def _after(
    c: int,
    node: Node,
    names: Iterable[str],
    graph: Mapping[Port, Sequence[Port]],
    early: Collection[str],
    refresh: _Refresh,
) -> dict[str, str]:
    """Return which value held inputs get behind the step, for the outputs that follow them.

    Where others wait for such an output it is now, from a source that has still to step as far as
    that can be told; else it is when all have stepped, unless nothing else is set then.
    """
    values = {}
    for name in names:
        following = {output for _, output in graph[c, name]}
        stepped = node.sources[name][0] < c
        wanted = following.intersection(early)
        if wanted or (stepped and following and (c, name) not in refresh.inputs):
            values[name] = NEWEST if stepped else END
    return values


def _jumping(
    nodes: Sequence[Node],
    graph: Mapping[Port, Sequence[Port]],
    kept: Collection[Port],
    early: Sequence[Collection[str]],
) -> set[Port]:
    """Return the outputs whose change between two reads of a step is a jump, and no slope.

    They follow a discrete signal, as a damper's force does the voltage of a controller that has
    stepped after it.
    """
    queue = [
        (c, name)
        for c, node in enumerate(nodes)
        for name, (d, output) in node.sources.items()
        if d >= c and not is_continuous(nodes[d].outputs[output])
    ]
    reached: set[Port] = set()
    while queue:
        port = queue.pop()
        if port not in reached:
            reached.add(port)
            queue += graph[port]
    return {port for port in kept if port in reached and port[1] in early[port[0]]}


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
        operations += reads(c, node, early[c])
    for c, node in enumerate(nodes):
        operations += writes(c, node, dict.fromkeys(node.sources, NEWEST))
    for c, node in enumerate(nodes):
        operations += reads(c, node, _at(refresh.outputs, c, 1))
    return Schedule(tuple(operations), _layout(nodes, refresh, early))


def _late(nodes: Sequence[Node], graph: Mapping[Port, Sequence[Port]]) -> _Refresh:
    """Return what follows the inputs whose source came later than their component's step."""
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

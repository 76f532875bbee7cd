"""Which signal follows which at once, and what is therefore read when in a macro step."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from .operations import Node, Port


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


def path_between(graph: Mapping[Port, Sequence[Port]], start: Port, goal: Port) -> list[Port]:
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


def find_loop(nodes: Sequence[Node]) -> list[Port]:
    """Return the ports of one algebraic loop that the FMUs declare, or an empty list."""
    graph = signal_graph(nodes, only_declared=True)
    for start in graph:
        found = path_between(graph, start, start)
        if found:
            return found
    return []


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
    reached = {}
    for c in feeds:
        queue, seen = list(feeds[c]), set()
        while queue:
            target = queue.pop()
            if target not in seen:
                seen.add(target)
                queue += feeds[target]
        reached[c] = seen
    inside = [c for c in reached if c in reached[c]]
    behind = {target for c in inside for target in reached[c]} - set(inside)
    return inside, sorted(behind)

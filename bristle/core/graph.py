"""Graphs of what feeds or follows what: what is reached from a node, and loops."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)


def reached(graph: Mapping[Node, Iterable[Node]], *starts: Node) -> set[Node]:
    """Return what is reached from some nodes over one edge or more."""
    found, queue = set[Node](), [*starts]
    while queue:
        fresh = {*graph[queue.pop()]} - found
        found |= fresh
        queue += fresh
    return found


def path_between(graph: Mapping[Node, Iterable[Node]], start: Node, goal: Node) -> list[Node]:
    """Return a path from `start` to `goal` with at least one edge, or an empty list."""
    before: dict[Node, Node] = {}
    queue = [start]
    while queue:
        node = queue.pop()
        for after in graph[node]:
            if after not in before:
                before[after] = node
                queue.append(after)
    if goal not in before:
        return []
    path = [goal, before[goal]]
    while path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]


def loop_in(graph: Mapping[Node, Iterable[Node]]) -> list[Node]:
    """Return the nodes of one loop, the first also as the last, or an empty list."""
    return next(filter(None, (path_between(graph, start, start) for start in graph)), [])

"""Where fits begin: over a net of the few shape parameters, with the linear ones solved for.

Given its shape parameters (`physics.law.Shape`) a law is linear in all else. So the best of a whole
net costs little, whatever the size of the rig (variable projection: Golub & Pereyra 1973, SIAM
J. Numer. Anal. 10(2), 413-432).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import nnls

from ..core.arrays import Array
from ..model.model import Model
from ..physics.law import Shape
from .problem import Problem

_NEAR_REST = 3.0  # errors of the velocity within which a sign law tells nothing
SEVERAL = 2
"""Starts beyond which the last one is another look from the best."""

_AT_LEAST = 1e-3  # of the typical size: what a start gives a parameter that came out as zero


def start_models(problem: Problem, model: Model, count: int) -> list[Model]:
    """Return up to `count` starts for a model's law, best first, apart from each other.

    Of several the last one is the best once more, with what came out as zero there at its usual
    size: from nothing a spring behind a dashpot does not grow.

    Parameters
    ----------
    model : Model
        Its `fixed` parameters keep their values; its effects are left as they are.
    """
    net = _Net(problem, model)
    cost, linear = net.solve()
    picked: list[Node] = []
    for flat in np.argsort(cost, axis=None):
        node = tuple(int(q) for q in np.unravel_index(flat, cost.shape))
        if all(max(abs(a - b) for a, b in zip(node, p, strict=True)) > 1 for p in picked):
            picked.append(node)
        if len(picked) == count:
            break
    found = [net.model(node, linear[node]) for node in picked]
    if count > SEVERAL and (lost := net.lost(linear[picked[0]])):
        usual = {name: problem.scaled(model.law, name) for name in lost}
        found[count - 1 :] = [replace(found[0], values={**found[0].values, **usual})]
    return found


Node = tuple[int, ...]
"""A place in the net: which value of each shape parameter."""


class _Net:
    """The columns of the linear parameters at each node, and their products, made once."""

    def __init__(self, problem: Problem, model: Model) -> None:
        self.problem, self.model_0 = problem, model
        self.law = model.law_class
        self.linear = list(self.law.linear())
        self._signed = [model.bounds(name)[0] < 0.0 for name in self.linear]
        idle = self.law.idle(model.values)
        self.grids = {
            name: self._nodes(name, shape)[: 1 if name in idle else None]
            for name, shape in self.law.shapes.items()
        }
        shapes = self.law.shapes
        # Which shape parameters a column depends on: it is the same at all nodes of the others.
        self.bends = {
            name: [name in shapes[shape].shapes for shape in self.grids] for name in self.linear
        }
        columns: list[Array] = []
        self.place: dict[tuple[str, Node], int] = {}
        for name in self.linear:
            for node in self._all_nodes(self.bends[name]):
                self.place[name, node] = len(columns)
                columns.append(self._column(name, node))
        weight = self._weight()
        C = np.array(columns) * weight
        f = np.concatenate([run.force for run in problem.runs]) * weight
        if problem.fits_zero(self.model_0):
            constant = weight / np.linalg.norm(weight)
            C, f = C - np.outer(C @ constant, constant), f - (f @ constant) * constant
        self.gram, self.right, self.square = C @ C.T, C @ f, float(f @ f)

    def _nodes(self, name: str, shape: Shape) -> Array:
        model = self.model_0
        if name in model.fixed:
            return np.array([model.value(name)])
        low, high = model.bounds(name)
        size = self.problem.size(self.law.parameters[name].unit)
        values = np.geomspace(shape.low, shape.high, shape.nodes) * size
        return np.unique(np.clip(values, low, high))

    def _all_nodes(self, counts: list[bool] | None = None) -> Iterator[Node]:
        """Yield the nodes of the net, or of the part of it in which some shapes count."""
        used = counts or [True] * len(self.grids)
        sizes = [
            len(grid) if own else 1 for grid, own in zip(self.grids.values(), used, strict=True)
        ]
        yield from product(*map(range, sizes))

    def _column(self, name: str, node: Node) -> Array:
        """Return the force over all runs of one linear parameter at 1, the others at zero."""
        values = {**dict.fromkeys(self.linear, 0.0), name: 1.0}
        for fixed in self.law.fixed():
            values[fixed] = self.model_0.value(fixed)
        for (shape, grid), k in zip(self.grids.items(), node, strict=True):
            values[shape] = float(grid[k])
        alone = Model(self.model_0.law, (), values)
        return np.concatenate([self.problem.predict(alone, run) for run in self.problem.runs])

    def _weight(self) -> Array:
        """Return the weight of each sample: none near rest for a law with a sign, or not measured.

        Runs of stronger noise weigh less.
        """
        parts = []
        for run in self.problem.runs:
            weight = np.full(len(run.v), 1.0 / run.whole_noise)
            if self.law.has("sign") and len(run.draws):
                error = float(np.std(run.draws[:, :, 1]))
                weight[np.abs(run.v) < _NEAR_REST * error] = 0.0
            if run.measured is not None:
                weight[~run.measured] = 0.0
            weight[: run.skip] = 0.0
            parts.append(weight)
        return np.concatenate(parts)

    def solve(self) -> tuple[Array, dict[Node, Array]]:
        """Return the cost at each node and the linear parameters there."""
        cost = np.empty(tuple(len(grid) for grid in self.grids.values()))
        linear = {}
        for node in self._all_nodes():
            cost[node], linear[node] = self._solve_at(node)
        return cost, linear

    def _solve_at(self, node: Node) -> tuple[float, Array]:
        model = self.model_0
        at = [
            self.place[name, tuple(k if own else 0 for k, own in zip(node, bends, strict=True))]
            for name, bends in self.bends.items()
        ]
        G, b = self.gram[np.ix_(at, at)], self.right[at]
        theta = np.array([model.value(name) for name in self.linear])
        free = np.array([name not in model.fixed for name in self.linear])
        free &= np.diag(G) > 0.0
        theta[~free & np.array([name not in model.fixed for name in self.linear])] = 0.0
        b = b - G[:, ~free] @ theta[~free]
        G, b = G[np.ix_(free, free)], b[free]
        size = np.sqrt(np.diag(G))
        # G = R'R turns the normal equations into a small least-squares problem with theta >= 0;
        # what may be negative is the difference of two such numbers.
        values, vectors = np.linalg.eigh(G / np.outer(size, size))
        values = np.maximum(values, 1e-12 * values[-1])
        R = np.sqrt(values)[:, None] * vectors.T
        signed = np.flatnonzero(np.array(self._signed)[free])
        found, _ = nnls(np.hstack([R, -R[:, signed]]), (vectors.T @ (b / size)) / np.sqrt(values))
        own, below = np.split(found, [len(size)])
        own[signed] -= below
        theta[free] = own / size
        own = theta[free]
        return self.square - 2.0 * float(b @ own) + float(own @ G @ own), theta

    def lost(self, theta: Array) -> list[str]:
        """Return the linear parameters that came out as nothing and are not fixed."""
        return [
            name
            for name, value in zip(self.linear, theta.tolist(), strict=True)
            if name not in self.model_0.fixed and 0.0 <= value <= self._least(name)
        ]

    def _least(self, name: str) -> float:
        return _AT_LEAST * self.problem.size(self.law.parameters[name].unit)

    def model(self, node: Node, theta: Array) -> Model:
        """Return the start at a node: within the bounds, no parameter exactly at zero."""
        model = self.model_0
        values = dict(model.values)
        values.update(dict(zip(self.linear, theta.tolist(), strict=True)))
        for (name, grid), k in zip(self.grids.items(), node, strict=True):
            values[name] = float(grid[k])
        for name in (*self.linear, *self.grids):
            if name not in model.fixed:
                low, high = model.bounds(name)
                if values[name] >= 0.0:
                    values[name] = max(values[name], self._least(name))
                values[name] = min(max(values[name], low), high)
        return replace(model, values=values)

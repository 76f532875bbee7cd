"""Where fits begin: over a net of the few shape parameters, with the linear ones solved for.

Given v_n, and a_0 of the bristles, both laws are linear in all else. So the best of a whole net
costs little, whatever the size of the rig (variable projection: Golub & Pereyra 1973, SIAM
J. Numer. Anal. 10(2), 413-432).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ..physics.damper import LAWS
from ..physics.effect import CHOICES
from .model import Array, Model, Problem, Run

SHAPES = ("v_n", "a_0")
"""Parameters in which the laws are not linear."""

_V_N = np.geomspace(0.05, 5.0, 11)  # of the typical speed
_A_0 = np.geomspace(0.5, 500.0, 13)  # of the inverse of the typical travel
_NEAR_REST = 3.0  # errors of the velocity within which a sign law tells nothing
_AT_LEAST = 1e-3  # of the typical size: what a start gives a parameter that came out as zero


def start_model(runs: list[Run], law: str, exponent: float = 1.0) -> Model:
    """Return the best start for a rig of any size."""
    return start_models(Problem(runs), Model(law, (), {"exponent": exponent}), 1)[0]


def start_models(problem: Problem, model: Model, count: int) -> list[Model]:
    """Return up to `count` starts for a model's law, best first, apart from each other.

    Parameters
    ----------
    model : Model
        Its `held` parameters keep their values; its effects are left as they are.
    """
    net = _Net(problem, model)
    cost, linear = net.solve()
    picked: list[tuple[int, int]] = []
    for flat in np.argsort(cost, axis=None):
        i, j = (int(q) for q in np.unravel_index(flat, cost.shape))
        if all(max(abs(i - p), abs(j - q)) > 1 for p, q in picked):
            picked.append((i, j))
        if len(picked) == count:
            break
    return [net.model(place, linear[place]) for place in picked]


class _Net:
    """The columns of the linear parameters at each node, and their products, made once."""

    def __init__(self, problem: Problem, model: Model) -> None:
        self.problem, self.model_0 = problem, model
        names = [name for name in LAWS[model.law].parameters if name not in CHOICES]
        self.linear = [name for name in names if name not in SHAPES]
        standard = model.value("exponent") == 0.0
        self.v_n = self._nodes("v_n", _V_N * problem.size("m/s"))
        if standard:
            self.v_n = self.v_n[:1]
        self.a_0 = np.ones(1)
        if model.law == "lugre":
            self.a_0 = self._nodes("a_0", _A_0 * problem.size("1/m"))
        columns: list[Array] = []
        self.place: dict[tuple[str, int], int] = {}
        for name in self.linear:
            viscous = name in ("c_0", "c_v", "sigma_2", "sigma_b")
            for k, shape in enumerate(self.v_n if viscous else self.a_0):
                self.place[name, k] = len(columns)
                columns.append(self._column(name, "v_n" if viscous else "a_0", float(shape)))
        self.viscous = [name in ("c_0", "c_v", "sigma_2", "sigma_b") for name in self.linear]
        weight = self._weight()
        C = np.array(columns) * weight
        f = np.concatenate([run.force for run in problem.runs]) * weight
        self.gram, self.right, self.square = C @ C.T, C @ f, float(f @ f)

    def _nodes(self, name: str, values: Array) -> Array:
        model = self.model_0
        if name in model.held:
            return np.array([model.value(name)])
        low, high = model.bounds(name)
        return np.unique(np.clip(values, low, high))

    def _column(self, name: str, shape: str, value: float) -> Array:
        """Return the force over all runs of one linear parameter at 1, the others at zero."""
        values = {**dict.fromkeys(self.linear, 0.0), name: 1.0}
        values["exponent"] = self.model_0.value("exponent")
        if shape in LAWS[self.model_0.law].parameters:
            values[shape] = value
        own = Model(self.model_0.law, (), values)
        return np.concatenate([self.problem.predict(own, run) for run in self.problem.runs])

    def _weight(self) -> NDArray[np.float64]:
        """Return the weight of each sample: none near rest for a law with a sign, or not measured.

        Runs of stronger noise weigh less.
        """
        parts = []
        for run in self.problem.runs:
            weight = np.full(len(run.v), 1.0 / run.noise)
            if self.model_0.law == "bingham" and len(run.draws):
                error = float(np.std(run.draws[:, :, 1]))
                weight[np.abs(run.v) < _NEAR_REST * error] = 0.0
            if run.measured is not None:
                weight[~run.measured] = 0.0
            weight[: run.skip] = 0.0
            parts.append(weight)
        return np.concatenate(parts)

    def solve(self) -> tuple[Array, dict[tuple[int, int], Array]]:
        """Return the cost at each node and the linear parameters there."""
        cost = np.empty((len(self.v_n), len(self.a_0)))
        linear = {}
        for i, j in product(range(len(self.v_n)), range(len(self.a_0))):
            cost[i, j], linear[i, j] = self._solve_at(i, j)
        return cost, linear

    def _solve_at(self, i: int, j: int) -> tuple[float, Array]:
        model = self.model_0
        at = [
            self.place[name, i if viscous else j]
            for name, viscous in zip(self.linear, self.viscous, strict=True)
        ]
        G, b = self.gram[np.ix_(at, at)], self.right[at]
        theta = np.array([model.value(name) for name in self.linear])
        free = np.array([name not in model.held for name in self.linear])
        free &= np.diag(G) > 0.0
        theta[~free & np.array([name not in model.held for name in self.linear])] = 0.0
        b = b - G[:, ~free] @ theta[~free]
        G, b = G[np.ix_(free, free)], b[free]
        size = np.sqrt(np.diag(G))
        # G = R'R turns the normal equations into a small least-squares problem with theta >= 0.
        values, vectors = np.linalg.eigh(G / np.outer(size, size))
        values = np.maximum(values, 1e-12 * values[-1])
        R = np.sqrt(values)[:, None] * vectors.T
        found, _ = nnls(R, (vectors.T @ (b / size)) / np.sqrt(values))
        theta[free] = found / size
        own = theta[free]
        return self.square - 2.0 * float(b @ own) + float(own @ G @ own), theta

    def model(self, place: tuple[int, int], theta: Array) -> Model:
        """Return the start at a node: within the bounds, no parameter exactly at zero."""
        model = self.model_0
        values = dict(model.values)
        values.update(dict(zip(self.linear, theta.tolist(), strict=True)))
        values["v_n"] = float(self.v_n[place[0]])
        if model.law == "lugre":
            values["a_0"] = float(self.a_0[place[1]])
        for name in (*self.linear, *SHAPES):
            if name in values and name not in model.held:
                unit = LAWS[model.law].parameters[name].unit
                low, high = model.bounds(name)
                least = _AT_LEAST * self.problem.size(unit)
                values[name] = min(max(values[name], low, least), high)
        return replace(model, values=values)

"""The search for a model's free parameters on runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..physics.effect import EFFECTS
from .fit import Model, Problem, parameter
from .residuals import Expected as Expected
from .residuals import residuals as residuals
from .search import Descent, descend, jacobian
from .watch import watched

Array = NDArray[np.float64]

MOST_TURNS = 5
"""How often a rough search begins again at most."""

PAYS = 0.95
"""What the loss must fall to, as a share, for another turn."""


def is_rough(model: Model) -> bool:
    """Return whether events such as impacts make a model's residuals jump."""
    return any(EFFECTS[name].joint for name in model.effects)


class Search:
    """The search for a model's parameters on runs: logarithms where a bound is above zero."""

    def __init__(self, problem: Problem, model: Model, expected: Expected, names: Sequence[str]):
        self.problem, self.model, self.expected = problem, model, expected
        self.names = list(names)
        self.rough = is_rough(model)
        declared = [parameter(model.law, name) for name in self.names]
        value = np.array([model.value(name) for name in self.names])
        bounds = np.array([model.bounds(name) for name in self.names], dtype=float).reshape(-1, 2)
        self.log = (bounds[:, 0] > 0.0) & (bounds[:, 1] > 50.0 * bounds[:, 0])
        sizes = np.array([problem.size(d.unit) for d in declared])
        self.scale = np.where(self.log, 1.0, np.maximum(np.abs(value), 1e-2 * sizes))
        self.low, self.high = self._to(bounds[:, 0]), self._to(bounds[:, 1])
        self.start = self._to(np.clip(value, bounds[:, 0], bounds[:, 1]))

    def _to(self, value: Array) -> Array:
        safe = np.where(self.log, np.maximum(value, 1e-300), 1.0)
        return np.where(self.log, np.log(safe), value / self.scale)

    def at(self, theta: Array) -> Model:
        """Return the model with these parameters."""
        value = np.where(self.log, np.exp(np.where(self.log, theta, 0.0)), theta * self.scale)
        return replace(
            self.model,
            values={**self.model.values, **dict(zip(self.names, value.tolist(), strict=True))},
        )

    def residuals(self, theta: Array) -> Array:
        """Return the normalised residuals of all runs (n,)."""
        return residuals(self.problem, self.at(theta), self.expected)

    def sensitivities(self) -> Array:
        """Return how the normalised residuals change with the parameters (n, p), there."""
        here = self.residuals(self.start)
        return jacobian(self.residuals, self.start, here, self.low, self.high, self.rough)

    def run(self, sweeps: int) -> tuple[Model, Descent]:
        """Search from the model's own values."""
        with watched(self.problem, self.at, expected=self.expected) as accepted:
            found = descend(
                self.residuals, self.start, self.low, self.high, sweeps, rough=self.rough,
                accepted=accepted,
            )  # fmt: skip
        return self.at(found.theta), found


def refine(start: Model, train: Problem, sweeps: int = 12) -> Model:
    """Fit all free parameters, the noise expected of the model renewed on the way.

    Where the way is rough a search ends early: it begins again as long as that pays.
    """
    model, cost = start, float("inf")
    for turn in range(MOST_TURNS):
        search = Search(train, model, train.expectation(model), model.free())
        model, ended = search.run(max(3, sweeps // 2) if turn == 0 else sweeps)
        if turn and not (search.rough and ended.cost < PAYS * cost):
            break
        cost = ended.cost
    return model

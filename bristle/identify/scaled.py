"""A model's free parameters as a search sees them: numbers of order one, and their residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..physics.effect import EFFECTS
from .model import Model, Problem, parameter
from .residuals import Expected, residuals
from .search import jacobian

Array = NDArray[np.float64]


class Scaled:
    """A model's free parameters as numbers of order one, and the residuals over them."""

    def __init__(self, problem: Problem, model: Model, expected: Expected) -> None:
        self.problem, self.model, self.expected = problem, model, expected
        self.names = model.free()
        # An impact's spike would tell a gap far more sharply than its fit can find it.
        self.rough = any(EFFECTS[name].joint for name in model.effects)
        start = np.array([model.value(name) for name in self.names])
        units = [parameter(model.law, name).unit for name in self.names]
        self.scale = np.maximum(np.abs(start), 1e-2 * np.array([problem.size(u) for u in units]))
        bounds = np.array([model.bounds(name) for name in self.names], dtype=float).reshape(-1, 2)
        self.low, self.high = bounds[:, 0] / self.scale, bounds[:, 1] / self.scale
        self.start = np.clip(start / self.scale, self.low, self.high)

    def at(self, theta: Array) -> Model:
        """Return the model with these values."""
        own = dict(zip(self.names, (theta * self.scale).tolist(), strict=True))
        return replace(self.model, values={**self.model.values, **own})

    def residuals(self, theta: Array) -> Array:
        """Return the normalised residuals of all runs, finite."""
        return residuals(self.problem, self.at(theta), self.expected)

    def jacobian(self, theta: Array, r: Array) -> Array:
        """Return the derivatives (n, p) of the residuals at theta."""
        return jacobian(self.residuals, theta, r, self.low, self.high, self.rough)

"""Least squares by stretches of the runs: what a curve would lower where it was not fitted."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .residual import Residual
from .rule import LEARN

Array = NDArray[np.float64]

HELD = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""By what share of its own information a parameter of the model is held where it is."""


class Hats(NamedTuple):
    """Hat functions of `knots` at samples: the knots `at` (n, m) that each feels, with `share`.

    They are constant beyond the ends. The shares of a sample add up to 1.
    """

    at: NDArray[np.int64]
    share: Array
    knots: int


def hats_at(values: Array, knots: Array) -> Hats:
    """Return the hat functions of knots (k,) at values (n,)."""
    at = np.clip(np.searchsorted(knots, values, side="right") - 1, 0, len(knots) - 2)
    share = np.clip((values - knots[at]) / (knots[at + 1] - knots[at]), 0.0, 1.0)
    return Hats(np.stack([at, at + 1], axis=1), np.stack([1.0 - share, share], axis=1), len(knots))


def products(first: Hats, second: Hats) -> Hats:
    """Return the hat functions of a grid: those along one signal times those along another one.

    The knots of the first lie beside one another: knot k at level l is the one of number
    l * first.knots + k.
    """
    n = len(first.at)
    at = second.at[:, :, None] * first.knots + first.at[:, None, :]
    share = second.share[:, :, None] * first.share[:, None, :]
    return Hats(at.reshape(n, -1), share.reshape(n, -1), first.knots * second.knots)


class Normal:
    """Normal equations by fold: the law's parameters first, then the values of a curve, if any.

    `grams` (f, p, p), `sides` (f, p), `powers` (f,), each summed over the samples of a fold with
    their weights; `count` the sum of the weights.
    """

    def __init__(self, residual: Residual) -> None:
        self.residual = residual
        known, weight, fold = residual.known, residual.weight, residual.fold
        self._weighted = known * weight[:, None]
        begins = np.searchsorted(fold, np.arange(int(fold.max()) + 1))
        ends = np.append(begins[1:], len(fold))
        self._spans = [slice(a, b) for a, b in zip(begins, ends, strict=True)]
        self.grams = np.array([self._weighted[one].T @ known[one] for one in self._spans])
        self.sides = np.array([self._weighted[one].T @ residual.r[one] for one in self._spans])
        self.powers = np.add.reduceat(weight * residual.r**2, begins)
        self.count = float(weight.sum())
        self._held = 0.0
        self._hold(LEARN.unsteady)

    def _hold(self, unsteady: float) -> None:
        """Hold the model's parameters as firmly as it takes for a fit to do without a stretch.

        Where the runs hardly tell some of them apart, a linear step without a stretch takes them
        far away: what is left there then says nothing of a curve.
        """
        most = unsteady * float(self.powers.sum()) / self.count
        for share in HELD:
            self._held = share
            if self.without_curve() <= most:
                return

    def with_curve(self, column: Array, hats: Hats, free: list[int]) -> Normal:
        """Return the equations with a curve's values at its `free` knots.

        Each sample feels few knots, so that sums over knots take the place of products of columns.

        Parameters
        ----------
        column : (n,) what a unit of the curve adds to the normalised prediction
        hats : of the curve's knots
        free : knots (from 0) whose value is not held at zero
        """
        residual, folds, count = self.residual, len(self.powers), hats.knots
        felt = [hats.share[:, m] * column for m in range(hats.at.shape[1])]
        places = [residual.fold * count + hats.at[:, m] for m in range(hats.at.shape[1])]

        def both(values: Array) -> Array:
            total = np.zeros(folds * count)
            for place, part in zip(places, felt, strict=True):
                total += np.bincount(place, values * part, folds * count)
            return total.reshape(folds, count)

        weight = residual.weight
        own = np.zeros(folds * count * count)
        for place, part in zip(places, felt, strict=True):
            for m, other in enumerate(felt):
                pair = place * count + hats.at[:, m]
                own += np.bincount(pair, weight * part * other, len(own))
        squares = own.reshape(folds, count, count)[:, free][:, :, free]
        mixed = np.array([both(column) for column in self._weighted.T]).transpose(1, 2, 0)
        sides = both(weight * residual.r)[:, free]
        return self._with(mixed[:, free], squares, sides)

    def with_columns(self, columns: Array) -> Normal:
        """Return the equations with more unknowns, of which each adds a column.

        Parameters
        ----------
        columns : (n, k) what a unit of each adds to the normalised prediction
        """
        residual, spans = self.residual, self._spans
        weighted = columns * residual.weight[:, None]
        mixed = np.array([weighted[one].T @ residual.known[one] for one in spans])
        own = np.array([weighted[one].T @ columns[one] for one in spans])
        sides = np.array([weighted[one].T @ residual.r[one] for one in spans])
        return self._with(mixed, own, sides)

    def _with(self, mixed: Array, own: Array, sides: Array) -> Normal:
        """Return the equations with k more unknowns.

        Parameters
        ----------
        mixed : (f, k, p) of these and of what is there
        own : (f, k, k) of these
        sides : (f, k) their right-hand sides
        """
        made = copy(self)
        made.grams = np.concatenate(
            [
                np.concatenate([self.grams, mixed.transpose(0, 2, 1)], axis=2),
                np.concatenate([mixed, own], axis=2),
            ],
            axis=1,
        )
        made.sides = np.concatenate([self.sides, sides], axis=1)
        return made

    def without_curve(self) -> float:
        """Return the mean squared residual where the law's parameters alone were fitted."""
        return self.left_out(np.zeros_like(self.grams[0]))

    def left_out(self, penalty: Array) -> float:
        """Return the mean squared residual of the folds that a fit has not seen."""
        gram, side = self.grams.sum(axis=0), self.sides.sum(axis=0)
        others = gram + penalty + self.ridge() - self.grams
        theta = np.linalg.solve(others, (side - self.sides)[:, :, None])[:, :, 0]
        fitted = np.einsum("fi,fij,fj->f", theta, self.grams, theta)
        missed = self.powers - 2.0 * np.sum(theta * self.sides, axis=1) + fitted
        return float(missed.sum() / self.count)

    def ridge(self) -> Array:
        """Return what makes the equations solvable (p, p), and holds the model's parameters."""
        size = np.diag(self.grams.sum(axis=0))
        least = 1e-9 * np.maximum(size, 1e-9 * max(float(size.max()), 1e-300))
        known = self.residual.known.shape[1]
        least[:known] = np.maximum(least[:known], self._held * size[:known])
        return np.asarray(np.diag(least))

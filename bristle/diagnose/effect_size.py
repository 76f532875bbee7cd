"""An effect beside a fitted model with one number for its size, and what it changes on some runs.

What the model's own parameters can absorb of a change is left out by their sensitivities.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ..data.command_limits import jumps
from ..identify.model import Model, Problem
from ..identify.residuals import BLOCK, Expected, drawn_noise, residuals
from ..identify.search import HUBER, losses, mean_loss
from ..identify.search_context import Search
from ..identify.start_grid import initial_guesses
from ..physics.drive import DRIVES, unit_for
from ..physics.effect import EFFECTS
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

KEPT = 8
"""Changes of an effect that are kept, for sizes that are asked for again."""

FEW = 4
"""Draws of the motion's error from which the noise on the runs that decide is taken."""

REFITS = 10
"""Steps of a robust fit of the model's own parameters, at most."""

SETTLED = 0.05
"""Fall of twice the logarithm of the likelihood that a further step is not taken for."""

TOLD = 1e-3
"""Size of a direction, over the largest, in which the runs tell the model's parameters."""

IDLE = 1e-9
"""What a parameter changes, over the one that changes most, below which it is rounding."""

NEAR = 1.0
"""Change of a parameter's logarithm beyond which its sensitivity says little of what it does."""

SMALL = 0.02
"""Change of a parameter's logarithm that is in proportion to its sensitivity."""


@dataclass(frozen=True)
class Known:
    """What all limits of some runs are found with: the model's residuals and sensitivities.

    `names` of the model's free parameters; `held_out` how many samples decide a verdict; `judging`
    the runs that these are of, None where a sample of them is taken to be like one of the others.
    """

    problem: Problem
    model: Model
    expected: Expected
    held_out: int
    rule: DecisionRule = BENCH
    judging: Problem | None = None

    @cached_property
    def expected_there(self) -> Expected:
        """What a true model would show on the runs that decide."""
        assert self.judging is not None
        return self.judging.expectation(self.model, FEW)

    @cached_property
    def search(self) -> Search:
        """The model with its free parameters."""
        return Search(self.problem, self.model, self.expected, self.model.free())

    @cached_property
    def left(self) -> Array:
        """The normalised residuals (n,) of the model, those far out clipped."""
        return np.clip(self.plain, -HUBER, HUBER)

    @cached_property
    def counts(self) -> Array:
        """1 for each sample (n,), 0 where the command jumps: no clock says on which side it is."""
        return _counted_in(self.problem)

    @cached_property
    def plain(self) -> Array:
        """The normalised residuals (n,) of the model as they are, of the samples that count."""
        return self.counts * self.search.residuals(self.search.start)

    @cached_property
    def _scaled(self) -> tuple[Array, Array]:
        """What the model's own parameters change (n, p), each column of length one; its length.

        A parameter that changes nothing has a column of zeros, of infinite length: it stays.
        """
        if not self.search.names:
            return np.zeros((len(self.plain), 0)), np.zeros(0)
        columns: Array = self.counts[:, None] * self.search.sensitivities()
        lengths = np.linalg.norm(columns, axis=0)
        lengths[lengths <= IDLE * lengths.max()] = np.inf
        return columns / lengths, lengths

    @property
    def own(self) -> Array:
        """What the model's own parameters change (n, p), each column of length one."""
        return self._scaled[0]

    @cached_property
    def taken(self) -> Array:
        """What of a change (n,) the model's own parameters absorb (p, n), by least squares."""
        return np.asarray(np.linalg.pinv(self.own, rcond=TOLD), dtype=float)

    @cached_property
    def basis(self) -> Array:
        """Orthonormal columns (n, p) that span what the model's own parameters change."""
        return np.linalg.qr(self.own[:, np.isfinite(self._scaled[1])])[0]

    @cached_property
    def noise(self) -> tuple[Array, Array]:
        """The force's own noise (n,) and draws (d, n) of the motion's, as residuals have them."""
        own, drawn = drawn_noise(self.problem, self.expected)
        return self.counts * own, self.counts * drawn

    @cached_property
    def size(self) -> float:
        """The norm of the normalised force."""
        parts = [
            (run.force / e[1])[run.skip :]
            for run, e in zip(self.problem.runs, self.expected, strict=True)
        ]
        return float(np.linalg.norm(np.concatenate(parts)))

    def beyond(self, change: Array) -> Array:
        """Return what of a change (n,) the model's own parameters do not absorb."""
        kept: Array = change - self.basis @ (self.basis.T @ change)
        return kept

    def refitted(self, left: Array) -> Array:
        """Return normalised residuals (n,) after a fit of the model's own parameters to them.

        A robust fit, as that of the model is: the force jumps where a sign law turns, by a hundred
        times the noise, and least squares would bend the whole model after those few samples.
        """
        for _ in range(REFITS):
            pull = self.basis.T @ np.clip(left, -HUBER, HUBER)
            weight = np.minimum(1.0, HUBER / np.maximum(np.abs(left), HUBER))
            if not pull.size or float(pull @ pull) <= SETTLED * float(np.mean(weight)):
                break
            normal = (self.basis * weight[:, None]).T @ self.basis
            left = left - self.basis @ np.linalg.lstsq(normal, pull, rcond=TOLD)[0]
        return left

    @cached_property
    def lowest(self) -> float:
        """The robust loss of the model as it is."""
        return float(np.sum(losses(self.refitted(self.plain))))

    def moved(self, change: Array) -> tuple[tuple[str, float], ...]:
        """Return by how much [SI] a fit moves the model's own parameters to absorb a change (n,).

        A parameter that the runs hardly tell would have to move beyond what its sensitivity says:
        it stays, and the others absorb what they can.

        Parameters
        ----------
        change : of the normalised residuals
        """
        stay = np.zeros(len(self.search.start), bool)
        steps = self.steps(change)
        while (far := np.where(self.search.log, np.abs(steps), 0.0)).max(initial=0.0) > NEAR:
            stay[np.argmax(far)] = True
            taken = np.linalg.pinv(self.own[:, ~stay], rcond=TOLD) @ change
            steps = np.zeros(len(stay))
            steps[~stay] = -taken / self._scaled[1][~stay]
        there = self.stepped(steps)
        return tuple((n, there.value(n) - self.model.value(n)) for n in self.search.names)

    def steps(self, change: Array) -> Array:
        """Return the steps (p,) of the search that take up a change (n,), by least squares."""
        steps: Array = -(self.taken @ change) / self._scaled[1]
        return steps

    def stepped(self, steps: Array) -> Model:
        """Return the model with its own parameters moved by steps (p,) within their bounds."""
        search = self.search
        return search.at(np.clip(search.start + steps, search.low, search.high))

    def scatter(self, direction: Array) -> float:
        """Return the standard deviation of a direction's (n,) product with the residual."""
        size = mean_loss(np.minimum(self.plain**2, HUBER**2))
        if self.problem.excess or size > self.rule.misfit**2:
            sums = np.add.reduceat(direction * self.left, np.arange(0, len(direction), BLOCK))
            return float(np.linalg.norm(sums))
        own, drawn = self.noise
        moved = np.clip(drawn, -HUBER, HUBER) @ direction
        more = float(np.var(moved, ddof=1)) if len(moved) > 1 else 0.0
        return sqrt(float(np.sum((direction * own) ** 2)) + more)


class Sized:
    """An effect in a model with one number for its size: 1 is that of a first guess, 0 is none."""

    def __init__(self, name: str, known: Known) -> None:
        effect, self.known = EFFECTS[name], known
        self.name, self.parameter = name, effect.amount.removeprefix("1/")
        self.falls = effect.amount.startswith("1/")
        self.key = f"{name}.{self.parameter}"
        self.model = _first_guess(name, known.model, known.problem)
        self.one = self.model.value(self.key)
        self.low, self.high = self.model.bounds(self.key)
        self.signed = self.low < 0.0 and not self.falls
        self._without = self._counted(self.without())
        self._changes: dict[float, Array] = {}

    @property
    def unit(self) -> str:
        """Return the parameter's unit with the command of the runs: A, not V, with a current."""
        drive = DRIVES[self.known.problem.runs[0].drive]
        return unit_for(EFFECTS[self.name].parameters[self.parameter].unit, drive)

    def value(self, size: float) -> float:
        """Return the parameter's value [SI] at a size, within its bounds."""
        return float(np.clip(self._wanted(size), self.low, self.high))

    def size_of(self, value: float) -> float:
        """Return the size at which the parameter has a value [SI]."""
        return self.one / value if self.falls else value / self.one

    def change(self, size: float) -> Array:
        """Return by how much the effect changes the normalised residuals (n,) at a size."""
        value = self.value(size)
        if value not in self._changes:
            if len(self._changes) == KEPT:
                del self._changes[next(iter(self._changes))]
            self._changes[value] = self._counted(self.with_value(value)) - self._without
        return self._changes[value]

    def change_there(self, size: float) -> Array:
        """Return what is left (n,) of the effect on the runs that decide, the model refitted.

        Of the normalised residuals there; the model's parameters absorb of the effect what they
        can on the runs that are fitted to. Where that is far, it is what a small part of the way
        changes, in proportion: sensitivities said how far, so that they say what it does.
        """
        known, found, none = self.known, self.with_value(self.value(size)), self.without()
        search, steps = known.search, known.steps(self.change(size))
        far = float(np.abs(steps[search.log]).max(initial=0.0))
        part = 1.0 if far <= NEAR else SMALL / far
        there = known.stepped(steps) if part == 1.0 else search.at(search.start + part * steps)
        moved = {name: there.value(name) for name in search.names}
        if part == 1.0:
            return self._there(replace(found, values={**found.values, **moved}), none)
        own = self._there(replace(none, values={**none.values, **moved}), none)
        return self._there(found, none) + own / part

    def _there(self, one: Model, other: Model) -> Array:
        """Return by how much two models differ (n,) on the runs that decide, over the noise."""
        judging, expected = self.known.judging, self.known.expected_there
        assert judging is not None
        first, second = (residuals(judging, model, expected) for model in (one, other))
        return _counted_in(judging) * (first - second)

    def _counted(self, model: Model) -> Array:
        known = self.known
        return known.counts * residuals(known.problem, model, known.expected)

    def ended(self, size: float) -> bool:
        """Return whether a bound keeps the parameter from a size."""
        return not self.low <= self._wanted(size) <= self.high

    def _wanted(self, size: float) -> float:
        return self.one / size if self.falls else self.one * size

    def without(self) -> Model:
        """Return the model with none of the effect: at zero where its parameter may be zero."""
        at_zero = not self.falls and self.low <= 0.0
        return self.with_value(0.0) if at_zero else self.known.model

    def with_value(self, value: float) -> Model:
        """Return the model with the effect at a value of its parameter [SI]."""
        return replace(self.model, values={**self.model.values, self.key: value})


def _counted_in(problem: Problem) -> Array:
    """Return 1 for each sample (n,) of a problem's runs, 0 where the command jumps."""
    return np.concatenate([~jumps(run.V)[run.skip :] for run in problem.runs]).astype(float)


def _first_guess(name: str, model: Model, problem: Problem) -> Model:
    """Return a model with an effect at its default shape, scaled to the rig."""
    guess, effect = initial_guesses(name, model, problem)[0], EFFECTS[name]
    if effect.start_shares:
        return guess
    scaled = {
        f"{name}.{own}": problem.scaled(model.law, f"{name}.{own}") for own in effect.parameters
    }
    return replace(guess, values={**guess.values, **model.values, **scaled})

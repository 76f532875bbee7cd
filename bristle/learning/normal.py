"""What a curve would lower of a residual, before it is fitted."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array, Indices
from ..identification.building_sites import StructureProblem, StructureRun
from ..identification.fit import Search
from ..identification.problem import Problem, Run
from ..identification.rig import DAMPER
from ..identification.search import HUBER
from ..model.model import Model
from ..physics.tuples import Inputs
from .curve import CurvePlace
from .rule import LEARN

# The residual of a fitted model, with what a curve of each part of its law would add to it.


FOLDS = 8
"""Stretches of the training runs that are left out in turn, at least."""


@dataclass(frozen=True)
class Residual:
    """The residual of a model on runs, with what the parts of its law do there.

    `r` (n,) normalised; `weight` (n,) robust; `fold` (n,) which stretch a sample belongs to;
    `known` (n, p) the sensitivities to the parameters; `parts` columns (n,) that a curve of each
    part is multiplied with, over the noise; `runs` of the samples, `keeps` which of each; `slow`
    [m/s], `top`, `drive` and `at` as of a `Curve`; `shown` the predicted force [N] of each run
    whose force a load cell showed, `sigma` (n,) [N] the noise that samples are divided by.
    """

    r: Array
    weight: Array
    fold: Indices
    known: Array
    parts: dict[str, Array]
    runs: list[Run]
    keeps: list[Indices]
    slow: float
    top: float
    drive: str
    shown: list[Array]
    sigma: Array
    at: str = DAMPER

    @property
    def place(self) -> CurvePlace:
        """The site of the rig whose model this is the residual of."""
        return CurvePlace(self.at)

    @property
    def coarsest_step(self) -> float:
        """The longest sampling step of the runs [s]: what that resolves, all of them resolve."""
        return max(run.dt for run in self.runs)

    @property
    def shortest_length(self) -> float:
        """The length of the shortest run [s]."""
        return min(run.dt * len(run.x) for run in self.runs)


def residual_of(problem: Problem, base: Model) -> Residual:
    """Return the residual of a fitted model, with what its law's parts do."""
    expected = problem.expectation(base)
    search = Search(problem, base, expected, base.free())
    r = search.residuals(search.start)
    scale = max(1.0, float(np.median(np.abs(r))) / 0.6745)
    sigma = _joined([noise for _, noise, _ in expected], problem.runs)
    slow = 0.03 * float(np.sqrt(np.mean(np.concatenate([run.v for run in problem.runs]) ** 2)))
    at = _site_of(problem, base)
    columns = _columns_of_line if CurvePlace(at).is_line else _columns
    parts = [columns(problem, base, run, slow) for run in problem.runs]
    return Residual(
        r,
        np.minimum(1.0, HUBER * scale / np.maximum(np.abs(r), 1e-12)),
        _folds(problem.runs),
        -search.sensitivities(),
        {name: _joined([one[name] for one in parts], problem.runs) / sigma for name in parts[0]},
        *_samples(problem.runs),
        slow,
        problem.size("V"),
        problem.runs[0].drive,
        [problem.predict(base, run) for run in problem.runs if not isinstance(run, StructureRun)],
        sigma,
        at,
    )


def _site_of(problem: Problem, base: Model) -> str:
    """Return the site of a rig whose runs and model these are."""
    of_line = isinstance(problem, StructureProblem) and base.law_class.site == "structure"
    if not of_line:
        return DAMPER
    assert isinstance(problem, StructureProblem)
    return f"storey{problem.storey}" if problem.storey else "layer"


def _joined(values: list[Array], runs: list[Run]) -> Array:
    """Return values (n,) per run, those that a fit skips left out, as one array."""
    pairs = zip(values, runs, strict=True)
    return np.concatenate([value[run.skip :] for value, run in pairs])


def _folds(runs: list[Run]) -> Indices:
    """Return which stretch each sample belongs to; no stretch goes over a run's end."""
    each = max(2, -(-FOLDS // len(runs)))
    counts = [len(run.force) - run.skip for run in runs]
    return np.concatenate(
        [k * each + np.arange(n) * each // max(n, 1) for k, n in enumerate(counts)]
    )


def _samples(runs: list[Run]) -> tuple[list[Run], list[Indices]]:
    """Return the whole runs, from which a memory follows, and which of their samples count."""
    wholes, keeps = [], []
    for run in runs:
        whole, keep = run.remembered
        wholes.append(whole)
        keeps.append(np.arange(len(whole.force))[keep][run.skip :])
    return wholes, keeps


def _columns(problem: Problem, base: Model, run: Run, slow: float) -> dict[str, Array]:
    """Return what a unit of each part's curve adds to the force at the samples of a run [N]."""
    law, top = base.law_class, problem.size("V")
    whole = problem.predict(Model(base.law, (), base.values), run)
    viscous = _part(base, run, "viscous")
    out = {
        "force": np.ones(len(run.force)), "friction": np.tanh(run.v / slow), "fluid": whole,
        "fluid_field": whole * run.V / top,
    }  # fmt: skip
    if law.has("viscous"):
        out["viscous"] = viscous
    if law.has("yield"):
        out["yield"] = whole - viscous - _part(base, run, "elastic")
        out["yield_field"] = out["yield"] * run.V / top
    if law.has("command") and top > 1e-6:
        out["command"] = _by_command(problem, base, run, whole, 1e-3 * top)
    return out


def _columns_of_line(_problem: Problem, base: Model, run: Run, slow: float) -> dict[str, Array]:
    """Return what a unit of each part's curve adds to the force of a layer or a storey [N]."""
    law = base.law_class
    return {
        "force": np.ones(len(run.force)), "friction": np.tanh(run.v / slow),
        "spring": base.value(law.stiffness) * run.x, "damping": run.v,
    }  # fmt: skip


def _part(base: Model, run: Run, name: str) -> Array:
    """Return the force (n,) [N] of a part of a model's law, the states of the law at zero."""
    law = base.law_class
    hook = law.hook(name)
    if hook is None:
        return np.zeros(len(run.force))
    rest = law.State(*(0.0 for _ in law.states)) if law.states else ()
    return np.array(
        [
            hook(Inputs(x, v, a, V, 0.0, 0.0, 0.0, False), rest, law.at(base.values, V))
            for x, v, a, V in zip(run.x, run.v, run.a, run.V, strict=True)
        ]
    )


def _by_command(problem: Problem, base: Model, run: Run, whole: Array, nudge: float) -> Array:
    """Return what a `nudge` [V] of the command adds to the force `whole` (n,) [N], in N/V."""
    more = replace(run, V=run.V + nudge)
    if isinstance(more, StructureRun):
        more = replace(more, whole=replace(more.whole, V=more.whole.V + nudge))
    return (problem.predict(Model(base.law, (), base.values), more) - whole) / nudge


HELD = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""By what share of its own information a parameter of the model is held where it is."""


class Hats(NamedTuple):
    """Hat functions of `knots` at samples: the knots `at` (n, m) that each feels, with `share`.

    They are constant beyond the ends. The shares of a sample add up to 1.
    """

    at: Indices
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

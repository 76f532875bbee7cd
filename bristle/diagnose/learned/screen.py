"""Which curves promise to explain a residual: penalised splines, linear in the model as it is.

The law's parameters move along, to first order, and the smoothness of a curve is what predicts
stretches of the training runs that it was not fitted to.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...identify.fit import Model, Problem, Run
from ...identify.search import HUBER
from ...identify.search_context import Search
from ...identify.structure import StructureRun
from ...physics.inputs import Inputs
from .along import ALONG, Along
from .curve import PARTS, Curve, may_change

Array = NDArray[np.float64]

FINE = 13
"""Knots of the spline that is looked at."""

RIPPLED = 33
"""The same along displacement, where a force may ripple."""

FOLDS = 8
"""Stretches of the training runs that are left out in turn, at least."""

SMOOTH = tuple(10.0**k for k in range(-6, 5))
"""Weights of the second differences that are tried, in terms of the curve's own information."""

FEWEST = 4
"""Knots of a curve at the least."""


@dataclass(frozen=True)
class Promise:
    """A curve with what it promises: `loss` the mean squared residual where it was not fitted."""

    curve: Curve
    loss: float


@dataclass(frozen=True)
class Residual:
    """The residual of a model on runs, with what the parts of its law do there.

    `r` (n,) normalised; `weight` (n,) robust; `sigma` (n,) N; `fold` (n,) which stretch a sample
    belongs to; `known` (n, p) the sensitivities to the parameters; `parts` columns (n,) that a
    curve of each part is multiplied with, over sigma; `runs` of the samples, `keeps` which of each.
    """

    r: Array
    weight: Array
    fold: NDArray[np.int64]
    known: Array
    parts: dict[str, Array]
    runs: list[Run]
    keeps: list[NDArray[np.int64]]
    slow: float
    top: float


def residual_of(problem: Problem, base: Model) -> Residual:
    """Return the residual of a fitted model, with what its law's parts do."""
    expected = problem.expectation(base)
    search = Search(problem, base, expected, base.free())
    r = search.residuals(search.start)
    scale = max(1.0, float(np.median(np.abs(r))) / 0.6745)
    weight = np.minimum(1.0, HUBER * scale / np.maximum(np.abs(r), 1e-12))
    sigma = np.concatenate(
        [e[1][run.skip :] for run, e in zip(problem.runs, expected, strict=True)]
    )
    slow = 0.03 * float(np.sqrt(np.mean(np.concatenate([run.v for run in problem.runs]) ** 2)))
    parts = {name: [] for name in PARTS}  # type: dict[str, list[Array]]
    wholes, keeps, folds, begin = [], [], [], 0
    each = max(2, -(-FOLDS // len(problem.runs)))
    for run in problem.runs:
        for name, column in _columns(problem, base, run, slow).items():
            parts[name].append(column[run.skip :])
        whole, keep = run, np.arange(len(run.force))
        if isinstance(run, StructureRun) and run.whole is not None:
            whole, keep = run.whole, run.keep
        wholes.append(whole)
        keeps.append(keep[run.skip :])
        count = len(run.force) - run.skip
        folds.append(begin + np.arange(count) * each // max(count, 1))
        begin += each
    columns = {name: np.concatenate(given) / sigma for name, given in parts.items() if given}
    return Residual(
        r,
        weight,
        np.concatenate(folds),
        -search.sensitivities(),
        columns,
        wholes,
        keeps,
        slow,
        problem.size("V"),
    )


def _columns(problem: Problem, base: Model, run: Run, slow: float) -> dict[str, Array]:
    """Return what a unit of each part's curve adds to the force at the samples of a run [N]."""
    plain = Model(base.law, (), base.values)
    law = base.law_class
    whole = problem.predict(plain, run)
    out = {
        "force": np.ones(len(run.force)), "friction": np.tanh(run.v / slow), "fluid": whole,
    }  # fmt: skip
    viscous = np.zeros(len(whole))
    hook = law.hook("viscous")
    if hook is not None:
        for k, (x, v, a, V) in enumerate(zip(run.x, run.v, run.a, run.V, strict=True)):
            q = Inputs(x, v, a, V, 0.0, 0.0, 0.0, False)
            rest = law.State(*(0.0 for _ in law.states)) if law.states else ()
            viscous[k] = hook(q, rest, law.at(base.values, V))
        if law.has("viscous"):
            out["viscous"] = viscous
    if law.has("yield"):
        out["yield"] = whole - viscous
        out["yield_field"] = out["yield"] * run.V / problem.size("V")
    out["fluid_field"] = whole * run.V / problem.size("V")
    nudge = 1e-3 * problem.size("V")
    if law.has("command") and nudge > 1e-9:
        more: Run = replace(run, V=run.V + nudge)
        if isinstance(run, StructureRun) and run.whole is not None:
            whole_run = replace(run.whole, V=run.whole.V + nudge)
            more = replace(run, V=run.V + nudge, whole=whole_run)
        out["command"] = (problem.predict(plain, more) - whole) / nudge
    return out


def promises(residual: Residual) -> list[Promise]:
    """Return the curves that lower the residual where they were not fitted, the best first."""
    known = Normal(residual)
    without = known.without_curve()
    found = []
    for along, memory, values in signals(residual):
        knots = knots_of(values, RIPPLED if along.name == "displacement" else FINE)
        if len(knots) < FEWEST:
            continue
        hats = hats_at(values, knots)
        for part in residual.parts:
            if may_change(part, along.name):
                one = _promise(known, part, (along, memory), knots, hats, values)
                if one is not None and one.loss < without:
                    found.append(one)
    return sorted(found, key=lambda one: one.loss)


def signals(residual: Residual) -> Iterator[tuple[Along, dict[str, float], Array]]:
    """Yield the signals that vary, with the parameters of their memory and their values (n,)."""
    step = residual.runs[0].dt
    length = min(len(run.x) for run in residual.runs) * step
    stroke = float(np.std(np.concatenate([run.x for run in residual.runs])))
    for along in ALONG.values():
        for memory in along.memories(step, length, stroke):
            parts = [
                along.history(run, memory)[keep]
                for run, keep in zip(residual.runs, residual.keeps, strict=True)
            ]
            values = np.concatenate(parts)
            if float(np.ptp(values)) > 1e-9 * max(1e-300, float(np.max(np.abs(values)))):
                yield along, memory, values


def knots_of(values: Array, count: int) -> Array:
    """Return up to `count` knots for values (n,): between equal steps and equal shares of samples.

    At levels that a signal holds, such as those of a command, stands a knot and none between.
    """
    levels, counts = np.unique(
        np.round(values / max(np.ptp(values), 1e-300), 4), return_counts=True
    )
    if len(levels) <= count and counts.min() > 20:
        return np.asarray(levels * np.ptp(values))
    low, high = np.quantile(values, [0.003, 0.997])
    even = np.linspace(low, high, count)
    shares = np.quantile(values, np.linspace(0.003, 0.997, count))
    knots = 0.6 * even + 0.4 * shares
    apart = np.append(True, np.diff(knots) > 1e-3 * (high - low))
    return np.asarray(knots[apart])


class Hats(NamedTuple):
    """Hat functions of `knots` at samples: knot `at` (n,) below each, `share` (n,) beyond it.

    They are constant beyond the ends.
    """

    at: NDArray[np.int64]
    share: Array
    knots: int


def hats_at(values: Array, knots: Array) -> Hats:
    """Return the hat functions of knots (k,) at values (n,)."""
    at = np.clip(np.searchsorted(knots, values, side="right") - 1, 0, len(knots) - 2)
    share = np.clip((values - knots[at]) / (knots[at + 1] - knots[at]), 0.0, 1.0)
    return Hats(at, share, len(knots))


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
        spans = [slice(a, b) for a, b in zip(begins, ends, strict=True)]
        self.grams = np.array([self._weighted[one].T @ known[one] for one in spans])
        self.sides = np.array([self._weighted[one].T @ residual.r[one] for one in spans])
        self.powers = np.add.reduceat(weight * residual.r**2, begins)
        self.count = float(weight.sum())

    def with_curve(self, column: Array, hats: Hats, free: list[int]) -> Normal:
        """Return the equations with a curve's values at its `free` knots.

        Each sample feels two knots, so that sums over knots take the place of products of columns.

        Parameters
        ----------
        column : (n,) what a unit of the curve adds to the normalised prediction
        hats : of the curve's knots
        free : knots (from 0) whose value is not held at zero
        """
        residual, folds, count = self.residual, len(self.powers), hats.knots
        below, above = (1.0 - hats.share) * column, hats.share * column
        index = residual.fold * count + hats.at

        def summed(values: Array) -> Array:
            total = np.bincount(index, values, folds * count)
            return np.asarray(total, dtype=float).reshape(folds, count)

        def both(values: Array) -> Array:
            out = summed(values * below)
            out[:, 1:] += summed(values * above)[:, :-1]
            return out

        weight = residual.weight
        own = np.zeros((folds, count, count))
        knot = np.arange(count)
        own[:, knot, knot] = summed(weight * below**2)
        own[:, knot[1:], knot[1:]] += summed(weight * above**2)[:, :-1]
        beside = summed(weight * below * above)[:, :-1]
        own[:, knot[:-1], knot[1:]] = beside
        own[:, knot[1:], knot[:-1]] = beside
        mixed = np.array([both(column) for column in self._weighted.T]).transpose(1, 2, 0)
        mixed, own = mixed[:, free], own[:, free][:, :, free]
        made = copy(self)
        made.grams = np.concatenate(
            [
                np.concatenate([self.grams, mixed.transpose(0, 2, 1)], axis=2),
                np.concatenate([mixed, own], axis=2),
            ],
            axis=1,
        )
        made.sides = np.concatenate([self.sides, both(weight * residual.r)[:, free]], axis=1)
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
        """Return what makes the equations solvable (p, p), too small to be felt."""
        size = np.diag(self.grams.sum(axis=0))
        return np.asarray(np.diag(1e-9 * np.maximum(size, 1e-9 * max(float(size.max()), 1e-300))))


def _promise(
    known: Normal, part: str, signal: tuple[Along, dict[str, float]], knots: Array,
    hats: Hats, values: Array,
) -> Promise | None:  # fmt: skip
    """Return the best curve of a part along a signal, None where it has too little to go by."""
    along, memory = signal
    held = _held(part, knots, values)
    free = [k for k in range(len(knots)) if k not in held]
    residual, p = known.residual, known.grams.shape[1]
    normal = known.with_curve(known.residual.parts[part], hats, free)
    gram = normal.grams.sum(axis=0)
    own = float(np.trace(gram[p:, p:])) / max(len(free), 1)
    if not own > 0.0:
        return None
    bend = np.diff(np.eye(len(knots)), 2, axis=0)[:, free]
    shape = bend.T @ bend
    best, penalty = np.inf, np.zeros_like(gram)
    for weight in SMOOTH:
        tried = np.zeros_like(gram)
        tried[p:, p:] = weight * own * shape
        loss = normal.left_out(tried)
        if loss < best:
            best, penalty = loss, tried
    inverse = np.linalg.inv(gram + penalty + normal.ridge())
    theta = inverse @ normal.sides.sum(axis=0)
    fine = np.zeros(len(knots))
    fine[free] = theta[p:]
    freedom = float(np.trace((inverse @ gram)[p:, p:]))
    count = int(np.clip(round(freedom) + 2, FEWEST, RIPPLED if len(knots) > FINE else FINE))
    if len(knots) > count:
        at = knots[np.unique(np.round(np.linspace(0, len(knots) - 1, count)).astype(int))]
        hold = _held(part, at, values)
        fine = np.interp(at, knots, fine)
        for k in hold:
            fine -= fine[k] if len(hold) == 1 else 0.0
            fine[k] = 0.0
        knots, held = at, hold
    low = PARTS[part].low
    curve = Curve(
        part, along.name, tuple(memory.items()), tuple(map(float, knots)),
        tuple(float(max(value, 0.9 * low)) for value in fine), held, residual.slow, residual.top,
    )  # fmt: skip
    return Promise(curve, best)


def _held(part: str, knots: Array, values: Array) -> tuple[int, ...]:
    """Return which knots (from 0) stay at zero: what the law's own strength is already."""
    if not PARTS[part].level:
        return ()
    if part == "command":
        return (0, len(knots) - 1)
    return (int(np.argmin(np.abs(knots - np.median(values)))),)


def distinct(found: Sequence[Promise], count: int, near: float = 1.25) -> list[Promise]:
    """Return the best promises of different parts and signals, those near the best one alone."""
    first: dict[tuple[str, str], Promise] = {}
    for one in found:
        if one.loss <= near * found[0].loss:
            first.setdefault((one.curve.part, one.curve.along), one)
    return list(first.values())[:count]

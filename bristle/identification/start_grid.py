"""Where the search for an effect begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from operator import is_
from threading import Lock
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..model.model import Model
from ..physics.effect import EFFECTS, Sizes
from ..physics.laws import LAWS
from .fit import Search
from .problem import Expected, Problem, residuals
from .search import HUBER, linear_step, loss, mean_loss

RELAXED = ((0.3, 2.0), (0.05, 10.0))
"""Size and width, as factors, of the part of a law that falls with speed, where a start makes room
for an effect of speed: a fit without it inflates that part."""

THIN = 6
"""Of what has no memory every so many samples suffice for a search."""

JOINT_LASTS = 30.0
"""Seconds, over all runs, that suffice for a search where the model has a joint: each is integrated
in the same short steps, however few samples it has."""

KEPT = {"none": 8, "memory": 2, "joint": 6}
"""From how many starts a search is made, by what the model has that makes it dear."""

LOOKED = {"none": 8, "memory": 4, "joint": 6}
"""From how many of those that promise most a linear step is made."""

ABSORBED = 1e-6
"""Share of a column that others must leave for it to be one of its own."""

FARTHEST = 10.0
"""Multiple of a start's own size at which its effect is looked at, at the most."""

FOLLOWED = 3
"""Jacobians of the search that fits the base model to a part of the runs."""

STEPS = (1.0, 0.3)
"""Shares of the linear step, of which the first that serves counts: a law far from linear
overshoots."""


def initial_guesses(effect: str, base: Model, problem: Problem) -> list[Model]:
    """Return the models from which the search for an effect's parameters begins.

    An effect of speed alone competes with the law's own fall with speed, which has absorbed what it
    could: so some of its starts have that part small and wide.
    """
    bases = [dict(base.values)]
    falling, over = base.law_class.falling()
    if EFFECTS[effect].needs == ("v",) and over and not {*falling, over} & set(base.fixed):
        for size, width in RELAXED:
            relaxed = {name: size * base.value(name) for name in falling}
            bases.append({**base.values, **relaxed, over: width * base.value(over)})
    joined = replace(base, effects=(*base.effects, effect), limits=_limits(effect, base, problem))
    return [
        replace(joined, values=_tied(effect, base.law, {**given, **own}, problem))
        for given in bases
        for own in _own_values(effect, base, problem)
    ]


def _own_values(effect: str, base: Model, problem: Problem) -> list[dict[str, float]]:
    """Return the values of an effect's own parameters, by full name, at each node of its grids."""
    declared = EFFECTS[effect].parameters
    if EFFECTS[effect].start_shares:
        plain = {name: parameter.value for name, parameter in declared.items()}
        scale = _largest(problem)
        grids = [
            {n: [share * scale[declared[n].unit] for share in shares] for n, shares in grid.items()}
            for grid in EFFECTS[effect].start_shares
        ]
    else:
        plain = {name: problem.scaled(base.law, f"{effect}.{name}") for name in declared}
        factors = EFFECTS[effect].start_grid
        grids = [{n: [plain[n] * factor for factor in given] for n, given in factors.items()}]
    nodes = [
        dict(zip(grid, node, strict=True)) for grid in grids for node in product(*grid.values())
    ]
    return [{f"{effect}.{n}": v for n, v in {**plain, **node}.items()} for node in nodes]


def _largest(problem: Problem) -> dict[str, float]:
    """Return the sizes that `Effect.start_shares` are shares of, by unit.

    Lengths and speeds are the largest that were measured: a stop beyond them has no force at all.
    """
    x = max(float(np.max(np.abs(run.x))) for run in problem.runs)
    v = max(float(np.max(np.abs(run.v))) for run in problem.runs)
    stiffness = problem.size("N/m")
    bent = {"N/m2": stiffness / x, "N/m3": stiffness / x**2} if x > 0.0 else {}
    units = {
        parameter.unit for effect in EFFECTS.values() for parameter in effect.parameters.values()
    }
    return {**{unit: problem.size(unit) for unit in units}, **bent, "m": x, "m/s": v}


def _limits(effect: str, base: Model, problem: Problem) -> dict[str, tuple[float, float]]:
    """Return a model's limits with those between which the search for an effect stays."""
    declared, own = EFFECTS[effect].parameters, EFFECTS[effect].start_limits
    scale = _largest(problem) if own else {}
    # One strong earthquake among weak ones says nothing of what these do not reach.
    weak = scale
    if own and problem.shaken:
        weak = min((_largest(problem.of([run])) for run in problem.runs), key=lambda one: one["m"])
    return base.limits | {
        f"{effect}.{name}": (low * weak[declared[name].unit], high * scale[declared[name].unit])
        for name, (low, high) in own.items()
    }


def _tied(effect: str, law: str, values: dict[str, float], problem: Problem) -> dict[str, float]:
    """Return start values with those that follow from others, the law's yield force included."""
    joined = EFFECTS[effect]
    p = joined.values_of({name: values[f"{effect}.{name}"] for name in joined.parameters})
    if joined.start_ties:
        sizes = Sizes(*(problem.size(unit) for unit in ("m", "m/s", "V", "N")))
        tied = joined.tie(p, sizes)  # type: ignore[attr-defined]
        for name, value in zip(joined.start_ties, tied, strict=True):
            values[f"{effect}.{name}"] = float(value)
    if hasattr(joined, "yield_share"):
        for name in LAWS[law].yield_parameters():
            if name in values:
                values[name] /= joined.yield_share(p)
    return values


@dataclass(frozen=True)
class ScreeningData:
    """Data for a search: runs, what to expect there, and what the base model leaves there.

    `left` (n,) are its normalised residuals, `known` (n, p) its sensitivities, `cost` its mean loss
    where it is fitted to these data; `kept` says from how many starts a search is worth its cost,
    `looked` of how many a linear step is made.
    """

    problem: Problem
    expected: Expected
    left: Array
    known: Array
    cost: float
    kept: int
    looked: int

    @cached_property
    def _weight(self) -> Array:
        """Root of Huber's weight (n,) of each residual."""
        return np.sqrt(np.minimum(1.0, HUBER / np.maximum(np.abs(self.left), 1e-12)))

    @cached_property
    def _basis(self) -> Array:
        """Orthonormal columns (n, p) that span what the base model's parameters change."""
        columns = self._weight[:, None] * self.known
        lengths = np.linalg.norm(columns, axis=0)
        return np.linalg.qr(columns[:, lengths > 0.0] / lengths[lengths > 0.0])[0]

    def _beyond(self, change: Array) -> Array:
        """Return what of a change (n,) the base model's parameters do not absorb, weighted."""
        weighted = self._weight * change
        kept: Array = weighted - self._basis @ (self._basis.T @ weighted)
        return kept

    def promise(self, start: Model) -> float:
        """Return by how much a start's effect lowers the squares, all else refitted linearly.

        At the size at which it does so best (a score test: Rao 1948, Proc. Camb. Phil. Soc. 44(1),
        50-57), which costs one simulation.
        """
        change = self._beyond(residuals(self.problem, start, self.expected) - self.left)
        along, square = -float(change @ self._beyond(self.left)), float(change @ change)
        size = float(np.clip(along / square, -FARTHEST, FARTHEST)) if square > 0.0 else 0.0
        return max(2.0 * size * along - size**2 * square, 2.0 * along - square)

    def score(self, here: Array, slopes: Array) -> float:
        """Return the share of the squares that an effect takes, refitted linearly from a start.

        Parameters
        ----------
        here, slopes : the residuals (n,) there, and how they change with the effect's parameters
            (n, p)
        """
        columns = np.array([self._beyond(one) for one in (here - self.left, *slopes.T)])
        lengths = np.linalg.norm(columns, axis=1)
        basis, rest = np.linalg.qr((columns[lengths > 0.0] / lengths[lengths > 0.0, None]).T)
        own = basis[:, np.abs(np.diag(rest)) > ABSORBED]
        whole = float(np.sum((self._weight * self.left) ** 2))
        taken = own.T @ self._beyond(self.left)
        return float(taken @ taken) / whole if whole > 0.0 else 0.0


class SearchContext:
    """A model that effects are to join, on its training runs: what all their searches share."""

    def __init__(self, base: Model, train: Problem) -> None:
        self.base, self.train = base, train
        self.expected = train.expectation(base)
        self.cost = mean_loss(loss(residuals(train, base, self.expected)))
        self._screening: dict[str, ScreeningData] = {}
        self._lock = Lock()

    def screening(self, effect: str) -> ScreeningData:
        """Return what the search for an effect is made on."""
        kind = _kind((*self.base.effects, effect), self.base.law)
        with self._lock:
            if kind not in self._screening:
                problem, expected = _thinned_out(self.train, self.expected, kind)
                search = Search(problem, self.base, expected, self.base.free())
                left = search.residuals(search.start)
                known = search.jacobian(search.start, left)
                cost = mean_loss(loss(left))
                if kind == "joint" and problem is not self.train:
                    # What the law gains by following these runs alone is no gain of an effect.
                    cost = search.run(FOLLOWED)[1].cost
                self._screening[kind] = ScreeningData(
                    problem, expected, left, known, cost, KEPT[kind], LOOKED[kind]
                )
        return self._screening[kind]


def _kind(effects: Sequence[str], law: str) -> str:
    joined = [EFFECTS[name] for name in effects]
    if any(effect.joint for effect in joined):
        return "joint"
    if LAWS[law].states or any(effect.states or effect.site == "sensor" for effect in joined):
        return "memory"
    return "none"


def _thinned_out(problem: Problem, expected: Expected, kind: str) -> tuple[Problem, Expected]:
    """Return less data for a search: some of the samples without memory, of the runs with a joint.

    Without states a law is a function of the motion at each sample. A series element costs many
    times as much as another effect: of every other run the start serves.
    """
    if kind == "joint":
        few = problem.runs[::2]
        begins = [run.first(JOINT_LASTS / len(few)) for run in few]
        if len(begins) == len(problem.runs) and all(map(is_, begins, few)):
            return problem, expected
        counts = [len(run.force) for run in begins]
        ends = zip(expected[::2], counts, strict=True)
        return problem.of(begins), [(b[:n], sigma[:n], d[:, :n]) for (b, sigma, d), n in ends]
    if kind == "memory":
        return problem, expected
    runs, thinned = [], []
    for run, (bias, sigma, draws) in zip(problem.runs, expected, strict=True):
        runs.append(run.every(THIN))
        thinned.append((bias[::THIN], sigma[::THIN], draws[:, ::THIN]))
    return problem.of(runs), thinned


@dataclass(frozen=True)
class Candidate:
    """A candidate on its way, with its mean loss on the runs looked at.

    `moves` whether any of its effect's parameters changes the force there: else no search leads on;
    `settled` whether a search has ended there.
    """

    model: Model
    cost: float
    moves: bool = True
    settled: bool = False


class Scored(NamedTuple):
    """An effect's starts, the best first, and what it promises at the best: its `score`.

    `here`, `slopes` are the residuals (n,) at the best start, and how they change with the effect's
    own parameters (n, p).
    """

    score: float
    starts: list[Model]
    here: Array
    slopes: Array


def scored_guesses(effect: str, context: SearchContext) -> Scored:
    """Return an effect's starts with their score; see `ScreeningData.score` and `promise`."""
    screening = context.screening(effect)
    guesses = initial_guesses(effect, context.base, context.train)
    if len(guesses) > 1:
        guesses.sort(key=screening.promise, reverse=True)
    here, slopes = _beside(effect, guesses[0], screening)
    return Scored(screening.score(here, slopes), guesses, here, slopes)


def _beside(effect: str, start: Model, screening: ScreeningData) -> tuple[Array, Array]:
    """Return the residuals (n,) at a start, and how an effect's own parameters change them."""
    own = _own_search(effect, start, screening)
    here = own.residuals(own.start)
    return here, own.jacobian(own.start, here)


def _own_search(effect: str, start: Model, screening: ScreeningData) -> Search:
    """Return the search for an effect's own parameters."""
    added = [name for name in start.free() if name.startswith(f"{effect}.")]
    return Search(screening.problem, start, screening.expected, added)


def ranked_guesses(
    effect: str, context: SearchContext, scored: Scored | None = None, most: int | None = None
) -> list[Candidate]:
    """Return an effect's starts after one linear step of all parameters, the best first.

    Those from which nothing moves, as a softening spring where there is none to soften, are left
    out: they would cost no more than the law alone, and so come before starts that are too large.

    Parameters
    ----------
    effect, context : the effect, and what it is to join
    scored : its starts, None where they are not scored yet
    most : how many of them are looked at; None for as many as the model allows
    """
    screening = context.screening(effect)
    _, starts, *first = scored or scored_guesses(effect, context)
    found = [_stepped(starts[0], effect, screening, *first)]
    for start in starts[1 : most or screening.looked]:
        found.append(_stepped(start, effect, screening, *_beside(effect, start, screening)))
    moving = [one for one in found if one.moves]
    return sorted(moving or found, key=lambda one: one.cost)


def _stepped(
    start: Model, effect: str, screening: ScreeningData, here: Array, slopes: Array
) -> Candidate:
    """Return a start, or what a linear step from it leads to where that is better.

    The base model's own sensitivities are taken as they are without the effect.

    Parameters
    ----------
    start, effect, screening : where to step from, the effect that joins, and on which data
    here, slopes : as `_beside` returns them
    """
    added = _own_search(effect, start, screening).names
    base = [name for name in start.free() if name not in added]
    moves = not added or bool(slopes.any())
    step = linear_step(np.hstack([screening.known, slopes]), here)
    whole = Search(screening.problem, start, screening.expected, [*base, *added])
    best = Candidate(start, mean_loss(loss(here)), moves)
    for share in STEPS:
        theta = np.clip(whole.start - share * step, whole.low, whole.high)
        there = whole.residuals(theta)
        cost = mean_loss(loss(there))
        if cost < best.cost:
            model = whole.at(theta)
            if not moves or _moves(model, there, effect, screening):
                return Candidate(model, cost, moves)
    return best


def _moves(model: Model, here: Array, effect: str, screening: ScreeningData) -> bool:
    """Return whether an effect has a force at its values, or a parameter that gives it one.

    `here` (n,) are the model's residuals.
    """
    without = replace(model, effects=tuple(one for one in model.effects if one != effect))
    if not np.array_equal(here, residuals(screening.problem, without, screening.expected)):
        return True
    return bool(_own_search(effect, model, screening).sensitivities().any())

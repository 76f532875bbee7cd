"""Parameters of a damper model from bench measurements, with intervals that hold.

The residual is divided, sample by sample, by the noise that a true model would show: the force's
own and that of the measured motion carried through the model. Both are drawn (`Run.draws`), so
that correlation in time counts in the intervals as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..core.arrays import Array
from ..core.progress import Count, tell
from ..model.model import Model, parameter
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from .problem import BLOCK, Expected, Problem, drawn_noise, residuals, steady, without
from .run_start import remembering_states
from .search import HUBER_AT_ONE, Descent, descend, in_threads, jacobian, loss, mean_loss
from .starts import start_models

# A model's parameters as a search sees them: numbers of order one, and the residuals over them.


MOST_TURNS = 5
"""How often a rough search begins again at most."""

PAYS, STAYS = 0.95, 0.999
"""What the loss must fall to, as a share, for another turn of a rough search, and for the second
one of another: a model that stays where it was has the noise that was drawn for it."""


def is_rough(model: Model) -> bool:
    """Return whether events such as impacts make a model's residuals jump."""
    return any(EFFECTS[name].joint for name in model.effects)


class Search:
    """The search for a model's parameters on runs, as numbers of order one.

    Parameters
    ----------
    problem, model : the runs; the model, where the search begins
    expected : what a true model would show on each run
    names : of the parameters that it moves
    logarithms : whether it moves the logarithm of a parameter whose lower bound is above zero
    """

    def __init__(
        self, problem: Problem, model: Model, expected: Expected, names: Sequence[str],
        *, logarithms: bool = True,
    ) -> None:  # fmt: skip
        self.problem, self.model, self.expected = problem, model, expected
        self.names = list(names)
        # An impact's spike would tell a gap far more sharply than its fit can find it.
        self.rough = is_rough(model)
        declared = [parameter(model.law, name) for name in self.names]
        value = np.array([model.value(name) for name in self.names])
        bounds = np.array([model.bounds(name) for name in self.names], dtype=float).reshape(-1, 2)
        self.log = logarithms & (bounds[:, 0] > 0.0) & (bounds[:, 1] > 50.0 * bounds[:, 0])
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

    def jacobian(self, theta: Array, r: Array) -> Array:
        """Return the derivatives (n, p) of the residuals at theta (p,), where they are `r`."""
        with self.problem.starts_held(self.at(theta), self.problem.runs):
            return jacobian(self.residuals, theta, r, self.low, self.high, self.rough)

    def sensitivities(self) -> Array:
        """Return how the normalised residuals change with the parameters (n, p), at the start."""
        return self.jacobian(self.start, self.residuals(self.start))

    def run(self, sweeps: int, tolerance: float = 1e-4) -> tuple[Model, Descent]:
        """Search from the model's own values."""
        found = descend(
            self.residuals, self.start, self.low, self.high, sweeps, tolerance, self.jacobian
        )
        return self.at(found.theta), found


def refine(start: Model, train: Problem, sweeps: int = 12) -> Model:
    """Fit all free parameters, the noise expected of the model renewed on the way.

    Where the way is rough a search ends early: it begins again as long as that pays.
    """
    model, cost = start, float("inf")
    for turn in range(MOST_TURNS):
        search = Search(train, model, train.expectation(model), model.free())
        model, ended = search.run(max(3, sweeps // 2) if turn == 0 else sweeps)
        last = ended.cost >= PAYS * cost if search.rough else ended.cost >= STAYS * ended.begun
        if last or (turn and not search.rough):
            break
        cost = ended.cost
    return model


# How well data determine a model's parameters: covariance, and what they do not identify.

_WEAK = 1e-6  # a singular value of the scaled Jacobian below this share of the largest is none
MISFIT = 1.15
"""z above which an error is more than noise."""


def covariance_of(scaled: Search, theta: Array) -> tuple[Array, tuple[str, ...]]:
    """Return the covariance (p, p) [SI], and the names that the data do not identify.

    Covariance A^-1 B A^-1 of an M-estimator (Huber 1981, Robust Statistics, ch. 7): A = J'J over
    the samples within the quadratic part of the loss, B the covariance of J' psi under the drawn
    noise, white for the force's own. Where the residual is more than noise, B is taken from the
    residual itself, in blocks, so that a wrong model's intervals widen with its error.

    Parameters
    ----------
    scaled : the parameters and the residuals
    theta : (p,) where the search ended
    """
    r = scaled.residuals(theta)
    J = scaled.jacobian(theta, r)
    norms = np.linalg.norm(J, axis=0)
    safe = np.where(norms > 0.0, norms, 1.0)
    J = J / safe
    inner = np.abs(r) <= 2.0
    A = J[inner].T @ J[inner]
    values, vectors = np.linalg.eigh(A)
    weak = values <= _WEAK**2 * values[-1]
    inverse = (vectors * np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, values))) @ vectors.T
    own, drawn = drawn_noise(scaled.problem, scaled.expected)
    B = (J * (own**2)[:, None]).T @ J
    if len(drawn) > 1:
        scores = np.array([J.T @ np.clip(e, -2.0, 2.0) for e in drawn])
        scores -= scores.mean(axis=0)
        B = B + scores.T @ scores / (len(drawn) - 1)
    if scaled.problem.excess or mean_loss(loss(r)) > MISFIT**2 * HUBER_AT_ONE:
        B = _scores_of_blocks(J, r)
    covariance = inverse @ B @ inverse
    size = scaled.scale / safe
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * size
    return covariance * np.outer(size, size), _lost(
        scaled, theta * scaled.scale, std, norms, vectors[:, weak]
    )


def _scores_of_blocks(J: Array, r: Array) -> Array:
    """Return the covariance (p, p) of J' psi, from blocks of samples taken as independent."""
    scores = J * np.clip(r, -2.0, 2.0)[:, None]
    edges = np.arange(0, len(r), min(BLOCK, max(1, len(r) // 20)))
    sums = np.add.reduceat(scores, edges, axis=0)
    sums -= sums.mean(axis=0)
    B: Array = sums.T @ sums
    return B


def _lost(
    scaled: Search, value: Array, std: Array, norms: Array, directions: Array
) -> tuple[str, ...]:
    """Name what does not move the force, is mixed up with others, or is wider than its size."""
    lost = []
    for i, name in enumerate(scaled.names):
        size = scaled.problem.size(parameter(scaled.model.law, name).unit)
        mixed = directions.size and float(np.max(np.abs(directions[i]))) > 0.3
        if norms[i] == 0.0 or mixed or std[i] > max(abs(value[i]), size):
            lost.append(name)
    return tuple(lost)


SEVERAL, FROM_REST = 2, 6
"""Parts of a damper that remember, from which on searches begin with runs from rest as well; the
Jacobians of such a search."""

_ALIKE = 1e-3  # relative difference of costs below which two starts have come to the same end
_FINAL_DRAWS = 24  # draws of the motion for bias and intervals of what is reported
_ENDS = 6  # searches from beside the best point where the loss is rough
_TURNS = 10  # Jacobians of such a search, about
_MOST_SPENT = 100e6  # steps of dampers' forces, see `Effort`, that they take at the most
_ASIDE = {"N/m": 0.4, "kg": 0.4}  # by what share, by unit: what a joint's spikes hardly tell
_BESIDE = 0.01  # all others
_AS_GOOD = 1.1  # times the least cost: ends that a rough loss does not tell apart


@dataclass(frozen=True)
class Fit:
    """What a fit found.

    `model` with the values; `std` by name; `cost` the mean robust loss per sample on the runs
    fitted; `unidentified` names the parameters that the data do not identify; `starts` how many
    were tried, `agreed` how many of them came to this end; `covariance` (p, p) that of the
    parameters in `std`, in its order [SI], None without.
    """

    model: Model
    std: dict[str, float]
    cost: float
    unidentified: tuple[str, ...] = ()
    starts: int = 1
    agreed: int = 1
    covariance: Array | None = None


def fit(
    problem: Problem,
    model: Model,
    *,
    expectation: Expected | None = None,
    max_evaluations: int = 25,
    with_std: bool = True,
) -> Fit:
    """Fit the free parameters of a model to the problem's runs.

    Parameters
    ----------
    problem : the runs
    model : where the search starts
    expectation : what a true model would show on each run; None draws it for `model`
    max_evaluations : most Jacobians of the search
    with_std : whether to make the standard deviations, too

    Returns
    -------
    Fit
        Robust weighted least squares (Huber's loss) within the bounds; standard deviations by the
        sandwich formula with the drawn noise.
    """
    expected = expectation or problem.expectation(model)
    scaled = Search(problem, model, expected, model.free(), logarithms=False)
    if not scaled.names:
        cost = mean_loss(loss(scaled.residuals(np.zeros(0))))
        return Fit(model, {}, cost)
    best, found = scaled.run(max_evaluations, tolerance=1e-5)
    fitted = Fit(best, {}, found.cost)
    return _with_intervals(fitted, scaled, found.theta) if with_std else fitted


def _with_intervals(found: Fit, scaled: Search, theta: Array) -> Fit:
    covariance, lost = covariance_of(scaled, theta)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist()
    by_name = dict(zip(scaled.names, std, strict=True))
    return replace(found, std=by_name, unidentified=lost, covariance=covariance)


def with_rest(problem: Problem, starts: list[Model], expected: Expected) -> list[Model]:
    """Return the starts of a law, and where short searches from them come with runs from rest.

    Where several parts of a damper remember what was before a run, its opening tells a mixture of
    what they hold: a model that is far off gives one of them too much, and a search from there ends
    in a wrong valley. Only the starts where one part remembers, or no run begins in motion.
    """
    states = remembering_states(starts[0].base_law, starts[0].effects)
    if len(states) < SEVERAL or not any(run.opening for run in problem.runs):
        return starts

    def searched(start: Model) -> Model:
        with problem.begun_at_rest():
            search = Search(problem, start, expected, start.free(), logarithms=False)
            return search.run(FROM_REST)[0]

    return [*starts, *in_threads(searched, starts)]


def multistart_refit(problem: Problem, model: Model, max_evaluations: int = 25) -> Fit:
    """Fit a model for the report: many draws for its intervals, and the spread of a rough loss.

    Impacts make the loss of a joint rough: a search ends in one of many dents, whose own width says
    nothing. So it begins again from beside; the best end counts, and the spread of the others that
    are about as good is added to its intervals.
    """
    expected = problem.expectation(model, _FINAL_DRAWS)
    found = fit(problem, model, expectation=expected, max_evaluations=max_evaluations)
    joints = [name for name in model.effects if EFFECTS[name].joint]
    if not joints:
        return found
    generator = np.random.default_rng(len(found.std))  # fixed: a model has the same ends again
    each = _TURNS * len(found.std) * problem.steps_of(found.model)
    few = min(_ENDS, int(_MOST_SPENT / max(each, 1.0)))
    starts = [_beside(found.model, joints, generator) for _ in range(few)]
    search = partial(fit, problem, expectation=expected, with_std=False)
    ends = [found, *in_threads(search, starts)]
    best = min(ends, key=lambda one: one.cost)
    if best is not found:
        best = fit(problem, best.model, expectation=expected, max_evaluations=4)
    near = [one.model for one in ends if one.cost <= _AS_GOOD * best.cost]
    spread = {
        name: _spread([m.value(name) for m in near], best.model.value(name)) for name in best.std
    }
    std = {name: float(np.hypot(own, spread[name])) for name, own in best.std.items()}
    assert best.covariance is not None
    more = np.diag(np.array([spread[name] for name in best.std]) ** 2)
    return replace(best, std=std, covariance=best.covariance + more)


def _beside(model: Model, joints: Sequence[str], generator: np.random.Generator) -> Model:
    """Return a model with its free parameters moved at random, those of a joint the most."""
    values = dict(model.values)
    for name in model.free():
        own = any(name.startswith(joint + ".") for joint in joints)
        aside = _ASIDE.get(parameter(model.law, name).unit, _BESIDE) if own else _BESIDE
        moved = model.value(name) * np.exp(aside * generator.standard_normal())
        values[name] = float(np.clip(moved, *model.bounds(name)))
    return replace(model, values=values)


def intervals_of(problem: Problem, model: Model) -> Fit:
    """Return a model as it is as a fit: its standard deviations without a further search.

    Parameters
    ----------
    problem : the runs that the model was fitted to
    model : with its values
    """
    expected = problem.expectation(model)
    scaled = Search(problem, model, expected, model.free(), logarithms=False)
    cost = mean_loss(loss(scaled.residuals(scaled.start)))
    found = Fit(model, {}, cost)
    return _with_intervals(found, scaled, scaled.start) if scaled.names else found


def _spread(values: list[float], about: float) -> float:
    """Return the root of the mean square of values about one of them."""
    return float(np.sqrt(np.sum((np.array(values) - about) ** 2) / max(len(values) - 1, 1)))


def fit_from_starts(problem: Problem, model: Model, starts: int = 4) -> Fit:
    """Fit a model from several starts; return the best fit with its intervals.

    Parameters
    ----------
    problem : the runs
    model : with the values of its effects to begin with, and those of fixed parameters [SI]; an
        effect without values begins at the size of the rig
    starts : how many starting points are tried; 0 for the model's own values

    Returns
    -------
    Fit
        With the parameters of a voltage that does not change held at zero and named in
        `unidentified`.
    """
    law, fixed = model.law, model.fixed
    model = replace(model, values=problem.at_size(law, model.effects) | model.values)
    driven = LAWS[law].driven() if steady(problem) else ()
    silent = tuple(name for name in driven if name not in fixed)
    model = without(model, silent)
    trials = start_models(problem, model, starts) if starts else [model]
    expected = problem.expectation(trials[0])
    trials = with_rest(problem, trials, expected) if starts else trials
    count = Count(f"fitting {law}: start", len(trials))

    def searched(start: Model) -> Fit:
        found = fit(problem, start, expectation=expected, max_evaluations=12, with_std=False)
        count.done()
        return found

    fits = in_threads(searched, trials)
    best = min(fits, key=lambda one: one.cost)
    agreed = sum(one.cost <= best.cost * (1.0 + _ALIKE) for one in fits)
    tell(f"fitting {law}: intervals")
    best = fit(problem, best.model, expectation=problem.expectation(best.model), with_std=False)
    best = multistart_refit(problem, best.model)
    return replace(
        best, unidentified=(*silent, *best.unidentified), starts=len(trials), agreed=agreed
    )

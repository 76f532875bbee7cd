"""Parameters of a damper model from bench measurements, with intervals that hold.

The residual is divided, sample by sample, by the noise that a true model would show: the force's
own and that of the measured motion carried through the model. Both are drawn (`Run.draws`), so
that correlation in time counts in the intervals as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..progress import Count, tell
from .intervals import covariance_of
from .model import (
    Model,
    Problem,
    Run,
    law_parameters,
    parameter,
    sizes,
    steady,
    without,
)  # fmt: skip
from .residuals import Expected
from .scaled import Scaled
from .search import descend, loss, mean_loss
from .starts import start_model, start_models
from .threads import in_threads
from .watch import watched

__all__ = [
    "Expected",
    "Fit",
    "Model",
    "Problem",
    "Run",
    "Scaled",
    "fit",
    "identify",
    "intervals_of",
    "law_parameters",
    "multistart_refit",
    "parameter",
    "sizes",
    "start_model",
]  # fmt: skip

Array = NDArray[np.float64]

_ALIKE = 1e-3  # relative difference of costs below which two starts have come to the same end
_FINAL_DRAWS = 24  # draws of the motion for bias and intervals of what is reported
_ENDS = 6  # searches from beside the best point where the loss is rough
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
    evaluations: int = 0
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
    scaled = Scaled(problem, model, expected)
    if not scaled.names:
        cost = mean_loss(loss(scaled.residuals(np.zeros(0))))
        return Fit(model, {}, cost)
    with watched(problem, scaled.at, expected=expected) as accepted:
        found = descend(
            scaled.residuals,
            scaled.start,
            scaled.low,
            scaled.high,
            max_evaluations,
            tolerance=1e-5,
            rough=scaled.rough,
            accepted=accepted,
        )
    best = scaled.at(found.theta)
    if not with_std:
        return Fit(best, {}, found.cost, (), found.sweeps)
    return _with_intervals(Fit(best, {}, found.cost, evaluations=found.sweeps), scaled, found.theta)


def _with_intervals(found: Fit, scaled: Scaled, theta: Array) -> Fit:
    covariance, lost = covariance_of(scaled, theta)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist()
    by_name = dict(zip(scaled.names, std, strict=True))
    return replace(found, std=by_name, unidentified=lost, covariance=covariance)


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
    starts = [_beside(found.model, joints, generator) for _ in range(_ENDS)]
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
    scaled = Scaled(problem, model, problem.expectation(model))
    cost = mean_loss(loss(scaled.residuals(scaled.start)))
    found = Fit(model, {}, cost)
    return _with_intervals(found, scaled, scaled.start) if scaled.names else found


def _spread(values: list[float], about: float) -> float:
    """Return the root of the mean square of values about one of them."""
    return float(np.sqrt(np.sum((np.array(values) - about) ** 2) / max(len(values) - 1, 1)))


def identify(
    problem: Problem,
    law: str,
    effects: tuple[str, ...] = (),
    starts: int = 4,
    *,
    values: Mapping[str, float] | None = None,
    fixed: tuple[str, ...] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> Fit:
    """Fit a law from several starts; return the best fit with its intervals.

    Parameters
    ----------
    problem : the runs
    law, effects : names of the law and of the effects that are on
    starts : how many starting points are tried
    values : parameters of effects to begin with, and those of `fixed` ones [SI]
    fixed, limits : see `Model`

    Returns
    -------
    Fit
        With the parameters of a voltage that does not change held at zero and named in
        `unidentified`.
    """
    given = {
        f"{effect}.{own}": problem.scaled(law, f"{effect}.{own}")
        for effect in effects
        for own in _parameters(effect)
    } | dict(values or {})
    model = Model(law, effects, given, fixed, dict(limits or {}))
    driven = LAWS[law].driven() if steady(problem) else ()
    silent = tuple(name for name in driven if name not in fixed)
    model = without(model, silent)
    trials = start_models(problem, model, starts)
    expected = problem.expectation(trials[0])
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


def _parameters(effect: str) -> list[str]:
    return list(EFFECTS[effect].parameters)

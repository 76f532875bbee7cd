"""Sensor faults that no redundant channel shows, told from physics by what physics cannot do.

A load cell off its zero adds the same force whatever the motion and the voltage: a spring's preload
would come with stiffness, and a damper that is stronger one way with more the more it yields. A
force that follows the voltage before the voltage was recorded has no cause: the record is late.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import is_

import numpy as np

from ..core.arrays import Array
from ..core.finding import Finding
from ..core.text import plain, quantity
from ..data.corrections import LIMITS, limited
from ..data.left_out import MISSING, merged
from ..identification.fit import Search, refine
from ..identification.problem import (
    Expected,
    Problem,
    Run,
    has_offset,
    moved_by,
    residuals,
    steady,
)
from ..identification.search import (
    HUBER_AT_ONE,
    descend,
    in_threads,
    linear_step,
    loss,
    losses,
    mean_loss,
)
from ..identification.start_grid import SearchContext, ranked_guesses
from ..model.model import Model
from ..physics.drive import DRIVES
from ..physics.effect import EFFECTS, Effect, effects_of
from .prepared import COARSE
from .rule import DRIVE, LIMITED, DecisionRule
from .trials import Trial, joinable, judge, short_search

LATEST = 0.15
"""Largest delay of the voltage that is looked for [s]."""

BLOCK = 250
"""Samples, longer than a residual's correlation."""


@dataclass(frozen=True)
class ModelBasedFaults:
    """Faults of sensors, the runs set right, and how the model does on them."""

    faults: tuple[Finding, ...]
    train: Problem
    held_out: Problem
    trial: Trial


def model_based_faults(before: Trial, train: Problem, held_out: Problem) -> ModelBasedFaults | None:
    """Return the fault that explains what a model leaves; None where none does, or physics better.

    Parameters
    ----------
    before : the model without further effects, fitted to `train` and judged on `held_out`
    train, held_out : runs to fit to, and those that decide
    """
    if before.z < 1.0 + DRIVE.gain:
        return None
    found = _zero_of_force(before, train, held_out)
    if (
        found
        and explains(found.trial, before, DRIVE)
        and not has_rival(found, before, train, "force_bias", DRIVE)
    ):
        return found
    found = _late_drive(before, train, held_out)
    if found and explains(found.trial, before, DRIVE):
        sure = before.z > DRIVE.late_drive_z
        return found if sure or not has_rival(found, before, train, "late_drive", DRIVE) else None
    return None


def explains(trial: Trial, before: Trial, rule: DecisionRule) -> bool:
    """Return whether a model with a fault set right lacks nearly nothing of what it did before."""
    share = 1.0 - max(trial.z**2 - 1.0, 0.0) / (before.z**2 - 1.0)
    least = rule.share_when_clean if trial.z < rule.clean else rule.share
    return 1.0 - trial.z / before.z > rule.gain and share > least


def has_rival(
    found: ModelBasedFaults, before: Trial, train: Problem, fault: str, rule: DecisionRule
) -> bool:
    """Return whether an effect that looks like the fault explains the runs as they are better.

    Parameters
    ----------
    found : the fault, the runs set right and the trial of them
    before : the trial of the runs as they are, without further effects
    train : the runs as they are, to fit to
    fault : what effects say that they look like, one of `physics.effect.MIMICKED`
    rule : the numbers that decide
    """
    model = before.model
    own = found.trial.model
    cost = _loss(own, found.train)
    context = SearchContext(model, train)
    rivals = [name for name in joinable(model) if fault in EFFECTS[name].mimics]
    found_there = in_threads(
        lambda name: short_search(name, context, ranked_guesses(name, context)), rivals
    )
    return any(_loss(one.model, train) < cost * (1.0 - rule.margin) for one in found_there)


def promise(cost: float, before: float) -> float:
    """Return which part of the mean loss above that of a true model is gone."""
    return (before - cost) / max(before - HUBER_AT_ONE, 1e-6)


def _loss(model: Model, problem: Problem) -> float:
    return mean_loss(losses(residuals(problem, model, problem.expectation(model))))


# --- the zero of the force ----------------------------------------------------------------------


def _zero_of_force(before: Trial, train: Problem, held_out: Problem) -> ModelBasedFaults | None:
    """Return the offset of the force that fits best, as a preload without stiffness."""
    carrier = _carrier(before.model.base_law)
    if carrier is None or train.free_zero or has_offset(before.model):
        return None  # it is known, or an offset of its own would be that one
    base, expected = before.model, train.expectation(before.model)
    offset = float(np.median(_left(base, train)))
    costs = (
        mean_loss(losses(residuals(one, base, expected)))
        for one in (_shifted(train, offset), train)
    )
    if promise(*costs) < DRIVE.promise:
        return None
    own = f"{carrier.name}.{carrier.offset}"
    others = tuple(f"{carrier.name}.{n}" for n in carrier.parameters if n != carrier.offset)
    start = replace(
        base, effects=(*base.effects, carrier.name), fixed=(*base.fixed, *others),
        values={**base.values, **dict.fromkeys(others, 0.0), own: offset},
    )  # fmt: skip
    fitted = refine(start, train)
    offset = fitted.value(own)
    plain = {k: v for k, v in fitted.values.items() if k not in (own, *others)}
    right = _shifted(train, offset), _shifted(held_out, offset)
    trial = judge(replace(base, values=plain), *right)
    fault = Finding(
        "bias", "warning",
        f"Force shows {quantity(offset, 'N')} whatever the {moved_by(train)}, without the "
        "stiffness of a spring: the zero of the load cell is off, or a preload acts on the rod.",
        channel="force", value=offset, std=_deviation(_left(trial.model, right[0])),
    )  # fmt: skip
    return ModelBasedFaults((fault,), *right, trial)


def _carrier(law: str) -> type[Effect] | None:
    """Return the effect whose offset is fitted in place of a constant, the library's own first."""
    able = [effect for effect in effects_of("damper", law) if effect.offset]
    return min(able, key=lambda effect: effect.own, default=None)


def _left(model: Model, problem: Problem) -> Array:
    """Return the residual of all runs (n,) [N]."""
    return np.concatenate(
        [(run.force - problem.predict(model, run))[run.skip :] for run in problem.runs]
    )


def _shifted(problem: Problem, offset: float) -> Problem:
    return problem.of([replace(run, force=run.force - offset) for run in problem.runs])


def _deviation(left: Array) -> float:
    """Return the standard deviation of the mean of a residual, from blocks."""
    blocks = left[: len(left) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1)
    return float(blocks.std() / np.sqrt(max(len(blocks), 1)))


# --- a late voltage -----------------------------------------------------------------------------


def _late_drive(before: Trial, train: Problem, held_out: Problem) -> ModelBasedFaults | None:
    """Return the delay of the voltage's record that fits best, the law refitted to it."""
    if steady(train):
        return None
    model, dt, drive = before.model, max(run.dt for run in train.runs), train.runs[0].drive
    grid = dt * np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
    grid = grid[grid <= LATEST]
    at_first = _loss(model, train)
    late = std = 0.0
    for turn in range(3):
        cost = _cost_of_delay(model, train)
        late = _between(cost, grid, int(np.argmin([cost(delay) for delay in grid])))
        if late < DRIVE.least_delay * dt:
            return None
        moved = _moved(train, late)
        model = refine(model, moved, 4)
        if turn == 0 and promise(_loss(model, moved), at_first) < DRIVE.promise:
            return None
    bend = cost(late + dt) + cost(late - dt) - 2.0 * cost(late)
    std = dt * float(np.sqrt(2.0 / max(bend, 1e-12)))
    right = _moved(train, late), _moved(held_out, late)
    fault = Finding(
        "delay", "warning",
        f"The force follows the {drive} {1e3 * late:.2f} ms before the {drive} was recorded: its "
        "record is late.",
        channel=drive, value=late, std=std,
    )  # fmt: skip
    return ModelBasedFaults((fault,), *right, judge(refine(model, right[0]), *right))


def _cost_of_delay(model: Model, train: Problem) -> Callable[[float], float]:
    """Return the sum of squares, outliers bounded, as a function of the delay [s]."""
    expected = train.expectation(model)

    def cost(late: float) -> float:
        moved = train.of([_advanced(run, late, draws=False) for run in train.runs])
        z = residuals(moved, model, expected)
        return float(np.sum(np.minimum(z * z, 25.0)))

    return cost


def _between(cost: Callable[[float], float], grid: Array, best: int) -> float:
    from scipy.optimize import minimize_scalar

    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 2e-5})
    return float(found.x)


def _moved(problem: Problem, late: float) -> Problem:
    return problem.of([_advanced(run, late) for run in problem.runs])


def _advanced(run: Run, late: float, draws: bool = True) -> Run:
    """Return a run whose voltage was `late` [s] later on record than in truth.

    What the voltage was in the last moments is not on record: they count as not measured.
    """
    if late == 0.0:
        return run
    samples = late / run.dt
    moved = run.draws
    if draws:
        moved = moved.copy()
        for one in moved:
            one[:, 3] = _ahead(one[:, 3], samples)
    known = np.arange(len(run.V)) < len(run.V) - samples
    left_out = merged(run.left_out, MISSING, ~known)
    return replace(run, V=_ahead(run.V, samples), draws=moved, left_out=left_out)


def _ahead(values: Array, samples: float) -> Array:
    """Return a signal (n,) moved ahead in time by a number of samples, its last value held."""
    at = np.arange(len(values), dtype=float)
    return np.interp(at + samples, at, values)


# --- a command that was limited between its record and the coil: in its slew or in its range -----
#
# The record then says more than the damper felt, and only a model shows it. The limit is fitted
# together with the law: neither is right without the other. It is told where it explains nearly all
# that the model leaves, and no effect that looks like it does so better: a coil that lags follows a
# large step as fast as a small one, a magnet that saturates bends and has no edge.

NODES = 7
"""Limits of each kind that are looked at first."""

SWEEPS = 12
"""Jacobians of the search for a limit together with the law."""

LOWEST = 0.35
"""Least range that is looked at, as a share of the largest command."""

SLOWEST = 3.0
"""Longest time [s] that is looked at, which the command needs from end to end."""

QUICKEST = 2.0
"""Samples that the largest change must take at the least: below, it is hardly slowed."""

MOVES = 0.02
"""Share of the largest command by which a run's command must change: a level shows no limit."""

APART = 0.01
"""Share of the largest command from which on the coil has another value than the record."""


@dataclass(frozen=True)
class _Limit:
    """A limit of a kind of `LIMITS`, and the model that was fitted with it."""

    fault: str
    value: float
    model: Model
    cost: float
    std: float = 0.0


def limited_drive(before: Trial, train: Problem, held_out: Problem) -> ModelBasedFaults | None:
    """Return the limit of the command that explains what a model leaves; None where none does.

    Parameters
    ----------
    before : the model without further effects, fitted to `train` and judged on `held_out`
    train, held_out : runs to fit to, and those that decide
    """
    if before.z < 1.0 + LIMITED.gain or not _moving(train):
        return None
    runs = [run.coarser(COARSE) for run in train.runs]
    coarse = train if all(map(is_, runs, train.runs)) else train.of(runs)
    expected = coarse.expectation(before.model)
    at_first = mean_loss(loss(residuals(coarse, before.model, expected)))
    looked = [_looked_at(kind, before.model, coarse, expected) for kind in LIMITS]
    able = [one for one in looked if one and promise(one.cost, at_first) > LIMITED.promise]
    if not able:
        return None
    found = min((_fitted(one, coarse, expected) for one in able), key=lambda one: one.cost)
    explained = promise(found.cost, at_first)
    if explained < LIMITED.share_when_clean or not found.value > LIMITED.fault_sigma * found.std:
        return None
    right, other = _felt(train, found), _felt(held_out, found)
    trial = judge(refine(found.model, right, 4), right, other)
    fault = _fault(found, train, held_out)
    shown = ModelBasedFaults((fault,), right, other, trial)
    if not explains(trial, before, LIMITED) or has_rival(
        shown, before, train, "limited_drive", LIMITED
    ):
        return None
    return shown


def _largest(problem: Problem) -> float:
    return max(float(np.max(np.abs(run.V))) for run in problem.runs)


def _moving(problem: Problem) -> list[Run]:
    """Return the runs whose command changes on its way."""
    least = MOVES * _largest(problem)
    return [run for run in problem.runs if float(np.ptp(run.V)) > least]


def _nodes(kind: str, train: Problem) -> Array:
    """Return the limits of a kind that are looked at first, in the command's unit (per second)."""
    if kind == "range":
        return np.linspace(LOWEST, 0.97, NODES) * _largest(train)
    moving = _moving(train)
    span = max(float(np.ptp(run.V)) for run in moving)
    quickest = max(float(np.max(np.abs(np.diff(run.V)))) / run.dt for run in moving)
    quickest = min(quickest, span / (QUICKEST * moving[0].dt))
    slowest = min(span / SLOWEST, 0.5 * quickest)
    return np.geomspace(slowest, 0.9 * quickest, NODES)


def _felt(problem: Problem, limit: _Limit, draws: bool = True) -> Problem:
    """Return the runs with the command as it reached the coil."""
    return problem.of([_of_run(run, limit.fault, limit.value, draws) for run in problem.runs])


def _of_run(run: Run, fault: str, value: float, draws: bool) -> Run:
    felt = limited(run.V, run.dt, fault, value)
    moved = run.draws
    if draws and moved.size and np.any(moved[:, :, 3]):
        moved = moved.copy()
        for one in moved:
            one[:, 3] = limited(run.V + one[:, 3], run.dt, fault, value) - felt
    return replace(run, V=felt, draws=moved)


def _looked_at(kind: str, model: Model, train: Problem, expected: Expected) -> _Limit | None:
    """Return the best of a kind's limits, by a linear step of the law beside each.

    That with the law's sensitivities as they are without a limit tells which, that with its own how
    good it is.
    """
    J = Search(train, model, expected, model.free()).sensitivities()
    best = None
    for value in _nodes(kind, train).tolist():
        limit = _Limit(kind, value, model, np.inf)
        search = Search(_felt(train, limit, draws=False), model, expected, model.free())
        found = _stepped(limit, search, J)
        if best is None or found.cost < best[0].cost:
            best = found, limit, search
    return None if best is None else _stepped(*best[1:], best[2].sensitivities())


def _stepped(limit: _Limit, search: Search, J: Array) -> _Limit:
    """Return a limit with the law after a linear step by sensitivities (n, p)."""
    here = search.residuals(search.start)
    theta = np.clip(search.start - linear_step(J, here), search.low, search.high)
    cost = mean_loss(loss(here + J @ (theta - search.start)))
    return replace(limit, model=search.at(theta), cost=cost)


def _fitted(limit: _Limit, train: Problem, expected: Expected) -> _Limit:
    """Return a limit that is fitted together with the law, from where it was looked at."""
    nodes = _nodes(limit.fault, train)
    search = Search(train, limit.model, expected, limit.model.free())
    known: dict[float, Problem] = {}

    def left(theta: Array) -> Array:
        value = float(np.exp(theta[-1]))
        if value not in known:
            known.clear()
            known[value] = _felt(train, replace(limit, value=value), draws=False)
        return residuals(known[value], search.at(theta[:-1]), expected)

    low = np.append(search.low, np.log(0.5 * nodes[0]))
    high = np.append(search.high, np.log(nodes[-1] / 0.9))
    found = descend(left, np.append(search.start, np.log(limit.value)), low, high, SWEEPS)
    value = float(np.exp(found.theta[-1]))
    share = float(np.sqrt(max(np.linalg.pinv(found.normal, hermitian=True)[-1, -1], 0.0)))
    spread = max(1.0, float(np.sqrt(2.0 * found.cost)))
    return _Limit(
        limit.fault, value, search.at(found.theta[:-1]), found.cost, value * share * spread
    )


def _fault(limit: _Limit, train: Problem, held_out: Problem) -> Finding:
    """Return the fault that a limit is, with what it does to the runs."""
    runs, drive = [*train.runs, *held_out.runs], train.runs[0].drive
    most = max(_largest(train), _largest(held_out))
    felt = [limited(run.V, run.dt, limit.fault, limit.value) for run in runs]
    gaps = [np.abs(run.V - one) for run, one in zip(runs, felt, strict=True)]
    apart = [gap > APART * most for gap in gaps]
    samples = f"{plain(100.0 * float(np.mean(np.concatenate(apart))), 2)} % of the samples"
    where = f"{sum(bool(one.any()) for one in apart)} of {len(runs)} runs"
    unit = DRIVES[drive].unit + ("/s" if limit.fault == "slew" else "")
    size = f"{quantity(limit.value, unit)} (± {plain(1.96 * limit.std, 2)})"
    late = plain(1e3 * max(float(gap.max()) for gap in gaps) / limit.value, 2)
    name = drive.capitalize()
    words = {
        "range": f"{name} reaches the coil up to {size} only: {samples}, in {where}, command more.",
        "slew": f"{name} reaches the coil no faster than {size}: in {where} it is late there, by "
        f"up to {late} ms, and differs from the record in {samples}.",
    }[limit.fault]
    return Finding(
        limit.fault, "warning",
        f"{words} A supply or an amplifier limits it: record it behind that, or set it right in "
        f'study.toml: correct = [{{channel = "{drive}", fault = "{limit.fault}", value = '
        f"{limit.value:.4g}}}] in each [[runs]].",
        channel=drive, value=limit.value, std=limit.std,
    )  # fmt: skip

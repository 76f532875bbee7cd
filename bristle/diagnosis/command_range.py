"""A command that was limited between its record and the coil: in its slew or in its range.

The record then says more than the damper felt, and only a model shows it. The limit is fitted
together with the law: neither is right without the other. It is told where it explains nearly all
that the model leaves, and no effect that looks like it does so better: a coil that lags follows a
large step as fast as a small one, a magnet that saturates bends and has no edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array
from ..core.finding import Finding
from ..core.text import plain, quantity
from ..data.corrections import LIMITS, limited
from ..identification.problem import Expected, Problem, Run, residuals
from ..identification.search import HUBER, descend, loss, mean_loss
from ..identification.start_grid import Search, refine
from ..model.model import Model
from ..physics.drive import DRIVES
from .model_faults import ModelBasedFaults, explains, has_rival, promise
from .prepared import COARSE
from .rule import LIMITED
from .trials import Trial, judge

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
    coarse = train.of([run.coarser(COARSE) for run in train.runs])
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
    """Return the best of a kind's limits, by a linear step of the law beside each."""
    best = None
    for value in _nodes(kind, train).tolist():
        limit = _Limit(kind, value, model, np.inf)
        search = Search(_felt(train, limit, draws=False), model, expected, model.free())
        here, J = search.residuals(search.start), search.sensitivities()
        weight = np.minimum(1.0, HUBER / np.maximum(np.abs(here), 1e-12))
        normal, gradient = (J * weight[:, None]).T @ J, (J * weight[:, None]).T @ here
        size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        step = np.linalg.lstsq(normal / np.outer(size, size), gradient / size, rcond=1e-8)[0] / size
        theta = np.clip(search.start - step, search.low, search.high)
        cost = mean_loss(loss(here + J @ (theta - search.start)))
        if best is None or cost < best.cost:
            best = replace(limit, model=search.at(theta), cost=cost)
    return best


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

"""Sensor faults that no redundant channel shows, told from physics by what physics cannot do.

A load cell off its zero adds the same force whatever the motion and the voltage: a spring's preload
would come with stiffness, and a damper that is stronger one way with more the more it yields. A
force that follows the voltage before the voltage was recorded has no cause: the record is late.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Model, Problem, Run
from ..identify.model import steady
from ..identify.search import HUBER_AT_ONE, losses
from ..identify.search_context import refine, residuals
from ..identify.start_grid import Ground, ranked
from .candidates import Trial, begin, joinable, judge
from .faults import SensorFault
from .mended import earlier

Array = NDArray[np.float64]

GAIN = 0.03
"""Share by which z on held-out runs must fall."""

SHARE = 0.9
"""Least part of what was unexplained that a fault must explain."""

CLEAN = 1.05
"""z below which nothing is left to explain."""

CLOSE = 0.75
"""Least part explained where z comes below `CLEAN`: of a small z the unexplained is uncertain."""

MARGIN = 0.02
"""Share by which an effect's loss may be below that of a fault: its parameters are more."""

LATEST = 0.15
"""Largest delay of the voltage that is looked for [s]."""

SMALLEST = 0.25
"""Smallest delay of the voltage that matters, in sampling steps."""

FIRST = 0.3
"""Part of the loss that a first look must explain for a search to go on."""

BLOCK = 250
"""Samples, longer than a residual's correlation."""

_SPRING = ("gas_spring.k", "gas_spring.k_2", "gas_spring.k_3")
_EVEN = ("gas_spring", "asymmetry")
_SLOW = ("coil_lag", "remanence", "saturation", "temperature", "delay")

PLAIN = 1.3
"""z above which a record of the voltage that comes late needs no comparison: no effect precedes
its cause, and by chance alone no lead explains so much."""


@dataclass(frozen=True)
class Unseen:
    """A fault, the runs set right, and how the model does on them."""

    fault: SensorFault
    train: Problem
    held_out: Problem
    trial: Trial


def unseen_fault(
    before: Trial, train: Problem, held_out: Problem, drive: str = "voltage"
) -> Unseen | None:
    """Return the fault that explains what a model leaves; None where none does, or physics better.

    Parameters
    ----------
    before : the model without further effects, fitted to `train` and judged on `held_out`
    drive : {"voltage", "current"}, the channel that is the runs' drive
    """
    if before.z < 1.0 + GAIN:
        return None
    found = _zero_of_force(before, train, held_out)
    if found and _explains(found.trial, before) and not _rival(found, before, train, _EVEN):
        return found
    found = _late_drive(before, train, held_out, drive)
    if found and _explains(found.trial, before):
        rivals = () if before.z > PLAIN else _SLOW
        return None if _rival(found, before, train, rivals) else found
    return None


def _explains(trial: Trial, before: Trial) -> bool:
    share = 1.0 - max(trial.z**2 - 1.0, 0.0) / (before.z**2 - 1.0)
    return 1.0 - trial.z / before.z > GAIN and share > (CLOSE if trial.z < CLEAN else SHARE)


def _rival(found: Unseen, before: Trial, train: Problem, names: tuple[str, ...]) -> bool:
    """Return whether an effect explains the runs as they are better than the fault does."""
    model = before.model
    own = found.trial.model
    cost = _loss(own, found.train)
    ground = Ground(model, train)
    rivals = [name for name in joinable(model) if name in names]
    with ThreadPoolExecutor(cpu_count()) as pool:
        begun = pool.map(lambda name: begin(name, ground, ranked(name, ground)), rivals)
        return any(_loss(one.model, train) < cost * (1.0 - MARGIN) for one in begun)


def _promise(cost: float, before: float) -> float:
    """Return which part of the loss above that of a true model is gone."""
    return (before - cost) / max(before - HUBER_AT_ONE, 1e-6)


def _loss(model: Model, problem: Problem) -> float:
    return float(np.mean(losses(residuals(problem, model, problem.expectation(model)))))


# --- the zero of the force ----------------------------------------------------------------------


def _zero_of_force(before: Trial, train: Problem, held_out: Problem) -> Unseen | None:
    """Return the offset of the force that fits best, as a preload without stiffness."""
    if "gas_spring" in before.effects:
        return None  # its preload is that offset
    base = before.model
    offset = float(np.median(_left(base, train)))
    if _promise(_loss(base, _shifted(train, offset)), _loss(base, train)) < FIRST:
        return None
    values = {**base.values, **dict.fromkeys(_SPRING, 0.0), "gas_spring.preload": offset}
    fitted = refine(
        replace(
            base, effects=(*base.effects, "gas_spring"), values=values, held=(*base.held, *_SPRING)
        ),
        train,
    )
    offset = fitted.value("gas_spring.preload")
    own = {k: v for k, v in fitted.values.items() if not k.startswith("gas_spring.")}
    right = [_shifted(problem, offset) for problem in (train, held_out)]
    trial = judge(replace(base, values=own), right[0], right[1])
    fault = SensorFault(
        "force", "bias", offset, _deviation(_left(trial.model, right[0])),
        f"Force shows {offset:.3g} N whatever the motion and the voltage, without the stiffness of "
        "a spring: the zero of the load cell is off, or a preload acts on the rod.",
    )  # fmt: skip
    return Unseen(fault, right[0], right[1], trial)


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


def _late_drive(before: Trial, train: Problem, held_out: Problem, drive: str) -> Unseen | None:
    """Return the delay of the voltage's record that fits best, the law refitted to it."""
    if steady(train):
        return None
    model, dt = before.model, train.runs[0].dt
    grid = dt * np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
    grid = grid[grid <= LATEST]
    at_first = _loss(model, train)
    late = std = 0.0
    for turn in range(3):
        cost = _cost_of_delay(model, train)
        late = _between(cost, grid, int(np.argmin([cost(delay) for delay in grid])))
        if late < SMALLEST * dt:
            return None
        moved = _moved(train, late)
        model = refine(model, moved, 4)
        if turn == 0 and _promise(_loss(model, moved), at_first) < FIRST:
            return None
    bend = cost(late + dt) + cost(late - dt) - 2.0 * cost(late)
    std = dt * float(np.sqrt(2.0 / max(bend, 1e-12)))
    right = [_moved(problem, late) for problem in (train, held_out)]
    fault = SensorFault(
        drive, "delay", late, std,
        f"The force follows the {drive} {1e3 * late:.2f} ms before the {drive} was recorded: its "
        "record is late.",
    )  # fmt: skip
    return Unseen(fault, right[0], right[1], judge(refine(model, right[0]), right[0], right[1]))


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
            one[:, 3] = earlier(one[:, 3], samples)
    known = np.arange(len(run.V)) < len(run.V) - samples
    measured = known if run.measured is None else known & run.measured
    return replace(run, V=earlier(run.V, samples), draws=moved, measured=measured)

"""The voltage history at which a peak or RMS is least: descent, then linear programs.

A peak is the limit of p-norms; each is descended by projected quasi-Newton steps (L-BFGS-B: Byrd,
Lu, Nocedal & Zhu 1995, SIAM J. Sci. Comput. 16(5)) from the last one's voltage. What then counts
are the few largest swings: their derivatives make a linear program for the next change of the
voltage, within a region that grows while it foretells the peak well (sequential linear programming:
Fletcher & Sainz de la Maza 1989, Math. Program. 43).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog, minimize

from ..core.arrays import Array
from ..engine.results import statistic_of
from .case import ControlProblem
from .horizon import Horizon

NORMS = (4.0, 6.0, 9.0, 14.0, 20.0, 30.0, 45.0)
"""Norms that are descended in turn, for a peak."""
ITERATIONS = 60
"""Of each norm."""
PROGRAMS = 20
"""Linear programs, at most."""
COUNTED = 0.75
"""Share of the peak from which a swing counts in a linear program."""
FLAT = 0.96
"""Share of the peak from which every node counts."""
REGION = 0.1
"""First region of a linear program, as a share of the largest voltage."""
LEAST_REGION = 1e-3
GAIN = 1e-3
"""Share of the peak that a linear program must promise."""


def descended(problem: ControlProblem, values: Array, statistic: str) -> Array:
    """Return the voltages (n,) at the nodes that lower a statistic from those given.

    Parameters
    ----------
    problem : ControlProblem
    values : (n,) V, where the search begins
    statistic : "peak" or "rms"
    """
    for norm in NORMS if statistic == "peak" else (2.0,):
        values = _descend(problem, values, norm)
    return values


def _descend(problem: ControlProblem, values: Array, norm: float) -> Array:
    scale = float(np.abs(problem.respond(problem.between(values))).max()) or 1.0
    v_max = problem.case.v_max

    def cost(x: Array) -> tuple[float, Array]:
        voltage = problem.between(v_max * x)
        share = np.abs(problem.respond(voltage)) / scale
        highest = share.max()
        if not np.isfinite(highest):
            return 1e6, np.zeros_like(x)
        powers = (share / highest) ** (norm - 1.0)
        total = float(np.sum(powers * share / highest))
        found = highest * total ** (1.0 / norm)
        weights = np.sign(problem.course.y) * powers * total ** (1.0 / norm - 1.0) / scale
        problem.slopes(voltage)
        return found, v_max * problem.to_nodes(problem.pull_back(weights))

    many = ITERATIONS if norm > 2.0 else 3 * ITERATIONS
    found = minimize(
        cost, values / v_max, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(values),
        options={"maxiter": many, "maxcor": 20},
    )  # fmt: skip
    better: Array = v_max * found.x
    return better


def levelled(problem: ControlProblem, values: Array) -> tuple[Array, float]:
    """Return the voltages (n,) at the nodes after linear programs, and the peak with them.

    Parameters
    ----------
    problem, values
        As in `descended`.
    """
    v_max, region = problem.case.v_max, REGION * problem.case.v_max
    y = problem.respond(problem.between(values)).copy()
    peak = float(np.abs(y).max())
    fresh = True
    for _ in range(PROGRAMS):
        if fresh:
            voltage = problem.between(values)
            problem.respond(voltage)
            problem.slopes(voltage)
            at = _swings(y, COUNTED * peak, problem.nodes)
            rows = np.array([_row(problem, k, float(np.sign(y[k]))) for k in at])
        low, high = np.maximum(-values, -region), np.minimum(v_max - values, region)
        promised, change = _program(rows, np.abs(y[at]), low, high)
        if promised > (1.0 - GAIN) * peak and region >= REGION * v_max:
            break
        tried = np.clip(values + change, 0.0, v_max)
        y_tried = problem.respond(problem.between(tried)).copy()
        found = float(np.abs(y_tried).max())
        gain = (peak - found) / max(peak - promised, 1e-300)
        fresh = found < peak
        if fresh:
            values, y, peak = tried, y_tried, found
        if gain > 0.5:
            region = min(2.0 * region, v_max)
        elif gain < 0.25:
            region *= 0.4
        if region < LEAST_REGION * v_max:
            break
    return values, peak


def _swings(y: Array, least: float, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the instants at which |y| is largest within a swing, where it exceeds `least`.

    Of `nodes`, instants as well, those that come near the peak are among them.
    """
    size = np.abs(y)
    inner = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] > least)
    counts = np.append(np.append(False, inner), False)
    counts[nodes] |= size[nodes] > FLAT * size.max()  # levelled swings have no one top
    found = np.flatnonzero(counts)
    if size[-1] > least:
        found = np.append(found, len(y) - 1)
    if not len(found):
        return np.array([int(size.argmax())])
    return found


def _row(problem: ControlProblem, k: int, sign: float) -> Array:
    """Return what the voltages at the nodes (n,) do to |y| at instant k."""
    weights = np.zeros(problem.last + 1)
    weights[k] = sign
    return problem.to_nodes(problem.pull_back(weights, max(k, 1)))


def _program(rows: Array, sizes: Array, low: Array, high: Array) -> tuple[float, Array]:
    """Return the least largest |y| that a change of the voltage promises, and the change (n,).

    Parameters
    ----------
    rows : (s, n) derivatives of the swings' sizes
    sizes : (s,) the sizes
    low, high : (n,) bounds of the change [V]
    """
    n = len(low)
    cost = np.zeros(n + 1)
    cost[-1] = 1.0
    A = np.hstack([rows, -np.ones((len(rows), 1))])
    bounds = [*zip(low, high, strict=True), (0.0, None)]
    found = linprog(cost, A_ub=A, b_ub=-sizes, bounds=bounds, method="highs")
    if found.x is None:
        return float(sizes.max()), np.zeros(n)
    change: Array = found.x[:-1]
    return float(found.x[-1]), change


# What one reaches who sees the ground motion for some time ahead: a receding horizon's result.

PERIODS = 1.0
"""Length of the horizon behind what is seen, in periods of the first mode."""
DECISIONS = 40
"""Decisions in a period, about."""
ROUNDS = 6
"""Gradient steps of a decision."""
POWERS = (2.0, 8.0)
"""Of the output in a decision's cost; for a peak the better one counts. The less is seen, the lower
is the better: what is not seen may be larger than all that is."""


def foreseen(
    problem: ControlProblem, seconds: float, start: float, least: float, statistic: str
) -> Array:
    """Return the voltage (N + 1,) [V] of a receding horizon at the instants of a problem.

    Parameters
    ----------
    problem : ControlProblem
    seconds : for which the ground motion is seen ahead [s]
    start : voltage at the start [V]
    least : size of the output that counts for nothing
    statistic : "peak" or "rms"
    """
    found = [
        _receded(problem, seconds, start, least, power)
        for power in (POWERS if statistic == "peak" else POWERS[:1])
    ]
    return min(found, key=lambda voltage: statistic_of(problem.respond(voltage), statistic))


def _receded(
    problem: ControlProblem, seconds: float, start: float, least: float, power: float
) -> Array:
    case = problem.case
    h, period = case.plant.h, 1.0 / case.frequency
    every = max(1, round(period / DECISIONS / h))
    steps = every * max(2, round((seconds + PERIODS * period) / (every * h)))
    n = steps // every
    horizon = Horizon(
        steps, every, ROUNDS, round(seconds / h), least, power, case.v_max, np.full(n, start),
        np.zeros((5, n + 1)), np.zeros((4, steps + 1)), problem.course_of(steps),
        problem.gradient_of(steps),
    )  # fmt: skip
    voltage = np.full(problem.last + 1, start)
    problem.recede(voltage, horizon)
    return voltage

"""What one who sees the ground motion for some time ahead reaches: a receding horizon's result."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .case import Problem
from .horizon import Horizon
from .search import value_of

Array = NDArray[np.float64]

PERIODS = 1.0
"""Length of the horizon behind what is seen, in periods of the first mode."""
DECISIONS = 40
"""Decisions in a period, about."""
ROUNDS = 6
"""Gradient steps of a decision."""
POWERS = (2.0, 8.0)
"""Of the output in a decision's cost; for a peak the better one counts. The less is seen, the lower
is the better: what is not seen may be larger than all that is."""


def foreseen(problem: Problem, seconds: float, start: float, least: float, statistic: str) -> Array:
    """Return the voltage (N + 1,) [V] of a receding horizon at the instants of a problem.

    Parameters
    ----------
    problem : Problem
    seconds : for which the ground motion is seen ahead [s]
    start : voltage at the begin [V]
    least : size of the output that counts for nothing
    statistic : "peak" or "rms"
    """
    found = [
        _receded(problem, seconds, start, least, power)
        for power in (POWERS if statistic == "peak" else POWERS[:1])
    ]
    return min(found, key=lambda voltage: value_of(problem.respond(voltage), statistic))


def _receded(problem: Problem, seconds: float, start: float, least: float, power: float) -> Array:
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

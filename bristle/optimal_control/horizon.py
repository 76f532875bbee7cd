"""What a receding horizon reaches that sees the ground motion for some time ahead.

At each decision the voltage of the coming horizon is improved by some projected gradient steps
(step lengths after Barzilai & Borwein 1988, IMA J. Numer. Anal. 8(1)), its first part is applied,
and the rest is where the next decision begins. Ground motion beyond what is seen counts as zero.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from .response import Course, Gradient, pull_back, respond, slopes, start

START, RESPOND, SLOPES, PULL_BACK, RECEDE = range(5)
"""What `compute` does."""

FIRST = 0.25
"""Change of the voltage that a first gradient step makes at most, as a share of the largest."""


class Horizon(NamedTuple):
    """How a receding horizon decides, and its room to work.

    Attributes
    ----------
    steps, every, rounds, seen : int
        Steps of the horizon, steps from one node of the voltage to the next, gradient steps of a
        decision, steps that are seen ahead.
    least, power, v_max : float
        Size of the output that counts for nothing; the cost's power; V.
    plan : (n,) array
        V at the nodes behind the first, which is fixed.
    nodes : (5, n + 1) array
    lines : (4, H + 1) array
        Voltage, weights of the output, derivative, expected ground motion.
    course, gradient : Course, Gradient
        Of the horizon.
    """

    steps: int
    every: int
    rounds: int
    seen: int
    least: float
    power: float
    v_max: float
    plan: Any
    nodes: Any
    lines: Any
    course: Any
    gradient: Any


def compute(
    task: int, plant: Any, setup: Any, ground: Any, voltage: Any, weights: Any, first: int,
    last: int, course: Course, gradient: Gradient, horizon: Horizon, u: Any,
) -> None:  # fmt: skip
    """Do one of the tasks: they are compiled together, for each needs the whole damper.

    Parameters
    ----------
    task : `START`, `RESPOND`, `SLOPES`, `PULL_BACK` or `RECEDE`
    plant, setup, ground, voltage, first, last, course, u : as in `response.respond`
    weights : (N + 1,) as in `response.pull_back`
    gradient, horizon : Gradient, Horizon; those that the task does not need are not looked at
    """
    if task == START:
        start(plant, setup, voltage, course)
    elif task == RESPOND:
        respond(plant, setup, ground, voltage, first, last, course, u)
    elif task == SLOPES:
        slopes(plant, setup, voltage, first, last, course, gradient, u)
    elif task == PULL_BACK:
        pull_back(plant, weights, first, last, gradient)
    else:
        recede(plant, setup, ground, voltage, last, course, horizon, u)


def recede(
    plant: Any, setup: Any, ground: Any, voltage: Any, last: int, truth: Course, horizon: Horizon,
    u: Any,
) -> None:  # fmt: skip
    """Fill in the voltage that a receding horizon applies, and the response to it.

    Parameters
    ----------
    plant, setup : Plant, Setup
    ground, voltage : (N + 1,) m/s2; V, of which the first is given, filled
    last : instant N
    truth : Course of N steps, its instant 0 given; filled
    horizon : Horizon; its plan is changed
    u : (7,) room to work
    """
    every, highest = horizon.every, horizon.least
    course, plan, expected = horizon.course, horizon.plan, horizon.lines[3]
    for first in range(0, last, every):
        for i in range(len(truth.x[0])):
            course.x[0, i] = truth.x[first, i]
        for i in range(len(truth.z[0])):
            course.z[0, i] = truth.z[first, i]
        course.force[0], course.energy[0] = truth.force[first], truth.energy[first]
        for k in range(horizon.steps + 1):
            known = k <= horizon.seen and first + k <= last
            expected[k] = ground[first + k] if known else 0.0
        improve(plant, setup, voltage[first], highest, horizon, u)
        end = min(first + every, last)
        for k in range(first, end):
            share = (k + 1 - first) / every
            voltage[k + 1] = voltage[first] + share * (plan[0] - voltage[first])
        respond(plant, setup, ground, voltage, first, end, truth, u)
        for k in range(first, end + 1):
            highest = max(highest, abs(truth.y[k]))
        for i in range(len(plan) - 1):
            plan[i] = plan[i + 1]


def improve(plant: Any, setup: Any, voltage: float, level: float, horizon: Horizon, u: Any) -> None:
    """Improve the plan of a horizon, in place.

    Parameters
    ----------
    plant, setup : Plant, Setup
    voltage : at the start of the horizon [V], fixed
    level : size of the output that the cost is told by
    horizon : Horizon; instant 0 of its course and the expected ground motion are given
    u : (7,) room to work
    """
    plan, nodes, v_max = horizon.plan, horizon.nodes, horizon.v_max
    n = len(plan)
    best, trial, slope, kept, last = nodes[0], nodes[1], nodes[2], nodes[3], nodes[4]
    best[0] = trial[0] = voltage
    for i in range(n):
        best[1 + i] = plan[i]
    lowest = cost_of(plant, setup, best, level, horizon, u)
    gradient_of(plant, setup, horizon, slope, u)
    largest = 0.0
    for i in range(1, n + 1):
        largest = max(largest, abs(slope[i]))
    if largest == 0.0:
        return
    length = FIRST * v_max / largest
    for _ in range(horizon.rounds):
        for i in range(1, n + 1):
            trial[i] = min(max(best[i] - length * slope[i], 0.0), v_max)
        found = cost_of(plant, setup, trial, level, horizon, u)
        if not found < lowest:
            length *= 0.25
            continue
        for i in range(1, n + 1):
            kept[i], last[i] = slope[i], best[i]
            best[i] = trial[i]
        lowest = found
        gradient_of(plant, setup, horizon, slope, u)
        above, below = 0.0, 0.0
        for i in range(1, n + 1):
            s, d = best[i] - last[i], slope[i] - kept[i]
            above += s * s
            below += s * d
        length = above / below if below > 0.0 else 2.0 * length
    for i in range(n):
        plan[i] = best[1 + i]


def cost_of(plant: Any, setup: Any, values: Any, level: float, horizon: Horizon, u: Any) -> float:
    """Return what voltages at the nodes cost; keep the output's weights in the derivative.

    Parameters
    ----------
    plant, setup, level, horizon, u : as in `improve`
    values : (n + 1,) V at the nodes
    """
    steps, every, power, y = horizon.steps, horizon.every, horizon.power, horizon.course.y
    voltage, weights = horizon.lines[0], horizon.lines[1]
    for k in range(steps + 1):
        at = min(k // every, len(values) - 2)
        share = min(k - at * every, every) / every
        voltage[k] = values[at] + share * (values[at + 1] - values[at])
    respond(plant, setup, horizon.lines[3], voltage, 0, steps, horizon.course, u)
    total = 0.0
    for k in range(1, steps + 1):
        share = abs(y[k]) / level
        term = share ** (power - 1.0)
        total += term * share
        weights[k] = power * term / level * (1.0 if y[k] > 0.0 else -1.0)
    return total


def gradient_of(plant: Any, setup: Any, horizon: Horizon, slope: Any, u: Any) -> None:
    """Fill in the derivative of the cost by the voltages at the nodes; after `cost_of`.

    Parameters
    ----------
    plant, setup, horizon, u : as in `improve`
    slope : (n + 1,) filled
    """
    steps, every, lines = horizon.steps, horizon.every, horizon.lines
    by_voltage = horizon.gradient.by_voltage
    slopes(plant, setup, lines[0], 0, steps, horizon.course, horizon.gradient, u)
    pull_back(plant, lines[1], 0, steps, horizon.gradient)
    for i in range(len(slope)):
        slope[i] = 0.0
    for k in range(steps + 1):
        at = min(k // every, len(slope) - 2)
        share = min(k - at * every, every) / every
        slope[at] += (1.0 - share) * by_voltage[k]
        slope[at + 1] += share * by_voltage[k]

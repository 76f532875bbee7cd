"""A lower bound of a peak or RMS, from a convex program that allows more than the damper can do.

The building is linear in the force. Allowed is any force up to the damper's largest, whatever the
motion, as long as the damper has taken more energy than it has given at any time. That a force
must resist the motion at each instant is not convex and left out: the true limit lies above.
With x_f the motion that the force alone makes, the energy taken until t is at most the work of the
force on the motion without damper less the energy of x_f, which is convex in the force.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.linalg import cholesky

from ..core.arrays import Array
from .case import Case, ControlProblem, room
from .response import V_0, V_1, VOLTAGE_0, VOLTAGE_1, damper_end

STEPS_PER_PERIOD = 50
"""Steps of the force in a period of the first mode, about; it is constant over each."""
BALANCED = 4
"""Steps from one balance of energy to the next."""
FASTER = 2.0
"""Up to which multiple of the largest speed the damper's largest force is looked for."""
SPEEDS = 40
SLIDING = 20.0
"""Length of the sliding at each of these speeds, in periods of the first mode."""
SOLVER = "cvxpy"
"""The package that solves the program; an extra installs it."""
INEXACT = 0.01
"""Share that is taken off a bound that the solver calls inexact."""


def largest_force(case: Case, speed: float) -> float:
    """Return the damper's largest force [N] in sliding at up to a speed [m/s], at full voltage."""
    most = 0.0
    h, work, end = case.plant.h, np.zeros(room(case)), case.functions.link(damper_end)
    for v in np.linspace(speed / SPEEDS, speed, SPEEDS):
        u = np.zeros(7)
        u[V_0] = u[V_1] = v
        u[VOLTAGE_0] = u[VOLTAGE_1] = case.v_max
        z = case.states.copy()
        for _ in range(round(SLIDING / (case.frequency * h))):
            after = z.copy()
            most = max(most, end(case.setup, h, case.plant.mass, u, 0.0, z, after, work))
            z = after
    return most


def bound_of(problem: ControlProblem, statistic: str, most: float) -> float | None:
    """Return what no force within the rules gives less than; None where the solver finds none.

    Parameters
    ----------
    problem : ControlProblem
    statistic : "peak" or "rms"
    most : largest force [N]
    """
    import cvxpy

    cp: Any = cvxpy
    case, plant = problem.case, problem.case.plant
    every = max(1, round(1.0 / (case.frequency * STEPS_PER_PERIOD * plant.h)))
    count = problem.last // every
    free = _without_damper(problem)[: count * every + 1 : every]
    ground = case.ground[: count * every + 1 : every]
    phi, push = np.eye(len(plant.phi)), np.zeros(len(plant.phi))
    for _ in range(every):
        phi, push = plant.phi @ phi, plant.phi @ push + plant.force_0 + plant.force_1

    x = cp.Variable((len(phi), count + 1))
    f = cp.Variable((1, count))
    travel = np.diff(free @ plant.displacement)
    y = (free @ plant.output)[1:] + plant.by_ground * ground[1:]
    y = y + plant.output @ x[:, 1:] + plant.by_force * f[0]
    rules = [x[:, 0] == 0.0, x[:, 1:] == phi @ x[:, :-1] + push[:, None] @ f, cp.abs(f) <= most]
    given = cp.cumsum(cp.multiply(f[0], travel))
    root = _energy_root(case)
    rules += [
        cp.sum_squares(root @ x[:, k + 1]) <= given[k] for k in range(BALANCED - 1, count, BALANCED)
    ]
    aim = cp.norm_inf(y) if statistic == "peak" else cp.norm(y)
    program = cp.Problem(cp.Minimize(aim), rules)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        try:
            program.solve(solver=cp.CLARABEL)
        except cp.error.SolverError:
            return None
    if program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        return None
    found = max(float(aim.value), 0.0)
    found *= 1.0 if program.status == cp.OPTIMAL else 1.0 - INEXACT
    if statistic == "rms":
        found *= float(np.sqrt(every / len(case.ground)))
    return found


def _without_damper(problem: ControlProblem) -> Array:
    """Return the states (N + 1, m) of the building under the ground motion alone."""
    plant, ground = problem.case.plant, problem.case.ground
    x = np.zeros((problem.last + 1, len(plant.phi)))
    for k in range(problem.last):
        x[k + 1] = plant.phi @ x[k] + plant.ground_0 * ground[k] + plant.ground_1 * ground[k + 1]
    return x


def _energy_root(case: Case) -> Array:
    """Return a root R (m, m) of the building's energy [J], which is |R x|^2 of a state x (m,)."""
    n = len(case.mass)
    root = np.zeros((2 * n, 2 * n))
    root[:n, :n], root[n:, n:] = cholesky(case.stiffness), cholesky(case.mass)
    found: Array = root / np.sqrt(2.0)
    return found

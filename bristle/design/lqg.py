"""LQG design: an optimal regulator on an estimate of the state, for the clipped-optimal switch.

As in Dyke, Spencer, Sain & Carlson (1996), Smart Mater. Struct. 5(5), 565-575: the estimator gets
the measured force, so that it knows what the damper did instead of what was asked of it.
"""

from __future__ import annotations

import numpy as np

from ..errors import DesignError
from . import table, verify
from .plant import Plant, structure
from .result import DesignResult, packed, pole_list
from .task import Task


def design_lqg(task: Task) -> DesignResult:
    """Return a verified LQG controller from floor acceleration and damper force to a force.

    x' = A x + B_f f + L (y - C x - D f),   u = -K x

    Parameters
    ----------
    task : Task
        Of kind "lqg".

    Raises
    ------
    DesignError
        If a Riccati equation has no solution, or as `design_hinf`.
    """
    import control

    weights, h = task.lqg, task.sample_period
    s = structure(task.plant_building, stiffness=task.stiffness, device=task.place)
    push, ground = s.B[:, :1], s.B[:, 1:]
    y, drift, direct = s.C[:1], s.C[1:2], s.D[:1, :1]
    Q = weights.acceleration * y.T @ y + weights.drift * drift.T @ drift
    R = weights.acceleration * direct.T @ direct + weights.force
    N = weights.acceleration * y.T @ direct
    try:
        K, _, regulated = control.lqr(s.A, push, Q, R, N, method="scipy")
        L, _, estimated = control.lqe(
            s.A, ground, y, weights.ground**2, weights.noise**2, method="scipy"
        )
    except (control.ControlArgument, np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(f"lqg: a Riccati equation has no solution: {error}") from None
    for name, poles in (("regulator", regulated), ("estimator", estimated)):
        if np.max(np.real(poles)) >= 0.0:
            raise DesignError(f"lqg: the {name} is not stable; weights nearer to 1 would help.")
    K, L = np.atleast_2d(K), np.atleast_2d(L)
    bank = table.Bank((s.A - L @ y)[None], L[None], (push - L @ direct)[None], -K[None])
    still = np.zeros(1)
    facts = verify.check_poles(bank, still, h)
    discrete = table.sampled(bank, h)
    # With a damper that gives the command exactly, the second input is the command itself.
    ideal = discrete._replace(A=discrete.A + discrete.W @ discrete.C)
    empty = np.zeros((0, 0))
    loop = Plant(s.A, empty, push, empty, empty, empty, y, empty, direct)
    modulus = verify.check_sampled_loop([loop], ideal, still, h)
    controller = packed(
        task,
        discrete,
        {
            "regulator_poles": pole_list(np.asarray(regulated, dtype=complex)),
            "poles": pole_list(bank.poles[0]),
            "sampled_loop_modulus": modulus,
            **facts,
        },
    )
    return DesignResult(task, controller, still, [], bank, None)

"""The kinds of design: H-infinity, LPV over the damper's speed, LQG.

The Bingham model inside the base equation makes damping and input gain depend on r = |v|
(quasi-LPV). Reconstructed from Shirazi et al. (2012), IEEE TCST 20(5), eqs. (8)-(17).
"""

from __future__ import annotations

from collections.abc import Iterable
from math import log10
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.progress import tell
from ..errors import DesignError
from . import analysis, lmi
from .analysis import DesignResult, hinf_norm, least_gamma, packed, pole_list
from .damper import Bank, coefficients, reconstruct, sampled
from .plant import Plant, States, Units, balancing, family, generalized, structure
from .task import Task

# H-infinity design: the command is the damper's force, which an inverse or a switch realises.

_USUAL = (2.0, 0.04, 5.0)
"""Command weight, noise and gamma of the size at which the solver's tolerances were tried."""


def units_for(plant: Plant, gamma: float) -> Units:
    """Return powers of ten that bring a plant's command, measurement and gamma to a usual size.

    Forces may be newtons or meganewtons; the solver's tolerances are absolute.
    """
    sizes = (float(np.linalg.norm(plant.D12)), float(np.linalg.norm(plant.D21)), gamma)
    return Units(
        *(10.0 ** round(log10(size / usual)) for size, usual in zip(sizes, _USUAL, strict=True))
    )


def design_hinf(task: Task) -> DesignResult:
    """Return a verified H-infinity controller from the floor acceleration to the damper's force.

    Parameters
    ----------
    task : Task
        Of kind "hinf".

    Returns
    -------
    DesignResult
        `facts` hold `gamma` (proved), `least_gamma` (no controller does better), `norm` (closed
        loop, computed anew), `open_loop_norm`, `poles` ...

    Raises
    ------
    DesignError
        If the solver fails, a number does not stand up to its check, or the controller is unstable
        or too fast for its sample period.
    """
    plant = generalized(
        task.plant_building, task.weights, stiffness=task.stiffness, device=task.place
    )
    least = least_gamma(plant)
    units = units_for(plant, least)
    normalised = units.normalised(plant)
    balanced = normalised.transformed(balancing(normalised, task.order))
    still = np.zeros(1)
    tell("solving the linear matrix inequalities")
    solution = lmi.solve([balanced], still, task.tau)
    bank = reconstruct(solution, [balanced], still, units)
    facts = analysis.check_poles(bank, still, task.sample_period)
    norms = analysis.closed_loop_norms([plant], bank, still)
    gamma = solution.gamma * units.gamma
    open_loop = hinf_norm(plant.open_loop())
    analysis.check_bound(norms, open_loop if task.reduced else gamma, still)
    discrete = sampled(bank, task.sample_period)
    modulus = analysis.check_sampled_loop([plant], discrete, still, task.sample_period)
    controller = packed(
        task,
        discrete,
        {
            "gamma": gamma,
            "least_gamma": least,
            "norm": float(norms[0]),
            "open_loop_norm": open_loop,
            "solver": solution.status,
            "poles": pole_list(bank.poles[0]),
            "sampled_loop_modulus": modulus,
            **facts,
        },
    )
    return DesignResult(task, controller, still, [plant], bank, solution)


_NORMS_BETWEEN = 61
"""At how many of the table's rows closed-loop norms are computed."""


def plants_at(task: Task, r: Array) -> list[Plant]:
    """Return the generalized plants at speeds r (k,) [m/s]; their command is the signed voltage.

    Raises
    ------
    DesignError
        If more voltage gives no more force somewhere.
    """
    d, b = coefficients(task.damper, r, task.scheduling.eps)
    moving = r > 0.0
    if np.any(b[moving] <= 0.0):
        speed = r[moving][np.argmin(b[moving])]
        raise DesignError(
            f"damper: at {speed:g} m/s voltage does not raise the force; nothing could control it."
        )
    return family(task.plant_building, task.weights, b, d, task.stiffness, task.place)


def _frame(task: Task, plants: list[Plant]) -> tuple[Units, States]:
    """Return the units and the balanced states that all plants of the task share."""
    middle = plants[task.scheduling.middle]
    units = units_for(middle, least_gamma(middle, 1e-3))
    return units, balancing(units.normalised(middle), task.order)


def gammas(task: Task, variants: Iterable[tuple[str, float]]) -> list[dict[str, Any]]:
    """Return the gamma of each way in which X and Y may depend on the speed.

    Parameters
    ----------
    task : Task
    variants : iterable of (varies, rate)
        "none", "X", "Y" or "both"; bound on the rate of change of the speed [m/s2].

    Returns
    -------
    list of dict
        `varies`, `rate`, `gamma`, `solver`.
    """
    grid = np.array(task.scheduling.grid)
    plants = plants_at(task, grid)
    units, states = _frame(task, plants)
    scaled = [units.normalised(plant).transformed(states) for plant in plants]
    rows = []
    for varies, rate in variants:
        s = lmi.solve(scaled, grid, task.tau, varies, rate)
        rows.append(
            {"varies": varies, "rate": rate, "gamma": s.gamma * units.gamma, "solver": s.status}
        )
    return rows


def design_lpv(task: Task) -> DesignResult:
    """Return a verified LPV controller, tabulated over the speed.

    Parameters
    ----------
    task : Task
        Of kind "lpv".

    Returns
    -------
    DesignResult
        `facts` hold `gamma`, proved at the grid points; `norms` of the closed loops with the speed
        held there, `row_norms` between; `largest_eigenvalue` of the LMI over the table's rows, and
        the `share_proved` of them where it is not above 0: elsewhere the bound is not proved.

    Raises
    ------
    DesignError
        As `design_hinf`, at any row of the table.
    """
    scheduling, h = task.scheduling, task.sample_period
    if scheduling.varies == "both":
        raise DesignError(
            'scheduling: varies = "both" makes the controller need the rate of the speed, which is '
            'not measured. "none", "X" or "Y" are right; `gammas` gives the bound for "both".'
        )
    grid, speeds = np.array(scheduling.grid), scheduling.speeds()
    at_grid, at_rows = plants_at(task, grid), plants_at(task, speeds)
    units, states = _frame(task, at_grid)
    scaled = [units.normalised(plant).transformed(states) for plant in at_grid]
    tell("solving the linear matrix inequalities")
    solution = lmi.solve(scaled, grid, task.tau, scheduling.varies, scheduling.rate)
    scaled_rows = [units.normalised(plant).transformed(states) for plant in at_rows]
    bank = reconstruct(solution, scaled_rows, speeds, units)
    grid_bank = reconstruct(solution, scaled, grid, units)
    facts: dict[str, Any] = {"gamma": solution.gamma * units.gamma, "solver": solution.status}
    facts |= analysis.check_poles(bank, speeds, h)
    open_loop = [hinf_norm(plant.open_loop()) for plant in at_grid]
    facts |= {"grid": grid.tolist(), "open_loop_norms": open_loop}
    bound = max(open_loop) if task.reduced else facts["gamma"]
    facts |= _norms(at_grid, grid_bank, grid, bound, "norm")
    every = np.linspace(0, len(speeds) - 1, min(_NORMS_BETWEEN, len(speeds))).round().astype(int)
    some = Bank(*(matrices[every] for matrices in bank))
    facts |= _norms([at_rows[k] for k in every], some, speeds[every], bound, "row_norm")
    worst, _ = lmi.eigenvalues(solution, scaled_rows, speeds, solution.gamma)
    facts["largest_eigenvalue"] = float(worst.max())
    facts["largest_eigenvalue_at"] = float(speeds[np.argmax(worst)])
    facts["share_proved"] = float(np.mean(worst <= 0.0))
    discrete = sampled(bank, h)
    facts["sampled_loop_modulus"] = analysis.check_sampled_loop(at_rows, discrete, speeds, h)
    facts["poles"] = [pole_list(poles) for poles in grid_bank.poles]
    return DesignResult(task, packed(task, discrete, facts), speeds, at_rows, bank, solution)


def _norms(plants: list[Plant], bank: Bank, r: Array, bound: float, name: str) -> dict[str, Any]:
    """Return the norms with the speed held at r (k,), and the largest; refuse one above `bound`."""
    norms = analysis.closed_loop_norms(plants, bank, r)
    analysis.check_bound(norms, bound, r)
    worst = int(np.argmax(norms))
    return {
        f"{name}s": norms.tolist(),
        f"largest_{name}": float(norms[worst]),
        f"largest_{name}_at": float(r[worst]),
    }


# LQG design: an optimal regulator on an estimate of the state, for the clipped-optimal switch.
#
# As in Dyke, Spencer, Sain & Carlson (1996), Smart Mater. Struct. 5(5), 565-575: the estimator gets
# the measured force, so that it knows what the damper did instead of what was asked of it.


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
    bank = Bank((s.A - L @ y)[None], L[None], (push - L @ direct)[None], -K[None])
    still = np.zeros(1)
    facts = analysis.check_poles(bank, still, h)
    discrete = sampled(bank, h)
    # With a damper that gives the command exactly, the second input is the command itself.
    ideal = discrete._replace(A=discrete.A + discrete.W @ discrete.C)
    empty = np.zeros((0, 0))
    loop = Plant(s.A, empty, push, empty, empty, empty, y, empty, direct)
    modulus = analysis.check_sampled_loop([loop], ideal, still, h)
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

"""LPV design over the damper's speed: the command is the signed voltage sgn(v) V.

The Bingham model inside the base equation makes damping and input gain depend on r = |v|
(quasi-LPV). Reconstructed from Shirazi et al. (2012), IEEE TCST 20(5), eqs. (8)-(17).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DesignError
from ..progress import tell
from . import lmi, table, verify
from .hinf import units_for
from .norms import hinf_norm, least_gamma
from .plant import Plant, States, Units, balancing, family
from .result import DesignResult, packed, pole_list
from .sliding import coefficients
from .task import Task

Array = NDArray[np.float64]

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
    bank = table.reconstruct(solution, scaled_rows, speeds, units)
    grid_bank = table.reconstruct(solution, scaled, grid, units)
    facts: dict[str, Any] = {"gamma": solution.gamma * units.gamma, "solver": solution.status}
    facts |= verify.check_poles(bank, speeds, h)
    open_loop = [hinf_norm(plant.open_loop()) for plant in at_grid]
    facts |= {"grid": grid.tolist(), "open_loop_norms": open_loop}
    bound = max(open_loop) if task.reduced else facts["gamma"]
    facts |= _norms(at_grid, grid_bank, grid, bound, "norm")
    every = np.linspace(0, len(speeds) - 1, min(_NORMS_BETWEEN, len(speeds))).round().astype(int)
    some = table.Bank(*(matrices[every] for matrices in bank))
    facts |= _norms([at_rows[k] for k in every], some, speeds[every], bound, "row_norm")
    worst, _ = lmi.eigenvalues(solution, scaled_rows, speeds, solution.gamma)
    facts["largest_eigenvalue"] = float(worst.max())
    facts["largest_eigenvalue_at"] = float(speeds[np.argmax(worst)])
    facts["share_proved"] = float(np.mean(worst <= 0.0))
    discrete = table.sampled(bank, h)
    facts["sampled_loop_modulus"] = verify.check_sampled_loop(at_rows, discrete, speeds, h)
    facts["poles"] = [pole_list(poles) for poles in grid_bank.poles]
    return DesignResult(task, packed(task, discrete, facts), speeds, at_rows, bank, solution)


def _norms(
    plants: list[Plant], bank: table.Bank, r: Array, bound: float, name: str
) -> dict[str, Any]:
    """Return the norms with the speed held at r (k,), and the largest; refuse one above `bound`."""
    norms = verify.closed_loop_norms(plants, bank, r)
    verify.check_bound(norms, bound, r)
    worst = int(np.argmax(norms))
    return {
        f"{name}s": norms.tolist(),
        f"largest_{name}": float(norms[worst]),
        f"largest_{name}_at": float(r[worst]),
    }

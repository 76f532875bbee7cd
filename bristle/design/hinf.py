"""H-infinity design: the command is the damper's force, which an inverse or a switch realises."""

from __future__ import annotations

from math import log10

import numpy as np

from ..progress import tell
from . import lmi, table, verify
from .norms import hinf_norm, least_gamma
from .plant import Plant, Units, balancing, generalized
from .result import DesignResult, packed, pole_list
from .task import Task

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
    bank = table.reconstruct(solution, [balanced], still, units)
    facts = verify.check_poles(bank, still, task.sample_period)
    norms = verify.closed_loop_norms([plant], bank, still)
    gamma = solution.gamma * units.gamma
    open_loop = hinf_norm(plant.open_loop())
    verify.check_bound(norms, open_loop if task.reduced else gamma, still)
    discrete = table.sampled(bank, task.sample_period)
    modulus = verify.check_sampled_loop([plant], discrete, still, task.sample_period)
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

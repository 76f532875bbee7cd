"""Frequency responses for a report: loops, weights and controller; a task's before its design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DesignError
from ..physics.building import Building, frequencies
from .margins import grid_rows
from .norms import gains
from .plant import Plant, StateSpace, structure
from .task import Task

if TYPE_CHECKING:
    from .result import DesignResult

Array = NDArray[np.float64]


def responses(result: DesignResult, omega: Array, row: int = 0) -> dict[str, Array]:
    """Return gains at `omega` (k,) [rad/s] with the speed held at one row of the table.

    Parameters
    ----------
    result : DesignResult
        Of kind "hinf" or "lpv".
    omega : (k,) array
        Frequencies [rad/s].
    row : int
        Row of the table; 0 without one.

    Returns
    -------
    dict of (k,) arrays
        `open_loop`, `closed_loop`: largest singular value from disturbance to weighted outputs [1],
        which gamma bounds. `acceleration_open`, `acceleration_closed`: floor acceleration per
        ground acceleration [1]; `command`: command per ground acceleration; `controller`: command
        per measured acceleration. `acceleration_bound`, `command_bound`: gamma over the weights,
        what the two closed loops stay below.

    Raises
    ------
    DesignError
        For an LQG design, which has no weights of this kind.
    """
    if not result.plants:
        raise DesignError("an LQG design has no weighted loop to show.")
    plant, K = result.plants[row], result.bank.at(row)
    gamma, weights = result.facts["gamma"], result.task.weights
    closed = plant.closed_loop(K)
    n = plant.order
    ground = closed.B[:, :1]
    command = np.hstack([np.zeros((1, n)), K.C])
    acceleration = np.hstack([plant.C2, plant.D22 @ K.C])
    nothing = np.zeros((1, 1))
    return {
        "open_loop": gains(plant.open_loop(), omega),
        "closed_loop": gains(closed, omega),
        "acceleration_open": gains(_to_acceleration(plant), omega),
        "acceleration_closed": gains(StateSpace(closed.A, ground, acceleration, nothing), omega),
        "command": gains(StateSpace(closed.A, ground, command, nothing), omega),
        "controller": gains(K, omega),
        "acceleration_bound": gamma / np.abs(weights.acceleration.response(omega)),
        "command_bound": gamma / np.abs(weights.command.response(omega)),
    }


def omega_of(building: Building) -> Array:
    """Return frequencies (k,) [rad/s] a decade beyond the building's, dense around each of them."""
    modes = 2.0 * np.pi * np.array(frequencies(building))
    around = (modes[:, None] * (1.0 + np.linspace(-0.1, 0.1, 81))[None]).ravel()
    return np.sort(np.concatenate([np.geomspace(modes[0] / 20, modes[-1] * 10, 600), around]))


def curves(result: DesignResult) -> dict[str, Any]:
    """Return what the figure of a design shows, as plain lists; empty for LQG.

    Returns
    -------
    dict
        `frequency` (k,) [Hz], and `speeds`: for each speed of the grid [m/s] the gains (k,) of
        `responses`.
    """
    if not result.plants:
        return {}
    omega = omega_of(result.task.building)
    return {
        "frequency": (omega / (2.0 * np.pi)).tolist(),
        "speeds": [
            {
                "speed": float(result.speeds[row]),
                **{name: one.tolist() for name, one in responses(result, omega, row).items()},
            }
            for row in grid_rows(result)
        ],
    }  # fmt: skip


def task_curves(task: Task) -> dict[str, Array]:
    """Return what a task weighs, before it is solved, at the frequencies of `omega_of`.

    Returns
    -------
    dict of (k,) arrays
        `frequency` [Hz]; `acceleration_open`: top floor per ground acceleration [1] without the
        damper that is commanded, as of a design "hinf"; `acceleration_weight` [s2/m],
        `command_weight` [1/N, 1/V]: sizes of the weights.
    """
    omega = omega_of(task.building)
    s = structure(task.plant_building, stiffness=task.stiffness, device=task.place)
    ground = StateSpace(s.A, s.B[:, 1:2], s.C[:1], s.D[:1, 1:2])
    return {
        "frequency": omega / (2.0 * np.pi),
        "acceleration_open": gains(ground, omega),
        "acceleration_weight": np.abs(task.weights.acceleration.response(omega)),
        "command_weight": np.abs(task.weights.command.response(omega)),
    }


def _to_acceleration(plant: Plant) -> StateSpace:
    return StateSpace(plant.A, plant.B1[:, :1], plant.C2, np.zeros((1, 1)))

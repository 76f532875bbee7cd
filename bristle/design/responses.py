"""Frequency responses for a report: loops, weights and controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import DesignError
from .norms import gains
from .plant import Plant, StateSpace

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


def _to_acceleration(plant: Plant) -> StateSpace:
    return StateSpace(plant.A, plant.B1[:, :1], plant.C2, np.zeros((1, 1)))

"""Slow displacements of levels that have none of their own.

A level whose displacement was not measured integrates its velocity, and drifts. What is slow is
therefore taken from the nearest level that has a displacement, and the storeys between by their
equilibrium: far below the first mode they hardly deflect.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ..errors import RecordError
from ..physics.building import Building
from ..physics.device import Device

Array = NDArray[np.float64]

SLOW = 0.3
"""Share of the first natural frequency below which a displacement that was not measured is taken
from equilibrium: storeys hardly deflect there, so that it needs their stiffness only roughly."""


class Load(NamedTuple):
    """A device beside the one that is identified: its `force` (n,) [N] as measured, its `noise`."""

    device: Device
    force: Array
    noise: float


def deflected(building: Building, a: Array, loads: Sequence[Load]) -> Array:
    """Return how far springs alone deflect under accelerations and known forces, (levels, n) m.

    Differences of levels count: what is below the first one may have a damper beside it.

    Parameters
    ----------
    building : its masses and springs
    a : (levels, n) absolute accelerations [m/s2]
    loads : what devices carry, as far as it is known
    """
    below = np.cumsum((np.array(building.M) @ a)[::-1], axis=0)[::-1]
    for load in loads:
        for i in range(1, building.size):
            below[i] += load.force * load.device.crosses(i)
    return np.asarray(np.cumsum(-below / np.array(building.stiffnesses)[:, None], axis=0))


def anchored(
    levels: list[dict[str, Any]],
    errors: list[Array],
    springs: Array,
    dt: float,
    corner: float,
    apart: set[int],
    names: Sequence[str],
) -> tuple[list[dict[str, Any]], list[Array]]:
    """Return levels and draws of their errors, with slow displacements from those measured.

    Parameters
    ----------
    levels, errors : per level what `smoothed_level` and `level_draws` return
    springs : (levels, n) how far the springs deflect [m]; see `deflected`
    dt, corner : sampling step [s]; frequency below which a displacement is not the level's own [Hz]
    apart : levels whose storey below has a device of unknown force beside its spring
    names : of each level's displacement, with the run, for messages

    Raises
    ------
    RecordError
        If a displacement was not measured that only levels beyond such a storey could give.
    """
    able = [i for i, level in enumerate(levels) if level["have"][0]]
    levels, errors = list(levels), list(errors)
    if not able or len(able) == len(levels):
        return levels, errors
    low = butter(2, min(2.0 * corner * dt, 0.5), output="sos")

    def joined(own: Array, other: Array) -> Array:
        """Return (..., n) the fast part of one displacement and the slow one of another."""
        return np.asarray(own + sosfiltfilt(low, other - own, axis=-1))

    for i, level in enumerate(levels):
        if level["have"][0]:
            continue
        beside = [k for k in able if not apart & set(range(min(i, k) + 1, max(i, k) + 1))]
        if not beside:
            raise RecordError(
                f"{names[i]} was not measured, and no other level gives it: the force of a damper "
                "between was not measured. Measure that displacement, or the force."
            )
        near = min(beside, key=lambda k: abs(k - i))
        state, std, error = level["state"].copy(), level["std"].copy(), errors[i].copy()
        there = levels[near]["state"][:, 0] + springs[i] - springs[near]
        state[:, 0] = joined(state[:, 0], there)
        if len(error):
            error[:, :, 0] = joined(error[:, :, 0], errors[near][:, :, 0])
        # White noise of a velocity, integrated: its power above a corner f is r dt/(2 pi^2 f).
        drift = np.sqrt(level["r"][1] * dt / (2.0 * np.pi**2 * corner))
        std[0] = np.hypot(min(std[0], drift), levels[near]["std"][0])
        levels[i], errors[i] = {**level, "state": state, "std": std}, error
    return levels, errors

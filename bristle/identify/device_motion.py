"""The motion of the device that is identified: of its upper level relative to the lower one.

Between the ground and a level it is that level's motion. Between two levels it is a small
difference, and what the levels' sensors share cancels in it: the noise of the ground's acceleration
is in the relative acceleration of every level. So channels are subtracted first and their
difference is smoothed, by its own jerk and the noise of the two sensors. Where the two levels do
not have the same sensors the smoothed motions are subtracted, and their errors add up as if they
were independent: a little too wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..data.measurement import Measurement
from ..physics.building import Building
from ..physics.device import GROUND, Device
from .level import level_draws, smoothed_level

Array = NDArray[np.float64]

_NAME = "relative"

LOOSER = 8.0
"""Factor on the likeliest jerk of a difference. Where a law's friction builds up fast the likeliest
one takes a thousandth off the displacement, which the spring of a storey turns into a force: on the
runs of tests/identify/test_building_devices.py z of training runs is 1.08 to 1.25 with it, and 1.01
to 1.11 with this factor."""


@dataclass(frozen=True)
class DeviceMotion:
    """Displacement, velocity and acceleration across a device, smoothed.

    `x`, `v` (n,) [m, m/s]; `std` (3,) what the smoother leaves uncertain of x, v and a;
    `draws` (d, n, 3) draws of that error.
    """

    x: Array
    v: Array
    std: Array
    draws: Array


def measured_across(
    runs: Sequence[Measurement], building: Building, device: Device, draws: int, seed: int,
    looser: float,
) -> list[DeviceMotion | None]:  # fmt: skip
    """Return the motion across a device between two levels, from the difference of channels.

    Parameters
    ----------
    runs : of one rig
    building : whose levels were measured
    device : that connects two of them, or the ground and one
    draws, seed : how many draws of the smoother's error, and their seed
    looser : factor of the jerk's intensity [1]

    Returns
    -------
    list
        None for a run whose two levels have other sensors, or no displacement; for all runs where
        the device is on the ground, and the level's own motion is its motion.
    """
    if device.lower == GROUND:
        return [None] * len(runs)
    jerk = looser * LOOSER
    pair = [building.levels()[i] for i in device.levels]
    smoothed = [
        None if (seen := _difference(run, *pair)) is None else smoothed_level(seen, _NAME, jerk)
        for run in runs
    ]
    return [
        None
        if one is None
        else DeviceMotion(
            one["state"][:, 0],
            one["state"][:, 1],
            one["std"],
            level_draws(len(run.time), one, run.step, draws, seed),
        )
        for one, run in zip(smoothed, runs, strict=True)
    ]


def _difference(run: Measurement, lower: str, upper: str) -> Measurement | None:
    """Return the difference of two levels' channels as those of a level on a still ground."""
    kinds = ("displacement", "velocity", "acceleration_absolute")
    there = [tuple(run.has(f"{level}_{kind}") for kind in kinds) for level in (lower, upper)]
    if there[0] != there[1] or not there[0][0]:
        return None
    channels, noise = {"ground_acceleration": np.zeros(len(run.time))}, {}
    for kind in (kind for kind, has in zip(kinds, there[0], strict=True) if has):
        low, high = f"{lower}_{kind}", f"{upper}_{kind}"
        channels[f"{_NAME}_{kind}"] = run[high] - run[low]
        both = run.noise.get(high, 0.0), run.noise.get(low, 0.0)
        noise[f"{_NAME}_{kind}"] = float(np.hypot(*both))
    return replace(run, channels=channels, noise=noise)

"""The force of a building's damper that no load cell shows, from equilibrium.

Its error is that of the accelerometers, which is white, and that of the smoothed motion times
springs and damping, which is correlated in time: that part is drawn with the error of the motion,
so that it counts in intervals as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.building import Building
from ..physics.device import GROUND
from .response import Response

Array = NDArray[np.float64]


class Reconstructed(NamedTuple):
    """A damper's force by equilibrium.

    `force` (n,) [N]; `noise` its standard deviation [N]; `white` that of the part that is white, of
    accelerometers and load cells; `error` (d, n) [N] draws of the other part, the motion's.
    """

    force: Array
    noise: float
    white: float
    error: Array


def reconstructed(
    response: Response, building: Building, linear_storeys: bool = True
) -> Reconstructed:
    """Return the damper's force by equilibrium.

    Of the equilibrium of all masses above a storey that the damper acts across, and the two ends'
    own, the one with the least noise is taken: that of the accelerometers, and what the smoother
    leaves uncertain of the motion, times the building's masses, springs and damping.

    Parameters
    ----------
    response : the run, its motion smoothed
    building : whose equilibrium gives the force
    linear_storeys : whether storeys are linear, as a level's own equilibrium needs
    """
    device, n = response.device, building.size
    able = [np.arange(n) >= i for i in range(device.lower + 1, device.upper + 1)]
    weights = [one.astype(np.float64) for one in able]
    if linear_storeys:
        ends = ((device.upper, 1.0), (device.lower, -1.0))
        weights += [sign * np.eye(n)[level] for level, sign in ends if level != GROUND]
    found = [_weighted(response, building, one) for one in weights]
    return min(found, key=lambda one: one.noise)


def _weighted(response: Response, building: Building, weights: Array) -> Reconstructed:
    """Return the damper's force by a sum of the levels' equilibria in which it counts once.

    Parameters
    ----------
    response, building : as in `reconstructed`
    weights : (n,) how often each level's equilibrium counts
    """
    M, C, K = (weights @ np.array(part) for part in (building.M, building.C, building.K))
    K[np.abs(K) < 1e-12 * np.abs(np.array(building.K)).max()] = 0.0  # rounding of springs above
    x, error = response.x, response.draws
    lower, upper = response.device.levels
    if response.across is not None and np.flatnonzero(K).tolist() == [lower, upper]:
        # The spring beside the damper takes its displacement, which is known better.
        x, error = x.copy(), error.copy()
        x[upper] = x[lower] + response.across.x
        error[upper, :, :, 0] = error[lower, :, :, 0] + response.across.draws[:, :, 0]
    force = -(M @ response.a + C @ response.v + K @ x)
    white = float(np.sum((M * response.noise_a) ** 2))
    for other in response.others:
        share = float(weights @ np.array(other.device.incidence(building.size)))
        force, white = force - share * other.force, white + (share * other.noise) ** 2
    smooth = float(np.sum((K * response.std[:, 0]) ** 2) + np.sum((C * response.std[:, 1]) ** 2))
    drawn = np.einsum("i,idn->dn", K, error[..., 0]) + np.einsum("i,idn->dn", C, error[..., 1])
    if len(drawn) > 1:  # in the mean nothing is known of it
        drawn = (drawn - drawn.mean(axis=0)) * np.sqrt(len(drawn) / (len(drawn) - 1))
    return Reconstructed(force, float(np.sqrt(white + smooth)), float(np.sqrt(white)), drawn)

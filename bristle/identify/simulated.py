"""The response that a building shows to a measured excitation, mode by mode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.signal import cont2discrete, lfilter, ss2tf

from ..physics.building import Building
from .response import Response

Array = NDArray[np.float64]


def stiffness_matrix(building: Building, stiffness: Array) -> Array:
    """Return K (n, n) with other stiffnesses [N/m] below the levels."""
    K = np.array(building.K)
    for i, change in enumerate(stiffness - np.array(building.stiffnesses)):
        K[i, i] += change
        if i:
            K[i - 1, i - 1] += change
            K[i - 1, i] -= change
            K[i, i - 1] -= change
    return K


def simulated(
    run: Response, building: Building, stiffness: Array, zeta: Array, first: int
) -> tuple[Array, Array]:
    """Return the displacements and velocities (n, samples) [m, m/s] that a building shows to a run.

    Parameters
    ----------
    run : the response whose ground motion, force and first state are taken
    building : its masses and matrices, of n levels
    stiffness : (n,) N/m below each level, in place of the building's
    zeta : (n,) damping ratios of the modes
    first : 1 where the force on the first level is unknown: that level's measured motion then
        drives the rest; else 0
    """
    M, K = np.array(building.M), stiffness_matrix(building, stiffness)
    start_x, start_v = run.x[:, 0], run.v[:, 0]
    if first == 0:
        load = -np.outer(M.sum(axis=1), run.ground)
        if run.force is not None:
            load[0] -= run.force
        base_x, base_v = np.zeros_like(run.ground), np.zeros_like(run.ground)
        ratios = zeta
    else:
        base_x, base_v = run.x[0], run.v[0]
        start_x, start_v = run.x[1:, 0] - base_x[0], run.v[1:, 0] - base_v[0]
        load = -np.outer(M[1:].sum(axis=1), run.a[0])
        M, K = M[1:, 1:], K[1:, 1:]
        ratios = zeta[1:]
    values, shapes = eigh(K, M)
    omega = np.sqrt(np.maximum(values, 1e-12))
    forces, x, v = shapes.T @ load, [], []
    for r in range(len(omega)):
        begin = (float(shapes[:, r] @ M @ start_x), float(shapes[:, r] @ M @ start_v))
        # An instrument of a mode must die out, whatever its ratio looks like in between.
        own = _oscillator(float(omega[r]), max(float(ratios[r]), 1e-3), forces[r], run.dt, begin)
        x.append(own[0])
        v.append(own[1])
    moved_x, moved_v = shapes @ np.array(x) + base_x, shapes @ np.array(v) + base_v
    if first:
        moved_x, moved_v = np.vstack([base_x, moved_x]), np.vstack([base_v, moved_v])
    return moved_x, moved_v


def _oscillator(
    omega: float, zeta: float, force: Array, dt: float, begin: tuple[float, float]
) -> tuple[Array, Array]:
    """Return position and velocity (n,) of p'' + 2 zeta omega p' + omega^2 p = force.

    Exact for a force that is linear between samples.
    """
    A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
    state = cont2discrete((A, np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))), dt, "foh")
    numerator, denominator = ss2tf(*state[:4])
    damped = omega * np.sqrt(max(1.0 - zeta**2, 1e-12))
    decay = zeta * omega
    time = np.arange(len(force)) * dt
    fade, phase = np.exp(-decay * time), damped * time
    side = (begin[1] + decay * begin[0]) / damped
    x = fade * (begin[0] * np.cos(phase) + side * np.sin(phase))
    v = -decay * x + damped * fade * (side * np.cos(phase) - begin[0] * np.sin(phase))
    return (
        x + lfilter(numerator[0], denominator, force),
        v + lfilter(numerator[1], denominator, force),
    )

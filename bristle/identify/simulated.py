"""The response that a building shows to a measured excitation, mode by mode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.signal import cont2discrete, lfilter, ss2tf

from ..physics.building import Building
from ..physics.device import GROUND, Device
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


def loads_on(run: Response, unknown: Device | None = None) -> Array:
    """Return the forces (n, samples) [N] of devices on the levels, as far as they are known.

    Parameters
    ----------
    run : with the forces that were measured
    unknown : a damper whose force was not measured in every run, and counts in none
    """
    n = len(run.x)
    loads = np.zeros((n, run.x.shape[1]))
    for load in run.loads if unknown is None else run.others:
        loads += np.outer(load.device.incidence(n), load.force)
    return loads


def simulated(
    run: Response, building: Building, stiffness: Array, zeta: Array, unknown: Device | None
) -> tuple[Array, Array]:
    """Return the displacements and velocities (n, samples) [m, m/s] that a building shows to a run.

    Parameters
    ----------
    run : the response whose ground motion, force and first state are taken
    building : its masses and matrices, of n levels
    stiffness : (n,) N/m below each level, in place of the building's
    zeta : (n,) damping ratios of the modes
    unknown : the damper whose force was not measured: the measured motion across it then drives
        the rest, its upper end and all above by that much; None where there is none
    """
    M, K = np.array(building.M), stiffness_matrix(building, stiffness)
    n = building.size
    load = -np.outer(M.sum(axis=1), run.ground) - loads_on(run, unknown)
    if unknown is None:
        free, ratios = np.eye(n), zeta
        driven_x, driven_v = np.zeros_like(run.x), np.zeros_like(run.v)
        start_x, start_v = run.x[:, 0], run.v[:, 0]
    else:
        # q = free y + above s: what the damper does to y is its force times b free = 0.
        kept = np.arange(n) != unknown.upper
        above = (np.arange(n) >= unknown.upper).astype(float)
        free, ratios = np.eye(n)[:, kept], zeta[1:]
        x, v, a = run.x[unknown.upper], run.v[unknown.upper], run.a[unknown.upper]
        if unknown.lower == GROUND:
            a = a - run.ground
        else:
            free[unknown.upper, unknown.lower] = 1.0
            x, v = x - run.x[unknown.lower], v - run.v[unknown.lower]
            a = a - run.a[unknown.lower]
        driven_x, driven_v = np.outer(above, x), np.outer(above, v)
        load -= np.outer(M @ above, a) + np.outer(K @ above, x)
        start_x, start_v = (run.x - driven_x)[kept, 0], (run.v - driven_v)[kept, 0]
    M, K, load = free.T @ M @ free, free.T @ K @ free, free.T @ load
    values, shapes = eigh(K, M)
    omega = np.sqrt(np.maximum(values, 1e-12))
    forces, x, v = shapes.T @ load, [], []
    for r in range(len(omega)):
        begin = (float(shapes[:, r] @ M @ start_x), float(shapes[:, r] @ M @ start_v))
        # An instrument of a mode must die out, whatever its ratio looks like in between.
        own = _oscillator(float(omega[r]), max(float(ratios[r]), 1e-3), forces[r], run.dt, begin)
        x.append(own[0])
        v.append(own[1])
    shown = free @ shapes
    return shown @ np.array(x) + driven_x, shown @ np.array(v) + driven_v


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

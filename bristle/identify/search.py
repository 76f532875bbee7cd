"""A bounded least-squares search on normal equations, for many short fits of long records.

Residuals are tens of thousands of samples, parameters ten or so: forming J'WJ costs far less than
the factorisation of J that general solvers do at every step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HUBER = 2.0
"""Normalised residual beyond which the loss grows linearly."""

HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""

CUT = 25.0
"""Normalised residuals count up to this, times their median scale where that is above 1.

A sign law's force near v = 0 has two values: where all draws of the motion show the one and the
truth is the other, the noise expected is a hundred times too small.
"""

_NUDGE = 1e-5


@dataclass(frozen=True)
class Descent:
    """Where a search ended.

    `theta` (p,); `cost` the mean robust loss per residual; `normal` (p, p) the matrix J'WJ there;
    `sweeps` how many steps were taken.
    """

    theta: Array
    cost: float
    normal: Array
    sweeps: int


def loss(z: Array) -> Array:
    """Return Huber's loss of normalised residuals: quadratic up to `HUBER`, linear beyond."""
    size = np.abs(z)
    return np.where(size <= HUBER, 0.5 * size * size, HUBER * size - 0.5 * HUBER * HUBER)


def losses(z: Array) -> Array:
    """Return the robust loss of each normalised residual (n,), spikes cut at `CUT`."""
    limit = CUT * max(1.0, float(np.median(np.abs(z))) / 0.6745) if len(z) else CUT
    return loss(np.clip(z, -limit, limit))


def z_of(mean_loss: float) -> float:
    """Return RMS(residual)/noise from a mean robust loss: 1 for Gaussian noise of that size."""
    return float(np.sqrt(max(mean_loss, 0.0) / HUBER_AT_ONE))


def z_scale(z: Array) -> float:
    """Return RMS(residual)/noise of residuals (n,) over their expected noise, robustly.

    Huber's loss with k = 2 (Huber 1964, Ann. Math. Statist. 35, 73-101): the errors of a sign law
    near v = 0 are not Gaussian, and a plain RMS reads 2 for the truth.
    """
    return z_of(float(np.mean(losses(z)))) if len(z) else float("nan")


def descend(
    residuals: Callable[[Array], Array],
    theta: Array,
    low: Array,
    high: Array,
    sweeps: int = 20,
    tolerance: float = 1e-4,
) -> Descent:
    """Minimise the mean robust loss of `residuals` from `theta` within bounds.

    Parameters
    ----------
    residuals : callable
        theta (p,), of order one, to normalised residuals (n,), finite.
    low, high : (p,) bounds
    sweeps : most steps
    tolerance : relative decrease of the cost below which the search ends

    Notes
    -----
    Levenberg's and Marquardt's method with Huber's weights, parameters at a bound that the step
    would leave held there (projected step).
    """
    theta = np.clip(theta, low, high)
    r = residuals(theta)
    cost = float(np.mean(loss(r)))
    damping, normal, small = 1e-3, np.zeros((len(theta), len(theta))), 0
    for sweep in range(sweeps):
        weight = np.minimum(1.0, HUBER / np.maximum(np.abs(r), 1e-12))
        J = jacobian(residuals, theta, r, low, high)
        weighted = J * weight[:, None]
        normal, gradient = weighted.T @ J, weighted.T @ r
        moved = False
        for _ in range(8):
            trial = np.clip(theta - _step(normal, gradient, damping, theta, low, high), low, high)
            found = residuals(trial)
            now = float(np.mean(loss(found)))
            if now < cost:
                moved = True
                break
            damping *= 6.0
        if not moved:
            return Descent(theta, cost, normal, sweep)
        small = small + 1 if cost - now < tolerance * cost else 0
        theta, r, cost, damping = trial, found, now, max(0.2 * damping, 1e-9)
        if small == 2:
            return Descent(theta, cost, normal, sweep + 1)
    return Descent(theta, cost, normal, sweeps)


def jacobian(
    residuals: Callable[[Array], Array], theta: Array, r: Array, low: Array, high: Array
) -> Array:
    """Return the derivatives of `residuals` at theta (n, p) by differences, inside the bounds."""
    J = np.empty((len(r), len(theta)))
    for i in range(len(theta)):
        nudge = _NUDGE * max(1.0, abs(theta[i]))
        if theta[i] + nudge > high[i]:
            nudge = -nudge
        other = theta.copy()
        other[i] += nudge
        J[:, i] = (residuals(other) - r) / nudge
    return J


def _step(
    normal: Array, gradient: Array, damping: float, theta: Array, low: Array, high: Array
) -> Array:
    """Return the damped step, zero where a parameter stands at a bound that it would leave."""
    held = ((theta <= low) & (gradient > 0.0)) | ((theta >= high) & (gradient < 0.0))
    free = np.flatnonzero(~held)
    step = np.zeros_like(theta)
    if len(free):
        matrix = normal[np.ix_(free, free)].copy()
        size = np.diag(matrix).copy()
        matrix[np.diag_indices_from(matrix)] += damping * size + 1e-12 * max(size.max(), 1e-300)
        step[free] = np.linalg.lstsq(matrix, gradient[free], rcond=None)[0]
    return step

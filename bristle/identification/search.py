"""A bounded least-squares search on normal equations, for many short fits of long records.

Residuals are tens of thousands of samples, parameters ten or so: forming J'WJ costs far less than
the factorisation of J that general solvers do at every step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass
from os import cpu_count
from typing import TypeVar

import numpy as np

from ..core.arrays import Array

HUBER = 2.0
"""Normalised residual beyond which the loss grows linearly."""

HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""

CUT = 25.0
"""Normalised residuals count up to this, times their median scale where that is above 1.

A sign law's force near v = 0 has two values: where all draws of the motion show the one and the
truth is the other, the noise expected is a hundred times too small.
"""

SECANTS = 3
"""Steps that an old Jacobian, brought up to date, serves."""

FAITHFUL = 0.5
"""Share of the promised decrease that a step must reach for the Jacobian to be kept."""

LIGHT = 1e-2
"""Damping up to which a step goes as far as its Jacobian says."""

_HUGE = 1e100  # its square is a number still
_NUDGE = 1e-5
_ROUGH_NUDGE = 1e-4
_SPIKE = 5.0


@dataclass(frozen=True)
class Descent:
    """Where a search ended.

    `theta` (p,); `begun`, `cost` the mean robust loss per residual at the start and there; `normal`
    (p, p) the matrix J'WJ there; `sweeps` how many steps were taken.
    """

    theta: Array
    begun: float
    cost: float
    normal: Array
    sweeps: int


def loss(z: Array) -> Array:
    """Return Huber's loss of normalised residuals: quadratic up to `HUBER`, linear beyond."""
    size = np.minimum(np.abs(z), _HUGE)
    return np.where(size <= HUBER, 0.5 * size * size, HUBER * size - 0.5 * HUBER * HUBER)


def losses(z: Array) -> Array:
    """Return the robust loss of each normalised residual (n,), spikes cut at `CUT`."""
    judged = np.abs(z[z != 0.0])
    limit = CUT * max(1.0, float(np.median(judged)) / 0.6745) if len(judged) else CUT
    return loss(np.clip(z, -limit, limit))


def mean_loss(each: Array) -> float:
    """Return the mean of losses (n,) over the samples that are judged.

    A sample that was not measured has a residual, and a loss, of exactly 0.
    """
    return float(each.sum()) / max(1, int(np.count_nonzero(each)))


def z_of(mean_loss: float) -> float:
    """Return RMS(residual)/noise from a mean robust loss: 1 for Gaussian noise of that size."""
    return float(np.sqrt(max(mean_loss, 0.0) / HUBER_AT_ONE))


def z_scale(z: Array) -> float:
    """Return RMS(residual)/noise of residuals (n,) over their expected noise, robustly.

    Huber's loss with k = 2 (Huber 1964, Ann. Math. Statist. 35, 73-101): the errors of a sign law
    near v = 0 are not Gaussian, and a plain RMS reads 2 for the truth.
    """
    return z_of(mean_loss(losses(z))) if len(z) else float("nan")


def weighed(J: Array, r: Array) -> tuple[Array, Array]:
    """Return the normal equations (p, p), (p,) of residuals (n,) by Huber's weights."""
    weighted = J * np.minimum(1.0, HUBER / np.maximum(np.abs(r), 1e-12))[:, None]
    return weighted.T @ J, weighted.T @ r


def linear_step(J: Array, r: Array) -> Array:
    """Return by how much parameters (p,) are too large, to first order; the least where open."""
    normal, gradient = weighed(J, r)
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal / np.outer(size, size), gradient / size
    return np.asarray(np.linalg.lstsq(*scaled, rcond=1e-8)[0] / size)


def descend(
    residuals: Callable[[Array], Array],
    theta: Array,
    low: Array,
    high: Array,
    sweeps: int = 20,
    tolerance: float = 1e-4,
    slopes: Callable[[Array, Array], Array] | None = None,
) -> Descent:
    """Minimise the mean robust loss of `residuals` from `theta` within bounds.

    Parameters
    ----------
    residuals : callable
        theta (p,), of order one, to normalised residuals (n,), finite.
    low, high : (p,) bounds
    sweeps : most Jacobians
    tolerance : relative decrease of the cost below which the search ends
    slopes : theta (p,) and the residuals (n,) there to their derivatives (n, p); else by `jacobian`

    Notes
    -----
    Levenberg's and Marquardt's method with Huber's weights, parameters at a bound that the step
    would leave held there (projected step). Between two Jacobians by differences up to `SECANTS`
    steps take one brought up to date by the last step (Broyden 1965, Math. Comp. 19, 577-593): it
    costs one evaluation instead of one per parameter.
    """
    theta = np.clip(theta, low, high)
    r = residuals(theta)
    judged = max(1, int(np.count_nonzero(r)))
    slopes = slopes or (lambda theta, r: jacobian(residuals, theta, r, low, high))
    begun = cost = float(np.sum(loss(r))) / judged
    if not len(theta):
        return Descent(theta, begun, cost, np.zeros((0, 0)), 0)
    damping, small, sweep, secants = 1e-3, 0, 1, 0
    J = slopes(theta, r)
    while True:
        normal, gradient = weighed(J, r)
        tried = _try(
            residuals, (theta, cost, judged), normal, gradient, damping, (low, high), not secants
        )
        damping = tried.damping
        if tried.moved:
            gain, promised = cost - tried.cost, tried.promised / judged
            change = tried.theta - theta
            slow = gain < tolerance * cost
            # A Jacobian made here that promised no more either is the last one.
            sure = slow and not secants and damping <= LIGHT and promised < tolerance * cost
            small = 2 if sure else small + 1 if slow else 0
            if small < 2 and not slow and secants < SECANTS and gain > FAITHFUL * promised:
                miss = tried.r - r - J @ change
                J += np.outer(miss, change / float(change @ change))
                theta, r, cost, secants = tried.theta, tried.r, tried.cost, secants + 1
                continue
            theta, r, cost = tried.theta, tried.r, tried.cost
        if small == 2 or (not tried.moved and not secants) or sweep >= sweeps:
            return Descent(theta, begun, cost, normal, sweep)
        J, secants, sweep = slopes(theta, r), 0, sweep + 1


@dataclass(frozen=True)
class _Tried:
    """A step of a search: where it came to, and by how much the model of the cost fell."""

    theta: Array
    r: Array
    cost: float
    damping: float
    promised: float
    moved: bool


def _try(
    residuals: Callable[[Array], Array], here: tuple[Array, float, int], normal: Array,
    gradient: Array, damping: float, bounds: tuple[Array, Array], patient: bool,
) -> _Tried:  # fmt: skip
    """Return the first damped step that lowers the cost; one try only where not `patient`.

    `here` is theta, its cost and how many residuals that is the mean of; `bounds` the lowest and
    highest values of theta (p,).
    """
    (theta, cost, judged), (low, high) = here, bounds
    for _ in range(8 if patient else 1):
        step = _step(normal, gradient, damping, theta, low, high)
        trial = np.clip(theta - step, low, high)
        found = residuals(trial)
        now = float(np.sum(loss(found))) / judged
        if now < cost:
            taken = theta - trial
            promised = float(gradient @ taken - 0.5 * taken @ normal @ taken)
            return _Tried(trial, found, now, max(0.2 * damping, 1e-9), promised, True)
        damping *= 6.0
    return _Tried(theta, found, cost, damping, 0.0, False)


def jacobian(
    residuals: Callable[[Array], Array],
    theta: Array,
    r: Array,
    low: Array,
    high: Array,
    rough: bool = False,
) -> Array:
    """Return the derivatives (n, p) of `residuals` at theta by differences, inside the bounds.

    Parameters
    ----------
    residuals : theta (p,) to normalised residuals (n,)
    theta, r : (p,) where to differentiate, and the residuals (n,) there
    low, high : (p,) bounds
    rough : whether events such as impacts make the residuals jump. An impact that a nudge moves to
        the next sample leaves a spike that says nothing about the rest of the curve and outweighs
        it: such entries are cut, at a multiple of what nine tenths of a column stay below
    """
    size = _ROUGH_NUDGE if rough else _NUDGE
    J = np.empty((len(r), len(theta)))
    for i in range(len(theta)):
        nudge = size * max(1.0, abs(theta[i]))
        if theta[i] + nudge > high[i]:
            nudge = -nudge
        other = theta.copy()
        other[i] += nudge
        J[:, i] = (residuals(other) - r) / nudge
    if rough and len(J):
        limit = _SPIKE * np.quantile(np.abs(J), 0.9, axis=0) + 1e-12
        np.clip(J, -limit, limit, out=J)
    return J


def _step(
    normal: Array, gradient: Array, damping: float, theta: Array, low: Array, high: Array
) -> Array:
    """Return the damped step, zero where a parameter stands at a bound that it would leave."""
    at_bound = ((theta <= low) & (gradient > 0.0)) | ((theta >= high) & (gradient < 0.0))
    free = np.flatnonzero(~at_bound)
    step = np.zeros_like(theta)
    if len(free):
        matrix = normal[np.ix_(free, free)].copy()
        size = np.diag(matrix).copy()
        matrix[np.diag_indices_from(matrix)] += damping * size + 1e-12 * max(size.max(), 1e-300)
        step[free] = np.linalg.lstsq(matrix, gradient[free], rcond=None)[0]
    return step


# The same work on several things at once: compiled forces leave Python's lock while they run.

Given = TypeVar("Given")
Found = TypeVar("Found")


def in_threads(work: Callable[[Given], Found], items: Sequence[Given]) -> list[Found]:
    """Return what a function makes of each item, in their order, on as many threads as cores.

    Each thread tells as the one that calls.

    Parameters
    ----------
    work : called with an item; results must not depend on which of them is done first
    items : what it is called with
    """
    with ThreadPoolExecutor(cpu_count()) as pool:
        at_work = [pool.submit(copy_context().run, work, item) for item in items]
        return [one.result() for one in at_work]

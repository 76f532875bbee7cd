"""The descent that trains a policy: stochastic gradients through its closed loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bristle.core.arrays import Array
from bristle.core.progress import Count

from .training import PATIENT, Loop, Run

POWER = 5.0
"""Of the mean over motions: the larger, the more the worst motion counts."""
NORM = 30.0
"""Of the norm that stands for a peak."""
SWINGS = 5.0
"""By how many samples at the peak that norm is divided."""
BEYOND = 2.0
"""Weight of the squares of what RMS of the output and drift exceed clipped-optimal's by."""
BATCH = 20
"""Motions of a step."""
RATE, LAST_RATE = 0.02, 1e-4
"""First and last size of a step, in whitened inputs of the network."""
MOST = (5.0, 0.5)
"""Longest gradient of a motion and of a step: at the edge of two fates it is huge."""
CHOICES = 12
"""How often the held-out motions are asked."""
THINNEST = 0.05
"""Least spread, as a share of the inputs' own, that is whitened."""


class Outcome(NamedTuple):
    """Trained weights, and the means of peak over clipped-optimal's: on the motions of the
    training and on those that chose; the round that was chosen."""

    weights: Array
    trained: float
    held_out: float
    chosen: int


class Whitening(NamedTuple):
    """Makes a network's inputs alike: T (D, D) of inputs less their mean (D,)."""

    T: Array
    mean: Array
    hidden: int

    def weights(self, whitened: Array) -> Array:
        """Return the weights on the inputs themselves."""
        D, hidden = len(self.mean), self.hidden
        found = whitened.copy()
        inner = whitened[: hidden * D].reshape(hidden, D) @ self.T
        found[: hidden * D] = inner.ravel()
        found[hidden * D : hidden * (D + 1)] -= inner @ self.mean
        found[-1 - D : -1] = whitened[-1 - D : -1] @ self.T
        found[-1] -= found[-1 - D : -1] @ self.mean
        return found

    def slope(self, slope: Array) -> Array:
        """Return the derivative by the whitened weights from that by the weights."""
        D, hidden = len(self.mean), self.hidden
        found = slope.copy()
        by_bias = slope[hidden * D : hidden * (D + 1)]
        inner = slope[: hidden * D].reshape(hidden, D) - np.outer(by_bias, self.mean)
        found[: hidden * D] = (inner @ self.T.T).ravel()
        found[-1 - D : -1] = self.T @ (slope[-1 - D : -1] - slope[-1] * self.mean)
        return found


def descend(
    loop: Loop, runs: list[Run], held_out: list[Run], rounds: int, random: np.random.Generator
) -> Outcome:
    """Return the weights that the held-out runs choose among those that the descent passes.

    Adam (Kingma & Ba 2015) on the mean of (peak / clipped-optimal's peak)^5, through the closed
    loop of each motion.

    Parameters
    ----------
    loop : Loop
    runs, held_out : to train on, and to choose by
    rounds : steps of the descent
    random : generator of first weights and batches
    """
    white = _whitening(loop, runs)
    D, hidden = len(white.mean), white.hidden
    w = np.zeros(len(loop.constant(0.5)))
    w[: hidden * (D + 1)] = 0.3 * random.standard_normal(hidden * (D + 1))
    w[hidden * (D + 1) : hidden * (D + 2)] = 0.1 * random.standard_normal(hidden)
    w[-1] = -1.0
    first, second = np.zeros_like(w), np.zeros_like(w)
    best = Outcome(white.weights(w), np.inf, np.inf, 0)
    count = Count("training: round", rounds)
    for k in range(1, rounds + 1):
        count.begins()
        size = min(BATCH, len(runs))
        batch = [runs[i] for i in random.choice(len(runs), size, replace=False)]
        slope = _limited(white.slope(_slope(loop, batch, white.weights(w))), MOST[1])
        first = 0.9 * first + 0.1 * slope
        second = 0.98 * second + 0.02 * slope**2
        rate = LAST_RATE + 0.5 * RATE * (1.0 + np.cos(np.pi * (k - 1) / rounds))
        w -= rate * first / (1.0 - 0.9**k) / (np.sqrt(second / (1.0 - 0.98**k)) + 1e-6)
        if k % max(1, rounds // CHOICES) == 0 or k == rounds:
            weights = white.weights(w)
            value = mean_cost(loop, held_out, weights)
            if value < best.held_out:
                best = Outcome(weights, 0.0, value, k)
    peaks = (peak_ratios(loop, which, best.weights) for which in (runs, held_out))
    trained, chosen = (float(np.mean(ratios)) for ratios in peaks)
    return best._replace(trained=trained, held_out=chosen)


def peak_ratios(loop: Loop, runs: list[Run], weights: Array) -> Array:
    """Return the peaks (k,) of runs over those of the clipped-optimal controller."""
    return np.array([np.abs(loop.respond(run, weights)[0]).max() / run.peak for run in runs])


def mean_cost(loop: Loop, runs: list[Run], weights: Array) -> float:
    """Return the mean that the descent lowers."""
    costs = np.array([_cost(run, *loop.respond(run, weights))[0] for run in runs])
    return float(np.mean(costs**POWER) ** (1.0 / POWER))


def _slope(loop: Loop, runs: list[Run], weights: Array) -> Array:
    """Return the derivative of `mean_cost` by the weights."""
    costs, slopes = np.zeros(len(runs)), []
    for i, run in enumerate(runs):
        costs[i], by_y, by_x = _cost(run, *loop.respond(run, weights))
        slopes.append(_limited(loop.pull_back(run, weights, by_y, by_x), MOST[0]))
    mean = np.mean(costs**POWER) ** (1.0 / POWER)
    found: Array = (costs / mean) ** (POWER - 1.0) @ np.array(slopes) / len(runs)
    return found


def _cost(run: Run, y: Array, x: Array) -> tuple[float, Array, Array]:
    """Return a run's cost and its derivatives by output and displacement (N,)."""
    cost, by_y = _peak(y, run.peak)
    by_x = np.zeros_like(x)
    rms, allowed = float(np.sqrt(np.mean(y**2))), run.rms
    if rms > allowed:
        cost += BEYOND * (rms / allowed - 1.0) ** 2
        by_y += 2.0 * BEYOND * (rms / allowed - 1.0) / (allowed * rms * len(y)) * y
    drift, by_drift = _peak(x, run.drift)
    if drift > 1.0:
        cost += BEYOND * (drift - 1.0) ** 2
        by_x = 2.0 * BEYOND * (drift - 1.0) * by_drift
    return cost, by_y, by_x


def _peak(y: Array, unit: float) -> tuple[float, Array]:
    """Return a smooth peak of a signal (N,) in a unit, and its derivative."""
    size = np.abs(y)
    most = float(size.max())
    if not (most > 0.0 and np.isfinite(most)):
        return (1e3 if most > 0.0 else 0.0), np.zeros_like(y)
    powers = (size / most) ** (NORM - 1.0)
    total = float(np.sum(powers * size / most)) / SWINGS
    by = np.sign(y) * powers / SWINGS * total ** (1.0 / NORM - 1.0) / unit
    return most * total ** (1.0 / NORM) / unit, by


def _limited(slope: Array, most: float) -> Array:
    """Return a slope that is no longer than allowed, and zero where it is not finite."""
    length = float(np.linalg.norm(slope))
    if not np.isfinite(length):
        return np.zeros_like(slope)
    return slope if length <= most else slope * (most / length)


def _whitening(loop: Loop, runs: list[Run]) -> Whitening:
    """Return what makes a network's inputs alike, as a constant voltage shows them."""
    seen = []
    for run in runs[::4]:
        loop.respond(run, loop.constant(PATIENT))
        seen.append(loop.course.inputs[: len(run.motion.ground) : 10].copy())
    inputs = np.vstack(seen)
    mean, spread = inputs.mean(axis=0), inputs.std(axis=0) + 1e-12
    values, axes = np.linalg.eigh(np.cov(((inputs - mean) / spread).T))
    lengths = np.maximum(np.sqrt(np.maximum(values, 0.0)), THINNEST)
    return Whitening((axes / lengths).T / spread, mean, loop.policy.hidden)

"""The force of a damper as a sum of shapes that all its runs share, with a gain and a zero of each.

A force depends on the velocity, the command and the motion since it last turned. Shapes of these
are what it is linear in: a yield force that turns with the velocity, bristles that deflect with
the motion, each with powers of the command, a viscous force, a spring and a mass. They tell no
parameter; they tell whether runs are of one rig, and recorded alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.arrays import Array
from .measurement import Measurement

_SAMPLES = 1500  # of a run, at most
_WIDTHS = (0.05, 0.3)  # of a yield force's turn, in standard deviations of the velocity
_LENGTHS = np.array([0.03, 0.12, 0.5])  # over which a force builds up, in those of the displacement
_PARTS = 6
_MASS = 0.02  # s; so that an acceleration is about as large as the other shapes
_TURNS = 25  # of gains and shapes


@dataclass(frozen=True, eq=False)
class RunForces:
    """Gain, zero [N] and misfit of each run (n,), and the standard errors of gain and zero."""

    gain: Array
    zero: Array
    misfit: Array
    gain_error: Array
    zero_error: Array


@dataclass(frozen=True, eq=False)
class ForcePart:
    """Shapes (n, s) and force (n,) [N] of a run, with their mean products."""

    shapes: Array
    force: Array
    squares: Array
    product: Array
    mean: Array


def force_parts(runs: Sequence[Measurement], velocities: Sequence[Array]) -> list[ForcePart]:
    """Return the shapes and the force of each run.

    Parameters
    ----------
    runs : with a force
    velocities : (n,) m/s of each run
    """
    every = [max(1, len(run.time) // _SAMPLES) for run in runs]
    forces = [run["force"][::k] for run, k in zip(runs, every, strict=True)]
    return [
        ForcePart(A, f, A.T @ A / len(A), A.T @ f / len(A), A.mean(axis=0))
        for A, f in zip(_shapes(runs, velocities, every), forces, strict=True)
    ]


def fitted_forces(parts: Sequence[ForcePart], sound: Sequence[int]) -> RunForces:
    """Return gain and zero of each run's force against shapes that are fitted to sound runs.

    The median gain of these is 1. Shapes and gains are fitted in turn, by least squares.

    Parameters
    ----------
    parts : of all runs
    sound : which of them the shapes are fitted to
    """
    largest = max(float(np.var(part.force)) for part in parts)
    weights = [1.0 / max(float(np.var(part.force)), 1e-3 * largest) for part in parts]
    gain, zero = np.ones(len(parts)), np.zeros(len(parts))
    theta = np.zeros(parts[0].shapes.shape[1])
    for _ in range(_TURNS):
        left = np.sum([weights[k] * gain[k] ** 2 * parts[k].squares for k in sound], axis=0)
        right = np.sum(
            [
                weights[k] * gain[k] * (parts[k].product - zero[k] * parts[k].mean)
                for k in sound
            ],
            axis=0,
        )  # fmt: skip
        small = 1e-8 * np.trace(left) / len(left) * np.eye(len(left))
        theta = np.linalg.solve(left + small, right)
        for k, part in enumerate(parts):
            mean, power = float(part.mean @ theta), float(theta @ part.squares @ theta)
            level = float(part.force.mean())
            gain[k] = (float(theta @ part.product) - mean * level) / max(power - mean**2, 1e-300)
            zero[k] = level - gain[k] * mean
        size = float(np.median(gain[list(sound)])) or 1.0
        gain, theta = gain / size, theta * size
    predicted = [part.shapes @ theta for part in parts]
    misfit = [
        float(np.std(part.force - g * p) / np.std(part.force))
        for part, g, p in zip(parts, gain, predicted, strict=True)
    ]
    errors = np.array([_errors(p, part.force) for p, part in zip(predicted, parts, strict=True)])
    relative = errors[:, 0] / np.maximum(np.abs(gain), 1e-9)
    return RunForces(gain, zero, np.array(misfit), relative, errors[:, 1])


def _errors(predicted: Array, force: Array) -> tuple[float, float]:
    """Return the standard errors of gain and zero of a run, from its parts that move."""
    moving = 0.05 * float(np.std(predicted))
    parts = [
        np.polyfit(p, f, 1)
        for p, f in zip(
            np.array_split(predicted, _PARTS), np.array_split(force, _PARTS), strict=True
        )
        if float(np.std(p)) > moving
    ]
    if len(parts) < 3:
        return float("inf"), float("inf")
    gain, zero = np.std(parts, axis=0) / np.sqrt(len(parts))
    return float(gain), float(zero)


def _shapes(
    runs: Sequence[Measurement], velocities: Sequence[Array], every: Sequence[int]
) -> list[Array]:
    """Return the shapes (n, s) of each run that a damper's force is linear in, one size in all."""
    motions = [_displacement(run, v) for run, v in zip(runs, velocities, strict=True)]
    speed = float(np.std(np.concatenate(velocities)))
    stroke = float(np.median([np.std(x) for x in motions])) or 1.0
    top = max((float(np.max(np.abs(run[run.drive]))) for run in runs if run.drive), default=0.0)
    out = []
    for run, v, x, k in zip(runs, velocities, motions, every, strict=True):
        rate, motion = v[::k] / speed, x[::k] / stroke
        u = run[run.drive][::k] / top if run.drive and top else np.zeros(len(rate))
        turning = [np.tanh(rate / width) for width in _WIDTHS]
        powers = (np.ones(len(u)), u, u * u)
        columns = [one * power for one in (*turning, *_slips(motion).T) for power in powers]
        push = np.gradient(rate) / (k * run.step) * _MASS
        columns += [rate, rate * u, rate * np.abs(rate), motion, push]
        out.append(np.column_stack(columns))
    used = np.any(np.concatenate(out) != 0.0, axis=0)
    return [one[:, used] for one in out]


def _slips(motion: Array) -> Array:
    """Return the deflections (n, l) of Dahl's bristles, between -1 and 1, that follow a motion."""
    steps = np.diff(motion, prepend=motion[0])
    kept = np.exp(-np.abs(steps)[:, None] / _LENGTHS)
    pulled = np.sign(steps)[:, None] * (1.0 - kept)
    out: Array = np.empty(kept.shape)
    now: Array = np.zeros(len(_LENGTHS))
    for k in range(len(out)):
        now = now * kept[k] + pulled[k]
        out[k] = now
    return out


def _displacement(run: Measurement, velocity: Array) -> Array:
    """Return the displacement (n,) [m] about its mean; without one the integral of the velocity."""
    if run.has("displacement"):
        return run["displacement"] - np.mean(run["displacement"])
    return np.cumsum(velocity - np.mean(velocity)) * run.step

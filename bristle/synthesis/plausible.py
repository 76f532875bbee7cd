"""Whether a design task asks for what its plant can use: warnings, each with the plausible range.

A design may be unusual on purpose, so that these are warnings. What cannot be meant is refused in
`task`. Ranges follow from the plant: its modes, the damper's speed, and how far a unit of command
moves what is weighted.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from ..physics.building import frequencies
from .analysis import hinf_norm
from .damper import coefficients
from .plant import StateSpace, structure
from .task import MOST_SAMPLES, SPEEDS, Task

EFFORT = (1e-4, 10.0)
"""Cost of a command over the acceleration that it can make, both weighted, at the first mode; the
reference designs have 0.02 to 0.05. Below, any command is free; above, none is worth its cost."""
NOISE = (1e-6, 1.0)
"""Noise over the acceleration that a unit of ground acceleration makes at resonance."""
OPEN_LOOP = (1e-3, 1e4)
"""Weighted response to the ground without control: gamma is of this size at most."""


class Reach(NamedTuple):
    """Peak gains of the plant: of the ground on the top level, of a command on top and drift."""

    ground: float
    command: float
    drift: float


def implausible(task: Task) -> list[str]:
    """Return what looks unmeant in a task, a sentence each, with the plausible range.

    Parameters
    ----------
    task : Task

    Returns
    -------
    list of str
        Empty where nothing looks unmeant.
    """
    reach = reach_of(task)
    found = _sampling(task)
    found += _lqg(task, reach) if task.kind == "lqg" else _weights(task, reach)
    return [*found, *(_scheduling(task) if task.kind == "lpv" else [])]


def reach_of(task: Task) -> Reach:
    """Return peak gains over frequency, per unit of command: N, or V for "lpv"."""
    s = structure(task.plant_building, stiffness=task.stiffness, device=task.place)
    gain = 1.0
    if task.kind == "lpv":
        speeds = np.array(task.scheduling.grid)
        gain = float(coefficients(task.damper, speeds, task.scheduling.eps)[1].max())

    def peak(column: int, row: int) -> float:
        part = StateSpace(
            s.A, s.B[:, [column]], s.C[[row]], s.D[np.ix_([row], [column])]
        )  # fmt: skip
        return float(hinf_norm(part))

    return Reach(peak(1, 0), gain * peak(0, 0), gain * peak(0, 1))


def _sampling(task: Task) -> list[str]:
    fastest = frequencies(task.building)[-1]
    shortest = 1.0 / (MOST_SAMPLES * fastest)
    if task.sample_period >= shortest:
        return []
    return [
        f"sample_period = {task.sample_period:g} s takes more than {MOST_SAMPLES} samples in a "
        f"period of the fastest mode, {fastest:.4g} Hz; {shortest:.2g} s or more is plausible."
    ]


def _scheduling(task: Task) -> list[str]:
    s, typical = task.scheduling, task.damper.speed
    low, high = (factor * typical for factor in SPEEDS)
    found = []
    if not low <= s.grid[-1] <= high:
        found.append(
            f"scheduling: the grid ends at {s.grid[-1]:g} m/s; the damper's typical speed is "
            f"{typical:g} m/s, so that {low:.3g} to {high:.3g} m/s is plausible. Faster motion is "
            "taken as the last speed."
        )
    if s.eps > s.grid[-1]:
        found.append(
            f"scheduling: eps = {s.eps:g} m/s smooths the sign function beyond the whole grid; "
            f"less than {s.grid[1]:g} m/s, the first speed of the grid, is plausible."
        )
    return found


def _weights(task: Task, reach: Reach) -> list[str]:
    first = np.array([2.0 * pi * frequencies(task.building)[0]])
    unit = "1/V" if task.kind == "lpv" else "1/N"
    acceleration = float(np.abs(task.weights.acceleration.response(first))[0])
    command = float(np.abs(task.weights.command.response(first))[0])
    found = []
    open_loop = acceleration * reach.ground
    if not OPEN_LOOP[0] <= open_loop <= OPEN_LOOP[1]:
        low, high = (limit / reach.ground for limit in OPEN_LOOP)
        found.append(
            f"weights: the weight on the acceleration is {acceleration:.3g} s2/m at the first "
            f"mode; the ground moves the top level up to {reach.ground:.3g} times its own "
            f"acceleration, so that {low:.1g} to {high:.1g} s2/m is plausible."
        )
    worth = acceleration * reach.command
    if not EFFORT[0] <= command / worth <= EFFORT[1]:
        low, high = (limit * worth for limit in EFFORT)
        why = "no command is worth its cost" if command > worth else "any command is nearly free"
        found.append(
            f"weights: the weight on the command is {command:.3g} {unit} at the first mode: {why}. "
            f"With this acceleration weight and plant {low:.1g} to {high:.1g} {unit} is plausible."
        )
    return [*found, *_noise("weights", task.weights.noise, reach)]


def _lqg(task: Task, reach: Reach) -> list[str]:
    w = task.lqg
    worth = w.acceleration * reach.command**2 + w.drift * reach.drift**2
    found = []
    if not EFFORT[0] ** 2 <= w.force / worth <= EFFORT[1] ** 2:
        low, high = (limit**2 * worth for limit in EFFORT)
        why = "no force is worth its cost" if w.force > worth else "any force is nearly free"
        found.append(
            f"lqg: force = {w.force:g}: {why}. With these weights on acceleration and drift, and "
            f"this plant, {low:.1g} to {high:.1g} is plausible."
        )
    return [*found, *_noise("lqg", w.noise / w.ground, reach)]


def _noise(where: str, noise: float, reach: Reach) -> list[str]:
    low, high = (limit * reach.ground for limit in NOISE)
    if low <= noise <= high:
        return []
    what = "noise" if where == "weights" else "noise over ground"
    return [
        f"{where}: {what} = {noise:g} m/s2; a ground acceleration of 1 m/s2 makes up to "
        f"{reach.ground:.3g} m/s2, so that {low:.1g} to {high:.1g} is plausible."
    ]

"""The runs of a training: a motion each, on a building and damper that may be the wrong ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from scipy import linalg

from bristle.component.control_laws import BESIDES, LARGEST, weight_count
from bristle.core.arrays import Array
from bristle.core.jit import compiled
from bristle.physics import damper
from bristle.physics.building import Building
from bristle.physics.tuples import Setup
from bristle.synthesis.damper import DesignDamper
from bristle.synthesis.plant import structure

from .adjoint import PULL_BACK, RESPOND, compute
from .closed_loop import STATES, Course, Motion, Plant, Policy
from .training import PolicyTask

PATIENT = 0.25
"""Constant voltage under which signals are looked at first, as a share of the largest."""


@dataclass
class Run:
    """A motion, building and damper, and what the clipped-optimal controller makes of them.

    `peak` and `rms` [m/s2] are those of the floor's absolute acceleration, `drift` [m] is the
    damper's largest displacement.
    """

    plant: Plant
    setup: Setup
    motion: Motion
    peak: float = 1.0
    rms: float = 1.0
    drift: float = 1.0


class Loop:
    """A policy in closed loop with any run, and the derivative of what comes out.

    Parameters
    ----------
    policy : Policy
    longest : int
        Samples of the longest motion.
    given : DesignDamper
    m : int
        States of the building.
    """

    def __init__(self, policy: Policy, longest: int, given: DesignDamper, m: int) -> None:
        self.policy = policy
        functions = damper.functions_of(given.kind.name, given.effects)
        self._run = compiled(functions.link(compute))
        states = damper.start_states(given.kind.name, given.values, functions.slots)
        n, k = policy.n, len(states)
        N, count = longest, n + BESIDES
        self.course = Course(
            np.zeros((N, m)), np.zeros((N, k)), np.zeros((N, 4)), np.zeros((N, 4)),
            np.zeros((N, n)), np.zeros(N), np.zeros(N), np.zeros((N, count)),
            np.zeros((N, policy.hidden)), np.zeros((N, m)), np.zeros((N, k)), np.zeros((N, 4)),
            np.zeros((N, n)), np.zeros(N), np.zeros(count), np.zeros(0, dtype=np.int64),
            np.zeros((2, STATES)), np.zeros(STATES), np.zeros((3, k)), np.zeros(damper.room(k)),
        )  # fmt: skip
        self.course.z[0] = states
        self.eps = np.zeros(STATES)

    def respond(self, run: Run, weights: Array) -> tuple[Array, Array]:
        """Return floor acceleration [m/s2] and the damper's displacement [m], (N,) each."""
        self._compute(RESPOND, run, weights)
        N = len(run.motion.ground)
        return self.course.measured[:N, 0], self.course.measured[:N, 1]

    def pull_back(self, run: Run, weights: Array, by_y: Array, by_x: Array) -> Array:
        """Return what the weights do to a sum; after `respond`.

        Parameters
        ----------
        run : Run
        weights : (w,) array
        by_y, by_x : (N,) arrays
            Derivatives of the sum by output and damper's displacement at the samples.

        Returns
        -------
        slope : (w,) array
        """
        slope = np.zeros_like(weights)
        self._compute(PULL_BACK, run, weights, by_y, by_x, slope)
        return slope

    def constant(self, share: float) -> Array:
        """Return the weights of a constant voltage, a share of the largest within 0 and 1."""
        weights = np.zeros(weight_count(self.policy.n, self.policy.hidden))
        weights[-1] = np.log(share / (1.0 - share))
        return weights

    def learn_states(self, run: Run) -> None:
        """Note which states of the damper move, and by which small changes slopes are taken."""
        lively = self.constant(PATIENT)
        lively[-1 - self.policy.n - BESIDES] = 3.0
        self.respond(run, lively)
        c, N = self.course, len(run.motion.ground)
        active = np.flatnonzero(np.ptp(c.z[:N], axis=0) > 0.0)
        x, v = (float(np.abs(c.measured[:N, i]).max()) for i in (1, 2))
        force = float(np.abs(c.measured[:N, 3]).max())
        sizes = [x, v, float(self.policy.scales[LARGEST]), x, v, force, force]
        sizes += np.abs(c.z[:N, active]).max(axis=0).tolist()
        self.eps = 1e-6 * np.array(sizes) + 1e-15
        table = np.zeros((2 + len(active), STATES + len(active)))
        self.course = c._replace(active=active, table=table)

    def refer(self, run: Run) -> None:
        """Note what this loop makes of a run, as what others are compared with."""
        y, x = self.respond(run, self.policy.weights)
        run.peak, run.drift = float(np.abs(y).max()), float(np.abs(x).max())
        run.rms = float(np.sqrt(np.mean(y**2)))

    def _compute(
        self, task: int, run: Run, weights: Array, by_y: Any = None, by_x: Any = None,
        slope: Any = None,
    ) -> None:  # fmt: skip
        none = np.zeros(0)
        self._run(
            task, run.plant, run.setup, self.policy._replace(weights=weights), run.motion,
            self.course, none if by_y is None else by_y, none if by_x is None else by_x, self.eps,
            none if slope is None else slope,
        )  # fmt: skip


def plant_of(task: PolicyTask, random: np.random.Generator | None = None) -> Plant:
    """Return the task's building over a sample; with `random`, one with wrong parameters."""
    building = task.plant_building
    if random is not None:
        building = _changed(building, task.motions.spread, random)
    s, h = structure(building, device=task.place), task.sample_period
    m = len(s.A)
    both = np.zeros((m + 3, m + 3))
    both[:m, :m], both[:m, m : m + 2], both[m + 1, m + 2] = s.A, s.B, 1.0 / h
    stepped = linalg.expm(both * h)
    ground_1 = stepped[:m, m + 2].copy()
    phi, push, ground_0 = stepped[:m, :m].copy(), stepped[:m, m].copy(), stepped[:m, m + 1]
    ground_0 = ground_0 - ground_1
    y, x, v = (row.copy() for row in s.C)
    return Plant(
        h, phi, push, ground_0, ground_1, x, v, y, float(s.D[0, 0]), v @ phi, float(v @ ground_0),
        float(v @ ground_1), float(v @ push),
    )  # fmt: skip


def _changed(building: Building, spread: float, random: np.random.Generator) -> Building:
    """Return a building whose masses and stiffnesses are wrong by up to a share."""

    def changed(matrix: Any) -> Any:
        roots = np.sqrt(1.0 + spread * random.uniform(-1.0, 1.0, building.size))
        found = np.array(matrix) * np.outer(roots, roots)
        return tuple(tuple(row) for row in found.tolist())

    return building._replace(M=changed(building.M), K=changed(building.K))


def setup_of(
    given: DesignDamper, spread: float, random: np.random.Generator | None = None
) -> Setup:
    """Return a damper for compiled code; with `random`, one with wrong parameters."""
    values = {**given.values, **given.parameters()}
    if random is not None:
        for name, parameter in given.kind.parameters.items():
            if parameter.unit != "1":
                factor = 1.0 + spread * random.uniform(-1.0, 1.0)
                values[name] = min(max(values[name] * factor, parameter.bounds[0]),
                                   parameter.bounds[1])  # fmt: skip
    own = damper.setup_of(given.kind.name, values, given.effects)
    return own._replace(
        p=np.array(own.p, dtype=np.float64),
        on=np.array([bool(switch) for switch in own.on], dtype=np.int8),
        moving=np.array(own.moving, dtype=np.int64),
    )


def disturbed(
    loop: Loop, run: Run, task: PolicyTask, random: np.random.Generator, worst: bool = False
) -> Run:
    """Return a run with wrong parameters, noise and delay, referred to the undisturbed one.

    Parameters
    ----------
    loop, run, task : Loop, Run, Task
    random : generator of the draws
    worst : with the whole delay, else any up to it
    """
    motions = task.motions
    most = ceil(motions.delay / task.sample_period - 1e-9)
    loop.respond(run, loop.constant(PATIENT))
    N = len(run.motion.ground)
    sizes = motions.noise * np.abs(loop.course.measured[:N]).max(axis=0)
    noise = random.standard_normal((N, 4)) * sizes
    delay = most if worst else int(random.integers(0, most + 1))
    return Run(
        plant_of(task, random), setup_of(task.damper, motions.spread, random),
        Motion(run.motion.ground, noise, delay), run.peak, run.rms, run.drift,
    )  # fmt: skip

"""What a policy is trained on and how: a design file with a table [motions]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import ceil, isfinite, log
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg

from bristle.component.control_laws import BESIDES, LARGEST, weight_count
from bristle.component.controller_file import POLICY
from bristle.core.arrays import Array
from bristle.core.config import ANY, Document, Spec
from bristle.core.jit import compiled
from bristle.data.ground_motion import GroundMotion, read_ground_motion
from bristle.errors import DesignError, RecordError
from bristle.physics import damper
from bristle.physics.building import Building
from bristle.physics.tuples import Setup
from bristle.synthesis.damper import DesignDamper
from bristle.synthesis.design_file import task_of
from bristle.synthesis.plant import structure
from bristle.synthesis.task import Task

from .closed_loop import PULL_BACK, RESPOND, STATES, Course, Motion, Plant, Policy, compute

ALIKE = 1e-3
"""Largest difference, as a share of the peak, of two records that are the same motion."""


@dataclass(frozen=True)
class Training:
    """The motions of a training, and its size.

    Attributes
    ----------
    synthetic : int
        Number of synthetic motions.
    records : tuple of str
        Names or files of ground motions that train beside them, each at four intensities.
    reported : tuple of str
        Those that the controller will be judged on: refused among `records`.
    weakest, strongest : float
        Peak ground acceleration over the damper's largest force per mass of the building.
    spread, noise, delay : float
        Wrong parameters (share), noise (share of a signal's peak) and delay [s] up to which seven
        of ten motions are trained.
    hidden, rounds, seed : int
        Hidden units of the network; steps of the descent; what the draws follow.
    folder : Path
        What relative paths of records are relative to.
    """

    synthetic: int = 0
    records: tuple[str, ...] = ()
    reported: tuple[str, ...] = ()
    weakest: float = 0.4
    strongest: float = 2.4
    spread: float = 0.1
    noise: float = 0.01
    delay: float = 0.004
    hidden: int = 16
    rounds: int = 600
    seed: int = 1
    folder: Path = Path()

    def __post_init__(self) -> None:
        for name, (low, high) in {
            "synthetic": (0, 10_000), "weakest": (1e-3, 1e3), "strongest": (self.weakest, 1e3),
            "spread": (0.0, 0.5), "noise": (0.0, 1.0), "delay": (0.0, 1.0), "hidden": (0, 200),
            "rounds": (1, 100_000), "seed": (0, 2**32 - 1),
        }.items():  # fmt: skip
            value = getattr(self, name)
            whole = isinstance(getattr(type(self), name), int)
            if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
                kind = "whole number" if whole else "number"
                raise DesignError(f"motions: {name} = {value!r}: expected a {kind}.")
            if not (isfinite(value) and low <= value <= high):
                raise DesignError(f"motions: {name} = {value!r} lies outside {low:g} .. {high:g}.")
        for name in ("records", "reported"):
            if not isinstance(value := getattr(self, name), list | tuple):
                raise DesignError(
                    f"motions: {name} = {value!r}: expected a list of names or files."
                )
        if not self.synthetic and not self.records:
            raise DesignError(
                "motions: there is none to train on; synthetic = 300 is usual, records = "
                '["kobe_1995_nishi_akashi_000"] adds a record.'
            )

    def recorded(self) -> list[GroundMotion]:
        """Return the records to train on.

        Raises
        ------
        DesignError
            If one cannot be read, or is among those that are reported.
        """
        found = {name: self._read(name) for name in self.records}
        for other in self.reported if found else ():
            shown = found.get(other) or self._read(other)
            seen = [name for name, motion in found.items() if same_motion(motion, shown)]
            if seen:
                raise DesignError(
                    f"motions: {', '.join(seen)} is trained on and reported ({other}); a policy "
                    "is judged on motions that it has not seen. Take it out of one of the lists."
                )
        return list(found.values())

    def _read(self, name: str) -> GroundMotion:
        try:
            return read_ground_motion(name, self.folder)
        except RecordError as error:
            raise DesignError(f"motions: {error}") from None

    def data(self) -> dict[str, object]:
        """Return the table of a design file."""
        content = {name: value for name, value in vars(self).items() if name != "folder"}
        return {**content, "records": list(self.records), "reported": list(self.reported)}


def same_motion(a: GroundMotion, b: GroundMotion) -> bool:
    """Return whether two records are one motion, whatever their names, files and scales."""
    if a.name == b.name:
        return True
    time = a.time - a.time[0]
    other = np.interp(time, b.time - b.time[0], b.acceleration / b.peak, right=0.0)
    return float(np.abs(a.acceleration / a.peak - other).max()) < ALIKE


@dataclass(frozen=True)
class PolicyTask(Task):
    """A training: building, damper and motions.

    Like an LQG design a policy takes the measured force, which holds what the damper's springs do:
    so it is a task of that kind, without its weights.
    """

    kind: str = "lqg"
    motions: Training = field(default_factory=lambda: Training(synthetic=300))

    def data(self) -> dict[str, Any]:
        """Return the task as the content of a design file, the building by name."""
        content = {**super().data(), "kind": POLICY, "motions": self.motions.data()}
        del content["lqg"]
        return content


def read_policy_task(path: Path) -> PolicyTask:
    """Return the training that a design file describes.

    Raises
    ------
    DesignError, PhysicsError
        Naming the file and what was expected.
    """
    document = Document(path, DesignError)
    data = document.data
    if data.get("kind") != POLICY or "lqg" in data:
        document.error(("kind",), f'expected kind = "{POLICY}" and a table [motions].')
    elif not isinstance(data.get("motions"), Mapping):
        document.error(("motions",), "a policy is trained on motions: expected a table [motions].")
    document.check()
    every = {one.name: ANY._replace(default=one.default) for one in fields(Training)[:-1]}
    found = document.read(Spec(every), ("motions",), data.pop("motions"))
    document.check()
    try:
        motions = Training(**found, folder=path.parent)
    except DesignError as error:
        document.error_of(("motions",), str(error))
        document.check()
        raise
    data["kind"] = "lqg"
    return PolicyTask(**vars(task_of(document, path.parent)), motions=motions)


# Synthetic ground motions for a training: of many kinds, so that no one kind is learnt.

SECONDS = 10.0
"""Length of a motion of the training."""
_STEP, _WHOLE = 0.005, 16.0


def synthetic(random: np.random.Generator, h: float) -> Array:
    """Return a ground acceleration (N,) at 0, h, ... with the peak 1.

    White noise is filtered by a layer of ground (Kanai 1957, Tajimi 1960) with a high-pass (Clough
    & Penzien), under an envelope that swells and fades. Half of the motions carry a near-fault
    pulse after Mavroeidis & Papageorgiou (2003), Bull. Seism. Soc. Am. 93(3).

    Parameters
    ----------
    random : generator of the draws
    h : step [s]
    """
    t: Array = np.arange(round(_WHOLE / _STEP)) * np.float64(_STEP)
    a = _filtered(random, t) * _envelope(random, t)
    a /= np.abs(a).max()
    if random.random() < 0.5:
        a = a * random.uniform(0.2, 0.9) + _pulse(random, t)
        a /= np.abs(a).max()
    found: Array = np.interp(np.arange(round(SECONDS / h) + 1) * h, t, a)
    return found


def at_samples(motion: GroundMotion, h: float) -> Array:
    """Return a record (N,) at 0, h, ... with the peak 1; it ends with its strong part."""
    t = motion.time - motion.time[0]
    square = np.cumsum(np.square(motion.acceleration[1:]) * np.diff(t))
    strong = t[1 + int(np.searchsorted(square, 0.95 * square[-1]))]
    grid = np.arange(round(min(strong + 2.0, t[-1]) / h) + 1) * h
    found: Array = np.interp(grid, t, motion.acceleration / motion.peak)
    return found


def _between(random: np.random.Generator, low: float, high: float) -> float:
    """Return a draw that is even over the logarithm."""
    return float(np.exp(random.uniform(log(low), log(high))))


def _filtered(random: np.random.Generator, t: Array) -> Array:
    w = 2.0 * np.pi * np.fft.rfftfreq(len(t), _STEP)
    s = 1j * w / _between(random, 6.0, 40.0)
    damping = random.uniform(0.25, 0.9)
    gain = (1.0 + 2.0 * damping * s) / (1.0 + 2.0 * damping * s + s**2)
    low = w / random.uniform(0.7, 3.0)
    gain *= low**2 / (1.0 - low**2 + 1.4j * low)
    gain /= 1.0 + (w / (2.0 * np.pi * random.uniform(6.0, 20.0))) ** 4
    found: Array = np.fft.irfft(np.fft.rfft(random.standard_normal(len(t))) * gain, len(t))
    return found


def _envelope(random: np.random.Generator, t: Array) -> Array:
    rise = random.uniform(0.7, 2.5)
    fall, fading = rise + random.uniform(2.0, 6.0), random.uniform(1.0, 3.0)
    shape = np.where(t < fall, np.minimum(t / rise, 1.0) ** 2, np.exp((fall - t) / fading))
    swell, period, phase = random.uniform((0.0, 1.5, 0.0), (0.8, 5.0, 2.0 * np.pi))
    found: Array = shape * np.exp(swell * np.cos(2.0 * np.pi * t / period + phase))
    return found


def _pulse(random: np.random.Generator, t: Array) -> Array:
    period, cycles = _between(random, 0.35, 2.5), random.uniform(1.0, 2.5)
    at, phase = t - random.uniform(2.0, 4.5), random.uniform(0.0, 2.0 * np.pi)
    bell = 0.5 * (1.0 + np.cos(2.0 * np.pi * at / (cycles * period)))
    bell[np.abs(at) >= cycles * period / 2.0] = 0.0
    found: Array = bell * np.cos(2.0 * np.pi * at / period + phase)
    return found


# The runs of a training: a motion each, on a building and damper that may be the wrong ones.

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

"""Design of a policy: motions and runs, the training, and the controller that comes of it."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from scipy import linalg

from bristle.component.control_laws import weight_count
from bristle.component.controller_file import POLICY, Controller, building_digest
from bristle.core.arrays import Array
from bristle.core.progress import counted, tell
from bristle.errors import DesignError
from bristle.synthesis.analysis import DesignResult, flat, pole_list
from bristle.synthesis.damper import Bank, coefficients
from bristle.synthesis.kinds import design_hinf
from bristle.synthesis.plant import StateSpace, structure
from bristle.synthesis.task import Task

from .closed_loop import Motion, Policy
from .descent import Outcome, descend, peak_ratios
from .training import (
    Loop,
    PolicyTask,
    Run,
    Training,
    at_samples,
    disturbed,
    plant_of,
    setup_of,
    synthetic,
)

LEVEL_LASTS = 8.0
"""How long the output's level is remembered [s]."""
INTENSITIES = 4
"""Intensities at which a record trains."""
DISTURBED = 7
"""Of ten runs, those with wrong parameters, noise and delay."""
CHOOSING = 6
"""One held-out motion for so many of the training; at least `FEWEST`."""
FEWEST = 8
LEAST, FAST = 0.025, 2.5
"""Least level in the damper's largest force per mass; typical speed in that of the damper's law."""
THRESHOLD = 0.05
"""Command that the clipped-optimal switch answers, as a share of the damper's largest force."""
SPEEDS = np.linspace(0.0, 0.4, 41)
"""Where it is looked for a force that follows the voltage [m/s]."""


def design_policy(task: PolicyTask) -> DesignResult:
    """Return a trained policy from what every controller measures to a voltage.

    Parameters
    ----------
    task : PolicyTask
        With the motions.

    Raises
    ------
    DesignError
        If the damper's force does not follow the voltage, a record cannot be read or is reported,
        there is no H-infinity design to compare with, or training does not beat the clipped-optimal
        controller on the motions held out.
    """
    training = task.motions
    s, h = structure(task.plant_building, device=task.place), task.sample_period
    largest = _largest_force(task)
    unit = largest / float(np.sum(np.array(task.building.M)))
    policy = _policy(task, s, largest, unit)
    grounds, held_out = _grounds(training, unit, h)
    longest = max(map(len, [*grounds, *held_out]))
    loop = Loop(policy, longest, task.damper, len(s.A))
    tell("compiling the closed loop, once")
    runs, choosing = ([_run(task, ground) for ground in each] for each in (grounds, held_out))
    loop.learn_states(runs[0])
    reference = _clipped(task, loop, longest, THRESHOLD * largest)
    for run in counted([*runs, *choosing], "clipped-optimal control: motion"):
        reference.refer(run)
    random = np.random.default_rng([training.seed, 1])
    for i in range(len(runs)):
        if i % 10 < DISTURBED:
            runs[i] = disturbed(loop, runs[i], task, random)
    worst = [disturbed(loop, run, task, random, worst=True) for run in choosing]
    outcome = descend(loop, runs, choosing + worst, training.rounds, random)
    facts = _facts(loop, choosing, worst, outcome)
    facts |= {"motions": len(grounds), "weights": weight_count(policy.n, training.hidden)}
    return _packed(task, policy, outcome, facts)


def _largest_force(task: PolicyTask) -> float:
    """Return the damper's largest force in steady sliding [N]; refuse one without voltage."""
    steady, per_volt = coefficients(task.damper, SPEEDS, 1e-3)
    if not per_volt.any():
        raise DesignError(
            f"damper: the force of {task.damper.law!r} does not follow the voltage; there is "
            "nothing to train. A parameter per volt above 0 is right."
        )
    return float(np.max(steady * SPEEDS + per_volt * task.damper.v_max))


def _policy(task: PolicyTask, s: StateSpace, largest: float, unit: float) -> Policy:
    """Return the policy without weights.

    Parameters
    ----------
    task, s : Task, and its building
    largest, unit : the damper's largest force [N], and that per mass of the building [m/s2]
    """
    A, B = estimator(s, task.sample_period)
    keep = np.exp(-task.sample_period / LEVEL_LASTS)
    scales = np.array(
        [keep, LEAST * unit, largest, unit, FAST * task.damper.speed, task.damper.v_max]
    )
    A, B, scales = (np.array(flat(each)) for each in (A, B, scales))
    n = len(s.A) + 2 * len(GROUNDS)
    return Policy(False, 0.0, n, task.motions.hidden, A, B, np.zeros(0), scales)


def _packed(
    task: PolicyTask, policy: Policy, outcome: Outcome, facts: dict[str, object]
) -> DesignResult:
    """Return the result; its bank holds the estimator."""
    n, h = policy.n, float(task.sample_period)
    A, B = policy.A.reshape(n, n), policy.B.reshape(n, 4)
    poles = np.asarray(np.log(np.linalg.eigvals(A).astype(complex)) / h, dtype=complex)
    controller = Controller(
        kind=POLICY, title=task.title, n=n, rows=1, v_top=0.0, sample_period=h,
        A=policy.A.tolist(), B=policy.B.tolist(), W=flat(outcome.weights),
        C=policy.scales.tolist(),
        facts={"building": task.building.name, "task": task.digest(), **facts,
               "poles": pole_list(poles)},
        design=task.data(), building=building_digest(task.building),
    )  # fmt: skip
    slow = np.real(linalg.logm(A)) / h
    bank = Bank(slow[None], B[None, :, :1], B[None, :, 3:], np.zeros((1, 1, n)))
    return DesignResult(task, controller, np.zeros(1), [], bank, None)


def _grounds(training: Training, unit: float, h: float) -> tuple[list[Array], list[Array]]:
    """Return ground accelerations [m/s2] to train on, and others to choose by.

    Parameters
    ----------
    training : Training
    unit : acceleration [m/s2] that intensities are told in
    h : sample period [s]
    """
    random = np.random.default_rng([training.seed, 0])
    low, high = np.log(training.weakest * unit), np.log(training.strongest * unit)

    def drawn(count: int) -> list[Array]:
        return [synthetic(random, h) * np.exp(random.uniform(low, high))
                for _ in range(count)]  # fmt: skip

    peaks = np.exp(np.linspace(low, high, INTENSITIES))
    records = [at_samples(motion, h) for motion in training.recorded()]
    found = drawn(training.synthetic) + [peak * record for record in records for peak in peaks]
    return found, drawn(max(FEWEST, len(found) // CHOOSING))


def _clipped(task: PolicyTask, loop: Loop, longest: int, f_min: float) -> Loop:
    """Return the clipped-optimal switch on the H-infinity design of the same building in closed
    loop; the design's weights are its default."""
    plant = {each.name: getattr(task, each.name) for each in fields(Task)}
    c = design_hinf(Task(**{**plant, "kind": "hinf"})).controller
    scales = loop.policy.scales
    law = Policy(True, f_min, c.n, 0, np.array(c.A), np.array(c.B), np.array(c.C), scales)
    return Loop(law, longest, loop.course.z[0].tolist(), loop.course.x.shape[1])


def _run(task: PolicyTask, ground: Array) -> Run:
    motion = Motion(ground, np.zeros((len(ground), 4)), 0)
    return Run(plant_of(task), setup_of(task.damper, 0.0), motion)


def _facts(
    loop: Loop, choosing: list[Run], worst: list[Run], outcome: Outcome
) -> dict[str, object]:
    """Return what a training reached; refuse one that reached nothing."""
    clean, wrong = (peak_ratios(loop, runs, outcome.weights) for runs in (choosing, worst))
    if float(clean.mean()) >= 1.0:
        raise DesignError(
            f"policy: on {len(choosing)} motions held out the mean peak is "
            f"{clean.mean():.3g} times that of the clipped-optimal controller: nothing was gained. "
            "More synthetic motions or rounds would help."
        )
    return {
        "held_out": len(choosing),
        "peak_ratio": float(f"{clean.mean():.4g}"),
        "peak_ratio_disturbed": float(f"{wrong.mean():.4g}"),
        "peak_ratio_trained": float(f"{outcome.trained:.4g}"),
        "chosen_round": outcome.chosen,
    }


# The policy's estimator: a Kalman filter of the building and of the ground that shakes it.

GROUNDS = ((5.0, 0.5), (25.0, 0.5))
"""Corner [rad/s] and damping ratio of the layers whose sum the ground motion is taken for."""
NOISE = (0.04, 1e-4, 1e-3)
"""Noise of floor acceleration [m/s2], displacement [m] and velocity [m/s] beside white noise of
1 m/s2 s^0.5 under each layer: only the ratio counts."""


def estimator(structure: StateSpace, h: float) -> tuple[Array, Array]:
    """Return A (n, n) and B (n, 4) of x_k = A x_k-1 + B m_k.

    The states are the building's and two of each layer of ground (Kanai 1957, Tajimi 1960); m holds
    floor acceleration [m/s2], displacement [m], velocity [m/s] and force [N] of the damper. The
    force is that of the interval before the sample.

    Parameters
    ----------
    structure : as `plant.structure` returns it, m states
    h : sample period [s]

    Raises
    ------
    DesignError
        If the filter's Riccati equation has no solution.
    """
    m = len(structure.A)
    n = m + 2 * len(GROUNDS)
    A, push, shaken = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((n, len(GROUNDS)))
    A[:m, :m], push[:m, 0] = structure.A, structure.B[:, 0]
    for k, (corner, damping) in enumerate(GROUNDS):
        at = m + 2 * k
        A[at : at + 2, at : at + 2] = [[0.0, 1.0], [-(corner**2), -2.0 * damping * corner]]
        A[:m, at] = structure.B[:, 1] * corner**2
        A[:m, at + 1] = structure.B[:, 1] * 2.0 * damping * corner
        shaken[at + 1, k] = 1.0
    seen = np.zeros((3, n))
    seen[:, :m] = structure.C
    stepped = linalg.expm(np.block([[A, push], [np.zeros((1, n + 1))]]) * h)
    phi, gamma = stepped[:n, :n], stepped[:n, n:]
    # The noise's covariance over a sample, after Van Loan (1978), IEEE TAC 23(3).
    both = linalg.expm(np.block([[-A, shaken @ shaken.T], [np.zeros((n, n)), A.T]]) * h)
    noisy = both[n:, n:].T @ both[:n, n:]
    R = np.diag(np.square(NOISE))
    try:
        P = linalg.solve_discrete_are(phi.T, seen.T, noisy + 1e-12 * np.eye(n), R)
        gain = np.linalg.solve(seen @ P @ seen.T + R, seen @ P).T
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(f"policy: the estimator's Riccati equation: {error}.") from None
    rest = np.eye(n) - gain @ seen
    direct = gain @ structure.D[:, :1]
    return rest @ phi, np.hstack([gain, rest @ gamma - direct])

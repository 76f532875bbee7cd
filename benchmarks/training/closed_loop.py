"""A building with a damper under a trained policy: the response, sample by sample.

Written in plain Python and compiled by `jit`. The building's step is exact for a force held over
it; the damper moves on by its own step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from bristle.component.control_laws import (
    BESIDES,
    KEEP,
    LARGEST,
    LEAST_LEVEL,
    advance,
    clipped_voltage,
    command,
    estimate,
    policy_inputs,
    recent_level,
    voltage_share,
)
from bristle.physics.damper import force_at
from bristle.physics.damper import step as damper_step
from bristle.physics.linear import dot
from bristle.physics.tuples import Inputs, record

FLOOR, DISPLACEMENT, VELOCITY, PUSHED = range(4)
"""Places of what is measured."""
X_0, V_0, V, X_1, V_1, REST, STICK, STATES = range(8)
"""What force and step of the damper follow: motion at begin and end, voltage, the force that would
bring it to rest at the end and that which would keep it there, and its states."""


class Plant(NamedTuple):
    """A building with m states over a step of `h` [s].

    `coming` (m,), `coming_0`, `coming_1` give the damper's speed at its end without force; `gain`
    [m/s/N] is what a held force adds to it.

    `phi` (m, m); `push`, `ground_0`, `ground_1` (m,): what the held force and the ground's
    acceleration at begin and end add; `displacement`, `velocity`, `output` (m,): rows of the
    damper's motion and of the floor's absolute acceleration, to which the force adds `direct`
    times itself.
    """

    h: float
    phi: Any
    push: Any
    ground_0: Any
    ground_1: Any
    displacement: Any
    velocity: Any
    output: Any
    direct: float
    coming: Any
    coming_0: float
    coming_1: float
    gain: float


class Policy(NamedTuple):
    """A policy: A (n n), B (n 4), weights and scales flat as in `component.control_laws`; hidden
    units.

    With `clipped` it is the clipped-optimal switch instead, on a linear law: A (n n), B (n,), the
    command's row as weights, `f_min` [N].
    """

    clipped: bool
    f_min: float
    n: int
    hidden: int
    A: Any
    B: Any
    weights: Any
    scales: Any


class Motion(NamedTuple):
    """Ground acceleration (N,) [m/s2], the sensors' noise (N, 4), and their delay in samples."""

    ground: Any
    noise: Any
    delay: int


class Course(NamedTuple):
    """A response at N samples, and room for its adjoint.

    `x` (N, m), `z` (N, k) states of building and damper; `measured` (N, 4) true values; `seen`
    (N, 4) with noise and delay; `e` (N, n) estimate; `level`, `voltage` (N,); `inputs` (N, n + 3),
    `units` (N, hidden) of the network. `by_...` are derivatives by the same; `table` (2 + q, 7 + q)
    those of the damper, whose `active` (q,) states move, `work` its room.
    """

    x: Any
    z: Any
    measured: Any
    seen: Any
    e: Any
    level: Any
    voltage: Any
    inputs: Any
    units: Any
    by_x: Any
    by_z: Any
    by_measured: Any
    by_e: Any
    by_level: Any
    by_inputs: Any
    active: Any
    table: Any
    given: Any
    states: Any
    work: Any


def held_force(plant: Any, setup: Any, u: Any, z: Any, work: Any) -> float:
    """Return the damper's force [N] that is held over a step.

    Parameters
    ----------
    plant, setup : Plant, Setup
    u : (7,) as `X_0` ... number them
    z, work : (k,) states; room to work
    """
    now = record(Inputs, (u[X_0], u[V_0], 0.0, u[V], plant.h, 0.0, u[REST], True))
    return force_at(setup, now, z, work)[0]


def stepped(plant: Any, setup: Any, u: Any, z0: Any, z1: Any, work: Any) -> float:
    """Move the damper on by a step; return its force at the end [N], the voltage still held.

    Parameters
    ----------
    plant, setup, u, work : as in `held_force`
    z0, z1 : (k,) states at begin and end, the latter filled
    """
    a = (u[V_1] - u[V_0]) / plant.h
    begin = record(Inputs, (u[X_0], u[V_0], a, u[V], plant.h, 0.0, u[STICK], True))
    end = record(Inputs, (u[X_1], u[V_1], a, u[V], plant.h, 0.0, u[STICK], True))
    return damper_step(setup, begin, end, z0, z1, work)[0]


def free_speed(plant: Any, x: Any, g_0: float, g_1: float) -> float:
    """Return the damper's speed [m/s] after a step without force.

    Parameters
    ----------
    plant : Plant
    x : (m,) states of the building before the step
    g_0, g_1 : ground acceleration at its ends [m/s2]
    """
    found: float = dot(plant.coming, x) + plant.coming_0 * g_0 + plant.coming_1 * g_1
    return found


def chosen_voltage(policy: Any, course: Any, k: int) -> float:
    """Return the voltage [V] of sample k; the estimate, the level and what the network does follow.

    Parameters
    ----------
    policy : Policy
    course : Course; what is seen is given up to this sample
    k : number of the sample
    """
    n, inputs, scales = policy.n, policy.n + BESIDES, policy.scales
    seen, e = course.seen[k], course.e[k]
    for i in range(n):
        e[i] = course.e[k - 1, i] if k > 0 else 0.0
    if policy.clipped:
        asked = command(n, policy.weights, 0, e)
        switched: float = clipped_voltage(asked, seen[PUSHED], policy.f_min, scales[LARGEST])
        advance(n, policy.A, policy.B, policy.B, 0, e, (seen[FLOOR], 0.0), course.inputs[k])
        return switched
    estimate(n, policy.A, policy.B, seen, e, course.inputs[k])
    level = max(course.level[k - 1] if k > 0 else 0.0, scales[LEAST_LEVEL])
    level = recent_level(level, seen[FLOOR], scales[KEEP])
    course.level[k] = level
    policy_inputs(n, e, level, seen, scales, course.inputs[k])
    found: float = scales[LARGEST] * voltage_share(
        inputs, policy.hidden, course.inputs[k], policy.weights, course.units[k]
    )
    return found


def respond(plant: Any, setup: Any, policy: Any, motion: Any, course: Any) -> None:
    """Fill in the response from rest.

    Parameters
    ----------
    plant, setup, policy, motion : Plant, Setup, Policy, Motion
    course : Course; the damper's states at the first sample are given
    """
    m, N = len(plant.phi), len(motion.ground)
    gain = plant.gain
    u = course.given
    for i in range(m):
        course.x[0, i] = 0.0
    for i in range(STATES):
        u[i] = 0.0
    force = held_force(plant, setup, u, course.z[0], course.work)
    for k in range(N):
        x, measured, seen = course.x[k], course.measured[k], course.seen[k]
        measured[FLOOR] = dot(plant.output, x) + plant.direct * force
        measured[DISPLACEMENT], measured[VELOCITY] = (
            dot(plant.displacement, x),
            dot(plant.velocity, x),
        )
        measured[PUSHED] = force
        for i in range(4):
            seen[i] = course.measured[max(k - motion.delay, 0), i] + motion.noise[k, i]
        voltage = chosen_voltage(policy, course, k)
        course.voltage[k] = voltage
        if k == N - 1:
            break
        g_0, g_1 = motion.ground[k], motion.ground[k + 1]
        u[X_0], u[V_0], u[V] = measured[DISPLACEMENT], measured[VELOCITY], voltage
        u[REST] = -free_speed(plant, x, g_0, g_1) / gain
        held = held_force(plant, setup, u, course.z[k], course.work)
        after = course.x[k + 1]
        for i in range(m):
            total = plant.push[i] * held + plant.ground_0[i] * g_0 + plant.ground_1[i] * g_1
            for j in range(m):
                total += plant.phi[i, j] * x[j]
            after[i] = total
        u[X_1], u[V_1] = dot(plant.displacement, after), dot(plant.velocity, after)
        u[STICK] = held - u[V_1] / gain
        force = stepped(plant, setup, u, course.z[k], course.z[k + 1], course.work)

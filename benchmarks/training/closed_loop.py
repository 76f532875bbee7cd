"""A building with a damper under a trained policy: the response, sample by sample.

Written in plain Python and compiled by `jit`. The building's step is exact for a force held over
it; the damper moves on by its own step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from bristle.component.control_laws import (
    ACCELERATION,
    BESIDES,
    FORCE,
    KEEP,
    LARGEST,
    LEAST_LEVEL,
    SPEED,
    advance,
    clipped_voltage,
    command,
    estimate,
    policy_inputs,
    recent_level,
    sign,
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


# What a trained policy's weights do to the response of its closed loop: the exact derivative.


def damper_slopes(plant: Any, setup: Any, u: Any, eps: Any, z: Any, course: Any) -> None:
    """Fill the table: held force, force at the end and states there, by `X_0` ... and states.

    Parameters
    ----------
    plant, setup, u : as in `held_force`
    eps : (7 + q,) small changes
    z : (k,) states at the start
    course : Course
    """
    table, work, active = course.table, course.work, course.active
    z0, z1, base = course.states[0], course.states[1], course.states[2]
    for i in range(len(z)):
        z0[i] = z[i]
    held_0 = held_force(plant, setup, u, z0, work)
    force_0 = stepped(plant, setup, u, z0, base, work)
    for j in range(STATES + len(active)):
        if REST <= j <= STICK and not setup.signed:
            continue
        moved, slot = (u, j) if j < STATES else (z0, active[j - STATES])
        kept = moved[slot]
        moved[slot] += eps[j]
        if j != X_1 and j != V_1:
            table[0, j] = (held_force(plant, setup, u, z0, work) - held_0) / eps[j]
        table[1, j] = (stepped(plant, setup, u, z0, z1, work) - force_0) / eps[j]
        for i in range(len(active)):
            table[2 + i, j] = (z1[active[i]] - base[active[i]]) / eps[j]
        moved[slot] = kept


def pull_back(
    plant: Any, setup: Any, policy: Any, motion: Any, course: Any, by_y: Any, by_x: Any, eps: Any,
    slope: Any,
) -> None:  # fmt: skip
    """Fill in what the weights do to a sum over the response, which `respond` has filled.

    Parameters
    ----------
    plant, setup, policy, motion, course : as in `respond`
    by_y, by_x : (N,) derivatives of the sum by the floor's acceleration and the damper's
        displacement
    eps : (7 + q,) small changes of what the damper follows
    slope : as many as weights, filled
    """
    N, m = len(motion.ground), len(plant.phi)
    clear(course, by_y, by_x, slope)
    gain = plant.gain
    u, table = course.given, course.table
    for k in range(N - 1, -1, -1):
        by_voltage = 0.0
        before, by_before = course.x[k], course.by_x[k]
        if k < N - 1:
            after, by_after, by_z = course.x[k + 1], course.by_x[k + 1], course.by_z[k + 1]
            u[X_0], u[V_0] = course.measured[k, DISPLACEMENT], course.measured[k, VELOCITY]
            u[X_1], u[V_1] = dot(plant.displacement, after), dot(plant.velocity, after)
            u[V] = course.voltage[k]
            g_0, g_1 = motion.ground[k], motion.ground[k + 1]
            free = free_speed(plant, before, g_0, g_1)
            u[REST], u[STICK] = -free / gain, -free / gain
            damper_slopes(plant, setup, u, eps, course.z[k], course)
            by_force = course.by_measured[k + 1, PUSHED]
            by_stick = along(table, by_force, by_z, STICK)
            by_x_1 = along(table, by_force, by_z, X_1)
            by_v_1 = along(table, by_force, by_z, V_1) - by_stick / gain
            for i in range(m):
                by_after[i] += plant.displacement[i] * by_x_1 + plant.velocity[i] * by_v_1
            by_held = by_stick + dot(plant.push, by_after)
            for j in range(len(course.active)):
                course.by_z[k, j] += along(table, by_force, by_z, STATES + j)
                course.by_z[k, j] += by_held * table[0, STATES + j]
            by_x_0 = along(table, by_force, by_z, X_0) + by_held * table[0, X_0]
            by_v_0 = along(table, by_force, by_z, V_0) + by_held * table[0, V_0]
            by_voltage = along(table, by_force, by_z, V) + by_held * table[0, V]
            by_free = -by_held * table[0, REST] / gain
            for j in range(m):
                by_before[j] += plant.displacement[j] * by_x_0 + plant.velocity[j] * by_v_0
                by_before[j] += plant.coming[j] * by_free
                for i in range(m):
                    by_before[j] += plant.phi[i, j] * by_after[i]
        policy_back(policy, motion, course, k, by_voltage, slope)
        by_measured = course.by_measured[k]
        by_measured[PUSHED] += plant.direct * by_measured[FLOOR]
        for i in range(m):
            by_before[i] += plant.output[i] * by_measured[FLOOR]
            by_before[i] += plant.displacement[i] * by_measured[DISPLACEMENT]
            by_before[i] += plant.velocity[i] * by_measured[VELOCITY]


def clear(course: Any, by_y: Any, by_x: Any, slope: Any) -> None:
    """Set the derivatives to those that the sum has by itself; see `pull_back`.

    Parameters
    ----------
    course : Course; its derivatives are set
    by_y, by_x : (N,) of the sum by output and damper's displacement at the samples
    slope : (w,) of the sum by the weights; set to 0
    """
    for i in range(len(slope)):
        slope[i] = 0.0
    for k in range(len(by_y)):
        for i in range(len(course.by_x[0])):
            course.by_x[k, i] = 0.0
        for i in range(len(course.by_z[0])):
            course.by_z[k, i] = 0.0
        for i in range(len(course.by_e[0])):
            course.by_e[k, i] = 0.0
        course.by_level[k] = 0.0
        course.by_measured[k, FLOOR], course.by_measured[k, DISPLACEMENT] = by_y[k], by_x[k]
        course.by_measured[k, VELOCITY] = course.by_measured[k, PUSHED] = 0.0


def along(table: Any, by_force: float, by_z: Any, j: int) -> float:
    """Return what column j of the damper's step does, through its force and its states.

    Parameters
    ----------
    table : (2 + k, columns) derivatives of the step; force at the end in row 1, states from 2 on
    by_force, by_z : derivatives of the sum by the force and the (k,) states at the end
    j : column
    """
    total: float = table[1, j] * by_force
    for i in range(len(table) - 2):
        total += table[2 + i, j] * by_z[i]
    return total


def policy_back(
    policy: Any, motion: Any, course: Any, k: int, by_voltage: float, slope: Any
) -> None:
    """Take sample k's voltage back to weights, earlier estimates, and what was measured.

    Parameters
    ----------
    policy, motion, course, slope : as in `pull_back`
    k : number of the sample
    by_voltage : derivative by its voltage
    """
    n, scales, seen = policy.n, policy.scales, course.seen[k]
    network_back(policy, course, k, by_voltage, slope)
    by_inputs, by_e, level = course.by_inputs, course.by_e[k], course.level[k]
    side, v = sign(seen[VELOCITY]), abs(seen[VELOCITY])
    by_level = course.by_level[k]
    for i in range(n):
        by_e[i] += side * by_inputs[i] / level
        by_level -= by_inputs[i] * course.inputs[k, i] / level
    by_level += by_inputs[n + 1] * scales[ACCELERATION] / (level + scales[ACCELERATION]) ** 2
    by_seen = course.by_measured[max(k - motion.delay, 0)]
    by_seen[PUSHED] += side * by_inputs[n] / scales[FORCE]
    by_seen[VELOCITY] += side * by_inputs[n + 2] * scales[SPEED] / (v + scales[SPEED]) ** 2
    if level == abs(seen[FLOOR]):
        by_seen[FLOOR] += sign(seen[FLOOR]) * by_level
    elif k > 0:
        course.by_level[k - 1] += scales[KEEP] * by_level
    for i in range(n):
        for j in range(4):
            by_seen[j] += policy.B[4 * i + j] * by_e[i]
        if k > 0:
            for j in range(n):
                course.by_e[k - 1, j] += policy.A[i * n + j] * by_e[i]


def network_back(policy: Any, course: Any, k: int, by_voltage: float, slope: Any) -> None:
    """Take sample k's voltage back to the network's weights and inputs; see `policy_back`.

    Parameters
    ----------
    policy, course : Policy, Course
    k : sample
    by_voltage : derivative of the sum by its voltage
    slope : (w,) of the sum by the weights; added to
    """
    count, hidden, weights = policy.n + BESIDES, policy.hidden, policy.weights
    biases = hidden * count
    outer = biases + hidden
    direct = outer + hidden
    largest, voltage, by_inputs = policy.scales[LARGEST], course.voltage[k], course.by_inputs
    total = by_voltage * voltage * (1.0 - voltage / largest)
    slope[direct + count] += total
    for j in range(count):
        slope[direct + j] += total * course.inputs[k, j]
        by_inputs[j] = total * weights[direct + j]
    for i in range(hidden):
        unit = course.units[k, i]
        slope[outer + i] += total * unit
        inner = total * weights[outer + i] * (1.0 - unit * unit)
        slope[biases + i] += inner
        for j in range(count):
            slope[i * count + j] += inner * course.inputs[k, j]
            by_inputs[j] += inner * weights[i * count + j]


RESPOND, PULL_BACK = range(2)


def compute(
    task: int, plant: Any, setup: Any, policy: Any, motion: Any, course: Any, by_y: Any, by_x: Any,
    eps: Any, slope: Any,
) -> None:  # fmt: skip
    """Do `RESPOND` or `PULL_BACK`: they are compiled together, for each needs the whole damper.

    Parameters
    ----------
    task : which
    plant, setup, policy, motion, course, by_y, by_x, eps, slope : as in `pull_back`
    """
    if task == RESPOND:
        respond(plant, setup, policy, motion, course)
    else:
        pull_back(plant, setup, policy, motion, course, by_y, by_x, eps, slope)

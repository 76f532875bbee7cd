"""What a trained policy's weights do to the response of its closed loop: the exact derivative.

One pass backwards (the adjoint); the damper's share of it follows from small changes. Written in
plain Python and compiled by `jit`; it mirrors `closed_loop` line by line.
"""

from __future__ import annotations

from typing import Any

from bristle.component.control_laws import ACCELERATION, BESIDES, FORCE, KEEP, LARGEST, SPEED, sign
from bristle.physics.linear import dot

from .closed_loop import (
    DISPLACEMENT,
    FLOOR,
    PUSHED,
    REST,
    STATES,
    STICK,
    V_0,
    V_1,
    VELOCITY,
    X_0,
    X_1,
    V,
    free_speed,
    held_force,
    respond,
    stepped,
)


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

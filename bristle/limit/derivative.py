"""What a voltage's history does to a response: its derivative, exactly as the response is computed.

The adjoint of the discrete system (Cao, Li, Petzold & Serban 2003, SIAM J. Sci. Comput. 24(3)): the
slopes of each step of the damper, by small changes, then one pass backwards. Written in plain
Python and compiled by `jit`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..physics.vectors import dot
from .response import (
    STATES,
    TRIED,
    V_0,
    V_1,
    VOLTAGE_0,
    VOLTAGE_1,
    X_0,
    X_1,
    Course,
    damper_end,
)


class Gradient(NamedTuple):
    """What a response's derivative is made of.

    Attributes
    ----------
    active : (q,) array
        Slots of the damper's states that move.
    eps : (7 + q,) array
        Small changes of what a step of the damper follows.
    table : (N, 1 + q, 7 + q) array
        Derivatives of force and active states by these, step by step.
    by_voltage : (N + 1,) array
        Per V.
    room : (2, m + q) array
        Room to work.
    """

    active: Any
    eps: Any
    table: Any
    by_voltage: Any
    room: Any


def slopes(
    plant: Any, setup: Any, voltage: Any, first: int, last: int, course: Course,
    gradient: Gradient, u: Any,
) -> None:  # fmt: skip
    """Fill in how each step of the damper follows its motion, voltage and states.

    Parameters
    ----------
    plant, setup, voltage, first, last, course, u : as in `respond`, which has filled the response
    gradient : Gradient; its table is filled
    """
    active, eps, table = gradient.active, gradient.eps, gradient.table
    q, size = len(active), len(course.z[0])
    z0, z1 = course.work[-3 * size : -2 * size], course.work[-2 * size : -size]
    work = course.work[: -3 * size]
    for k in range(first, last):
        for i in range(size):
            z0[i] = course.z[k, i]
        before, after = course.x[k], course.x[k + 1]
        u[X_0], u[V_0] = dot(plant.displacement, before), dot(plant.velocity, before)
        u[X_1], u[V_1] = dot(plant.displacement, after), dot(plant.velocity, after)
        u[VOLTAGE_0], u[VOLTAGE_1], u[TRIED] = voltage[k], voltage[k + 1], course.force[k + 1]
        energy, rows = course.energy[k], table[k]
        base = damper_end(setup, plant.h, plant.mass, u, energy, z0, z1, work)
        for i in range(q):
            rows[1 + i, TRIED] = z1[active[i]]
        for at in range(1, STATES + q + 1):
            j = (TRIED + at) % (STATES + q)  # the last is TRIED, whose column holds the base
            moved, slot = (u, j) if j < STATES else (z0, active[j - STATES])
            kept = moved[slot]
            moved[slot] += eps[j]
            found = damper_end(setup, plant.h, plant.mass, u, energy, z0, z1, work)
            moved[slot] = kept
            rows[0, j] = (found - base) / eps[j]
            for i in range(q):
                rows[1 + i, j] = (z1[active[i]] - rows[1 + i, TRIED]) / eps[j]


def carried(rows: Any, by_z: Any, column: int) -> float:
    """Return what one cause does by way of the states at the end of a step.

    Parameters
    ----------
    rows : (1 + q, 7 + q) array
        A step's entry of `Gradient.table`.
    by_z : (q,) array
        What the states at its end do to the sum.
    column : X_0 ... of the cause
    """
    total = 0.0
    for i in range(len(by_z)):
        total += rows[1 + i, column] * by_z[i]
    return total


def pull_back(plant: Any, weights: Any, first: int, last: int, gradient: Gradient) -> None:
    """Fill in what the voltages do to the sum of weights times outputs; after `slopes`.

    Parameters
    ----------
    plant : Plant
    weights : (N + 1,) of the outputs at the instants
    first, last : instants
    gradient : Gradient; `by_voltage` is filled
    """
    table, room, by_voltage = gradient.table, gradient.room, gradient.by_voltage
    by_voltage[:] = 0.0
    m, q = len(plant.phi), len(table[0]) - 1
    by_x, new_x = room[0, :m], room[1, :m]
    by_z, new_z = room[0, m : m + q], room[1, m : m + q]
    x_1, v_1 = dot(plant.displacement, plant.force_1), dot(plant.velocity, plant.force_1)
    room[0] = 0.0
    by_f = 0.0
    for k in range(last - 1, first - 1, -1):
        w, rows = weights[k + 1], table[k]
        if w != 0.0:
            by_f += w * plant.by_force
            for i in range(m):
                by_x[i] += w * plant.output[i]
        bent_x, bent_v = carried(rows, by_z, X_1), carried(rows, by_z, V_1)
        total = by_f + dot(plant.force_1, by_x) + carried(rows, by_z, TRIED)
        total += x_1 * bent_x + v_1 * bent_v
        total /= 1.0 - rows[0, TRIED] - x_1 * rows[0, X_1] - v_1 * rows[0, V_1]
        x_1_by, v_1_by = bent_x + rows[0, X_1] * total, bent_v + rows[0, V_1] * total
        for i in range(m):
            by_x[i] += plant.displacement[i] * x_1_by + plant.velocity[i] * v_1_by
        x_by = rows[0, X_0] * total + carried(rows, by_z, X_0)
        v_by = rows[0, V_0] * total + carried(rows, by_z, V_0)
        by_voltage[k] += rows[0, VOLTAGE_0] * total + carried(rows, by_z, VOLTAGE_0)
        by_voltage[k + 1] += rows[0, VOLTAGE_1] * total + carried(rows, by_z, VOLTAGE_1)
        for j in range(q):
            new_z[j] = rows[0, STATES + j] * total + carried(rows, by_z, STATES + j)
        for j in range(m):
            new_x[j] = plant.displacement[j] * x_by + plant.velocity[j] * v_by
            for i in range(m):
                new_x[j] += plant.phi[i, j] * by_x[i]
        by_f = dot(plant.force_0, by_x)
        for i in range(m):
            by_x[i] = new_x[i]
        for i in range(q):
            by_z[i] = new_z[i]

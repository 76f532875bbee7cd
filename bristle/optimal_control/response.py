"""The response of a building to a history of voltage, and its derivative.

Written in plain Python and compiled by `jit`. A step is that of the coupled engine: the building's
exact linear step, force and voltage linear in time, the damper's own step, and the force corrected
until motion and force agree.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..physics.damper import force_at, step
from ..physics.linear import dot
from ..physics.tuples import Inputs, record

SWEEPS = 30
"""Corrections of the force in a step, at most."""
AGREED = 1e-9
"""Disagreement of the force, as a share of the largest so far, at which they end."""

X_0, V_0, X_1, V_1, VOLTAGE_0, VOLTAGE_1, TRIED, STATES = range(8)
"""What a damper's step follows: motion and voltage at begin and end, the force that is tried, and
from here on its states."""


class DrivenPlant(NamedTuple):
    """A building over a step of `h` [s], with m states, and the damper's place in it.

    Attributes
    ----------
    phi : (m, m) array
    ground_0, ground_1, force_0, force_1 : (m,) arrays
        What ground acceleration and force at begin and end add.
    displacement, velocity : (m,) arrays
        Rows of what the damper feels.
    output : (m,) array
        Row of the output, to which a force and the ground add `by_force` and `by_ground` times
        theirs.
    mass : float
        Mass [kg] that a damper has to stop within a step.
    """

    h: float
    phi: Any
    ground_0: Any
    ground_1: Any
    force_0: Any
    force_1: Any
    displacement: Any
    velocity: Any
    output: Any
    by_force: float
    by_ground: float
    mass: float


class Course(NamedTuple):
    """A response at the instants 0, h, ... of N steps.

    `x` (N + 1, m) and `z` (N + 1, k) are the states of building and damper, `force` [N], `energy`
    [J] and `y` (N + 1,) follow; `work` is room to work.
    """

    x: Any
    z: Any
    force: Any
    energy: Any
    y: Any
    work: Any


def damper_end(
    setup: Any, h: float, mass: float, u: Any, energy: float, z0: Any, z1: Any, work: Any
) -> float:
    """Advance the damper over a step; return its force at the end [N].

    Parameters
    ----------
    setup : Setup
    h, mass : step [s], mass to stop [kg]
    u : (7,) as `X_0` ... `TRIED` number them
    energy : dissipated so far [J]
    z0, z1 : (k,) states at begin and end, the latter filled
    work : room to work
    """
    a = (u[V_1] - u[V_0]) / h
    stick = u[TRIED] + mass * u[V_1] / h
    begin = record(Inputs, (u[X_0], u[V_0], a, u[VOLTAGE_0], h, energy, stick, True))
    end = record(Inputs, (u[X_1], u[V_1], a, u[VOLTAGE_1], h, energy, stick, True))
    return step(setup, begin, end, z0, z1, work)[0]


def start(plant: Any, setup: Any, voltage: Any, course: Course) -> None:
    """Fill in the force and the output at instant 0, the states there being given.

    Parameters
    ----------
    plant, setup, course : DrivenPlant, Setup, Course
    voltage : (N + 1,) V
    """
    x, v = dot(plant.displacement, course.x[0]), dot(plant.velocity, course.x[0])
    now = record(Inputs, (x, v, 0.0, voltage[0], plant.h, course.energy[0], 0.0, False))
    course.force[0] = force_at(setup, now, course.z[0], course.work)[0]


def settled_force(
    plant: Any, setup: Any, course: Course, k: int, scale: float, u: Any
) -> float:  # fmt: skip
    """Correct a step's force until motion and force agree; return it [N].

    Parameters
    ----------
    plant, setup : DrivenPlant, Setup
    course : Course; the damper's states at instant k + 1 are filled
    k : the step's number
    scale : largest force so far [N]
    u : (7,) motion as if no force acted at the end, and the force that is tried first
    """
    x_1, v_1 = dot(plant.displacement, plant.force_1), dot(plant.velocity, plant.force_1)
    x, v, tried = u[X_1], u[V_1], u[TRIED]
    tried_before, excess_before = 0.0, 0.0
    found: float = tried
    for sweep in range(SWEEPS):
        u[X_1], u[V_1], u[TRIED] = x + x_1 * tried, v + v_1 * tried, tried
        found = damper_end(
            setup, plant.h, plant.mass, u, course.energy[k], course.z[k], course.z[k + 1],
            course.work,
        )  # fmt: skip
        excess = found - tried
        scale = max(scale, abs(found))
        if abs(excess) <= AGREED * scale:
            break
        slope = -1.0
        if sweep > 0 and tried != tried_before:
            slope = min((excess - excess_before) / (tried - tried_before), -0.5)
        tried_before, excess_before = tried, excess
        tried -= excess / slope
    return found


def respond(
    plant: Any, setup: Any, ground: Any, voltage: Any, first: int, last: int, course: Course,
    u: Any,
) -> None:  # fmt: skip
    """Fill the response from instant `first`, where it is given, to instant `last`.

    Parameters
    ----------
    plant, setup : DrivenPlant, Setup
    ground, voltage : (N + 1,) m/s2 and V at the instants, linear between
    first, last : instants
    course : Course
    u : (7,) room to work
    """
    m = len(plant.phi)
    scale = 1e-12
    for k in range(first, last):
        before, after = course.x[k], course.x[k + 1]
        f0 = course.force[k]
        for i in range(m):
            total = plant.ground_0[i] * ground[k] + plant.ground_1[i] * ground[k + 1]
            total += plant.force_0[i] * f0
            for j in range(m):
                total += plant.phi[i, j] * before[j]
            after[i] = total
        u[X_0], u[V_0] = dot(plant.displacement, before), dot(plant.velocity, before)
        u[X_1], u[V_1] = dot(plant.displacement, after), dot(plant.velocity, after)
        u[VOLTAGE_0], u[VOLTAGE_1], u[TRIED] = voltage[k], voltage[k + 1], f0
        found = settled_force(plant, setup, course, k, scale, u)
        scale = max(scale, abs(found))
        for i in range(m):
            after[i] += plant.force_1[i] * found
        course.force[k + 1] = found
        power = f0 * u[V_0] + found * u[V_1]
        course.energy[k + 1] = course.energy[k] + 0.5 * plant.h * power
    for k in range(first, last + 1):
        course.y[k] = (
            dot(plant.output, course.x[k])
            + plant.by_force * course.force[k]
            + plant.by_ground * ground[k]
        )


# What a voltage's history does to a response: its derivative, exactly as the response is computed.
#
# The adjoint of the discrete system (Cao, Li, Petzold & Serban 2003, SIAM J. Sci. Comput. 24(3)):
# the slopes of each step of the damper, by small changes, then one pass backwards. Written in plain
# Python and compiled by `jit`.


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
    plant : DrivenPlant
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

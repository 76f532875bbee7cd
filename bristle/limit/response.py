"""A linear building with one damper over a ground motion, and what its voltage moves.

Written in plain Python and compiled by `jit`. A step is that of the coupled engine: the building's
exact linear step, force and voltage linear in time, the damper's own step, and the force corrected
until motion and force agree.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..physics.damper import force_at
from ..physics.damper import step as law_step
from ..physics.inputs import Inputs
from ..physics.tuples import record
from ..physics.vectors import dot

SWEEPS = 30
"""Corrections of the force in a step, at most."""
AGREED = 1e-9
"""Disagreement of the force, as a share of the largest so far, at which they end."""

X_0, V_0, X_1, V_1, VOLTAGE_0, VOLTAGE_1, TRIED, STATES = range(8)
"""What a damper's step follows: motion and voltage at begin and end, the force that is tried, and
from here on its states."""


class Plant(NamedTuple):
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
    return law_step(setup, begin, end, z0, z1, work)[0]


def start(plant: Any, setup: Any, voltage: Any, course: Course) -> None:
    """Fill in the force and the output at instant 0, the states there being given.

    Parameters
    ----------
    plant, setup, course : Plant, Setup, Course
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
    plant, setup : Plant, Setup
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
    plant, setup : Plant, Setup
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

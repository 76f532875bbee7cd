"""A damper: its law and effects within limits of the voltage, sticking, and the energy it takes."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from typing import NamedTuple

from ..physics.damper import (
    BAKED_ROWS,
    STORE_ROWS,
    fill,
    force_at,
    room,
    setup_from,
    states_of,
    store_size,
)
from ..physics.damper import bake as bake_law
from ..physics.damper import step as law_step
from ..physics.damper_source import hold_law
from ..physics.generate import Slots
from ..physics.linear import Row, open_row, packed, place, row
from ..physics.tuples import Inputs, Setup, record
from .control_laws import limited

DISPLACEMENT, VELOCITY, VOLTAGE, HOLDING_FORCE, ACCELERATION = range(5)
FORCE, DISSIPATED_ENERGY, STROKE_RATIO, OUTSIDE, FRICTION = range(5)
"""Outputs; friction, the part of the force that is, is hidden, and so is how far outside of the
data the damper is where it knows of none."""

REMEMBERED = 9
"""How many numbers the state holds behind the states of law and effects."""


class Constants(NamedTuple):
    """What a damper computes with.

    `setup` is that of law and effects. `moving_mass` [kg] is what the holding force holds, 0: the
    law slides. The acceleration is `measured`, or the difference of velocity over the step. Motion
    and voltage are `linear` over a step, or held at their newest. `tracks` are pairs of a slot in
    `setup.p` and the input that it follows. `range` is that of the data, in the order of `RANGE`.
    """

    setup: Setup
    v_max: float
    stroke: float
    moving_mass: float
    measured: bool
    linear: bool
    tracks: Row
    range: Row


LIMITS, TRACKS = BAKED_ROWS, BAKED_ROWS + 1
"""Rows of what is baked, behind those of law and effects: the index of each of `OWN` among the
values; pairs of a slot in `p` and the input that it follows."""

WIDE = 1e30
"""An end of a range that no motion or command reaches."""
OWN = ("v_max", "stroke", "moving_mass")
"""What a damper's values hold besides the parameters of law and effects."""

RANGE = (
    "range.displacement_low", "range.displacement_high", "range.speed", "range.command_low",
    "range.command_high",
)  # fmt: skip
"""The range [m, m/s, the command's unit] of the data that a damper knows, behind `OWN`; a build
has all of it or none."""

_OWN, _FOLLOWED = STORE_ROWS, STORE_ROWS + 1
_V_MAX, _STROKE, _MOVING_MASS = range(3)
_LOW, _HIGH, _SPEED, _COMMAND_LOW, _COMMAND_HIGH, _MEASURED = range(3, 9)


def bake(
    law: str, names: Sequence[str], tracks: Sequence[tuple[str, int]], slots: Slots
) -> list[float]:
    """Return what a build fixes of a damper.

    Parameters
    ----------
    law : a damper's law, such as "bingham"
    names : of the values, in their order, as law and effects know them; those of `OWN` among them
    tracks : parameters of effects that follow an input, each with the input's number
    slots : where law and effects have their places
    """
    own = [names.index(name) for name in (*OWN, *RANGE) if name in names]
    pairs = [number for name, port in tracks for number in (slots.parameters[name], port)]
    return packed(*bake_law(law, names, slots), own, pairs)


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take.

    Parameters
    ----------
    values, baked : as in `setup`
    counts : (4,) filled

    Returns
    -------
    int
        0.
    """
    states = states_of(baked) + REMEMBERED
    counts[0] = store_size(baked) + _MEASURED + 3 + len(row(baked, TRACKS))
    counts[1], counts[2], counts[3] = states, FRICTION + 1, room(states)
    return 0


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply, and the states of law and effects at the start.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked, in SI; a switch is 1 or 0
    given : (5 + c,) 1 for each input that a host has set, else 0
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; filled

    Returns
    -------
    int
        0; negative if effects exclude each other: see `physics.damper.refusals`.
    """
    code = fill(values, baked, store, state)
    if code < 0:
        return code
    own, limits = open_row(store, _OWN, _MEASURED + 1), row(baked, LIMITS)
    for i in range(len(limits)):
        store[own + i] = values[int(limits[i])]
    if len(limits) <= _LOW:
        store[own + _LOW] = store[own + _COMMAND_LOW] = -WIDE
        store[own + _HIGH] = store[own + _SPEED] = store[own + _COMMAND_HIGH] = WIDE
    tracks = row(baked, TRACKS)
    at = open_row(store, _FOLLOWED, len(tracks))
    for i in range(len(tracks)):
        store[at + i] = tracks[i]
    bind(given, store)
    return 0


def bind(given: Row, store: Row) -> None:
    """Take the acceleration for measured once a host has set it: whenever `given` has changed.

    Parameters
    ----------
    given, store
        As in `setup`.
    """
    store[place(store, _OWN) + _MEASURED] = given[ACCELERATION]


def constants(store: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views."""
    own = row(store, _OWN)
    return Constants(
        setup_from(store), own[_V_MAX], own[_STROKE], own[_MOVING_MASS], own[_MEASURED] != 0.0,
        False, row(store, _FOLLOWED), own[_LOW:_MEASURED],
    )  # fmt: skip


def follow(inputs: Row, c: Constants) -> None:
    """Let parameters that follow an input have its newest value: before start, step and output.

    Parameters
    ----------
    inputs : (5 + c,) as in `start`
    c : Constants
    """
    for i in range(0, len(c.tracks), 2):
        c.setup.p[int(c.tracks[i])] = inputs[int(c.tracks[i + 1])]


ENERGY, ENERGY_SHOWN, ENERGY_AT_BEGIN, DISPLACEMENT_AT_END = range(-REMEMBERED, -5)
VELOCITY_AT_END, FORCE_AT_END, ACCELERATION_AT_END, VOLTAGE_AT_END, LAST_STEP = range(-5, 0)
"""What the state holds behind the states of law and effects: counted from its end.

`ENERGY` is that of the step, which effects know; `ENERGY_SHOWN` that at the motion shown since;
`ENERGY_AT_BEGIN` has what the start of the step adds to it already. Motion and force at the end are
those shown since, at the voltage of the step.
"""

SATURATED = 1
"""The voltage left its limits."""


def stick_force(holding: float, v: float, mass: float, dt: float) -> float:
    """Return the force [N] that brings a mass to rest within a step.

    Parameters
    ----------
    holding : force at which its velocity stays [N]
    v : its velocity [m/s]
    mass : kg
    dt : length of the step [s]
    """
    return holding + mass * v / dt


def present_force(
    motion: tuple[float, float, float], V: float, holding: float, c: Constants, state: Row,
    work: Row,
) -> tuple[float, float]:  # fmt: skip
    """Return force and friction [N] at a motion, without moving on.

    Parameters
    ----------
    motion : displacement [m], velocity [m/s], acceleration [m/s2]
    V : voltage within its limits [V]
    holding : holding force [N]
    c : Constants
    state : as in `start`, kept
    work : room to work, of the size that `sizes` gives
    """
    x, v, a = motion
    dt = state[LAST_STEP]
    sticks = c.moving_mass > 0.0 and (isfinite(dt) or v == 0.0)
    stick = stick_force(holding, v, c.moving_mass, dt) if sticks else 0.0
    now = record(Inputs, (x, v, a, V, dt, state[ENERGY], stick, sticks))
    return force_at(c.setup, now, state, work)


def beyond(value: float, low: float, high: float, size: float) -> float:
    """Return how far a value is beyond a range, as a share of a size; 0 inside.

    Parameters
    ----------
    value, low, high, size : in one unit
    """
    over = max(low - value, value - high)
    return over / size if over > 0.0 else 0.0


def half_way(low: float, high: float, whole: float) -> float:
    """Return half the way between two ends, or a whole where one of them is `WIDE` or both are one.

    The zero of a displacement may be anywhere.
    """
    half = 0.5 * (high - low)
    return half if 0.0 < half < 0.25 * WIDE else whole


def larger_end(low: float, high: float, whole: float) -> float:
    """Return the larger of the ends that are known, or a whole where none is but 0."""
    end = 0.0
    if low > -WIDE:
        end = abs(low)
    if high < WIDE:
        end = max(end, abs(high))
    return end if end > 0.0 else whole


def outside(x: float, v: float, V: float, c: Constants) -> float:
    """Return how far a motion or its command is outside of the damper's data; 0 inside.

    Parameters
    ----------
    x, v : displacement [m], velocity [m/s]
    V : voltage within its limits [V]
    c : Constants

    Returns
    -------
    float
        What the worst of displacement, speed and command exceeds its range by: 0.3 is 30 % of half
        the stroke, of the speed, of the largest command.
    """
    low, high, speed, least, most = c.range[0], c.range[1], c.range[2], c.range[3], c.range[4]
    if low <= x <= high and abs(v) <= speed and least <= V <= most:
        return 0.0
    moved = beyond(x, low, high, half_way(low, high, c.stroke))
    fast = beyond(abs(v), 0.0, speed, speed)
    return max(moved, fast, beyond(V, least, most, larger_end(least, most, c.v_max)))


def is_measured(inputs: Row, c: Constants) -> bool:
    """Return whether the acceleration among inputs was measured.

    Many hosts write 0 to an input that nothing is connected to. Where the acceleration really is 0,
    differences of the velocity show that as well.

    Parameters
    ----------
    inputs : (5,) as in `start`
    c : Constants
    """
    return c.measured and inputs[ACCELERATION] != 0.0


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Begin without energy and without a step behind.

    Parameters
    ----------
    time : s, not used
    inputs : (5,) displacement [m], velocity [m/s], voltage [V], holding force [N],
        acceleration [m/s2]
    c : Constants
    state : (`Slots.z_size` + 9,) the states of law and effects as given; the last nine are filled
    outputs : (5,) force [N], dissipated energy [J], stroke ratio [1], how far outside of the
        data [1], friction [N], filled
    work : room to work, of the size that `sizes` gives

    Returns
    -------
    int
        0 or `SATURATED`.
    """
    state[ENERGY] = state[ENERGY_SHOWN] = state[ENERGY_AT_BEGIN] = 0.0
    state[LAST_STEP] = inf
    state[ACCELERATION_AT_END] = inputs[ACCELERATION] if is_measured(inputs, c) else 0.0
    code = output(time, inputs, c, state, outputs, work)
    remember(inputs, c, state, outputs)
    return code


def remember(inputs: Row, c: Constants, state: Row, outputs: Row) -> None:
    """Take the present motion, voltage and force for those from which the next step begins.

    Parameters
    ----------
    inputs : (5,) as in `start`
    c : Constants
    state : as in `start`, its last entries filled
    outputs : (5,) as in `start`, those at these inputs
    """
    state[DISPLACEMENT_AT_END] = inputs[DISPLACEMENT]
    state[VELOCITY_AT_END], state[FORCE_AT_END] = inputs[VELOCITY], outputs[FORCE]
    state[VOLTAGE_AT_END] = limited(inputs[VOLTAGE], 0.0, c.v_max)
    if is_measured(inputs, c):
        state[ACCELERATION_AT_END] = inputs[ACCELERATION]


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Advance law, effects and energy over one step.

    A voltage that has jumped since the last step acts from the start of this one on: the energy's
    trapezoid begins at the force that the damper then has.

    Parameters
    ----------
    clock : tuple
        Time at the start [s], dt [s], sweep (not used).
    before, now : (5,) inputs at begin and end, as in `start`
    c : Constants
    state, new_state : states at begin (kept) and end (filled), as in `start`
    outputs : (5,) as in `start`, filled
    work : room to work, of the size that `sizes` gives

    Returns
    -------
    int
        0 or `SATURATED`.
    """
    dt = clock[1]
    x0, v0 = before[DISPLACEMENT], before[VELOCITY]
    x1, v1 = now[DISPLACEMENT], now[VELOCITY]
    V1 = limited(now[VOLTAGE], 0.0, c.v_max)
    V0 = limited(before[VOLTAGE], 0.0, c.v_max) if c.linear else V1
    a0 = state[ACCELERATION_AT_END]
    a1 = now[ACCELERATION] if is_measured(now, c) else (v1 - v0) / dt
    force0, energy = state[FORCE_AT_END], state[ENERGY_SHOWN]
    if state[VOLTAGE_AT_END] != V0:
        shown = state[DISPLACEMENT_AT_END], state[VELOCITY_AT_END], a0
        force0 = present_force(shown, V0, before[HOLDING_FORCE], c, state, work)[0]
    sticks = c.moving_mass > 0.0
    stick = stick_force(now[HOLDING_FORCE], v1, c.moving_mass, dt) if sticks else 0.0
    end = record(Inputs, (x1, v1, a1, V1, dt, energy, stick, sticks))
    begin = record(Inputs, (x0, v0, a0, V0, dt, energy, stick, sticks)) if c.linear else end
    if c.linear or c.setup.active:  # one call: compiled code grows with each
        force, friction = law_step(c.setup, begin, end, state, new_state, work)
    else:
        force, friction = hold_law(c.setup.law, c.setup.p, end, state, new_state)
    energy += 0.5 * dt * force0 * state[VELOCITY_AT_END]
    new_state[ENERGY_AT_BEGIN] = energy
    energy += 0.5 * dt * force * v1
    new_state[ENERGY] = new_state[ENERGY_SHOWN] = energy
    new_state[DISPLACEMENT_AT_END] = x1
    new_state[VELOCITY_AT_END], new_state[FORCE_AT_END] = v1, force
    new_state[ACCELERATION_AT_END], new_state[VOLTAGE_AT_END] = a1, V1
    new_state[LAST_STEP] = dt
    outputs[FORCE], outputs[FRICTION] = force, friction
    outputs[DISSIPATED_ENERGY], outputs[STROKE_RATIO] = energy, abs(x1) / c.stroke
    outputs[OUTSIDE] = outside(x1, v1, V1, c)
    if c.setup.heats and not c.linear:  # above, an effect has known the energy of before
        return output(clock[0] + dt, now, c, new_state, outputs, work)
    return SATURATED if now[VOLTAGE] != V1 else 0


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Let the force follow motion and voltage, the states held.

    The step's energy ends at the motion shown: a master may have given the middle of the step for
    it, and gives its end now. It ends at the voltage of the step: another one since, a jump or the
    end of a step whose middle was given, counts from the next step on.

    Parameters
    ----------
    time : s, not used
    inputs : (5,) as in `start`
    c : Constants
    state : as in `start`, kept but for energy, velocity and force at the end
    outputs : (5,) as in `start`, filled
    work : room to work, of the size that `sizes` gives

    Returns
    -------
    int
        0 or `SATURATED`.
    """
    V = limited(inputs[VOLTAGE], 0.0, c.v_max)
    a = inputs[ACCELERATION] if is_measured(inputs, c) else state[ACCELERATION_AT_END]
    x, v, holding = inputs[DISPLACEMENT], inputs[VELOCITY], inputs[HOLDING_FORCE]
    dt, V_end = state[LAST_STEP], state[VOLTAGE_AT_END]
    force, friction = present_force((x, v, a), V, holding, c, state, work)
    if isfinite(dt):
        force_end = force
        if V_end != V:
            force_end = present_force((x, v, a), V_end, holding, c, state, work)[0]
        state[ENERGY_SHOWN] = state[ENERGY_AT_BEGIN] + 0.5 * dt * force_end * v
        state[DISPLACEMENT_AT_END], state[VELOCITY_AT_END] = x, v
        state[FORCE_AT_END] = force_end
    outputs[FORCE], outputs[FRICTION] = force, friction
    outputs[DISSIPATED_ENERGY] = state[ENERGY_SHOWN]
    outputs[STROKE_RATIO], outputs[OUTSIDE] = abs(x) / c.stroke, outside(x, v, V, c)
    return SATURATED if inputs[VOLTAGE] != V else 0

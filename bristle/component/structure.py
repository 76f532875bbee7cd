"""A building under ground motion and the forces of devices, on its first level and between any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..physics import structure as laws
from ..physics.building import GROUND, Building
from ..physics.generate import Slots
from ..physics.linear import Row, copy, invert, open_row, packed, place, row
from ..physics.structure import (
    EFFECT_STEP,
    Loads,
    Setup,
    accelerations,
    add_force,
    fill_size,
    fill_step,
    free_step,
    functions_of,
    holding_force,
    matrices,
    resting_contact,
    resting_forces,
    work_size,
)
from ..physics.structure import step as effects_step
from .damper import stick_force

# What devices do to a structure: they act between two levels, or between the ground and one.
#
# A device's displacement and velocity are those of its upper level relative to its lower one, and
# its force acts on both, once either way.

GROUND_ACCELERATION, DAMPER_FORCE, EXTRA_FORCE, DEVICE_FORCES = range(4)
"""Inputs; behind the damper's force and the extra one, both on the first level, those of the
building's own devices."""

PER_LEVEL = 3
"""Outputs of each level: displacement, velocity, absolute acceleration.

The drifts follow, then the holding force, then `PER_DEVICE` outputs of each device.
"""

PER_DEVICE = 3
"""Outputs of each device: displacement and velocity of its ends, holding force."""


def add_devices(before: Row, now: Row, c: Constants, new_state: Row) -> None:
    """Add what the forces of the building's own devices do over a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `structure.start`
    c : Constants
    new_state : state at the end, changed in place
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        f1 = now[DEVICE_FORCES + k]
        f0 = before[DEVICE_FORCES + k] if c.linear else f1
        add_force(c.n, c.held, c.ramp, upper, f0, f1, new_state)
        if lower != GROUND:
            add_force(c.n, c.held, c.ramp, lower, -f0, -f1, new_state)


def forces_between(before: Row, now: Row, share: float, c: Constants, forces: Row) -> None:
    """Fill `forces` with those of all devices on each level within a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `structure.start`
    share : of the step that has passed [1]; counts where forces are linear over it
    c : Constants
    forces : (n,) N, positive against +x
    """
    for i in range(c.n):
        forces[i] = 0.0
    f1 = now[DAMPER_FORCE] + now[EXTRA_FORCE]
    f0 = before[DAMPER_FORCE] + before[EXTRA_FORCE] if c.linear else f1
    forces[0] = f0 + share * (f1 - f0)
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        f1 = now[DEVICE_FORCES + k]
        f0 = before[DEVICE_FORCES + k] if c.linear else f1
        force = f0 + share * (f1 - f0)
        forces[upper] += force
        if lower != GROUND:
            forces[lower] -= force


def devices_at_first_level(inputs: Row, c: Constants) -> float:
    """Return the force of the building's own devices on the first level [N]."""
    total = 0.0
    for k in range(c.devices):
        if c.ends[2 * k + 1] == 0:
            total += inputs[DEVICE_FORCES + k]
        elif c.ends[2 * k] == 0:
            total -= inputs[DEVICE_FORCES + k]
    return total


def show_device_motion(c: Constants, state: Row, outputs: Row, at: int) -> None:
    """Give displacement and velocity of each device.

    Parameters
    ----------
    c : Constants
    state : begins with displacements and velocities of the n levels (2n,) [m, m/s]
    outputs : as in `structure.start`, changed in place
    at : place of the first device's outputs
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        for j in range(2):
            i = upper + j * c.n
            below = state[lower + j * c.n] if lower != GROUND else 0.0
            outputs[at + j] = state[i] - below
        at += PER_DEVICE


def load_upper_levels(inputs: Row, c: Constants, outputs: Row) -> None:
    """Add to the accelerations what devices do on the levels above the first.

    Parameters
    ----------
    inputs : (3 + d,) as in `structure.start`
    c : Constants
    outputs : as in `structure.start`, the absolute accelerations among them changed in place
    """
    n = c.n
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        force = inputs[DEVICE_FORCES + k]
        for i in range(n):
            row, at = i * n, PER_LEVEL * i + 2
            if upper > 0:
                outputs[at] -= c.m_inverse[row + upper] * force
            if lower > 0:
                outputs[at] += c.m_inverse[row + lower] * force


def show_holding_forces(
    inputs: Row, left: float, first: float, c: Constants, free: Row, outputs: Row, at: int
) -> None:  # fmt: skip
    """Give the force at which the ends of each device would not accelerate to each other.

    The other devices' forces stay. So does that of a contact, but for a device between the ground
    and the first level: as the damper, it holds first.

    Parameters
    ----------
    inputs : (3 + d,) as in `structure.start`
    left : what all devices' forces on the first level leave of what would hold it [N]
    first : force on the first level of all but the building's own devices [N]
    c : Constants
    free : (n,) absolute accelerations without any of these forces [m/s2]
    outputs : as in `structure.start`; the holding forces are filled
    at : place of the first device's
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        if upper == 0:
            outputs[at] = left + inputs[DEVICE_FORCES + k]
        else:
            apart = free[upper] - gain(GROUND, 0, lower, upper, c) * first
            apart -= free[lower] if lower != GROUND else inputs[GROUND_ACCELERATION]
            for j in range(c.devices):
                if j != k:  # else its own force would count by its rounding
                    each = gain(int(c.ends[2 * j]), int(c.ends[2 * j + 1]), lower, upper, c)
                    apart -= each * inputs[DEVICE_FORCES + j]
            outputs[at] = apart / gain(lower, upper, lower, upper, c)
        at += PER_DEVICE


def gain(lower: int, upper: int, below: int, above: int, c: Constants) -> float:
    """Return what a device's force takes off the acceleration of another's ends [1/kg].

    Parameters
    ----------
    lower, upper : levels that the first device connects
    below, above : levels that the other one connects, or the same
    c : Constants
    """
    total: float = c.m_inverse[above * c.n + upper]
    if lower != GROUND:
        total -= c.m_inverse[above * c.n + lower]
    if below != GROUND:
        total -= c.m_inverse[below * c.n + upper]
        if lower != GROUND:
            total += c.m_inverse[below * c.n + lower]
    return total


class Constants(NamedTuple):
    """What a structure computes with.

    `n`, `isolated`, `mass`, `m_inverse`, `damping`, `stiffness`, `stiffnesses` are those of
    `physics.structure.Matrices`; `p`, `on` the parameters and switches of effects, any of which is
    `active`, one of which is a contact that `touches`. `substeps` of `h` [s] make a step, whose
    matrices are `phi`, `held`, `ramp` (see `discretise`). Forces are `linear` over a step, or held.
    Each of the `devices` acts between two levels, which follow each other in `ends`, the lower one
    first; -1 is the ground.
    """

    n: int
    isolated: bool
    mass: float
    m_inverse: Row
    damping: Row
    stiffness: Row
    stiffnesses: Row
    p: Row
    on: Row
    active: bool
    touches: bool
    linear: bool
    substeps: int = 1
    h: float = 0.0
    phi: Row = ()
    held: Row = ()
    ramp: Row = ()
    devices: int = 0
    ends: Sequence[int] = ()


_NUMBERS, _MASS, _DAMPING, _STIFFNESS, _STIFFNESSES, _ENDS, _DEFAULTS = range(7)
_INTO_P, _SWITCHES, _CONTACTS, _STATES = range(7, 11)
_LEVELS, _ISOLATED, _DEVICES, _ATTACHED_MASS = range(4)
"""What is baked: see `bake`."""

_N, _IS_ISOLATED, _FIRST_MASS, _ACTIVE, _TOUCHES, _COUNT, _SUBSTEPS, _STEP = range(8)
_SCALARS, _M_INVERSE, _C, _K, _SPRINGS, _P, _ON, _LEVELS_OF_DEVICES = range(8)
_PHI, _HELD, _RAMP = range(8, 11)
"""Rows of the store, as `Constants` has them."""


def bake(building: Building, names: Sequence[str], slots: Slots) -> list[float]:
    """Return what a build fixes of a structure, rows packed one behind the other.

    They are: sizes and the index of the attached mass among the values, -1 for none; mass, damping
    and stiffness matrices and stiffnesses; the ends of the devices; the parameters of effects as
    they are without a value; pairs of a value's index and its slot in `p`; the index of each
    effect's switch, -1 where it has none; which of them are contacts; and for each state of effects
    the index of its start value, or -1.

    Parameters
    ----------
    building : Building
    names : of the values in their order: "attached_mass", "duffing.on", "duffing.k3",
        "NAME.STATE_0"
    slots : where effects have their places
    """
    at = {name: index for index, name in enumerate(names)}
    attached = at.get("attached_mass", -1)
    sizes = [building.size, building.isolated, len(building.devices), attached]
    matrices = [[value for row in matrix for value in row] for matrix in building[1:4]]
    # Never empty: compiled code takes what is empty for numbers of another kind.
    ends = [level for device in building.devices for level in device.levels] or [GROUND]
    into_p = [
        number
        for name, slot in slots.parameters.items()
        if name in at
        for number in (at[name], slot)
    ]
    switches = [at.get(f"{effect.name}.on", -1) for effect in slots.effects]
    contacts = [effect.contact for effect in slots.effects]
    states = [at.get(f"{name}_0", -1) for name in slots.states]
    return packed(
        sizes, *matrices, building.stiffnesses, ends, laws.pack({}, slots), into_p, switches,
        contacts, states,
    )  # fmt: skip


def room(n: int, slots: Slots) -> int:
    """Return the size of work of a structure of n levels."""
    return work_size(n) + 4 * n + 2 * laws.state_size(n, slots)


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
    numbers = row(baked, _NUMBERS)
    n, devices = int(numbers[_LEVELS]), int(numbers[_DEVICES])
    states = len(row(baked, _STATES)) * (n + 1)
    effects = len(row(baked, _DEFAULTS)) + len(row(baked, _SWITCHES))
    matrices = 3 * n * n + n + 4 * n * n + 4 * n * (n + 1)
    counts[0] = _RAMP + 1 + _STEP + 1 + matrices + effects + len(row(baked, _ENDS))
    counts[1] = 3 * n + states + 1
    drifts = n - int(numbers[_ISOLATED])
    counts[2] = PER_LEVEL * n + drifts + 1 + PER_DEVICE * devices
    step = fill_size(n) + 4 * n * n + 4 * n * (n + 1)
    counts[3] = max(step, 10 * n + 2 * states)
    return 0


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply, and the state at rest; `discretise` before a step.

    The state holds displacements and velocities (2n,), the states of effects, and what `settle`
    makes of them: absolute accelerations without devices (n,) and the holding force on still
    ground.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked, in SI; a switch is 1 or 0
    given : (3 + d,) not used
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; filled

    Returns
    -------
    int
        0.
    """
    numbers = row(baked, _NUMBERS)
    n, attached = int(numbers[_LEVELS]), int(numbers[_ATTACHED_MASS])
    square, at = n * n, open_row(store, _SCALARS, _STEP + 1)
    inverse_at, damping = open_row(store, _M_INVERSE, square), open_row(store, _C, square)
    stiffness, springs = open_row(store, _K, square), open_row(store, _SPRINGS, n)
    copy(row(baked, _DAMPING), 0, store, damping, square)
    copy(row(baked, _STIFFNESS), 0, store, stiffness, square)
    copy(row(baked, _STIFFNESSES), 0, store, springs, n)
    switch(values, baked, store)
    ends = row(baked, _ENDS)
    copy(ends, 0, store, open_row(store, _LEVELS_OF_DEVICES, len(ends)), len(ends))
    phi = open_row(store, _PHI, 4 * square)
    open_row(store, _HELD, 2 * n * (n + 1))
    open_row(store, _RAMP, 2 * n * (n + 1))

    room_to_work = store[phi : phi + 4 * square]  # no step is there yet
    mass, m_inverse = room_to_work[0:square], room_to_work[square : 2 * square]
    copy(row(baked, _MASS), 0, mass, 0, square)
    store[at + _FIRST_MASS] = mass[0]
    if attached >= 0:
        mass[0] += values[attached]
        store[at + _FIRST_MASS] = mass[0]
    invert(mass, n, m_inverse, room_to_work[2 * square : 4 * square])
    copy(m_inverse, 0, store, inverse_at, square)

    store[at + _N], store[at + _IS_ISOLATED] = numbers[_LEVELS], numbers[_ISOLATED]
    store[at + _COUNT], store[at + _SUBSTEPS], store[at + _STEP] = numbers[_DEVICES], 1.0, 0.0
    fill_states(values, baked, n, state)
    return 0


def switch(values: Row, baked: Row, store: Row) -> None:
    """Fill in parameters and switches of the effects, and what follows for the whole.

    Parameters
    ----------
    values, baked, store
        As in `setup`; the rows of `store` before these are there.
    """
    defaults, into_p = row(baked, _DEFAULTS), row(baked, _INTO_P)
    p = open_row(store, _P, len(defaults))
    copy(defaults, 0, store, p, len(defaults))
    for i in range(0, len(into_p), 2):
        store[p + int(into_p[i + 1])] = values[int(into_p[i])]
    switches, contacts = row(baked, _SWITCHES), row(baked, _CONTACTS)
    on, at = open_row(store, _ON, len(switches)), place(store, _SCALARS)
    store[at + _ACTIVE] = store[at + _TOUCHES] = 0.0
    for k in range(len(switches)):
        given = int(switches[k])
        store[on + k] = 1.0 if given >= 0 and values[given] != 0.0 else 0.0
        if store[on + k] != 0.0:
            store[at + _ACTIVE] = 1.0
            if contacts[k] != 0.0:
                store[at + _TOUCHES] = 1.0


def fill_states(values: Row, baked: Row, n: int, state: Row) -> None:
    """Fill in the state at rest, the states of effects at their start values on each level.

    Parameters
    ----------
    values, baked, state
        As in `setup`.
    n : number of levels
    """
    starts = row(baked, _STATES)
    for i in range(len(state)):
        state[i] = 0.0
    at = 2 * n
    for _ in range(n + 1):
        for k in range(len(starts)):
            if starts[k] >= 0.0:
                state[at] = values[int(starts[k])]
            at += 1


def constants(store: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views."""
    c = row(store, _SCALARS)
    return Constants(
        int(c[_N]), c[_IS_ISOLATED] != 0.0, c[_FIRST_MASS], row(store, _M_INVERSE),
        row(store, _C), row(store, _K), row(store, _SPRINGS), row(store, _P), row(store, _ON),
        c[_ACTIVE] != 0.0, c[_TOUCHES] != 0.0, False, int(c[_SUBSTEPS]), c[_STEP],
        row(store, _PHI), row(store, _HELD), row(store, _RAMP), int(c[_COUNT]),
        row(store, _LEVELS_OF_DEVICES),
    )  # fmt: skip


def discretise(dt: float, store: Row, work: Row) -> None:
    """Fill in the matrices of a step: whenever its length differs from the last one's.

    Parameters
    ----------
    dt : length of the step [s]
    store : as `setup` has filled it
    work : room to work, of the size that `sizes` gives
    """
    at = place(store, _SCALARS)
    n = int(store[at + _N])
    whole, forced = 4 * n * n, 2 * n * (n + 1)
    substeps = 1
    if store[at + _ACTIVE] != 0.0:
        substeps = max(1, int(dt / EFFECT_STEP + 0.999999))
    h = dt / substeps
    phi, held = work[0:whole], work[whole : whole + forced]
    ramp = work[whole + forced : whole + 2 * forced]
    spare = work[whole + 2 * forced : whole + 2 * forced + fill_size(n)]
    m_inverse, damping, stiffness = row(store, _M_INVERSE), row(store, _C), row(store, _K)
    fill_step(n, m_inverse, damping, stiffness, h, phi, held, ramp, spare)
    copy(phi, 0, store, place(store, _PHI), whole)
    copy(held, 0, store, place(store, _HELD), forced)
    copy(ramp, 0, store, place(store, _RAMP), forced)
    store[at + _SUBSTEPS], store[at + _STEP] = float(substeps), h


def laid_down(
    building: Building, values: Mapping[str, float], effects: Sequence[str]
) -> tuple[list[float], list[float], list[float]]:
    """Return store, state and work of a structure from values by name, for its `functions_of`."""
    names = [*values, *(f"{effect}.on" for effect in effects)]
    numbers = [*values.values(), *(1.0 for _ in effects)]
    baked, counts = bake(building, names, laws.functions_of(effects).slots), [0.0] * 4
    sizes(numbers, baked, counts)
    store, state, _, work = ([0.0] * int(count) for count in counts)
    setup(numbers, [], baked, store, state)
    return store, state, work


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Begin at rest, in balance with nothing yet: the state follows no input.

    Parameters
    ----------
    time : s, not used
    inputs : (3 + d,) ground acceleration [m/s2], damper force [N], extra force [N]; the force [N]
        of each of the d devices
    c : Constants
    state : as `setup` leaves it; what `settle` makes of it is filled
    outputs : displacement [m], velocity [m/s], absolute acceleration [m/s2] of each of the n
        levels; the drifts [m], n of them or, isolated, n - 1; the holding force [N]; displacement
        [m], velocity [m/s] and holding force [N] of each of the d devices; filled
    work : (`room(n, slots)`,) room to work

    Returns
    -------
    int
        0.
    """
    settle(c, state, work)
    show_motion(c, state, outputs)
    return output(time, inputs, c, state, outputs, work)


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Advance over one step: the ground linear, the devices' force held unless `c.linear`.

    A caller that sweeps, `c.linear`, gets the motion, drifts included; on what it keeps it calls
    `settle` before it asks for the other outputs.

    Parameters
    ----------
    clock : tuple
        Time at the start [s], dt [s], sweep: 0 for the first of a step.
    before, now : (3 + d,) inputs at begin and end, as in `start`
    c : Constants
        With the matrices of a step of dt, as `discretise` returns them.
    state, new_state : states at begin (kept) and end (filled), as `setup` lays them down
    outputs : as in `start`, filled
    work : (`room(n, slots)`,) room to work, kept from one sweep of a step to the next

    Returns
    -------
    int
        0.
    """
    n, size = c.n, 2 * c.n
    a0, a1 = before[GROUND_ACCELERATION], now[GROUND_ACCELERATION]
    if c.active:
        effect_steps(before, now, c, state, new_state, work)
    else:
        # Without the devices' force no sweep differs from the one before.
        if clock[2] == 0 or work[size] != a1:
            free_step(n, c.phi, c.held, c.ramp, state, a0, a1, work)
            work[size] = a1
        for i in range(size):
            new_state[i] = work[i]
        f1 = now[DAMPER_FORCE] + now[EXTRA_FORCE]
        f0 = before[DAMPER_FORCE] + before[EXTRA_FORCE] if c.linear else f1
        add_force(n, c.held, c.ramp, 0, f0, f1, new_state)
        if c.devices > 0:
            add_devices(before, now, c, new_state)
    show_motion(c, new_state, outputs)
    if c.linear:
        return 0
    settle(c, new_state, work)
    return output(clock[0] + clock[1], now, c, new_state, outputs, work)


def effect_steps(
    before: Row, now: Row, c: Constants, state: Row, new_state: Row, work: Row
) -> None:
    """Advance motion and states of effects over the substeps of a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `start`; the ground acceleration goes
        linearly from one to the other
    c : Constants
    state, new_state : states at begin (kept) and end (filled), as `setup` lays them down
    work : (`room(n, slots)`,) room to work
    """
    n, size, states = c.n, 2 * c.n, len(state) - 3 * c.n - 1
    room = work[0 : 6 * n]
    x0 = work[6 * n : 8 * n]
    f0, f1 = work[8 * n : 9 * n], work[9 * n : 10 * n]
    z0 = work[10 * n : 10 * n + states]
    z1 = work[10 * n + states : 10 * n + 2 * states]
    copy(state, 0, new_state, 0, size)
    copy(state, size, z1, 0, states)
    setup = Setup(n, c.isolated, c.stiffnesses, c.phi, c.held, c.ramp, c.h, c.p, c.on, True)
    a0, a1 = before[GROUND_ACCELERATION], now[GROUND_ACCELERATION]
    forces_between(before, now, 0.0, c, f1)
    for k in range(c.substeps):
        s, e = k / c.substeps, (k + 1.0) / c.substeps
        copy(new_state, 0, x0, 0, size)
        copy(z1, 0, z0, 0, states)
        copy(f1, 0, f0, 0, n)
        forces_between(before, now, e, c, f1)
        loads = Loads(a0 + s * (a1 - a0), a0 + e * (a1 - a0), f0, f1, 0.0)
        effects_step(setup, loads, x0, z0, new_state, z1, room)
    copy(z1, 0, new_state, size, states)


def settle(c: Constants, state: Row, work: Row) -> None:
    """Put what follows from the state alone behind it, so that a new force costs little."""
    n, end = c.n, len(state) - c.n - 1
    loads, unloaded = work[3 * n : 4 * n], work[4 * n : 5 * n]  # behind what sweeps share
    if c.active:
        resting_forces(n, c.isolated, c.stiffnesses, state, state[2 * n : end], c.p, c.on, loads)
    else:
        for i in range(n):
            loads[i] = 0.0
    accelerations(n, c.m_inverse, c.damping, c.stiffness, state, loads, unloaded)
    copy(unloaded, 0, state, end, n)
    state[end + n] = holding_force(n, c.damping, c.stiffness, c.mass, state, 0.0, loads[0])


def show_motion(c: Constants, state: Row, outputs: Row) -> None:
    """Give displacements, velocities and drifts of a state, and the motion of devices."""
    n, at = c.n, 0
    for i in range(n):
        outputs[at], outputs[at + 1] = state[i], state[n + i]
        at += PER_LEVEL
    for i in range(1 if c.isolated else 0, n):
        outputs[at] = state[i] - (state[i - 1] if i > 0 else 0.0)
        at += 1
    if c.devices > 0:
        show_device_motion(c, state, outputs, at + 1)


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Let absolute accelerations and holding forces follow the inputs, the motion held.

    A contact that sticks carries what the devices' force leaves of the holding force, for the
    devices hold first; the level then has the ground's acceleration.

    Parameters
    ----------
    time : s, not used
    inputs : (3 + d,) as in `start`
    c : Constants
    state : as `setup` lays it down, after `settle`; kept
    outputs : as in `start`; displacements, velocities and drifts stay, the others are filled
    work : not used

    Returns
    -------
    int
        0.
    """
    n, end = c.n, len(state) - c.n - 1
    others = inputs[EXTRA_FORCE]
    if c.devices > 0:
        others += devices_at_first_level(inputs, c)
    force = inputs[DAMPER_FORCE] + others
    hold = state[end + n] - c.mass * inputs[GROUND_ACCELERATION]
    left, contact = hold - force, 0.0
    if c.touches:
        stick = stick_force(left, state[n], c.mass, EFFECT_STEP)
        contact = resting_contact(
            n, c.isolated, c.stiffnesses, state, stick, state[2 * n : end], c.p, c.on
        )
        force += contact
    m_inverse, at = c.m_inverse, 2
    for i in range(n):
        outputs[at] = state[end + i] - m_inverse[i * n] * force
        at += PER_LEVEL
    at = PER_LEVEL * n + (n - 1 if c.isolated else n)
    outputs[at] = hold - others
    if c.devices > 0:
        load_upper_levels(inputs, c, outputs)
        first, free = inputs[DAMPER_FORCE] + inputs[EXTRA_FORCE] + contact, state[end : end + n]
        show_holding_forces(inputs, left, first, c, free, outputs, at + PER_DEVICE)
    return 0


class StructureModel:
    """A building and its state, ready to step in plain Python outside an FMU.

    `x` (2n,) [m, m/s] and `z`, the states of effects, may be set; `settle` then.
    """

    def __init__(
        self,
        building: Building,
        values: dict[str, float] | None = None,
        effects: list[str] | None = None,
    ) -> None:
        self.m = matrices(building)
        link = functions_of(effects or []).link
        self._settle, self._step, self._output = map(link, (settle, step, output))
        self._store, state, self._work = laid_down(building, values or {}, effects or [])
        self.constants = constants(self._store)
        size = 2 * self.m.n
        self.x, self.z = state[0:size], state[size : len(state) - self.m.n - 1]
        self.p, self.on = self.constants.p, self.constants.on
        self._idle = [0.0] * len(building.devices)
        shown = PER_LEVEL * self.m.n + self.m.n + 1 + PER_DEVICE * len(building.devices)
        self._outputs = [0.0] * shown
        self._h = 0.0
        self.settle()

    def settle(self) -> None:
        """Compute what follows from the state, which was set from outside."""
        self._state = [*self.x, *self.z, *[0.0] * (self.m.n + 1)]
        self._settle(self.constants, self._state, self._work)

    def step(self, dt: float, a0: float, a1: float, force: float) -> None:
        """Advance over one step, the ground acceleration linear and the devices' force held.

        Parameters
        ----------
        dt : length of the step [s]
        a0, a1 : ground acceleration at begin and end [m/s2]
        force : of the devices on the first level [N], positive against +x
        """
        if dt != self._h:
            discretise(dt, self._store, self._work)
            self.constants, self._h = constants(self._store), dt
        new = list(self._state)
        inputs = [a0, 0.0, 0.0, *self._idle], [a1, force, 0.0, *self._idle]
        clock = (0.0, dt, 0)
        self._step(clock, *inputs, self.constants, self._state, new, self._outputs, self._work)
        self._state, size = new, 2 * self.m.n
        self.x, self.z = new[0:size], new[size : size + len(self.z)]

    def absolute_accelerations(self, force: float, a_g: float = 0.0) -> list[float]:
        """Return q'' + a_g (n,) [m/s2] under the devices' force [N] on the first level."""
        self._show(a_g, force, 0.0)
        return self._outputs[2 : PER_LEVEL * self.m.n : PER_LEVEL]

    def holding_force(self, a_g: float, others: float) -> float:
        """Return the damper force [N] at which the first level stays at its velocity."""
        self._show(a_g, 0.0, others)
        return self._outputs[PER_LEVEL * self.m.n + self.m.n - self.m.isolated]

    def _show(self, a_g: float, force: float, extra: float) -> None:
        inputs = [a_g, force, extra, *self._idle]
        self._output(0.0, inputs, self.constants, self._state, self._outputs, self._work)

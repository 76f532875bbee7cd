"""What a building, its parameters and the length of a step imply of a structure's constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..physics import structure as laws
from ..physics.building import Building
from ..physics.codegen import Slots
from ..physics.device import GROUND
from ..physics.linear import Row, copy, invert
from ..physics.rows import open_row, packed, place, row
from ..physics.structure import EFFECT_STEP, fill_size, fill_step, work_size
from .devices import PER_DEVICE, PER_LEVEL


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

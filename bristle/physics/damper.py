"""A damper: law, effects and their states, set up from names, evaluated, advanced over a step.

One source for both paths. `evaluate` gives the force at given motion, voltage and state; `step`
advances the state over a time step and gives the force at its end. Both take records (`inputs`)
and flat sequences (`generate.Slots`): lists inside FMUs, arrays under numba.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from ..errors import PhysicsError
from .command import MOST_KNOTS
from .damper_source import (
    LIBRARY,
    SETS,
    advance_law,
    changed,
    evaluate,
    felt_voltage,
    functions_of,
    hold_law,
    inner_motion,
    is_friction,
    law_factors,
    law_force,
    series_element,
    step_law,
)
from .generate import Slots
from .law import LAWS, WHOLE, law_code
from .linear import Row, open_row, packed, place, row
from .series import INSTANT, SETTLE, Balance, advance_implicit, advance_series, balanced_speed
from .tuples import Inputs, Setup, record

__all__ = [
    "LIBRARY", "SETS", "DamperModel", "change_parameters", "changes_of", "evaluate", "force_at",
    "functions_of", "hold_law", "jump", "law_force", "room", "setup_of", "start_states", "step",
    "step_law",
]  # fmt: skip


# What a damper's parameters and switches imply, from flat numbers into flat numbers.
#
# `bake` lays down once which value belongs where, for a law and the names of a component's values.
# `fill` then runs on lists inside FMUs and on arrays in compiled code, and knows no name.

NUMBERS, DEFAULTS, INTO_P, INTO_Z, SWITCHES, TRAITS, MOVING, CHANGES = range(8)
"""Rows of what is baked: see `bake`."""

BAKED_ROWS = 8
"""How many rows `bake` gives; a component's own come behind them."""

_CODE, _OWN_STATES, _EXACT, _SIGNED, _LAGS, _STATES = range(6)
_ADVANCES, _JOINT, _FRICTION, _WORKS, _HEATS, _TRAITS = range(6)

_LAW, _N_MOVING, _ADVANCING, _N_OWN, _SIGNS, _ACTIVE, _LAGGING, _HEATED, _SERIES = range(9)
_OF_SETUP, _P, _ON, _MOVING = range(4)

STORE_ROWS = 4
"""How many rows `fill` writes; a component's own come behind them."""


def parameter_places(law: str, slots: Slots) -> dict[str, list[int]]:
    """Return the slots in `p` of each parameter of a law and of all effects, by its name."""
    kind = LAWS[law]
    places: dict[str, list[int]] = {name: [] for name in kind.parameters}
    for slot, name in enumerate(kind.base.parameters):
        if name in places:
            places[name].append(slot)
    if kind.form:
        for k, form in enumerate(kind.command.values()):
            names = [name for one in form.names() for name in kind.listed(one)]
            if len(names) <= MOST_KNOTS:  # else it is a table of the law's own, which stays
                own = slots.law_parameters + MOST_KNOTS * (k + 1)
                for i, name in enumerate(names):
                    places[name].append(own + i)
    places.update({name: [slot] for name, slot in slots.parameters.items()})
    return places


def state_places(law: str, slots: Slots) -> dict[str, int]:
    """Return the slot in `z` of each start value of a law and of all effects, by its name."""
    places = {f"{name}_0": slot for slot, name in enumerate(LAWS[law].states)}
    return {**places, **{f"{name}_0": slot for name, slot in slots.states.items()}}


def changes_of(law: str, slots: Slots) -> list[float]:
    """Return pairs of an effect that changes a parameter and a slot of that parameter in `p`."""
    places = parameter_places(law, slots)
    return [
        float(number)
        for k, effect in enumerate(slots.effects)
        for name in (LAWS[law].linear() if effect.changes == WHOLE else (effect.changes,))
        for slot in places.get(name, ())
        for number in (k, slot)
    ]


def change_parameters(p: Row, on: Any, changes: Row) -> None:
    """Let the effects that are on change the parameters that depend on a label, in place.

    Parameters
    ----------
    p : flat parameters as they are without
    on : (effects,) whether each is on
    changes : pairs as `changes_of` returns them
    """
    for i in range(0, len(changes), 2):
        k, slot = int(changes[i]), int(changes[i + 1])
        if on[k] != 0.0:
            p[slot] = changed(k, p[slot], p)


def pack_into(law: str, values: Mapping[str, float], slots: Slots) -> list[float]:
    """Return the flat parameters of a law and of all effects; missing ones take their defaults.

    Behind the law's own stand the knots and numbers of a chosen form, where `command.entered` reads
    them.
    """
    kind, p = LAWS[law], [0.0] * slots.p_size
    p[slots.law_parameters : slots.law_parameters + len(kind.knots)] = kind.knots
    defaults = {name: parameter.value for name, parameter in kind.parameters.items()}
    for effect in slots.effects:
        for name, parameter in effect.parameters.items():
            defaults[f"{effect.name}.{name}"] = parameter.value
    for name, places in parameter_places(law, slots).items():
        for slot in places:
            p[slot] = values.get(name, defaults[name])
    return p


def bake(law: str, names: Sequence[str], slots: Slots) -> list[list[float]]:
    """Return the rows that say where a damper's values belong.

    They are: numbers of the law; the defaults of `p`; pairs of a value's index and its slot in `p`;
    such pairs for `z`; the index of each effect's switch, -1 where it has none; five traits of
    each effect (its states advance, it is in series, it is friction, it is at work over a run, it
    knows the energy); pairs of an effect and the slot of a state that moves by its rate; pairs of
    `changes_of`.

    Parameters
    ----------
    law : a damper's law, such as "bingham"
    names : of the values, in their order: "f_c", "gas_spring.on", "gas_spring.k",
        "coil_lag.voltage_0"; a name that is none of law and effects is left out
    slots : where law and effects have their places
    """
    kind, at = LAWS[law], {name: index for index, name in enumerate(names)}
    code, own = law_code(law, slots.laws), len(kind.states)
    numbers = [code, own, kind.exact(), kind.has("sign"), bool(kind.felt)]
    into_p = [
        (at[name], slot)
        for name, places in parameter_places(law, slots).items()
        if name in at
        for slot in places
    ]
    into_z = [(at[name], slot) for name, slot in state_places(law, slots).items() if name in at]
    traits = []
    for effect in slots.effects:
        series, friction = bool(effect.joint), is_friction(effect)
        works, heats = not effect.changes, "energy" in effect.needs
        traits.append(("advance" in effect.hooks(), series, friction, works, heats))
    moving = [
        (k, slots.states[f"{effect.name}.{state}"])
        for k, effect in enumerate(slots.effects)
        if "rate" in effect.hooks()
        for state in effect.states
        if state not in effect.joint
    ]
    switches = [at.get(f"{effect.name}.on", -1) for effect in slots.effects]
    rows: list[list[float]] = [[*numbers, slots.z_size], pack_into(law, {}, slots)]
    rows += [_flat(into_p), _flat(into_z), [*switches], _flat(traits), _flat(moving)]
    return [*rows, changes_of(law, slots)]


def _flat(pairs: Sequence[tuple[float, ...]]) -> list[float]:
    return [value for pair in pairs for value in pair]


def refusals(slots: Slots) -> dict[int, str]:
    """Return what the negative codes of `fill` mean."""
    joint = [(k, e.name) for k, e in enumerate(e for e in slots.effects if e.joint)]
    return {
        -1 - sum(2**k for k, _ in chosen): "{} are series elements: one is right.".format(
            " and ".join(name for _, name in chosen)
        )
        for count in range(2, len(joint) + 1)
        for chosen in combinations(joint, count)
    }


def store_size(baked: Row) -> int:
    """Return how many floats `fill` writes."""
    own = _SERIES + 1 + len(row(baked, DEFAULTS)) + len(row(baked, SWITCHES))
    return STORE_ROWS + own + max(1, states_of(baked))


def states_of(baked: Row) -> int:
    """Return how many states law and effects have room for: `Slots.z_size`."""
    return int(row(baked, NUMBERS)[_STATES])


def fill(values: Row, baked: Row, store: Row, z: Row) -> int:
    """Fill in what values imply of a damper, and the states at the start.

    Parameters
    ----------
    values : in the order of the names that were baked, in SI; a switch is 1 or 0
    baked : the rows of `bake`, packed; more may follow
    store : (`store_size`,) or more, its first rows filled; `setup_from` reads them
    z : (`Slots.z_size`,) or more states of law and effects, filled

    Returns
    -------
    int
        0; negative if effects exclude each other: see `refusals`.
    """
    law, defaults = row(baked, NUMBERS), row(baked, DEFAULTS)
    at = open_row(store, _OF_SETUP, _SERIES + 1)
    p = open_row(store, _P, len(defaults))
    for i in range(len(defaults)):
        store[p + i] = defaults[i]
    into_p = row(baked, INTO_P)
    for i in range(0, len(into_p), 2):
        store[p + int(into_p[i + 1])] = values[int(into_p[i])]
    for i in range(int(law[_STATES])):
        z[i] = 0.0
    into_z = row(baked, INTO_Z)
    for i in range(0, len(into_z), 2):
        z[int(into_z[i + 1])] = values[int(into_z[i])]
    code = switch(values, baked, store)
    if code < 0:
        return code
    changing = row(baked, CHANGES)
    if len(changing) > 0:
        own = row(store, _P)  # in plain Python a copy
        change_parameters(own, row(store, _ON), changing)
        for i in range(len(own)):
            store[p + i] = own[i]
    exact = law[_EXACT] != 0.0
    store[at + _N_MOVING] = float(list_moving(baked, store))
    store[at + _LAW], store[at + _LAGGING] = law[_CODE], law[_LAGS]
    store[at + _N_OWN] = law[_OWN_STATES] if exact else 0.0
    if not exact:
        store[at + _ACTIVE] = 1.0
    return 0


def switch(values: Row, baked: Row, store: Row) -> int:
    """Fill in which effects are on, and what follows for the whole.

    Parameters
    ----------
    values, baked, store
        As in `fill`; the rows of `store` before that of the switches are there.

    Returns
    -------
    int
        As `fill`.
    """
    switches, traits = row(baked, SWITCHES), row(baked, TRAITS)
    at, on = place(store, _OF_SETUP), open_row(store, _ON, len(switches))
    store[at + _ACTIVE] = store[at + _ADVANCING] = store[at + _HEATED] = 0.0
    store[at + _SIGNS] = row(baked, NUMBERS)[_SIGNED]
    series, bit, code = 0, 1, -1
    for k in range(len(switches)):
        given = int(switches[k])
        store[on + k] = 1.0 if given >= 0 and values[given] != 0.0 else 0.0
        joint = traits[_TRAITS * k + _JOINT] != 0.0
        if store[on + k] != 0.0 and traits[_TRAITS * k + _WORKS] != 0.0:
            store[at + _ACTIVE] = 1.0
            if traits[_TRAITS * k + _ADVANCES] != 0.0:
                store[at + _ADVANCING] = 1.0
            if traits[_TRAITS * k + _HEATS] != 0.0:
                store[at + _HEATED] = 1.0
            if traits[_TRAITS * k + _FRICTION] != 0.0:
                store[at + _SIGNS] = 1.0
            if joint:
                series += 1
                code -= bit
        if joint:
            bit *= 2
    store[at + _SERIES] = float(series)
    return code if series > 1 else 0


def list_moving(baked: Row, store: Row) -> int:
    """List the slots of the states that move by `rate`; return how many they are.

    The law's own states move with those of effects, unless a series element carries them along;
    alone, where the law has no `advance`.

    Parameters
    ----------
    baked, store
        As in `fill`; the rows of `store` before that of the moving states are there.
    """
    law, pairs = row(baked, NUMBERS), row(baked, MOVING)
    on, moving = place(store, _ON), open_row(store, _MOVING, max(1, int(law[_STATES])))
    carried = store[place(store, _OF_SETUP) + _SERIES] != 0.0
    n = 0
    for i in range(0, len(pairs), 2):
        if store[on + int(pairs[i])] != 0.0:
            n += 1
    own = int(law[_OWN_STATES]) if (n > 0 or law[_EXACT] == 0.0) and not carried else 0
    for i in range(own):
        store[moving + i] = float(i)
    n = own
    for i in range(0, len(pairs), 2):
        if store[on + int(pairs[i])] != 0.0:
            store[moving + n] = pairs[i + 1]
            n += 1
    return n


def setup_from(store: Row) -> Setup:
    """Return the setup that `fill` has laid down; in compiled code its rows are views."""
    at = place(store, _OF_SETUP)
    return Setup(
        int(store[at + _LAW]), row(store, _P), row(store, _ON), row(store, _MOVING),
        int(store[at + _N_MOVING]), store[at + _ADVANCING] != 0.0, int(store[at + _N_OWN]),
        store[at + _SIGNS] != 0.0, store[at + _ACTIVE] != 0.0, store[at + _LAGGING] != 0.0,
        store[at + _HEATED] != 0.0,
    )  # fmt: skip


def step(
    setup: Setup, begin: Inputs, end: Inputs, z0: Row, z1: Row, work: Row
) -> tuple[float, float]:
    """Advance a damper over a step; return its force [N] at the end and the friction in it [N].

    Parameters
    ----------
    setup : Setup
    begin, end : Inputs
        At begin and end of the step of end.dt [s], which `begin` names too. Give the end twice
        where the input is held: with the newest motion held the bristle leads by half a step and
        makes good the half step by which a held force lags behind (measured: half-sine peaks within
        0.7 % instead of 1.1 % at 2 ms).
    z0, z1 : sequence of float
        State at begin (kept) and at end (filled).
    work : sequence of float
        Room for `room(len(z0))` floats.
    """
    if not setup.active:
        return step_law(setup.law, setup.p, begin, end, z0, z1)  # type: ignore[no-any-return]
    size = len(z0)
    for i in range(size):
        z1[i] = z0[i]
    deflection, speed = series_element(setup.on)
    n_own = setup.n_own if setup.n_moving == 0 and speed < 0 else 0
    moved = work[2 * size : 3 * size]
    if n_own > 0:
        xs, vs = inner_motion(setup, begin, z0)
        xe, ve = inner_motion(setup, end, z0)
        V = 0.5 * (felt_voltage(setup, begin, z0) + felt_voltage(setup, end, z0))
        inner = Inputs(
            0.5 * (xs + xe), 0.5 * (vs + ve), end.a, V, end.dt, end.energy, end.stick_force,
            end.sticks,
        )  # fmt: skip
        advance_law(setup.law, setup.p, inner, law_factors(setup, inner, z0), z0, moved)
        for i in range(n_own):  # the law's share of the heat is that of the middle
            z1[i] = 0.5 * (z0[i] + moved[i])
    if setup.advances:
        # At the middle of the step: second order where the inputs move, exact where they are held.
        middle = Inputs(
            0.5 * (begin.x + end.x), 0.5 * (begin.v + end.v), 0.5 * (begin.a + end.a),
            0.5 * (begin.V + end.V), end.dt, end.energy, end.stick_force, end.sticks,
        )  # fmt: skip
        evaluate(setup, middle, z1, work[0:size], z1)
        for i in range(n_own):
            z1[i] = moved[i]
        # And on to the end, without time: what depends on a signal alone ends where that does.
        evaluate(setup, without_time(end), z1, work[0:size], z1)
    for i in range(n_own):
        z1[i] = moved[i]
    if speed >= 0:
        advance_series(setup, begin, end, z1, deflection, speed)
    if setup.n_moving > 0:
        advance_implicit(setup, begin, end, z1, work)
    return evaluate(setup, end, z1, work[0:size], work[size : 2 * size])  # type: ignore[no-any-return]


def without_time(now: Inputs) -> Inputs:
    """Return the same inputs for a step in which no time goes by."""
    return Inputs(now.x, now.v, now.a, now.V, 0.0, now.energy, now.stick_force, now.sticks)


def force_at(setup: Setup, now: Inputs, z: Row, work: Row) -> tuple[float, float]:
    """Return force and friction [N] at a state, as `evaluate` does; nothing moves on.

    Parameters
    ----------
    setup, now : Setup, Inputs
    z : (k,) state, kept
    work : (k,) or more, room to work
    """
    if not setup.active:
        return law_force(setup.law, setup.p, now, z)  # type: ignore[no-any-return]
    return evaluate(setup, now, z, work, work)  # type: ignore[no-any-return]


def jump(setup: Setup, now: Inputs, z: Row, work: Row) -> float:
    """Bring the state to a voltage that has jumped to now.V [V]; return the force [N].

    No time goes by: states that depend on the voltage alone follow it, and a series mass, too small
    to be felt between samples, comes to rest in its new balance.

    Parameters
    ----------
    setup, now : Setup, Inputs; now.dt [s] is what `Q.dt` tells the forces
    z : (k,) state, changed in place
    work : (2k,) or more, room to work
    """
    size = len(z)
    rates, after = work[0:size], work[size : 2 * size]
    evaluate(setup, without_time(now), z, rates, z)
    deflection, speed = series_element(setup.on)
    if speed >= 0:
        instant = Inputs(now.x, now.v, now.a, now.V, INSTANT, now.energy, 0.0, False)
        balance = Balance(instant, now.v, SETTLE, z[deflection], z[speed], 0.5)
        z[speed] = balanced_speed(setup, balance, z[speed], 0.0, z)[0]
    return evaluate(setup, now, z, rates, after)[0]  # type: ignore[no-any-return]


def room(size: int) -> int:
    """Return how many floats `step` needs as room to work, where the states are so many."""
    return 7 * size + 2 * size * size


def setup_of(
    law: str, values: Mapping[str, float], effects: Sequence[str], row: Any = list,
    whole: Any = list,
) -> Setup:  # fmt: skip
    """Return the setup of a damper, for its `functions_of`.

    Parameters
    ----------
    law : str
        A damper's law, such as "bingham".
    values : dict
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes its default.
    effects : sequence of str
        The effects that are on.
    row, whole : callable
        What makes sequences of numbers, of switches and slots, from lists.

    Raises
    ------
    PhysicsError
        If two effects are series elements.
    """
    names = [*values, *(f"{effect}.on" for effect in effects)]
    functions = functions_of(law, effects)
    slots = functions.slots
    baked = packed(*bake(law, names, slots))
    store, z = [0.0] * store_size(baked), [0.0] * slots.z_size
    if code := functions.link(fill)([*values.values(), *(1.0 for _ in effects)], baked, store, z):
        raise PhysicsError(refusals(slots)[code])
    setup = setup_from(store)
    moving = [int(slot) for slot in setup.moving[: setup.n_moving]]
    on = [switch != 0.0 for switch in setup.on]
    return setup._replace(p=row(setup.p), on=whole(on or [False]), moving=whole(moving or [0]))


def start_states(law: str, values: Mapping[str, float], slots: Slots) -> list[float]:
    """Return the states at the start; start values end in `_0`: "coil_lag.voltage_0"."""
    z = [0.0] * slots.z_size
    for name, slot in state_places(law, slots).items():
        z[slot] = values.get(name, 0.0)
    return z


class DamperModel:
    """A damper's law, effects, parameters and state, ready to step in plain Python.

    Parameters
    ----------
    law : str
        A damper's law, such as "bingham".
    values : dict
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes its default. Start
        values of states end in `_0` ("bristle_deflection_0", "coil_lag.voltage_0").
    effects : list of str
        The effects that are on.

    Attributes
    ----------
    functions : Functions
        What it is made of; a user's own law or effect has functions of its own.
    """

    def __init__(
        self, law: str, values: dict[str, float] | None = None, effects: list[str] | None = None
    ) -> None:
        values, effects = values or {}, effects or []
        self.functions = functions_of(law, effects)
        self.setup = setup_of(law, values, effects)
        self.law, self.p, self.on = self.setup.law, self.setup.p, self.setup.on
        self.active = self.setup.active
        self.moving = list(self.setup.moving[: self.setup.n_moving])
        self.advances = self.setup.advances
        self.z = start_states(law, values, self.functions.slots)
        self._work = [0.0] * room(len(self.z))
        self._end = list(self.z)
        self._force, self._step = map(self.functions.link, (force_at, step))
        self._hold_law = self.functions.made["hold_law"]

    def force(
        self, x: float, v: float, a: float, V: float, dt: float, energy: float,
        stick_force: float, sticks: bool,
    ) -> float:  # fmt: skip
        """Return the force [N] at the present state, without advancing it.

        Parameters
        ----------
        x, v, a, V : displacement [m], velocity [m/s], acceleration [m/s2], voltage [V]
        dt : length of the step [s]
        energy : dissipated so far [J]
        stick_force, sticks : force [N] that would stop the motion within dt; whether it is known
        """
        now = record(Inputs, (x, v, a, V, dt, energy, stick_force, sticks))
        return self._force(self.setup, now, self.z, self._work)[0]  # type: ignore[no-any-return]

    def step(
        self, x: float, v: float, a: float, V: float, dt: float, energy: float,
        stick_force: float, sticks: bool,
    ) -> float:  # fmt: skip
        """Advance over a step, the inputs held; return the force [N] at the end.

        Parameters
        ----------
        x, v, a, V, dt, energy, stick_force, sticks
            As in `force`.
        """
        now = record(Inputs, (x, v, a, V, dt, energy, stick_force, sticks))
        if self.active:
            force = self._step(self.setup, now, now, self.z, self._end, self._work)[0]
        else:
            force = self._hold_law(self.law, self.p, now, self.z, self._end)[0]
        self.z, self._end = self._end, self.z
        return force  # type: ignore[no-any-return]

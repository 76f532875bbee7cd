"""What a damper's parameters and switches imply, from flat numbers into flat numbers.

`bake` lays down once which value belongs where, for a law and the names of a component's values.
`fill` then runs on lists inside FMUs and on arrays in compiled code, and knows no name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from .codegen import Slots
from .command import MOST_KNOTS
from .damper_source import is_friction
from .inputs import Setup
from .law import LAWS, law_code
from .linear import Row
from .rows import open_row, place, row

NUMBERS, DEFAULTS, INTO_P, INTO_Z, SWITCHES, TRAITS, MOVING = range(7)
"""Rows of what is baked: see `bake`."""

BAKED_ROWS = 7
"""How many rows `bake` gives; a component's own come behind them."""

_CODE, _OWN_STATES, _EXACT, _SIGNED, _LAGS, _STATES = range(6)
_ADVANCES, _JOINT, _FRICTION = range(3)

_LAW, _N_MOVING, _ADVANCING, _N_OWN, _SIGNS, _ACTIVE, _LAGGING, _SERIES = range(8)
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


def pack(law: str, values: Mapping[str, float], slots: Slots) -> list[float]:
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
    such pairs for `z`; the index of each effect's switch, -1 where it has none; three traits of
    each effect (its states advance, it is in series, it is friction); pairs of an effect and the
    slot of a state that moves by its rate.

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
    traits = [
        ("advance" in effect.hooks(), bool(effect.joint), is_friction(effect))
        for effect in slots.effects
    ]
    moving = [
        (k, slots.states[f"{effect.name}.{state}"])
        for k, effect in enumerate(slots.effects)
        if "rate" in effect.hooks()
        for state in effect.states
        if state not in effect.joint
    ]
    switches = [at.get(f"{effect.name}.on", -1) for effect in slots.effects]
    rows: list[list[float]] = [[*numbers, slots.z_size], pack(law, {}, slots)]
    rows += [_flat(into_p), _flat(into_z), [*switches], _flat(traits), _flat(moving)]
    return rows


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
    """Fill in what values imply of a damper, and the states at the begin.

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
    store[at + _ACTIVE], store[at + _ADVANCING] = 0.0, 0.0
    store[at + _SIGNS] = row(baked, NUMBERS)[_SIGNED]
    series, bit, code = 0, 1, -1
    for k in range(len(switches)):
        given = int(switches[k])
        store[on + k] = 1.0 if given >= 0 and values[given] != 0.0 else 0.0
        joint = traits[3 * k + _JOINT] != 0.0
        if store[on + k] != 0.0:
            store[at + _ACTIVE] = 1.0
            if traits[3 * k + _ADVANCES] != 0.0:
                store[at + _ADVANCING] = 1.0
            if traits[3 * k + _FRICTION] != 0.0:
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
    )  # fmt: skip

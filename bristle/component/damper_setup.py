"""What a build and its parameters imply of a damper's constants, from flat numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..physics.codegen import Slots
from ..physics.damper import room
from ..physics.damper_setup import (
    BAKED_ROWS,
    STORE_ROWS,
    fill,
    setup_from,
    states_of,
    store_size,
)
from ..physics.damper_setup import bake as bake_law
from ..physics.inputs import Setup
from ..physics.linear import Row
from ..physics.rows import open_row, packed, place, row

DISPLACEMENT, VELOCITY, VOLTAGE, HOLDING_FORCE, ACCELERATION = range(5)
FORCE, DISSIPATED_ENERGY, STROKE_RATIO, FRICTION = range(4)
"""Outputs; friction, the part of the force that is, is hidden."""

REMEMBERED = 9
"""How many numbers the state holds behind the states of law and effects."""


class Constants(NamedTuple):
    """What a damper computes with.

    `setup` is that of law and effects. `moving_mass` [kg] is what the holding force holds, 0: the
    law slides. The acceleration is `measured`, or the difference of velocity over the step. Motion
    and voltage are `linear` over a step, or held at their newest. `tracks` are pairs of a slot in
    `setup.p` and the input that it follows.
    """

    setup: Setup
    v_max: float
    stroke: float
    moving_mass: float
    measured: bool
    linear: bool
    tracks: Row


LIMITS, TRACKS = BAKED_ROWS, BAKED_ROWS + 1
"""Rows of what is baked, behind those of law and effects: the index of each of `OWN` among the
values; pairs of a slot in `p` and the input that it follows."""

OWN = ("v_max", "stroke", "moving_mass")
"""What a damper's values hold besides the parameters of law and effects."""

_OWN, _FOLLOWED = STORE_ROWS, STORE_ROWS + 1
_V_MAX, _STROKE, _MOVING_MASS, _MEASURED = range(4)


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
    own = [names.index(name) for name in OWN]
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
    """Fill in what parameters imply, and the states of law and effects at the begin.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked, in SI; a switch is 1 or 0
    given : (5 + c,) 1 for each input that a host has set, else 0
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; filled

    Returns
    -------
    int
        0; negative if effects exclude each other: see `physics.damper_setup.refusals`.
    """
    code = fill(values, baked, store, state)
    if code < 0:
        return code
    own, limits = open_row(store, _OWN, _MEASURED + 1), row(baked, LIMITS)
    for i in range(len(limits)):
        store[own + i] = values[int(limits[i])]
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
        False, row(store, _FOLLOWED),
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

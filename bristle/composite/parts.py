"""Lays the parts of a whole scenario out in their records, and takes inputs over."""

from __future__ import annotations

from math import nan

from ..component import controller, damper, sensors, source, structure
from ..physics.linear import Row, copy
from ..physics.rows import place, row
from ..simulate.layout import (
    lay_controller,
    lay_damper,
    lay_sampled,
    lay_sensors,
    lay_source,
    lay_structure,
)
from .rows import (
    CONTROLLER,
    DAMPER,
    FIRST_PART,
    FIRST_STORE,
    GENERAL,
    GIVEN,
    KIND,
    MEASURES,
    NUMBER,
    PARTS,
    PLAYED,
    SLOTS,
    SOURCE,
    STRUCTURE,
    VALUE_AT,
    VALUE_OF,
    VALUES,
    Constants,
    about,
    part_setup,
    part_sizes,
    scale_part,
    values_of,
)
from .state import Opened

damper_constants, structure_constants = damper.constants, structure.constants
source_constants = source.constants
controller_constants, sensors_constants = controller.constants, sensors.constants


def lay_part(k: int, c: Constants, run: Opened, h: float, work: Row) -> None:
    """Lay part k out in its record.

    Parameters
    ----------
    k : number of the part
    c : Constants
    run : the state, apart
    h : substep [s]
    work : room to work
    """
    part, wiring = about(c.baked, k), row(c.baked, FIRST_PART + 3 * k + 1)
    kind, i = int(part[KIND]), int(part[NUMBER])
    store, first = row(c.store, FIRST_STORE + 2 * k), row(c.store, FIRST_STORE + 2 * k + 1)
    if kind == SOURCE:
        lay_played(k, c, run)
    elif kind == DAMPER:
        lay_damper(run.dampers[i], damper_constants(store), first, wiring)
    elif kind == STRUCTURE:
        lay_structure(run.structures[i], structure_constants(store), first, wiring)
    elif kind == CONTROLLER:
        r, law = run.sampled[i], controller_constants(store)
        at = place(c.store, FIRST_STORE + 2 * k)  # its matrices stay where its store has them
        lay_sampled(r, law.period, wiring, h)
        lay_controller(r, law)
        r["A"], r["B"] = at + place(store, 1), at + place(store, 2)
        r["W"], r["C"] = at + place(store, 3), at + place(store, 4)
        r["A_end"], r["B_end"] = r["A"] + len(law.A), r["B"] + len(law.B)
        r["W_end"], r["C_end"] = r["W"] + len(law.W), r["C"] + len(law.C)
    else:
        r = run.sampled[i]
        lay_sampled(r, sensors_constants(store).period, wiring, h)
        lay_sensors(r, sensors_constants(store))


def lay_memory(c: Constants, run: Opened, work: Row) -> None:
    """Lay out what sampled parts remember, one behind the other.

    Parameters
    ----------
    c : Constants
    run : the state, apart
    work : room to work
    """
    at = 0
    for k in range(int(row(c.baked, GENERAL)[PARTS])):
        part = about(c.baked, k)
        if int(part[KIND]) >= CONTROLLER:
            part_sizes(k, values_of(k, c.baked, c.store), c.baked, work[0:4])
            states, spare = int(work[1]), int(work[3])
            r, first = run.sampled[int(part[NUMBER])], row(c.store, FIRST_STORE + 2 * k + 1)
            copy(first, 0, run.memory, at, states)
            r["state"], r["work"], r["end"] = at, at + states, at + states + spare
            at += states + spare


def lay_played(k: int, c: Constants, run: Opened) -> None:
    """Lay part k, a source, out in its record."""
    part, wiring = about(c.baked, k), row(c.baked, FIRST_PART + 3 * k + 1)
    store, j = row(c.store, FIRST_STORE + 2 * k), int(part[PLAYED])
    law = source_constants(store, row(c.times, j), row(c.samples, j))
    lay_source(run.sources[int(part[NUMBER])], law, int(wiring[0]), place(c.times, j))


def take_values(inputs: Row, c: Constants, run: Opened) -> int:
    """Set up the sources again whose values inputs stand for; return 0 or the code of a part."""
    places, parts, at = row(c.baked, VALUE_AT), row(c.baked, VALUE_OF), place(c.store, VALUES)
    changed = False
    for j in range(len(places)):
        if places[j] >= 0.0 and c.store[at + int(places[j])] != inputs[j]:
            c.store[at + int(places[j])], changed = inputs[j], True
    for j in range(len(places)):
        if places[j] >= 0.0:
            code = set_up_again(int(parts[j]), c) if changed else 0
            if code < 0:
                c.store[at + int(places[j])] = nan  # what is wrong now is wrong the next time too
                return code
            lay_played(int(parts[j]), c, run)
    return 0


def set_up_again(k: int, c: Constants) -> int:
    """Set up part k, a source, from values that have changed; return 0 or its code."""
    store, first = row(c.store, FIRST_STORE + 2 * k), row(c.store, FIRST_STORE + 2 * k + 1)
    code = part_setup(k, first, c.baked, c.store, store, first)
    return code if code < 0 else scale_part(k, c.times, c.samples, c.baked, c.store)


def take_measured(c: Constants, run: Opened) -> None:
    """Let dampers whose acceleration is an input take it for measured once a host has set it."""
    dampers, given = row(c.baked, MEASURES), row(c.store, GIVEN)
    for j in range(len(dampers)):
        if dampers[j] >= 0.0:
            run.dampers[int(dampers[j])]["measured"] = given[j] != 0.0


def take_inputs(inputs: Row, c: Constants, run: Opened) -> None:
    """Write the inputs into the signals, and keep them."""
    slots = row(c.baked, SLOTS)
    for j in range(len(slots)):
        run.signals[int(slots[j])] = run.kept[j] = inputs[j]

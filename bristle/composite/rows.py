"""Where the numbers of a whole scenario lie, and how its parts are set up from theirs.

All parts share the rows of one component: their values follow each other, what is fixed when it is
built and what parameters imply are packed one part behind the other.
"""

from __future__ import annotations

from typing import NamedTuple

from ..component import controller, damper, sensors, source, structure
from ..physics.linear import Row
from ..physics.rows import open_row, place, row
from ..simulate.layout import substeps_in

SOURCE, DAMPER, STRUCTURE, CONTROLLER, SENSORS = range(5)
"""Kinds of parts."""

(
    GENERAL, SIGNALS, SHOWN, SLOTS, HELD, MEASURES, VALUE_AT, VALUE_OF, TAKEN, STARTS, FIRST_PART,
) = range(11)  # fmt: skip
"""Rows of what is baked: numbers, see `PARTS`; the signals before the run; the slot of each output;
of each input, its slot, whether it is held over a step, the damper whose acceleration it is, the
index of the value and the number of the part that it sets; of each value of the parts, its index
among the parameters, -1 where an input stands for it, and how it starts. Behind them three rows for
each part: see `KIND`, its wiring and what its component bakes. -1 stands for none."""

PARTS, STEP, LONGEST, SOURCES, DAMPERS, STRUCTURES, SAMPLED = range(7)
"""The numbers: how many parts there are, the scenario's step and the longest substep [s], and how
many of the parts are what."""

KIND, NUMBER, FIRST_VALUE, COUNT_OF_VALUES, FIRST_PARAMETER, PLAYED = range(6)
"""Of a part: its kind, its number among the parts of that kind, where its values begin among all
and how many they are, where they do among the parameters, and which of the signals it plays."""

HEADER, GIVEN, VALUES, FIRST_STORE = range(4)
"""Rows of the store: numbers; which inputs a host has set; the values of all parts. Behind them two
rows for each part, its own store and its state at the begin, and room to work."""

H, SUBSTEPS, DT, _COUNTS, _NOTHING = 0, 1, 2, 3, 7
HEADER_SIZE = 16
"""Of the header: length of a substep [s], how many there are in a step, and that step [s]; room to
count; zeros."""

PER_PART = 100_000
"""By how much the codes of two parts differ."""

MOST_SUBSTEPS = 1_000_000
"""Substeps in one step beyond which the step is taken for a mistake."""

TOO_LONG = -1
"""Why a step cannot be taken: it holds more than `MOST_SUBSTEPS`."""

UNSETTLED = 1 - PER_PART
"""The code of a damper whose force and motion did not agree."""

WHOLE = 1e-6
"""Share of a sample period by which the end of a substep may miss an instant."""

damper_sizes, damper_setup = damper.sizes, damper.setup
structure_sizes, structure_setup = structure.sizes, structure.setup
structure_discretise = structure.discretise
source_sizes, source_setup = source.sizes, source.setup
source_scale_samples = source.scale_samples
controller_sizes, controller_setup = controller.sizes, controller.setup
sensors_sizes, sensors_setup = sensors.sizes, sensors.setup
controller_constants, sensors_constants = controller.constants, sensors.constants


class Constants(NamedTuple):
    """What a whole scenario computes with: rows of numbers, see `setup`."""

    baked: Row
    store: Row
    times: Row
    samples: Row


def about(baked: Row, k: int) -> Row:
    """Return the row about part k, see `KIND`; in compiled code it is a view."""
    return row(baked, FIRST_PART + 3 * k)


def coded(code: int, k: int) -> int:
    """Return a code of part k as one of the whole: other parts' differ from it."""
    if code < 0:
        return code - PER_PART * (k + 1)
    return code + PER_PART * (k + 1) if code > 0 else 0


def part_sizes(k: int, mine: Row, baked: Row, counts: Row) -> None:
    """Fill in what part k asks for, as the `sizes` of its component.

    Parameters
    ----------
    k : number of the part
    mine : its values
    baked : as in `setup`
    counts : (4,) filled
    """
    kind, own = int(about(baked, k)[KIND]), row(baked, FIRST_PART + 3 * k + 2)
    if kind == SOURCE:
        source_sizes(mine, own, counts)
    elif kind == DAMPER:
        damper_sizes(mine, own, counts)
    elif kind == STRUCTURE:
        structure_sizes(mine, own, counts)
    elif kind == CONTROLLER:
        controller_sizes(mine, own, counts)
    else:
        sensors_sizes(mine, own, counts)


def store_size(values: Row, baked: Row, counts: Row) -> tuple[int, int]:
    """Return how many floats the store takes, and how many most room to work of a part.

    Parameters
    ----------
    values, baked : as in `setup`
    counts : (4,) room to count
    """
    parts, inputs = int(row(baked, GENERAL)[PARTS]), len(row(baked, SLOTS))
    size, room = HEADER_SIZE + 1 + inputs + 1 + len(row(baked, TAKEN)) + 1, parts
    for k in range(parts):
        # A part that has fewer parameters than values is a source: its sizes depend on neither.
        part_sizes(k, values[int(about(baked, k)[FIRST_PARAMETER]) :], baked, counts)
        size += int(counts[0]) + int(counts[1]) + 2
        room = max(room, int(counts[3]))
    return size + room + 1, room


def values_of(k: int, baked: Row, store: Row) -> Row:
    """Return the values of part k; in compiled code they are a view."""
    first, count = int(about(baked, k)[FIRST_VALUE]), int(about(baked, k)[COUNT_OF_VALUES])
    begin = place(store, VALUES) + first
    return store[begin : begin + count]


def part_setup(k: int, given: Row, baked: Row, whole: Row, store: Row, state: Row) -> int:
    """Fill in what its values imply of part k; return 0 or a code of the whole.

    Parameters
    ----------
    k : number of the part
    given : zeros: what a host has set is told elsewhere
    baked : as in `setup`
    whole : the store of the whole, with the values of all parts
    store, state : the part's own, zero; filled
    """
    kind, own = int(about(baked, k)[KIND]), row(baked, FIRST_PART + 3 * k + 2)
    mine = values_of(k, baked, whole)
    if kind == SOURCE:
        code = source_setup(mine, given, own, store, state)
    elif kind == DAMPER:
        code = damper_setup(mine, given, own, store, state)
    elif kind == STRUCTURE:
        code = structure_setup(mine, given, own, store, state)
    elif kind == CONTROLLER:
        code = controller_setup(mine, given, own, store, state)
    else:
        code = sensors_setup(mine, given, own, store, state)
    return coded(code, k)


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what the parameters of all parts imply; `scale_samples` comes next.

    Parameters
    ----------
    values : of the parameters of the parts, one part behind the other
    given : 1 for each input that a host has set, else 0
    baked : rows, see `FIRST_PART`
    store : of the size of `sizes`, zero; filled, see `FIRST_STORE`
    state : not used: `start` fills it

    Returns
    -------
    int
        0, or the code of a part.
    """
    parts, inputs = int(row(baked, GENERAL)[PARTS]), len(row(baked, SLOTS))
    header = open_row(store, HEADER, HEADER_SIZE)
    open_row(store, GIVEN, inputs)
    fill_values(values, baked, store)
    counts = store[header + _COUNTS : header + _NOTHING]
    none = store[header + _NOTHING : header + HEADER_SIZE]
    room = parts
    for k in range(parts):
        part_sizes(k, values_of(k, baked, store), baked, counts)
        room = max(room, int(counts[3]))
        size, states = int(counts[0]), int(counts[1])
        own = open_row(store, FIRST_STORE + 2 * k, size)
        at = open_row(store, FIRST_STORE + 2 * k + 1, states)
        own_store, own_state = store[own : own + size], store[at : at + states]
        code = part_setup(k, none, baked, store, own_store, own_state)
        if code < 0:
            return code
    at = open_row(store, FIRST_STORE + 2 * parts, room)
    bind(given, store)
    discretise(row(baked, GENERAL)[STEP], baked, store, store[at : at + room])
    return 0


def fill_values(values: Row, baked: Row, store: Row) -> None:
    """Fill in the values of all parts: parameters, and how those start that inputs stand for."""
    taken, starts = row(baked, TAKEN), row(baked, STARTS)
    at = open_row(store, VALUES, len(taken))
    for i in range(len(taken)):
        store[at + i] = values[int(taken[i])] if taken[i] >= 0.0 else starts[i]


def bind(given: Row, store: Row) -> None:
    """Take over which inputs a host has set: whenever that has changed."""
    at = place(store, GIVEN)
    for j in range(len(given)):
        store[at + j] = given[j]


def discretise(dt: float, baked: Row, store: Row, work: Row) -> None:
    """Cut a step into substeps, and fill in what their length implies of the structures.

    A step that differs by rounding alone is taken for the one before.

    Parameters
    ----------
    dt : length of the step [s]
    baked : as in `setup`
    store : as `setup` fills it
    work : room to work, of the size that `sizes` gives
    """
    general, header = row(baked, GENERAL), place(store, HEADER)
    parts, longest = int(general[PARTS]), general[LONGEST]
    if abs(dt - store[header + DT]) <= 1e-9 * dt or dt > MOST_SUBSTEPS * longest:
        return
    sampled = 0
    for k in range(parts):
        kind, own = int(about(baked, k)[KIND]), row(store, FIRST_STORE + 2 * k)
        if kind == CONTROLLER:
            work[sampled] = controller_constants(own).period
            sampled += 1
        elif kind == SENSORS:
            work[sampled] = sensors_constants(own).period
            sampled += 1
    n = substeps_in(dt, longest, work[0:sampled])
    store[header + H], store[header + SUBSTEPS], store[header + DT] = dt / n, float(n), dt
    for k in range(parts):
        if int(about(baked, k)[KIND]) == STRUCTURE:
            structure_discretise(dt / n, row(store, FIRST_STORE + 2 * k), work)


def scale_samples(times: Row, samples: Row, baked: Row, store: Row) -> int:
    """Take over what the samples of the sources imply: once they are there, after `setup`.

    Parameters
    ----------
    times, samples : packed rows, one for each signal that is played [s; the signal's unit]
    baked, store : as in `setup`

    Returns
    -------
    int
        0, or the code of a part.
    """
    for k in range(int(row(baked, GENERAL)[PARTS])):
        code = scale_part(k, times, samples, baked, store)
        if code < 0:
            return code
    return 0


def scale_part(k: int, times: Row, samples: Row, baked: Row, store: Row) -> int:
    """Do so for part k, if it is a source.

    Parameters
    ----------
    k : number of the part
    times, samples, baked, store
        As in `scale_samples`, and what is returned too.
    """
    part = about(baked, k)
    if int(part[KIND]) != SOURCE:
        return 0
    j = int(part[PLAYED])
    own = row(store, FIRST_STORE + 2 * k)
    return coded(source_scale_samples(row(times, j), row(samples, j), own), k)

"""A whole scenario as the functions of one component, see `bristle.component`.

Its step is the coupled engine's own, over a communication step of any length. They take arrays, for
the records of the time loop lie in the state as they are; so they are called compiled, and nothing
else of a run is written here again: parts are set up by their components' functions, laid out in
records by `engine.records` and moved by `engine.time_loop`.

All parts share the rows of one component: their values follow each other, what is fixed when it is
built and what parameters imply are packed one part behind the other.
"""

from __future__ import annotations

from math import nan
from typing import Any, NamedTuple

from ..component import controller, damper, sensors, source, structure
from ..engine import records
from ..engine.coupled import RecordLayout, couple, linked, room
from ..engine.records import (
    is_whole,
    lay_controller,
    lay_damper,
    lay_matrices,
    lay_sampled,
    lay_sensors,
    lay_source,
    lay_structure,
    substeps_in,
)
from ..engine.time_loop import (
    INLINE,
    LEAST_FORCE,
    begin_run,
    gather,
    respond,
    show,
    substep,
    update,
)
from ..engine.time_loop import sample as take_samples
from ..physics.generate import Link
from ..physics.linear import Row, copy, open_row, place, row

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
rows for each part, its own store and its state at the start, and room to work."""

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
damper_constants, structure_constants = damper.constants, structure.constants
source_constants = source.constants
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


# The state of a whole scenario: numbers, signals, the records of the time loop as they are.

ORIGIN, BASE, COUNT, SUBSTEP, SCALE = range(5)
NUMBERS = 8
"""What the state begins with: the start of the run [s]; substeps count from the time `BASE` [s] on,
each of so many seconds; the largest force so far [N]. Behind them the signals, the inputs at the
last step, and the records and the memory of the time loop."""

SOURCE_RECORD = records.source_record()
DAMPER_RECORD, STRUCTURE_RECORD = records.damper_record(), records.structure_record()
SAMPLED_RECORD = records.sampled_record()
SOURCE_SIZE, DAMPER_SIZE, STRUCTURE_SIZE, SAMPLED_SIZE = (
    record.itemsize // 8
    for record in (SOURCE_RECORD, DAMPER_RECORD, STRUCTURE_RECORD, SAMPLED_RECORD)
)


def fitted(system: RecordLayout) -> Link:
    """Return what fits functions of a whole scenario to the laws and effects of its components."""
    damper = records.damper_record(system.dampers.slots)
    structure = records.structure_record(system.structures.slots)
    return linked(
        system.dampers, system.structures,
        DAMPER_RECORD=damper, DAMPER_SIZE=damper.itemsize // 8,
        STRUCTURE_RECORD=structure, STRUCTURE_SIZE=structure.itemsize // 8,
    )  # fmt: skip


class Opened(NamedTuple):
    """The state of a whole scenario, apart."""

    signals: Any
    kept: Any
    sources: Any
    dampers: Any
    structures: Any
    sampled: Any
    memory: Any


def opened(state: Row, baked: Row) -> Opened:
    """Return the parts of a state; in compiled code they are views."""
    general = row(baked, GENERAL)
    a = NUMBERS + len(row(baked, SIGNALS))
    b = a + len(row(baked, SLOTS))
    c = b + int(general[SOURCES]) * SOURCE_SIZE
    d = c + int(general[DAMPERS]) * DAMPER_SIZE
    e = d + int(general[STRUCTURES]) * STRUCTURE_SIZE
    f = e + int(general[SAMPLED]) * SAMPLED_SIZE
    return Opened(
        state[NUMBERS:a], state[a:b], state[b:c].view(SOURCE_RECORD),
        state[c:d].view(DAMPER_RECORD), state[d:e].view(STRUCTURE_RECORD),
        state[e:f].view(SAMPLED_RECORD), state[f:],
    )  # fmt: skip


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
    general = row(baked, GENERAL)
    dampers, inputs = int(general[DAMPERS]), len(row(baked, SLOTS))
    state = NUMBERS + len(row(baked, SIGNALS)) + inputs + dampers * DAMPER_SIZE
    state += int(general[SOURCES]) * SOURCE_SIZE + int(general[SAMPLED]) * SAMPLED_SIZE
    state += int(general[STRUCTURES]) * STRUCTURE_SIZE
    store, most = store_size(values, baked, counts)
    for k in range(int(general[PARTS])):
        if int(about(baked, k)[KIND]) >= CONTROLLER:
            part_sizes(k, values[int(about(baked, k)[FIRST_PARAMETER]) :], baked, counts)
            state += int(counts[1]) + int(counts[3])
    counts[0], counts[1], counts[2] = store, state, len(row(baked, SHOWN))
    counts[3] = state + inputs + most + room(dampers)
    return 0


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


INLINED = (
    *INLINE,
    "composite_functions.opened",
    "composite_functions.about",
    "composite_functions.values_of",
)
"""What becomes part of its caller: that of the time loop, and what returns rows."""


def constants(baked: Row, store: Row, times: Row, samples: Row) -> Constants:
    """Return what `start`, `step` and `output` take.

    Parameters
    ----------
    baked, store : as in `setup`
    times, samples : as in `scale_samples`
    """
    return Constants(baked, store, times, samples)


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Begin the run: lay the parts out, settle their signals, take the first samples.

    Parameters
    ----------
    time : begin of the run [s]
    inputs : values of the inputs, each in its own unit
    c : Constants
    state : filled, see `NUMBERS`
    outputs : of all parts, each in its own unit; filled
    work : room to work, of the size that `sizes` gives

    Returns
    -------
    int
        0, or the code of a part.
    """
    for i in range(len(state)):
        state[i] = 0.0
    h = row(c.store, HEADER)[H]
    state[ORIGIN] = state[BASE] = time
    state[SUBSTEP], state[SCALE] = h, LEAST_FORCE
    run = opened(state, c.baked)
    copy(row(c.baked, SIGNALS), 0, run.signals, 0, len(run.signals))
    for k in range(int(row(c.baked, GENERAL)[PARTS])):
        lay_part(k, c, run, h, work)
    lay_memory(c, run, work)
    couple(run.dampers, run.structures, h, work)
    code = take_values(inputs, c, run)
    if code < 0:
        return code
    take_measured(c, run)
    take_inputs(inputs, c, run)
    played = run.sources, c.times, c.samples
    begin_run(played, (run.dampers, run.structures), time, h, run.signals)
    sampled = run.sampled, c.store, run.memory
    take_samples(sampled, (run.dampers, run.structures), time, time, h, run.signals)
    show_outputs(c, run.signals, outputs)
    return 0


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Move all parts over a communication step, in substeps of the coupled engine.

    An input is held at its newest value, or linear from that at the start; see `HELD`. The
    latter is that of the last step, but where a host has set a derivative with a new value.

    Parameters
    ----------
    clock : tuple
        Time at the start [s], dt [s], sweep (not used).
    before, now : inputs at the start and at the end of the step, as in `start`
    c : Constants
        As `discretise` has left them for a step of dt.
    state, new_state : one and the same sequence, as in `start`, moved on in place
    outputs : as in `start`, filled
    work : as in `start`

    Returns
    -------
    int
        0, `TOO_LONG`, or the code of a part.
    """
    time, dt, _ = clock
    if dt > MOST_SUBSTEPS * row(c.baked, GENERAL)[LONGEST]:
        return TOO_LONG
    run = opened(state, c.baked)
    coupled, s = (run.dampers, run.structures), run.signals
    code = take_values(now, c, run)
    if code < 0:
        return code
    align(time, c, state, run, work)
    take_measured(c, run)
    h, substeps = row(c.store, HEADER)[H], int(row(c.store, HEADER)[SUBSTEPS])
    slots, held, since = row(c.baked, SLOTS), row(c.baked, HELD), work[0 : len(now)]
    jumps = False
    for j in range(len(now)):
        since[j] = before[j]
        if held[j] != 0.0:
            jumps = jumps or run.kept[j] != now[j]
            since[j] = now[j]
        s[int(slots[j])] = since[j]
    if jumps:
        respond(run.dampers, run.structures, s)
    played, sampled = (run.sources, c.times, c.samples), (run.sampled, c.store, run.memory)
    for k in range(substeps):
        state[COUNT] += 1.0
        t = state[BASE] + state[COUNT] * h
        passed = (t, h, (k + 1.0) / substeps)
        driven = (slots, since, now)
        worst, _, state[SCALE] = substep(played, coupled, driven, passed, state[SCALE], s)
        if worst >= 0:
            return unsettled(worst, c)
        take_samples(sampled, coupled, state[ORIGIN], t, h, s)
    for i in range(len(run.structures)):
        show(run.structures[i], run.structures[i].state, s)
    take_inputs(now, c, run)
    show_outputs(c, s, outputs)
    return 0


def show_outputs(c: Constants, s: Row, outputs: Row) -> None:
    """Read the outputs from the signals."""
    slots = row(c.baked, SHOWN)
    for j in range(len(slots)):
        outputs[j] = s[int(slots[j])]


def unsettled(damper: int, c: Constants) -> int:
    """Return the code that says of a damper that its force and motion did not agree."""
    for k in range(int(row(c.baked, GENERAL)[PARTS])):
        part = about(c.baked, k)
        if int(part[KIND]) == DAMPER and int(part[NUMBER]) == damper:
            return coded(UNSETTLED, k)
    return UNSETTLED


def align(time: float, c: Constants, state: Row, run: Opened, work: Row) -> None:
    """Begin to count substeps anew where their length or the time is not what it was to be.

    As long as steps follow each other in the same length, the ends of substeps are those of the
    coupled engine, to the last digit.

    Parameters
    ----------
    time : begin of the step [s]
    c : Constants
    state, run : the state, and apart
    work : room to work
    """
    h, expected = row(c.store, HEADER)[H], state[BASE] + state[COUNT] * state[SUBSTEP]
    if state[SUBSTEP] == h and abs(time - expected) <= WHOLE * h:
        return
    if state[SUBSTEP] != h:
        for k in range(int(row(c.baked, GENERAL)[PARTS])):
            part = about(c.baked, k)
            if int(part[KIND]) == STRUCTURE:
                matrices = structure_constants(row(c.store, FIRST_STORE + 2 * k))
                lay_matrices(run.structures[int(part[NUMBER])], matrices)
        couple(run.dampers, run.structures, h, work)
    state[BASE], state[COUNT], state[SUBSTEP] = time, 0.0, h
    for i in range(len(run.structures)):
        show(run.structures[i], run.structures[i].state, run.signals)
    for i in range(len(run.sampled)):
        r = run.sampled[i]
        gather(r.inputs, run.signals, r.before)
        r["aligned"] = is_whole(r.period, h) and is_whole(time - state[ORIGIN], h)


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Let the outputs follow inputs that have changed since the step, the motion held.

    Parameters
    ----------
    time : s
    inputs : as in `start`
    c : Constants
    state : as in `start`, kept
    outputs : as in `start`, filled
    work : as in `start`

    Returns
    -------
    int
        0, or the code of a part.
    """
    kept, changed = opened(state, c.baked).kept, False
    for j in range(len(inputs)):
        changed = changed or inputs[j] != kept[j]
    if not changed:
        show_outputs(c, opened(state, c.baked).signals, outputs)
        return 0
    copy(state, 0, work, 0, len(state))
    run = opened(work[0 : len(state)], c.baked)
    code = take_values(inputs, c, run)
    if code < 0:
        return code
    take_measured(c, run)
    take_inputs(inputs, c, run)
    update((run.sources, c.times, c.samples), (run.dampers, run.structures), time, run.signals)
    show_outputs(c, run.signals, outputs)
    return 0

"""A whole scenario as the functions of one component, see `bristle.component`.

Its step is the coupled engine's own, over a communication step of any length. They take arrays, for
the records of the time loop lie in the state as they are; so they are called compiled, and nothing
else of a run is written here again: parts are set up by their components' functions (`rows`), laid
out in records by `simulate.layout` and moved by `simulate.time_loop`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import controller, damper, sensors, source, structure
from ..physics.linear import Row, copy
from ..physics.rows import place, row
from ..simulate import records
from ..simulate.layout import (
    is_whole,
    lay_controller,
    lay_damper,
    lay_matrices,
    lay_sampled,
    lay_sensors,
    lay_source,
    lay_structure,
)
from ..simulate.pushed import couple, room
from ..simulate.time_loop import (
    INLINE,
    LEAST_FORCE,
    begin_run,
    gather,
    respond,
    show,
    substep,
    update,
)
from ..simulate.time_loop import sample as take_samples
from .rows import (
    CONTROLLER,
    DAMPER,
    DAMPERS,
    FIRST_PARAMETER,
    FIRST_PART,
    FIRST_STORE,
    GENERAL,
    GIVEN,
    HEADER,
    HELD,
    KIND,
    LONGEST,
    MEASURES,
    MOST_SUBSTEPS,
    NUMBER,
    PARTS,
    PER_PART,
    PLAYED,
    SAMPLED,
    SHOWN,
    SIGNALS,
    SLOTS,
    SOURCE,
    SOURCES,
    STRUCTURE,
    STRUCTURES,
    SUBSTEPS,
    TOO_LONG,
    UNSETTLED,
    VALUE_AT,
    VALUE_OF,
    VALUES,
    WHOLE,
    Constants,
    H,
    about,
    bind,
    discretise,
    part_setup,
    part_sizes,
    scale_part,
    scale_samples,
    setup,
    store_size,
    values_of,
)

__all__ = [
    "FLAT", "INLINED", "bind", "constants", "discretise", "fit_records", "output", "scale_samples",
    "setup", "sizes", "start", "step",
]  # fmt: skip

FLAT = tuple(name for name in __all__ if name not in ("FLAT", "fit_records"))
"""What the compiler takes of them."""

ORIGIN, BASE, COUNT, SUBSTEP, SCALE = range(5)
NUMBERS = 8
"""What the state begins with: the begin of the run [s]; substeps count from the time `BASE` [s] on,
each of so many seconds; the largest force so far [N]. Behind them the signals, the inputs at the
last step, and the records and the memory of the time loop."""

INLINED = (*INLINE, "functions.opened", "rows.about", "rows.values_of")
"""What becomes part of its caller: that of the time loop, and what returns rows."""

SOURCE_RECORD: Any = None
DAMPER_RECORD: Any = None
STRUCTURE_RECORD: Any = None
SAMPLED_RECORD: Any = None
SOURCE_SIZE = DAMPER_SIZE = STRUCTURE_SIZE = SAMPLED_SIZE = 0

damper_constants, damper_output = damper.constants, damper.output
structure_constants, source_constants = structure.constants, source.constants
controller_constants, sensors_constants = controller.constants, sensors.constants


def fit_records() -> None:
    """Fit the records to the laws and effects that are registered: before functions are used."""
    made = {
        "SOURCE": records.source_record(), "DAMPER": records.damper_record(),
        "STRUCTURE": records.structure_record(), "SAMPLED": records.sampled_record(),
    }  # fmt: skip
    for name, record in made.items():
        globals()[f"{name}_RECORD"] = record
        globals()[f"{name}_SIZE"] = record.itemsize // 8


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


def constants(baked: Row, store: Row, times: Row, samples: Row) -> Constants:
    """Return what `start`, `step` and `output` take."""
    return Constants(baked, store, times, samples)


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take.

    Parameters
    ----------
    values, baked : as in `rows.setup`
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
        r, law, at = (
            run.sampled[i],
            controller_constants(store),
            place(c.store, FIRST_STORE + 2 * k),
        )
        lay_sampled(r, law.period, wiring, h)
        lay_controller(r, law)
        r["A"], r["B"] = at + place(store, 1), at + place(store, 2)
        r["W"], r["C"] = at + place(store, 3), at + place(store, 4)
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
    for j in range(len(places)):
        if places[j] < 0.0:
            continue
        k = int(parts[j])
        if c.store[at + int(places[j])] != inputs[j]:
            c.store[at + int(places[j])] = inputs[j]
            store, first = row(c.store, FIRST_STORE + 2 * k), row(c.store, FIRST_STORE + 2 * k + 1)
            code = part_setup(k, first, c.baked, c.store, store, first)
            if code >= 0:
                code = scale_part(k, c.times, c.samples, c.baked, c.store)
            if code < 0:
                return code
        lay_played(k, c, run)
    return 0


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


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Move all parts over a communication step, in substeps of the coupled engine.

    An input is held at its newest value, or linear from that of the last step; see `rows.HELD`.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep (not used).
    before : not used: the state knows the inputs of the last step
    now : inputs, as in `start`
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
        since[j] = run.kept[j]
        if held[j] != 0.0:
            jumps = jumps or since[j] != now[j]
            since[j] = s[int(slots[j])] = now[j]
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
            return UNSETTLED - PER_PART * (k + 1)
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
    for i in range(len(state)):
        work[i] = state[i]
    run = opened(work[0 : len(state)], c.baked)
    changed = False
    for j in range(len(inputs)):
        changed = changed or inputs[j] != run.kept[j]
    if changed:
        code = take_values(inputs, c, run)
        if code < 0:
            return code
        take_measured(c, run)
        take_inputs(inputs, c, run)
        played = run.sources, c.times, c.samples
        update(played, (run.dampers, run.structures), time, run.signals)
    show_outputs(c, run.signals, outputs)
    return 0

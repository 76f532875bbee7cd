"""A whole scenario as the functions of one component, see `bristle.component`.

Its step is the coupled engine's own, over a communication step of any length. They take arrays, for
the records of the time loop lie in the state as they are; so they are called compiled, and nothing
else of a run is written here again: parts are set up by their components' functions (`rows`), laid
out in records by `engine.records` and moved by `engine.time_loop`.
"""

from __future__ import annotations

from ..engine.coupled import couple
from ..engine.records import is_whole, lay_matrices
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
from ..physics.linear import Row, copy, row
from .rows import (
    BASE,
    COUNT,
    DAMPER,
    FIRST_STORE,
    GENERAL,
    HEADER,
    HELD,
    KIND,
    LONGEST,
    MOST_SUBSTEPS,
    NUMBER,
    ORIGIN,
    PARTS,
    SCALE,
    SHOWN,
    SIGNALS,
    SLOTS,
    STRUCTURE,
    SUBSTEP,
    SUBSTEPS,
    TOO_LONG,
    UNSETTLED,
    WHOLE,
    Constants,
    H,
    Opened,
    about,
    bind,
    coded,
    discretise,
    lay_memory,
    lay_part,
    opened,
    scale_samples,
    setup,
    sizes,
    structure_constants,
    take_inputs,
    take_measured,
    take_values,
)

__all__ = [
    "INLINED", "bind", "constants", "discretise", "output", "scale_samples", "setup", "sizes",
    "start", "step",
]  # fmt: skip

INLINED = (*INLINE, "rows.opened", "rows.about", "rows.values_of")
"""What becomes part of its caller: that of the time loop, and what returns rows."""


def constants(baked: Row, store: Row, times: Row, samples: Row) -> Constants:
    """Return what `start`, `step` and `output` take.

    Parameters
    ----------
    baked, store : as in `rows.setup`
    times, samples : as in `rows.scale_samples`
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

    An input is held at its newest value, or linear from that at the begin; see `rows.HELD`. The
    latter is that of the last step, but where a host has set a derivative with a new value.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep (not used).
    before, now : inputs at the begin and at the end of the step, as in `start`
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

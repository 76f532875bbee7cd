"""The time loop of the coupled system: written in plain Python, compiled by `jit`.

In each substep the structures take their exact linear step and the dampers theirs, with the smooth
forces linear in time and friction held at its new value. The forces at the end are extrapolated
from the last substeps, and corrected until motion and forces agree. Friction that sticks takes
whatever value brings the motion to rest, up to its limit (Moreau's time stepping: Moreau 1988, in
Nonsmooth Mechanics and Applications, CISM 302).

What components do is what their FMUs do (`bristle.component`); here is what couples them. All
signals of the scenario stand in one vector `s`; each component is a record (see `records`) that
holds its numbers, the slots of its inputs in `s`, and the first of its outputs.
"""

from __future__ import annotations

from math import floor, inf, isfinite
from typing import Any

from ..component import clock, controller, damper, sensors, source, structure
from ..component.control_laws import limited
from ..component.damper import (
    ACCELERATION,
    FORCE,
    FRICTION,
    HOLDING_FORCE,
    LAST_STEP,
    VOLTAGE,
    VOLTAGE_AT_END,
)
from ..component.structure import DAMPER_FORCE, DEVICE_FORCES, EXTRA_FORCE
from ..physics.laws import laws_of
from ..physics.tuples import Setup

ROUNDING = clock.ROUNDING
DamperConstants, StructureConstants = damper.Constants, structure.Constants
ControllerConstants, SensorConstants = controller.Constants, sensors.Constants
SourceConstants = source.Constants
damper_start, damper_step, damper_output = damper.start, damper.step, damper.output
damper_remember = damper.remember
structure_step, structure_output = structure.step, structure.output
settle, show_motion = structure.settle, structure.show_motion
controller_start, controller_step = controller.start, controller.step
sensors_start, sensors_step = sensors.start, sensors.step
source_output = source.output

TOLERANCE = 1e-6
"""Disagreement of a force, as a share of the largest force so far, at which sweeps end."""

MAX_SWEEPS = 40

LEAST_FORCE = 1e-9
"""Size [N] of the largest force so far, before there is one."""

INLINE = (
    *("time_loop.play", "time_loop.start", "time_loop.begin", "time_loop.move"),
    *("time_loop.substep", "time_loop.drive", "time_loop.agree", "time_loop.most_sweeps"),
    *("time_loop.correct", "time_loop.accept", "time_loop.gather"),
    *("time_loop.gather_forces", "time_loop.damper_constants", "time_loop.structure_constants"),
    *("damper.step", "damper.stick_force", "control_laws.limited"),
    *("structure.step", "structure.settle", "structure.output", "structure.show_motion"),
    *("structure.free_step", "structure.add_force", "structure.copy"),
    *("controller.step", "controller.sample", "sensors.step"),
    *("generate.step_law", "falling.falling"),
    *(
        f"{hook.__module__.rpartition('.')[2]}.{hook.__qualname__}"
        for law in laws_of("damper")
        for hook in law.hooks().values()
    ),
)
"""What becomes part of its caller: it is short or has one caller. Saves time, twice."""


def integrate(
    span: Any, sources: Any, coupled: Any, sampled: Any, s: Any, outputs: Any, table: Any
) -> tuple[int, int, int]:
    """Fill `table` (rows + 1, m) with the signals `outputs` (m,), a row for some substeps each.

    Parameters
    ----------
    span : tuple
        Number of rows, substeps of each, and a substep [s].
    sources : tuple of arrays
        Records (see `records`), and the times [s] and samples of all of them one after another.
    coupled : tuple of arrays
        Records of dampers and of structures.
    sampled : tuple of arrays
        Records of components with clocks, and the constants and the memory that they compute with.
    s : (n,) array
        The signals, with their start values.

    Returns
    -------
    tuple of int
        How many rows are filled, the last of them perhaps with values that are not finite; the
        damper whose force and motion did not agree, which ends the loop before the next row (-1:
        none); the number of sweeps.
    """
    (rows, substeps, h), (_, structures) = span, coupled
    scale, sweeps = LEAST_FORCE, 0
    driven = outputs[:0], table[0, :0], table[0, :0]  # sources alone move a scenario
    begin_run(sources, coupled, 0.0, h, s)
    sample(sampled, coupled, 0.0, 0.0, h, s)
    for j in range(len(outputs)):
        table[0, j] = s[outputs[j]]
    for row in range(rows):
        for k in range(substeps):
            t = (row * substeps + k + 1) * h
            unsettled, taken, scale = substep(sources, coupled, driven, (t, h, 1.0), scale, s)
            sweeps += taken
            if unsettled >= 0:
                return row + 1, unsettled, sweeps
            sample(sampled, coupled, 0.0, t, h, s)
        for i in range(len(structures)):
            show(structures[i], structures[i].state, s)
        total = 0.0
        for j in range(len(outputs)):
            table[row + 1, j] = s[outputs[j]]
            total += s[outputs[j]]
        if not isfinite(total):
            return row + 2, -1, sweeps
    return rows + 1, -1, sweeps


def begin_run(sources: Any, coupled: Any, t: float, h: float, s: Any) -> None:
    """Bring the signals to the start of a run; the first samples are taken next.

    Parameters
    ----------
    sources, coupled : as in `integrate`
    t, h : begin and length of the first substep [s]
    s : (n,) signals with their start values, changed in place
    """
    dampers, structures = coupled
    play(sources, t, s)
    start(dampers, structures, h, s)


def substep(
    sources: Any, coupled: Any, driven: Any, clock: Any, scale: float, s: Any
) -> tuple[int, int, float]:
    """Take all that moves in time over one substep; `sample` comes next.

    Parameters
    ----------
    sources, coupled : as in `integrate`
    driven : tuple of arrays
        Slots (d,) of the signals that are given from outside, and their values (d,) at the start
        and at the end of the communication step, between which they are linear.
    clock : tuple
        End of the substep [s], its length [s], and the share of the communication step that has
        passed then [1].
    scale : largest force so far [N]
    s : (n,) signals, changed in place

    Returns
    -------
    tuple
        The damper whose force and motion did not agree (-1: none), the number of sweeps, and the
        largest force so far [N].
    """
    dampers, structures = coupled
    t, h, share = clock
    begin(dampers, structures, s)
    play(sources, t, s)
    drive(driven, share, s)
    unsettled, sweeps, scale = agree(dampers, structures, t, h, scale, s)
    if unsettled < 0:
        accept(dampers, structures, s)
    return unsettled, sweeps, scale


def drive(driven: Any, share: float, s: Any) -> None:
    """Write what is given from outside into the signals, see `substep`."""
    slots, before, now = driven
    for j in range(len(slots)):
        value = now[j]
        if share < 1.0:
            value = before[j] + share * (now[j] - before[j])
        s[int(slots[j])] = value


def agree(
    dampers: Any, structures: Any, t: float, h: float, scale: float, s: Any
) -> tuple[int, int, float]:
    """Sweep over structures and dampers until motion and forces agree.

    Parameters
    ----------
    dampers, structures : arrays of records, see `records`
    t, h : end of the substep and its length [s]
    scale : largest force so far [N]
    s : (n,) signals, changed in place

    Returns
    -------
    tuple
        As `substep`.
    """
    sweep, change, most = 0, inf, most_sweeps(structures)
    while change > TOLERANCE * scale and sweep < most:
        for i in range(len(structures)):
            move(structures[i], (t - h, h, sweep), s)
        change = 0.0
        for i in range(len(dampers)):
            change = max(change, correct(dampers[i], (t - h, h, sweep), s))
            scale = max(scale, abs(dampers[i].found))
        sweep += 1
    worst = -1
    if change > TOLERANCE * scale:
        worst = 0
        for i in range(len(dampers)):
            worst = i if abs(dampers[i].excess) == change else worst
    return worst, sweep, scale


def most_sweeps(structures: Any) -> int:
    """Return how many sweeps a substep takes at most: friction at several places takes longer."""
    most = MAX_SWEEPS
    for i in range(len(structures)):
        most += MAX_SWEEPS * structures[i].devices
    return most


def play(sources: Any, t: float, s: Any) -> None:
    """Write what the sources give at time t [s] into the signals."""
    records, times, samples = sources
    for i in range(len(records)):
        g = records[i]
        c = SourceConstants(
            g.kind, g.p[:], times[g.begin : g.end], samples[g.begin : g.end], g.scale, g.delay,
            g.rated,
        )  # fmt: skip
        shown = s[g.first :]
        source_output(t, shown, c, shown, shown, shown)


def start(dampers: Any, structures: Any, h: float, s: Any) -> None:
    """Settle the signals at the start: accelerations and forces may follow each other.

    Parameters
    ----------
    dampers, structures : arrays of records, see `records`
    h : length of a substep [s]
    s : (n,) signals, each in its own unit, changed in place
    """
    for _ in range(3):
        for i in range(len(structures)):
            b = structures[i]
            show_motion(structure_constants(b), b.state[:], s[b.first :])
            show(b, b.state, s)
        for i in range(len(dampers)):
            d = dampers[i]
            gather(d.inputs, s, d.now)
            if d.on_structure >= 0:
                d.now[HOLDING_FORCE] = s[d.holding] / d.sharing
            c, state = damper_constants(d), d.state[:]
            damper_start(0.0, d.now[:], c, state, s[d.first :], d.work[:])
            state[LAST_STEP] = h
            d.smooth = d.smooth_1 = d.smooth_2 = s[d.first + FORCE]
            s[d.first + FRICTION] = 0.0


def begin(dampers: Any, structures: Any, s: Any) -> None:
    """Keep what a substep begins from, and extrapolate the forces to its end."""
    for i in range(len(structures)):
        b = structures[i]
        gather_forces(b, s, b.before)
        b.smooth0 = (
            b.before[DAMPER_FORCE] + b.before[EXTRA_FORCE] - s[b.friction] - s[b.extra_friction]
        )
        for k in range(b.devices):
            b.smooths[k] = b.before[DEVICE_FORCES + k] - s[b.frictions[k]]
    for i in range(len(dampers)):
        d = dampers[i]
        gather(d.inputs, s, d.before)
        s[d.first + FORCE] = 3.0 * (d.smooth - d.smooth_1) + d.smooth_2 + s[d.first + FRICTION]
        d.smooth_2, d.smooth_1 = d.smooth_1, d.smooth


def move(b: Any, clock: Any, s: Any) -> None:
    """Take a structure to the end of the substep under the forces of the present sweep."""
    gather_forces(b, s, b.now)
    b.before[DAMPER_FORCE] = b.smooth0 + s[b.friction] + s[b.extra_friction]
    b.before[EXTRA_FORCE] = 0.0
    for k in range(b.devices):
        b.before[DEVICE_FORCES + k] = b.smooths[k] + s[b.frictions[k]]
    structure_step(
        clock, b.before[:], b.now[:], structure_constants(b), b.state[0 : b.n_states],
        b.new_state[0 : b.n_states], s[b.first :], b.work[:],
    )  # fmt: skip
    if b.followed:
        show(b, b.new_state, s)


def correct(d: Any, clock: Any, s: Any) -> float:
    """Take a damper to the end of the substep and correct its force; return its disagreement [N].

    The correction is the secant's, from the second sweep on and while friction stays: a plain
    exchange of forces converges slowly, or not at all, where a damper is stiff or has inertia.
    """
    shown = s[d.first :]
    tried, friction = shown[FORCE], shown[FRICTION]
    gather(d.inputs, s, d.now)
    d.now[HOLDING_FORCE] = tried  # under it the level has the velocity that the damper feels
    damper_step(
        clock, d.before[:], d.now[:], damper_constants(d), d.state[:],
        d.new_state[:], shown, d.work[:],
    )  # fmt: skip
    d.found = shown[FORCE]
    excess, slope = d.found - tried, -1.0
    if clock[2] > 0 and tried != d.tried and shown[FRICTION] == friction:
        slope = min((excess - d.excess) / (tried - d.tried), -0.5)
    d.tried, d.excess = tried, excess
    shown[FORCE] = tried - excess / slope
    return abs(excess)  # type: ignore[no-any-return]


def accept(dampers: Any, structures: Any, s: Any) -> None:
    """Accept a substep."""
    for i in range(len(structures)):
        b = structures[i]
        for j in range(b.n_states):
            b.state[j] = b.new_state[j]
    for i in range(len(dampers)):
        d = dampers[i]
        for j in range(len(d.state)):
            d.state[j] = d.new_state[j]
        s[d.first + FORCE] = d.found
        d.smooth = d.found - s[d.first + FRICTION]


def sample(sampled: Any, coupled: Any, origin: float, t: float, h: float, s: Any) -> None:
    """Let the components act whose instant a substep reaches; the forces follow.

    Components measure the motion and the dampers' forces with the voltages before, in the order of
    the scenario.

    Parameters
    ----------
    sampled, coupled : tuples of arrays, as in `integrate`
    origin : begin of the run [s]: the time of sample 0
    t : end of the substep [s], `origin` at the start
    h : length of a substep [s]
    s : (n,) signals, each in its own unit, changed in place
    """
    (records, constants, memory), (dampers, structures) = sampled, coupled
    some = False
    for i in range(len(records)):
        c = records[i]
        some = some or not c.aligned or floor((t - origin) / c.period + ROUNDING) >= c.coming
    if not some:
        return
    for i in range(len(structures)):
        show(structures[i], structures[i].state, s)
    for i in range(len(records)):
        c = records[i]
        gather(c.inputs, s, c.now)
        if c.senses:
            take_readings(c, origin, t, h, memory, s)
        else:
            take_command(c, origin, t, h, constants, memory, s)
        c.coming = floor((t - origin) / c.period + ROUNDING) + 1
        for j in range(len(c.inputs)):
            c.before[j] = c.now[j]
    respond(dampers, structures, s)


def take_command(
    c: Any, origin: float, t: float, h: float, constants: Any, memory: Any, s: Any
) -> None:
    """Let a controller act at the end of a substep.

    Parameters
    ----------
    c : record of the controller, see `records.sampled_record`
    origin, t, h : as in `sample`
    constants, memory : flat matrices of all controllers; states and room to work of all clocks
    s : (n,) signals, each in its own unit, changed in place
    """
    law = ControllerConstants(
        c.kind, c.period, c.v_max, c.velocity_corner, c.n, c.rows, c.v_top,
        constants[c.A : c.A_end], constants[c.B : c.B_end], constants[c.W : c.W_end],
        constants[c.C : c.C_end], c.f_min, c.anti_windup, c.law,
        c.p[:], c.still, c.least_slope, c.gain, c.integral_corner,
    )  # fmt: skip
    state, work = memory[c.state : c.work], memory[c.work : c.end]
    if t == origin:
        controller_start(origin, c.now[:], law, state, s[c.first :], work)
    else:
        span = (t - h, h, 0)
        controller_step(span, c.before[:], c.now[:], law, state, state, s[c.first :], work)


def take_readings(c: Any, origin: float, t: float, h: float, memory: Any, s: Any) -> None:
    """Let sensors act at the end of a substep.

    Parameters
    ----------
    c : record of the sensors, see `records.sampled_record`
    origin, t, h : as in `sample`
    memory : states and room to work of all components with clocks
    s : (n,) signals, each in its own unit, changed in place
    """
    law = SensorConstants(
        c.period, c.seed, c.size, c.gains[:], c.biases[:], c.deviation[:], c.quantisation[:],
        c.corner[:], c.share[:], c.length[:], c.ring[:],
    )  # fmt: skip
    state, work = memory[c.state : c.work], memory[c.work : c.end]
    if t == origin:
        sensors_start(origin, c.now[:], law, state, s[c.first :], work)
    else:
        span = (t - h, h, 0)
        sensors_step(span, c.before[:], c.now[:], law, state, state, s[c.first :], work)


def respond(dampers: Any, structures: Any, s: Any) -> None:
    """Let the forces of dampers follow voltages that have jumped, the motion held.

    Where a damper is given the acceleration, force and acceleration follow each other as in
    `start`. The forces are extrapolated from here with the slope that they had.
    """
    for k in range(3):
        again = False
        for i in range(len(dampers)):
            d = dampers[i]
            gather(d.inputs, s, d.now)
            if k == 0:
                d.jumps = limited(d.now[VOLTAGE], 0.0, d.v_max) != d.state[VOLTAGE_AT_END]
            if not d.jumps:
                continue
            again = again or d.measured
            shown, state = s[d.first :], d.state[:]
            d.now[HOLDING_FORCE] = shown[FORCE]
            c = damper_constants(d)
            damper_output(0.0, d.now[:], c, state, shown, d.work[:])
            damper_remember(d.now[:], c, state, shown)
            jump = shown[FORCE] - shown[FRICTION] - d.smooth
            d.smooth += jump
            d.smooth_1 += jump
            d.smooth_2 += jump
        if not again:
            break
        for i in range(len(structures)):
            show(structures[i], structures[i].state, s)


def update(sources: Any, coupled: Any, t: float, s: Any) -> None:
    """Let forces and accelerations follow signals that are given from outside, the motion held.

    Where a damper is given the acceleration, force and acceleration follow each other as in
    `start`.

    Parameters
    ----------
    sources, coupled : as in `integrate`
    t : s
    s : (n,) signals, each in its own unit, changed in place
    """
    dampers, structures = coupled
    play(sources, t, s)
    for i in range(len(dampers)):
        dampers[i].jumps = False
    for _ in range(3):
        for i in range(len(structures)):
            show(structures[i], structures[i].state, s)
        for i in range(len(dampers)):
            d = dampers[i]
            for j in range(len(d.inputs)):
                follows = j != HOLDING_FORCE and (j != ACCELERATION or d.measured)
                if follows and s[d.inputs[j]] != d.now[j]:
                    d.jumps = True
            if not d.jumps:
                continue
            gather(d.inputs, s, d.now)
            shown = s[d.first :]
            d.now[HOLDING_FORCE] = shown[FORCE]
            damper_output(0.0, d.now[:], damper_constants(d), d.state[:], shown, d.work[:])


def show(b: Any, state: Any, s: Any) -> None:
    """Write accelerations and holding force of a structure in a state into the signals."""
    gather_forces(b, s, b.now)
    c, now = structure_constants(b), state[0 : b.n_states]
    settle(c, now, b.work[:])
    structure_output(0.0, b.now[:], c, now, s[b.first :], b.work[:])


def gather(slots: Any, s: Any, values: Any) -> None:
    """Read a component's inputs from the signals."""
    for j in range(len(slots)):
        values[j] = s[slots[j]]


def gather_forces(b: Any, s: Any, values: Any) -> None:
    """Read a structure's inputs from the signals."""
    gather(b.inputs, s, values)
    for k in range(b.devices):
        values[DEVICE_FORCES + k] = s[b.forces[k]]


def damper_constants(d: Any) -> damper.Constants:
    """Return what a damper's functions compute with."""
    # Over a step that is linear nothing asks whether an effect knows the energy.
    setup = Setup(
        d.law, d.p[:], d.on[:], d.moving[:], d.n_moving, d.advances, d.n_own, d.signed, d.active,
        d.lags, False,
    )  # fmt: skip
    none = d.p[:0]  # no parameter follows an input here
    return DamperConstants(
        setup, d.v_max, d.stroke, d.moving_mass, d.measured, True, none, d.range[:]
    )


def structure_constants(b: Any) -> structure.Constants:
    """Return what a structure's functions compute with."""
    return StructureConstants(
        b.n, b.isolated, b.mass, b.m_inverse[:], b.damping[:], b.stiffness[:], b.stiffnesses[:],
        b.p[:], b.on[:], b.active, b.touches, True, 1, b.h, b.phi[:], b.held[:], b.ramp[:],
        b.devices, b.ends[:],
    )  # fmt: skip

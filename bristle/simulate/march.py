"""The time march of the coupled system: written in plain Python, compiled by `jit`.

In each substep the structures take their exact linear step and the dampers theirs, with the smooth
forces linear in time and friction held at its new value. The forces at the end are extrapolated
from the last substeps, and corrected until motion and forces agree. Friction that sticks takes
whatever value brings the motion to rest, up to its limit (Moreau's time stepping: Moreau 1988, in
Nonsmooth Mechanics and Applications, CISM 302).

All signals of the scenario stand in one vector `s`; each component is a record (`layout`) that
holds its numbers and the slots of its ports in `s`.
"""

from __future__ import annotations

from math import inf, isfinite

from ..physics import damper, signals, structure
from ..physics.inputs import Inputs, Setup
from ..physics.laws import laws_of
from . import sampled as clocks

damper_step = damper.step
damper_evaluate = damper.evaluate
structure_step = structure.step
free_step = structure.free_step
add_force = structure.add_force
accelerations = structure.accelerations
holding_force = structure.holding_force
rest_forces = structure.rest_forces
signal_value = signals.value
signal_rate = signals.rate
due, sample = clocks.due, clocks.sample

TOLERANCE = 1e-6
"""Disagreement of a force, as a share of the largest force so far, at which sweeps end."""

MAX_SWEEPS = 40

INLINE = (
    *("play", "start", "begin", "move", "resist", "end", "show_motion", "felt_voltage", "setup"),
    *("due", "sample", "act"),
    *("step", "free_step", "add_force", "step_law", "falling"),
    *(hook.__qualname__ for law in laws_of("damper") for hook in law.hooks().values()),
)
"""What becomes part of its caller: it is short or has one caller. Saves time, twice."""


def march(
    rows, substeps, h, sources, times, samples, dampers, structures, sampled, constants, memory,
    s, outputs, table
):  # fmt: skip
    """Fill `table` (rows + 1, m) with the signals `outputs` (m,), one row per `substeps` of h [s].

    `sources`, `dampers`, `structures`, `sampled` are arrays of records (see `layout`), `times` and
    `samples` the samples of all sources one after another, `constants` and `memory` what sampled
    components compute with, `s` the signals with their start values.

    Returns
    -------
    tuple of int
        How many rows are filled, the last of them perhaps with values that are not finite; the
        damper whose force and motion did not agree, which ends the march before the next row (-1:
        none); the number of sweeps.
    """
    scale, sweeps = 1e-9, 0
    play(sources, times, samples, 0.0, s)
    start(dampers, structures, s)
    serve(sampled, dampers, structures, 0, h, constants, memory, s)
    for j in range(len(outputs)):
        table[0, j] = s[outputs[j]]
    for row in range(rows):
        for k in range(substeps):
            begin(dampers, structures, s)
            play(sources, times, samples, (row * substeps + k + 1) * h, s)
            sweep, change = 0, inf
            while change > TOLERANCE * scale and sweep < MAX_SWEEPS:
                for i in range(len(structures)):
                    move(structures[i], sweep, h, s)
                change = 0.0
                for i in range(len(dampers)):
                    change = max(change, resist(dampers[i], structures, sweep, h, s))
                    scale = max(scale, abs(dampers[i].found))
                sweep += 1
            sweeps += sweep
            if change > TOLERANCE * scale:
                worst = 0
                for i in range(len(dampers)):
                    worst = i if abs(dampers[i].excess) == change else worst
                return row + 1, worst, sweeps
            end(dampers, structures, h, s)
            at = row * substeps + k + 1
            serve(sampled, dampers, structures, at, h, constants, memory, s)
        for i in range(len(structures)):
            b = structures[i]
            show_rest(b, b.x, b.z, s)
        for i in range(len(dampers)):
            s[dampers[i].stroke_ratio] = abs(s[dampers[i].x]) / dampers[i].stroke
        total = 0.0
        for j in range(len(outputs)):
            table[row + 1, j] = s[outputs[j]]
            total += s[outputs[j]]
        if not isfinite(total):
            return row + 2, -1, sweeps
    return rows + 1, -1, sweeps


def play(sources, times, samples, t, s):
    """Write what the sources give at time t [s] into the signals."""
    for i in range(len(sources)):
        g = sources[i]
        own_times, own = times[g.begin : g.end], samples[g.begin : g.end]
        s[g.out] = g.scale * signal_value(g.kind, t - g.delay, g.p, own_times, own)
        if g.rate_out >= 0:
            s[g.rate_out] = signal_rate(g.kind, t - g.delay, g.p, own_times, own)


def start(dampers, structures, s):
    """Settle the signals at the begin: accelerations and forces may follow each other."""
    for _ in range(3):
        for i in range(len(structures)):
            b = structures[i]
            show_motion(b, b.x, s)
            show_rest(b, b.x, b.z, s)
        for i in range(len(dampers)):
            d = dampers[i]
            d.a0 = s[d.a] if d.a >= 0 else 0.0
            resting = d.halts and s[d.v] == 0.0
            halt = s[structures[d.on_structure].holding] / d.sharing if resting else 0.0
            now = Inputs(s[d.x], s[d.v], d.a0, felt_voltage(d, s), inf, 0.0, halt, resting)
            s[d.force] = damper_evaluate(setup(d), now, d.z[:], d.z1[:], d.spare[:])[0]
            d.smooth = d.smooth_1 = d.smooth_2 = s[d.force]
            s[d.stroke_ratio] = abs(s[d.x]) / d.stroke


def begin(dampers, structures, s):
    """Keep what a substep begins from, and extrapolate the forces to its end."""
    for i in range(len(structures)):
        b = structures[i]
        b.ground0 = s[b.ground]
        b.smooth0 = s[b.force] + s[b.extra] - s[b.friction] - s[b.extra_friction]
    for i in range(len(dampers)):
        d = dampers[i]
        d.x0, d.v0, d.V0, d.force0 = s[d.x], s[d.v], felt_voltage(d, s), s[d.force]
        s[d.force] = 3.0 * (d.smooth - d.smooth_1) + d.smooth_2 + s[d.friction]
        d.smooth_2, d.smooth_1 = d.smooth_1, d.smooth


def move(b, sweep, h, s):
    """Take a structure to the end of the substep under the forces of the present sweep."""
    friction = s[b.friction] + s[b.extra_friction]
    f0, f1 = b.smooth0 + friction, s[b.force] + s[b.extra]
    x1 = b.x1
    if b.active:
        structure_step(
            b.n, b.isolated, b.stiffness, b.phi, b.held, b.ramp, h, b.x, b.ground0, s[b.ground],
            f0, f1, 0.0, b.z, b.p, b.on, True, x1, b.z1, b.work,
        )  # fmt: skip
    else:
        free = b.free
        if sweep == 0 or b.follows:
            free_step(b.n, b.phi, b.held, b.ramp, b.x, b.ground0, s[b.ground], free)
        for i in range(2 * b.n):
            x1[i] = free[i]
        add_force(b.n, b.held, b.ramp, 0, f0, f1, x1)
    show_motion(b, x1, s)
    if b.followed:
        show_rest(b, x1, b.z1, s)


def resist(d, structures, sweep, h, s):
    """Take a damper to the end of the substep and correct its force; return its disagreement [N].

    The correction is the secant's, from the second sweep on and while friction stays: a plain
    exchange of forces converges slowly, or not at all, where a damper is stiff or has inertia.
    """
    tried, friction, v1 = s[d.force], s[d.friction], s[d.v]
    a1 = s[d.a] if d.a >= 0 else (v1 - d.v0) / h
    halt = 0.0
    if d.halts:
        halt = tried - v1 / (structures[d.on_structure].gain * d.sharing)
    energy = s[d.energy]
    before = Inputs(d.x0, d.v0, d.a0, d.V0, h, energy, halt, d.halts)
    now = Inputs(s[d.x], v1, a1, felt_voltage(d, s), h, energy, halt, d.halts)
    d.found, s[d.friction] = damper_step(setup(d), before, now, d.z[:], d.z1[:], d.work[:])
    excess, slope = d.found - tried, -1.0
    if sweep > 0 and tried != d.tried and s[d.friction] == friction:
        slope = min((excess - d.excess) / (tried - d.tried), -0.5)
    d.tried, d.excess = tried, excess
    s[d.force] = tried - excess / slope
    return abs(excess)


def end(dampers, structures, h, s):
    """Accept a substep."""
    for i in range(len(structures)):
        b = structures[i]
        for j in range(2 * b.n):
            b.x[j] = b.x1[j]
        if b.active:
            for j in range(len(b.z)):
                b.z[j] = b.z1[j]
    for i in range(len(dampers)):
        d = dampers[i]
        for j in range(d.n_states):
            d.z[j] = d.z1[j]
        s[d.force] = d.found
        d.smooth = d.found - s[d.friction]
        d.a0 = s[d.a] if d.a >= 0 else (s[d.v] - d.v0) / h
        s[d.energy] += 0.5 * h * (d.force0 * d.v0 + d.found * s[d.v])


def idle(sampled, dampers, structures, at, h, constants, memory, s):
    """Do nothing, in place of `serve` where nothing has a clock: the march compiles sooner."""


def serve(sampled, dampers, structures, at, h, constants, memory, s):
    """Let the sampled components act whose instant substep `at` reaches; the forces follow."""
    if not due(sampled, at, h):
        return
    for i in range(len(structures)):
        b = structures[i]
        show_rest(b, b.x, b.z, s)
    for i in range(len(dampers)):
        dampers[i].V0 = felt_voltage(dampers[i], s)
    sample(sampled, at, h, constants, memory, s)
    respond(dampers, structures, h, s)


def respond(dampers, structures, h, s):
    """Let the forces of dampers follow voltages that are no longer V0, the motion held.

    Where a damper is given the acceleration, force and acceleration follow each other as in
    `start`. The forces are extrapolated from here with the slope that they had.
    """
    for _ in range(3):
        again = False
        for i in range(len(dampers)):
            d = dampers[i]
            V = felt_voltage(d, s)
            if V == d.V0:
                continue
            again = again or d.a >= 0
            d.a0 = s[d.a] if d.a >= 0 else d.a0
            halt = 0.0
            if d.halts:
                halt = s[d.force] - s[d.v] / (structures[d.on_structure].gain * d.sharing)
            now = Inputs(s[d.x], s[d.v], d.a0, V, h, s[d.energy], halt, d.halts)
            s[d.force], s[d.friction] = damper_evaluate(setup(d), now, d.z[:], d.z1[:], d.spare[:])
            jump = s[d.force] - s[d.friction] - d.smooth
            d.smooth += jump
            d.smooth_1 += jump
            d.smooth_2 += jump
        if not again:
            break
        for i in range(len(structures)):
            b = structures[i]
            show_rest(b, b.x, b.z, s)


def show_motion(b, x, s):
    """Write the displacements and velocities of a structure in state x into the signals."""
    at = b.first_output
    for i in range(b.n):
        s[at] = x[i]
        s[at + 1] = x[b.n + i]
        at += 3


def show_rest(b, x, z, s):
    """Write the accelerations, drifts and the holding force of a structure into the signals."""
    n = b.n
    loads, absolute = b.work[0:n], b.absolute
    for i in range(n):
        loads[i] = 0.0
    devices = s[b.force] + s[b.extra]
    if b.active:
        hold = rest_forces(
            n, b.isolated, b.stiffness, b.c, b.k, b.mass, x, s[b.ground], devices, z, b.p, b.on,
            loads,
        )  # fmt: skip
    else:
        hold = holding_force(n, b.c, b.k, b.mass, x, s[b.ground], 0.0)
    loads[0] += devices
    accelerations(n, b.m_inverse, b.c, b.k, x, loads, absolute)
    at = b.first_output
    for i in range(n):
        s[at + 2] = absolute[i]
        at += 3
    for i in range(1 if b.isolated else 0, n):
        s[at] = x[i] - (x[i - 1] if i > 0 else 0.0)
        at += 1
    s[b.holding] = hold - s[b.extra]


def setup(d):
    """Return what a damper's functions need of its record."""
    return Setup(d.law, d.p, d.on, d.moving, d.n_moving, d.advances, d.n_own, d.signed, d.active)


def felt_voltage(d, s):
    """Return the voltage of a damper within the limits at which it saturates [V]."""
    return min(max(s[d.V], 0.0), d.v_max)

"""The time march of the coupled system: written in plain Python, compiled by `jit`.

In each substep the structures take their exact linear step and the dampers theirs, with the smooth
forces linear in time and friction held at its new value; both are repeated until the forces
agree (a sweep shrinks the error by substep x slope of the force / mass, about 0.01 at 0.2 ms).
Friction that sticks takes whatever value brings the motion to rest, up to its limit (Moreau's time
stepping: Moreau 1988, in Nonsmooth Mechanics and Applications, CISM 302).

All signals of the scenario stand in one vector; components hold the slots of their ports in it.
"""

from __future__ import annotations

from math import inf, isfinite

from ..physics import damper, signals, structure

damper_step = damper.step
damper_evaluate = damper.evaluate
structure_step = structure.step
free_step = structure.free_step
add_force = structure.add_force
accelerations = structure.accelerations
holding_force = structure.holding_force
effect_forces = structure.effect_forces
signal_value = signals.value
signal_rate = signals.rate

TOLERANCE = 1e-6
"""Change of a force between sweeps, as a share of the largest force so far, that ends them."""

MAX_SWEEPS = 40


def sources(t, so, s):  # type: ignore[no-untyped-def]
    """Write the sources' values at time t [s] into the signals."""
    for i in range(len(so.kind)):
        a, b = so.begin[i], so.end[i]
        times, samples = so.times[a:b], so.samples[a:b]
        s[so.out[i]] = so.scale[i] * signal_value(so.kind[i], t - so.delay[i], so.p[i], times, samples)
        if so.rate_out[i] >= 0:
            s[so.rate_out[i]] = signal_rate(so.kind[i], t, so.p[i], times, samples)


def motion_outputs(b, st, x, s):  # type: ignore[no-untyped-def]
    """Write the displacements and velocities of structure b into the signals."""
    at = st.first_output[b]
    for i in range(st.n[b]):
        s[at] = x[i]
        s[at + 1] = x[st.n[b] + i]
        at += 3


def other_outputs(b, st, x, s, loads, absolute):  # type: ignore[no-untyped-def]
    """Write the accelerations, drifts and the holding force of structure b into the signals."""
    n, isolated = st.n[b], st.isolated[b]
    for i in range(n):
        loads[i] = 0.0
    if st.active[b]:
        effect_forces(
            n, isolated, st.stiffness[b], x, inf, 0.0, 0.0, st.z[b], st.p[b], st.on[b], loads
        )
    others = loads[0] + s[st.extra[b]]
    loads[0] = others + s[st.force[b]]
    accelerations(n, st.m_inverse[b], st.c[b], st.k[b], x, loads, absolute)
    at = st.first_output[b]
    for i in range(n):
        s[at + 2] = absolute[i]
        at += 3
    for i in range(1 if isolated else 0, n):
        s[at] = x[i] - (x[i - 1] if i > 0 else 0.0)
        at += 1
    s[at] = holding_force(n, st.c[b], st.k[b], st.mass[b], x, s[st.ground[b]], others)


def felt_voltage(d, da, s):  # type: ignore[no-untyped-def]
    """Return the voltage at damper d within the limits at which it saturates [V]."""
    return min(max(s[da.V[d]], 0.0), da.v_max[d])


def first_row(so, da, st, s, loads, absolute):  # type: ignore[no-untyped-def]
    """Settle the signals at the begin: accelerations and forces may follow each other."""
    for _ in range(3):
        for b in range(len(st.n)):
            motion_outputs(b, st, st.x[b], s)
            other_outputs(b, st, st.x[b], s, loads, absolute)
        for d in range(len(da.law)):
            size = da.z.shape[1]
            a = s[da.a[d]] if da.a[d] >= 0 else 0.0
            s[da.force[d]] = damper_evaluate(
                da.law[d], s[da.x[d]], s[da.v[d]], a, felt_voltage(d, da, s), inf, 0.0, 0.0, False,
                da.z[d], da.p[d], da.on[d], da.work[0:size], da.work[size : 2 * size],
            )[0]  # fmt: skip
            s[da.stroke_ratio[d]] = abs(s[da.x[d]]) / da.stroke[d]


def march(rows, substeps, h, so, da, st, s, outputs, table):  # type: ignore[no-untyped-def]
    """Fill `table` (rows + 1, m) with the signals `outputs` (m,), one row per `substeps` of h [s].

    `so`, `da`, `st` are `model`'s named tuples of arrays for sources, dampers and structures, `s`
    the signals with their start values.

    Returns
    -------
    tuple of int
        The row at which a value stopped being finite (-1: none), and how many substeps ended
        before the forces agreed.
    """
    dampers, buildings = len(da.law), len(st.n)
    loads, absolute = st.work[0:64].copy(), st.work[0:64].copy()
    x1, free, sz1, z1 = st.x.copy(), st.x.copy(), st.z.copy(), da.z.copy()
    friction = s * 0.0  # the part of each force signal that is friction
    smooth, smooth_before = s * 0.0, s * 0.0
    begin = s.copy()
    ground0, f0 = st.mass * 0.0, st.mass * 0.0
    a0, V0 = da.v_max * 0.0, da.v_max * 0.0
    scale, unsettled = 1e-9, 0
    sources(0.0, so, s)
    first_row(so, da, st, s, loads, absolute)
    for d in range(dampers):
        a0[d] = s[da.a[d]] if da.a[d] >= 0 else 0.0
        smooth[da.force[d]] = smooth_before[da.force[d]] = s[da.force[d]]
    for j in range(len(outputs)):
        table[0, j] = s[outputs[j]]
    for row in range(rows):
        for k in range(substeps):
            begin[:] = s
            for b in range(buildings):
                ground0[b] = s[st.ground[b]]
                f0[b] = s[st.force[b]] + s[st.extra[b]] - friction[st.force[b]] - friction[st.extra[b]]
            for d in range(dampers):
                slot = da.force[d]
                V0[d] = felt_voltage(d, da, s)
                ahead = 2.0 * smooth[slot] - smooth_before[slot]
                smooth_before[slot] = smooth[slot]
                s[slot] = ahead + friction[slot]
            sources((row * substeps + k + 1) * h, so, s)
            for b in range(buildings):
                if not st.active[b]:
                    free_step(
                        st.n[b], st.phi[b], st.held[b], st.ramp[b], st.x[b], ground0[b],
                        s[st.ground[b]], free[b],
                    )  # fmt: skip
            settled = False
            for _ in range(MAX_SWEEPS):
                for b in range(buildings):
                    rub = friction[st.force[b]] + friction[st.extra[b]]
                    f1 = s[st.force[b]] + s[st.extra[b]]
                    if st.active[b]:
                        structure_step(
                            st.n[b], st.isolated[b], st.stiffness[b], st.phi[b], st.held[b],
                            st.ramp[b], h, st.x[b], ground0[b], s[st.ground[b]], f0[b] + rub, f1,
                            0.0, st.z[b], st.p[b], st.on[b], True, x1[b], sz1[b], st.work,
                        )  # fmt: skip
                    else:
                        for i in range(2 * st.n[b]):
                            x1[b, i] = free[b, i]
                        add_force(st.n[b], st.held[b], st.ramp[b], 0, f0[b] + rub, f1, x1[b])
                    motion_outputs(b, st, x1[b], s)
                    if st.feeds_acceleration[b]:
                        other_outputs(b, st, x1[b], s, loads, absolute)
                change = 0.0
                for d in range(dampers):
                    slot = da.force[d]
                    v0, v1 = begin[da.v[d]], s[da.v[d]]
                    a1 = s[da.a[d]] if da.a[d] >= 0 else (v1 - v0) / h
                    halt, on = 0.0, da.on_structure[d]
                    if on >= 0:
                        halt = s[slot] - v1 / st.held[on, st.n[on] * (st.n[on] + 1)]
                    force, rub = damper_step(
                        da.law[d], begin[da.x[d]], v0, a0[d], V0[d], s[da.x[d]], v1, a1,
                        felt_voltage(d, da, s), h, begin[da.energy[d]], halt, on >= 0, da.z[d],
                        da.p[d], da.on[d], da.moving[d], da.n_moving[d], da.advances[d], z1[d],
                        da.work,
                    )  # fmt: skip
                    change = max(change, abs(force - s[slot]))
                    scale = max(scale, abs(force))
                    s[slot], friction[slot], smooth[slot] = force, rub, force - rub
                if not change > TOLERANCE * scale:
                    settled = True
                    break
            if not settled:
                unsettled += 1
            st.x[:] = x1
            st.z[:] = sz1
            da.z[:] = z1
            for d in range(dampers):
                v0, v1 = begin[da.v[d]], s[da.v[d]]
                a0[d] = s[da.a[d]] if da.a[d] >= 0 else (v1 - v0) / h
                power = begin[da.force[d]] * v0 + s[da.force[d]] * v1
                s[da.energy[d]] += 0.5 * h * power
        for b in range(buildings):
            other_outputs(b, st, st.x[b], s, loads, absolute)
        for d in range(dampers):
            s[da.stroke_ratio[d]] = abs(s[da.x[d]]) / da.stroke[d]
        total = 0.0
        for j in range(len(outputs)):
            table[row + 1, j] = s[outputs[j]]
            total += s[outputs[j]]
        if not isfinite(total):
            return row + 1, unsettled
    return -1, unsettled

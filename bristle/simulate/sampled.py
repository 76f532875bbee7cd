"""Controllers and sensors in the time march: sampled on clocks of their own.

The laws are those that the FMUs run (`bristle.control`). At each instant a component measures the
motion and the damper's force with the voltage before, then sets its outputs, which stand until its
next sample; the dampers' forces follow at once. Components act in the order of the scenario.

Written in plain Python, compiled with the march by `jit`.
"""

from __future__ import annotations

from math import floor

from ..control import instrument, inverse, linear, sensing, switching

CLIPPED, INVERSE, SCHEDULED, CLIPPED_LQG, SKYHOOK, SENSORS = range(6)
KINDS = {
    "ClippedOptimal": CLIPPED,
    "HinfInverse": INVERSE,
    "Lpv": SCHEDULED,
    "LqgClipped": CLIPPED_LQG,
    "Skyhook": SKYHOOK,
    "Sensors": SENSORS,
}

ROUNDING = 1e-6
"""Share of a sample period by which a substep's end may miss an instant."""

table_row, command, advance = linear.table_row, linear.command, linear.advance
clipped_voltage = switching.clipped_voltage
signed_voltage, applied_signed = switching.signed_voltage, switching.applied_signed
voltage_of_law, force_of_law = inverse.voltage_of_law, inverse.force_of_law
estimate_states = inverse.estimate_states
low_passed, filtered_velocity = sensing.low_passed, sensing.filtered_velocity
leaky_integral, skyhook_command = sensing.leaky_integral, sensing.skyhook_command
skyhook_switch = sensing.skyhook_switch
reading = instrument.reading


def due(sampled, at, h):
    """Return whether a component has to look at the end of substep `at` (0: the begin)."""
    some = False
    for i in range(len(sampled)):
        c = sampled[i]
        c.last = floor(at * h / c.period + ROUNDING)
        some = some or c.last >= c.next or not c.aligned
    return some


def sample(sampled, at, h, constants, memory, s):
    """Let every component take the samples that substep `at` of h [s] ends on or passes.

    An instant within the substep is measured as if the inputs were linear over it.
    """
    for i in range(len(sampled)):
        c = sampled[i]
        for j in range(len(c.inputs)):
            c.now[j] = s[c.inputs[j]]
        for k in range(c.next, c.last + 1):
            share = min(max(k * c.period / h - (at - 1), 0.0), 1.0)
            if share > 1.0 - ROUNDING * c.period / h:
                share = 1.0
            act(c, k, share, constants, memory, s)
        c.next = max(c.next, c.last + 1)
        for j in range(len(c.inputs)):
            c.before[j] = c.now[j]


def act(c, k, share, constants, memory, s):
    """Take sample k, `share` of the way from the inputs before to those now."""
    if c.kind == SENSORS:
        for j in range(len(c.inputs)):
            s[c.outputs[j]] = shown(c, j, k, measured(c, j, share), constants, memory)
        return
    y, x = measured(c, 0, share), measured(c, 1, share)
    v, f = measured(c, 2, share), measured(c, 3, share)
    if c.filtered:
        if k == 0:
            c.low = c.x_before = x
        c.low = low_passed(c.low, c.x_before, x, c.velocity_corner, c.period)
        c.x_before = x
        v = filtered_velocity(c.low, x, c.velocity_corner)
    if c.kind == SKYHOOK:
        voltage, u = hooked(c, y, v)
    else:
        voltage, u = designed(c, y, v, f, constants, memory)
    s[c.outputs[0]] = voltage
    s[c.outputs[1]] = u
    s[c.outputs[2]] = v


def measured(c, j, share):
    """Return input j at an instant; at the substep's end to the last digit."""
    if share == 1.0:
        return c.now[j]
    return c.before[j] + share * (c.now[j] - c.before[j])


def designed(c, y, v, f, constants, memory):
    """Return voltage [V] and raw command of a state-space law, and move its state on."""
    n, size = c.n, c.rows * c.n
    x, spare = memory[c.state : c.state + n], memory[c.state + n : c.state + 2 * n]
    row = table_row(v, c.v_top, c.rows) if c.rows > 1 else 0
    u = command(n, constants[c.C : c.C + size], row, x)
    second = 0.0
    if c.kind == INVERSE:
        voltage, applied = inverted(c, u, v)
        second = c.anti_windup * (applied - u)
    elif c.kind == SCHEDULED:
        voltage = signed_voltage(u, v, c.v_max)
        second = c.anti_windup * (applied_signed(voltage, v) - u)
    else:
        voltage = clipped_voltage(u, f, c.f_min, c.v_max)
        second = f if c.kind == CLIPPED_LQG else 0.0
    advance(
        n, constants[c.A : c.A + size * n], constants[c.B : c.B + size],
        constants[c.W : c.W + size], row, x, y, second, spare,
    )  # fmt: skip
    return voltage, u


def inverted(c, u, v):
    """Return the voltage [V] for the commanded force, and the force [N] that it gives by the law.

    Moves the estimated states of the law on.
    """
    voltage = voltage_of_law(c.law, c.p, u, v, c.z, c.still, c.least_slope, c.v_max)
    applied = force_of_law(c.law, c.p, v, voltage, c.z)
    estimate_states(c.law, c.p, v, voltage, c.period, c.z)
    return voltage, applied


def hooked(c, y, v):
    """Return voltage [V] and command [N] of the skyhook law, and move its integral on."""
    c.absolute = leaky_integral(c.absolute, c.y_before, y, c.integral_corner, c.period)
    c.y_before = y
    u = skyhook_command(c.absolute, c.gain)
    voltage, _ = inverted(c, u, v)
    if c.switches:
        voltage = skyhook_switch(c.absolute, v, c.v_max)
    return voltage, u


def shown(c, j, k, value, constants, memory):
    """Return what the instrument of channel j shows at sample k, and move it on."""
    ring = memory[c.ring[j] : c.ring[j] + c.length[j]]
    if k == 0:
        c.channel_low[j] = c.channel_before[j] = value
        for i in range(len(ring)):
            ring[i] = value
    if c.corner[j] > 0.0:
        low, before = c.channel_low[j], c.channel_before[j]
        c.channel_low[j] = low_passed(low, before, value, c.corner[j], c.period)
    else:
        c.channel_low[j] = value
    c.channel_before[j] = value
    disturbance = constants[c.noise[j] + k] if c.noise[j] >= 0 else 0.0
    return reading(
        k, c.channel_low[j], ring, c.share[j], c.own_gain[j], c.bias[j], disturbance,
        c.quantisation[j],
    )  # fmt: skip

"""Controllers on a clock of their own: from what is measured to a voltage within limits.

A command comes from a designed state-space law or from skyhook; a switch, a law's inverse or the
signed voltage turns it into a voltage, which stands until the next sample.
"""

from __future__ import annotations

from ..control.inverse import estimate_states, force_of_law, voltage_of_law
from ..control.linear import advance, command, table_row
from ..control.policy import (
    BESIDES,
    KEEP,
    LARGEST,
    LEAST_LEVEL,
    estimate,
    hidden_units,
    policy_inputs,
    recent_level,
    voltage_share,
)
from ..control.sensing import (
    filtered_velocity,
    leaky_integral,
    low_passed,
    skyhook_command,
    skyhook_switch,
)
from ..control.switching import applied_signed, clipped_voltage, limited, signed_voltage
from ..physics.linear import Row
from .clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code
from .controller_setup import (
    CLIPPED,
    CLIPPED_LQG,
    INVERSE,
    NO_INVERSE,
    NO_KIND,
    NO_VELOCITY,
    POLICY,
    REMEMBERED,
    SIGNED,
    SKYHOOK_INVERSE,
    SKYHOOK_SWITCH,
    Constants,
    bake,
    constants,
    setup,
    sizes,
)

__all__ = [
    "CLIPPED", "CLIPPED_LQG", "COMMAND_RAW", "INVERSE", "NO_INVERSE", "NO_KIND", "NO_VELOCITY",
    "POLICY", "SCHEDULING", "SIGNED", "SKYHOOK_INVERSE", "SKYHOOK_SWITCH", "VOLTAGE", "Constants",
    "bake", "constants", "output", "setup", "sizes", "start", "step",
]  # fmt: skip

FLOOR_ACCELERATION, BASE_DISPLACEMENT, BASE_VELOCITY, DAMPER_FORCE = range(4)
VOLTAGE, COMMAND_RAW, SCHEDULING = range(3)

LOW, X_BEFORE, ABSOLUTE, Y_BEFORE = range(-REMEMBERED, -2)
LEVEL = ABSOLUTE
"""What the state holds behind that of the state-space law and the states of the damper's law that
is inverted, as the controller estimates them; before `ORIGIN` and `COMING`. A trained policy keeps
the output's recent level where skyhook has its integral."""


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Take the first sample from a law at rest.

    Parameters
    ----------
    time : time of sample 0 [s]
    inputs : (4,) floor acceleration [m/s2], base displacement [m], base velocity [m/s], damper
        force [N]
    c : Constants
    state : (n + `Slots.law_states` + 6,) states of the state-space law, of the damper's law that is
        inverted, and what is remembered; filled
    outputs : (3,) voltage [V], raw command [N or V] and scheduling velocity [m/s], filled
    work : (n + 4,) room to work

    Returns
    -------
    int
        0.
    """
    for i in range(len(state)):
        state[i] = 0.0
    state[ORIGIN], state[COMING] = time, 1.0
    sample(0, inputs, c, state, outputs, work)
    return 0


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Take the samples that the step ends on or passes.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep (not used).
    before, now : (4,) inputs at begin and end, as in `start`
    c : Constants
    state, new_state : one and the same sequence, as in `start`, moved on in place
    outputs : (3,) as in `start`, filled where a sample is taken
    work : (n + 4,) room to work

    Returns
    -------
    int
        0, `LONG_STEP` or `TOO_MANY_SAMPLES` of `clock`.
    """
    time, dt, _ = clock
    origin, coming = state[ORIGIN], state[COMING]
    last = last_sample(time + dt, c.period, origin)
    code = step_code(dt, c.period, last - coming)
    if code < 0:
        return code
    measured = work[c.n : c.n + 4]
    for k in range(first_sample(time, c.period, origin, coming), last + 1):
        measure(origin + k * c.period - time, dt, c.period, before, now, measured)
        sample(k, measured, c, new_state, outputs, work)
        new_state[COMING] = k + 1.0
    return code


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Hold the outputs: none follows an input.

    Parameters
    ----------
    time, inputs, c, state, outputs, work
        As in `start`; nothing is read or filled.
    """
    return 0


def sample(k: int, measured: Row, c: Constants, state: Row, outputs: Row, spare: Row) -> None:
    """Take one sample: fill the outputs and move the state on, in place.

    Parameters
    ----------
    k : number of the sample, 0 the first
    measured : (4,) inputs at its instant, as in `start`
    c : Constants
    state, outputs : as in `start`
    spare : (n,) or more, room to work
    """
    y, v = measured[FLOOR_ACCELERATION], measured[BASE_VELOCITY]
    x = measured[BASE_DISPLACEMENT]
    if c.velocity_corner > 0.0:
        if k == 0:  # nothing is known of the past: the filter has settled
            state[LOW] = state[X_BEFORE] = x
        low = low_passed(state[LOW], state[X_BEFORE], x, c.velocity_corner, c.period)
        state[LOW], state[X_BEFORE] = low, x
        v = filtered_velocity(low, x, c.velocity_corner)
    if c.kind == POLICY:
        voltage, u = trained(measured, v, c, state, spare)
    elif c.kind >= SKYHOOK_SWITCH:
        voltage, u = skyhook(y, x, v, c, state)
    else:
        voltage, u = designed(measured, v, c, state, spare)
    outputs[VOLTAGE], outputs[COMMAND_RAW], outputs[SCHEDULING] = voltage, u, v


def designed(measured: Row, v: float, c: Constants, state: Row, spare: Row) -> tuple[float, float]:
    """Return voltage and raw command of a state-space law, and move its state on.

    Parameters
    ----------
    measured : (4,) inputs, as in `start`
    v : velocity across the damper that the law works with [m/s]
    c : Constants
    state : as in `start`, moved on in place
    spare : (n,) or more, room to work

    Returns
    -------
    voltage : float
        V.
    u : float
        Command before limits and inverse: N; V where the kind is `SIGNED`.
    """
    y, f = measured[FLOOR_ACCELERATION], measured[DAMPER_FORCE]
    row = table_row(v, c.v_top, c.rows) if c.rows > 1 else 0
    u = command(c.n, c.C, row, state)
    if c.kind == INVERSE:
        voltage, applied = inverted(u, measured[BASE_DISPLACEMENT], v, c, state)
        second = c.anti_windup * (applied - u)
    elif c.kind == SIGNED:
        voltage = signed_voltage(u, v, c.v_max)
        second = c.anti_windup * (applied_signed(voltage, v) - u)
    else:
        voltage = clipped_voltage(u, f, c.f_min, c.v_max)
        second = f if c.kind == CLIPPED_LQG else 0.0
    advance(c.n, c.A, c.B, c.W, row, state, (y, second), spare)
    return voltage, u


def trained(measured: Row, v: float, c: Constants, state: Row, spare: Row) -> tuple[float, float]:
    """Return voltage and raw command [V] of a trained policy, and move its state on.

    Parameters
    ----------
    measured : (4,) inputs, as in `start`; the velocity becomes `v`
    v : velocity across the damper that the law works with [m/s]
    c : Constants
    state : as in `start`, moved on in place
    spare : room to work, `measured` in it behind the first n
    """
    count, hidden = c.n + BESIDES, hidden_units(c.n, len(c.W))
    first = c.n + len(measured)
    inputs, units = spare[first : first + count], spare[first + count : first + count + hidden]
    measured[BASE_VELOCITY] = v
    estimate(c.n, c.A, c.B, measured, state, spare)
    level = max(state[LEVEL], c.C[LEAST_LEVEL])
    level = recent_level(level, measured[FLOOR_ACCELERATION], c.C[KEEP])
    state[LEVEL] = level
    policy_inputs(c.n, state, level, measured, c.C, inputs)
    u = c.C[LARGEST] * voltage_share(count, hidden, inputs, c.W, units)
    return limited(u, 0.0, c.v_max), u


def inverted(u: float, x: float, v: float, c: Constants, state: Row) -> tuple[float, float]:
    """Return the voltage of a commanded force, and the force that it gives by the law.

    Moves the estimated states of the law on.

    Parameters
    ----------
    u : commanded force [N]
    x, v : displacement [m] and velocity [m/s] across the damper
    c : Constants
    state : as in `start`

    Returns
    -------
    voltage, applied : float
        V; N.
    """
    z = state[c.n : len(state) - REMEMBERED]
    voltage = voltage_of_law(c.law, c.p, u, v, z, (c.still, c.least_slope, c.v_max), x)
    applied = force_of_law(c.law, c.p, v, voltage, z, x)
    estimate_states(c.law, c.p, v, voltage, c.period, z)
    for i in range(len(z)):
        state[c.n + i] = z[i]
    return voltage, applied


def skyhook(y: float, x: float, v: float, c: Constants, state: Row) -> tuple[float, float]:
    """Return voltage and command of the skyhook law, and move its integral on.

    Parameters
    ----------
    y : floor acceleration [m/s2]
    x, v : displacement [m] and velocity [m/s] across the damper
    c : Constants
    state : as in `start`, moved on in place

    Returns
    -------
    voltage, u : float
        V; N.
    """
    total, before = state[ABSOLUTE], state[Y_BEFORE]
    absolute = leaky_integral(total, before, y, c.integral_corner, c.period)
    state[ABSOLUTE], state[Y_BEFORE] = absolute, y
    u = skyhook_command(absolute, c.gain)
    if c.kind == SKYHOOK_SWITCH:
        return skyhook_switch(absolute, v, c.v_max), u
    return inverted(u, x, v, c, state)[0], u

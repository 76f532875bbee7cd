"""Controllers on a clock of their own: from what is measured to a voltage within limits.

A command comes from a designed state-space law or from skyhook; a switch, a law's inverse or the
signed voltage turns it into a voltage, which stands until the next sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import NamedTuple

from ..physics.linear import Row, copy, open_row, packed, row
from .clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code
from .control_laws import (
    BESIDES,
    KEEP,
    LARGEST,
    LEAST_LEVEL,
    advance,
    applied_signed,
    clipped_voltage,
    command,
    estimate,
    estimate_states,
    filtered_velocity,
    force_of_law,
    hidden_units,
    leaky_integral,
    limited,
    low_passed,
    policy_inputs,
    recent_level,
    signed_voltage,
    skyhook_command,
    skyhook_switch,
    table_row,
    voltage_of_law,
    voltage_share,
)
from .controller_file import Controller

CLIPPED, INVERSE, SIGNED, CLIPPED_LQG, SKYHOOK_SWITCH, SKYHOOK_INVERSE, POLICY = range(7)
"""Kinds of controllers."""

REMEMBERED = 6
"""How many numbers the state holds behind those of the laws."""

NO_VELOCITY, NO_KIND, NO_INVERSE = -2, -3, -4
"""Why a controller cannot be set up: a text is none of its words."""

FIELDS = (
    "sample_period", "v_max", "velocity", "velocity_corner", "f_min", "anti_windup", "kind", "gain",
    "integral_corner", "inverse", "still", "least_slope",
)  # fmt: skip
"""What the values of a controller may hold besides the parameters of the laws to invert."""

_BUILT, _FIELDS, _BAKED_A, _BAKED_B, _BAKED_W, _BAKED_C, _LAWS, _COUNTS, _PARAMETERS = range(9)
_FIXED_KIND, _STATES, _TABLE, _FASTEST, _LAW_STATES = range(5)
(
    _PERIOD, _V_MAX, _VELOCITY, _CORNER, _F_MIN, _ANTI_WINDUP, _CHOSEN, _GAIN, _INTEGRAL, _INVERSE,
    _STILL, _LEAST,
) = range(len(FIELDS))  # fmt: skip

_NUMBERS, _A, _B, _W, _C, _P = range(6)
_KIND, _N, _ROWS, _V_TOP, _LAW = range(len(FIELDS), len(FIELDS) + 5)
_COUNT = _LAW + 1


class Constants(NamedTuple):
    """What a controller computes with; what its kind does not need is 0.

    `n`, `rows`, `v_top`, `A`, `B`, `W`, `C` are those of `component.controller_file.Controller`;
    `velocity_corner` [rad/s] is that of the low-passed displacement whose rate is the velocity, 0:
    the velocity is measured; `law` and `p` say which damper's law is inverted, `still` and
    `least_slope` how; `gain` and `integral_corner` [rad/s] belong to skyhook.
    """

    kind: int
    period: float
    v_max: float
    velocity_corner: float
    n: int
    rows: int
    v_top: float
    A: Row
    B: Row
    W: Row
    C: Row
    f_min: float
    anti_windup: float
    law: int
    p: Row
    still: float
    least_slope: float
    gain: float
    integral_corner: float


def bake(
    names: Sequence[str], kind: int | None, design: Controller | None,
    laws: Mapping[str, tuple[int, Sequence[str]]], law_states: int,
) -> list[float]:  # fmt: skip
    """Return what a build fixes of a controller.

    They are rows: sizes and the kind; the index of each of `FIELDS` among the values, -1 where it
    is none; the matrices of the design; the codes of the laws that can be inverted, the numbers of
    their parameters, and the indices of these among the values.

    Parameters
    ----------
    names : of the values, in their order
    kind : which of the kinds; None: the value of `kind` says switch or inverse, of skyhook
    design : of the state-space law; None: there is none
    laws : by name, in the order of the words of `inverse`, code and names of parameters among
        the values
    law_states : how many states of a law the controller estimates at most
    """
    at = {name: index for index, name in enumerate(names)}
    sizes = [-1 if kind is None else kind, 0, 1, 0.0, law_states]
    matrices: list[Sequence[float]] = [[], [], [], []]
    if design is not None:
        sizes[1:4] = design.n, design.rows, design.v_top
        matrices = [design.A, design.B, design.W, design.C]
    found = [at.get(name, -1) for name in FIELDS]
    codes = [code for code, _ in laws.values()]
    counts = [len(own) for _, own in laws.values()]
    indices = [at[name] for _, own in laws.values() for name in own]
    return packed(sizes, found, *matrices, codes, counts, indices)


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
    built = row(baked, _BUILT)
    n = int(built[_STATES])
    matrices = 0
    for k in range(4):
        matrices += len(row(baked, _BAKED_A + k))
    counts[0] = _P + 1 + _COUNT + matrices + len(row(baked, _PARAMETERS))
    counts[1], counts[2], counts[3] = n + built[_LAW_STATES] + REMEMBERED, 3, n + 4
    if built[_FIXED_KIND] == POLICY:
        counts[3] += n + BESIDES + hidden_units(n, len(row(baked, _BAKED_W)))
    return 0


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked
    given : (4,) not used
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; the store is filled

    Returns
    -------
    int
        0, `NO_VELOCITY`, `NO_KIND` or `NO_INVERSE`.
    """
    built, fields = row(baked, _BUILT), row(baked, _FIELDS)
    at = open_row(store, _NUMBERS, _COUNT)
    for i in range(len(fields)):
        store[at + i] = values[int(fields[i])] if fields[i] >= 0.0 else 0.0
    if fields[_LEAST] < 0.0:
        store[at + _LEAST] = 1.0
    if store[at + _VELOCITY] < 0.0:
        return NO_VELOCITY
    filtered = store[at + _VELOCITY] != 0.0
    store[at + _CORNER] = 2.0 * pi * store[at + _CORNER] if filtered else 0.0
    store[at + _INTEGRAL] = 2.0 * pi * store[at + _INTEGRAL]
    store[at + _KIND] = built[_FIXED_KIND]
    if built[_FIXED_KIND] < 0.0:
        store[at + _KIND] = SKYHOOK_SWITCH + store[at + _CHOSEN]
        if store[at + _CHOSEN] < 0.0:
            return NO_KIND
    if store[at + _INVERSE] < 0.0:
        return NO_INVERSE
    store[at + _N], store[at + _ROWS] = built[_STATES], built[_TABLE]
    store[at + _V_TOP] = built[_FASTEST]
    for k in range(4):
        matrix = row(baked, _BAKED_A + k)
        copy(matrix, 0, store, open_row(store, _A + k, len(matrix)), len(matrix))
    take_law(values, baked, int(store[at + _INVERSE]), store, at)
    return 0


def take_law(values: Row, baked: Row, chosen: int, store: Row, at: int) -> None:
    """Fill in code and parameters of the law that is inverted.

    Parameters
    ----------
    values, baked, store
        As in `setup`; the rows of `store` before that of the parameters are there.
    chosen : which of the laws it is
    at : where the numbers of the store begin
    """
    codes, counts, indices = row(baked, _LAWS), row(baked, _COUNTS), row(baked, _PARAMETERS)
    store[at + _LAW], count, first = 0.0, 0, 0
    if len(codes) > 0:
        store[at + _LAW], count = codes[chosen], int(counts[chosen])
    for k in range(chosen):
        first += int(counts[k])
    p = open_row(store, _P, count)
    for i in range(count):
        store[p + i] = values[int(indices[first + i])]


def constants(store: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views."""
    c = row(store, _NUMBERS)
    return Constants(
        int(c[_KIND]), c[_PERIOD], c[_V_MAX], c[_CORNER], int(c[_N]), int(c[_ROWS]), c[_V_TOP],
        row(store, _A), row(store, _B), row(store, _W), row(store, _C), c[_F_MIN],
        c[_ANTI_WINDUP], int(c[_LAW]), row(store, _P), c[_STILL], c[_LEAST], c[_GAIN],
        c[_INTEGRAL],
    )  # fmt: skip


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
        Time at the start [s], dt [s], sweep (not used).
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

"""Run-time laws of controllers: linear, switching, through a damper's inverse, a trained policy.

A Kalman filter estimates the building and a model of the ground that shakes it. The output's recent
level says how strong the shaking is. Both enter a network with one hidden layer:

    share = (1 + tanh(o/2)) / 2,   o = b + s phi + w tanh(b_h + S phi)

phi are the inputs of `policy_inputs`: D of them for n estimated states. The weights lie one after
another in one flat sequence: S (hidden D), b_h (hidden), w (hidden), s (D), b.
"""

from __future__ import annotations

from math import exp, inf, tanh

from ..physics.damper_source import advance_law, law_force
from ..physics.linear import Row
from ..physics.tuples import NO_EFFECT, Inputs, record


def sign(value: float) -> float:
    """Return 1 or -1; 1 at zero."""
    return 1.0 if value >= 0.0 else -1.0


def limited(value: float, low: float, high: float) -> float:
    """Return the value within [low, high]."""
    if value < low:
        return low
    return high if value > high else value


def clipped_voltage(command: float, force: float, f_min: float, v_max: float) -> float:
    """Return the clipped-optimal voltage [V], which is 0 or `v_max`.

        V = v_max H((u - f) f) H(|u| - f_min),   H(0) = 0

    After Dyke, Spencer, Sain & Carlson (1996), Smart Mater. Struct. 5(5), 565-575, with the
    threshold of Yoshioka, Ramallo & Spencer (2002), J. Eng. Mech. 128(5), 540-551.

    Parameters
    ----------
    command, force : float
        Commanded and actual force [N], positive against +x.
    f_min : float
        Commands of this size or less are not answered [N].
    v_max : float
        Largest voltage [V].
    """
    if abs(command) > f_min and (command - force) * force > 0.0:
        return v_max
    return 0.0


def signed_voltage(command: float, v: float, v_max: float) -> float:
    """Return the voltage [V] of the signed command w = sgn(v) V [V] at damper velocity v [m/s].

    A damper's force follows the sign of its velocity; the signed voltage takes that sign into the
    command, so that a controller sees a gain of one sign.
    """
    return limited(sign(v) * command, 0.0, v_max)


def applied_signed(voltage: float, v: float) -> float:
    """Return the signed voltage [V] that a voltage is at damper velocity v [m/s]."""
    return sign(v) * voltage


MEASURED = 4
"""Floor acceleration [m/s2], displacement [m], velocity [m/s] and force [N] of the damper."""
BESIDES = 3
"""Inputs of the network besides the estimated states."""
KEEP, LEAST_LEVEL, FORCE, ACCELERATION, SPEED, LARGEST = range(6)
"""Places of the scales: share of the level that a sample keeps, its least value [m/s2], typical
force [N], acceleration [m/s2] and speed [m/s], and the largest voltage [V] of the training."""
SCALES = 6


def hidden_units(n: int, count: int) -> int:
    """Return how many hidden units a network of `count` weights has, of n estimated states."""
    inputs = n + BESIDES
    return (count - inputs - 1) // (inputs + 2)


def weight_count(n: int, hidden: int) -> int:
    """Return how many weights a network has."""
    inputs = n + BESIDES
    return hidden * (inputs + 2) + inputs + 1


def estimate(n: int, A: Row, B: Row, measured: Row, state: Row, spare: Row) -> None:
    """Bring the estimate from one sample to the next, in place: x <- A x + B m.

    Parameters
    ----------
    n : number of estimated states
    A, B : (n n,), (n 4,) flat
    measured : (4,) as `MEASURED` says
    state : (n,) or more; the first n are the estimate
    spare : (n,) or more, room to work
    """
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += A[i * n + j] * state[j]
        for j in range(MEASURED):
            total += B[i * MEASURED + j] * measured[j]
        spare[i] = total
    for i in range(n):
        state[i] = spare[i]


def recent_level(level: float, y: float, keep: float) -> float:
    """Return the largest recent size of the output [m/s2]; a sample keeps a share of the last."""
    return max(level * keep, abs(y))


def policy_inputs(
    n: int, state: Row, level: float, measured: Row, scales: Row, inputs: Row
) -> None:  # fmt: skip
    """Fill in what the network sees.

    The voltage is the same where all signs turn, so signs are told against the velocity's.

    Parameters
    ----------
    n : number of estimated states
    state : (n,) or more, the estimate first
    level : `recent_level` [m/s2]
    measured : (4,) as `MEASURED` says
    scales : (6,)
    inputs : (n + 3,) estimate over level, force, level and speed over their scales; filled
    """
    v, f = measured[2], measured[3]
    side = sign(v)
    for i in range(n):
        inputs[i] = side * state[i] / level
    inputs[n] = side * f / scales[FORCE]
    inputs[n + 1] = level / (level + scales[ACCELERATION])
    inputs[n + 2] = abs(v) / (abs(v) + scales[SPEED])


def voltage_share(count: int, hidden: int, inputs: Row, weights: Row, units: Row) -> float:
    """Return the network's output, within 0 and 1.

    Parameters
    ----------
    count, hidden : numbers of inputs and of hidden units
    inputs : (count,)
    weights : flat, as the module says
    units : (hidden,) the hidden units, filled
    """
    biases = hidden * count
    outer = biases + hidden
    direct = outer + hidden
    total = weights[direct + count]
    for j in range(count):
        total += weights[direct + j] * inputs[j]
    for i in range(hidden):
        inner = weights[biases + i]
        for j in range(count):
            inner += weights[i * count + j] * inputs[j]
        units[i] = tanh(inner)
        total += weights[outer + i] * units[i]
    return 0.5 * (1.0 + tanh(0.5 * total))


# The voltage at which a damper gives a commanded force.
#
# A law whose quantities are constant or linear in the voltage is affine in it at given motion,
# f = f_0 + slope V, so that V = (u - f_0)/slope. Reconstructed from the prose of Shirazi et al.
# (2012), IEEE TCST 20(5), eq. (7).
#
# `law` is the code of a law of the library (`physics.law.law_code`), `p` are its parameters in
# their order, `z` its states as the controller estimates them: after each sample they move on by
# `estimate_states`.

STILL = 1e-3
"""Speed [m/s] below which the inverse asks for no voltage."""

LEAST_SLOPE = 0.5
"""Least force per volt [N/V] that is divided by; with 0.05 the voltage chatters."""


def force_of_law(law: int, p: Row, v: float, V: float, z: Row, x: float = 0.0) -> float:
    """Return a law's force [N]; sgn(0) = 1.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    v, V : velocity [m/s], voltage [V]
    z : (k,) states of the law
    x : displacement [m], which only laws with a spring or a hysteresis over it ask for
    """
    now = record(Inputs, (x, v, 0.0, V, 0.0, 0.0, inf, v == 0.0))
    return law_force(law, p, now, z)[0]  # type: ignore[no-any-return]


def voltage_of_law(
    law: int, p: Row, command: float, v: float, z: Row, limits: tuple[float, float, float],
    x: float = 0.0,
) -> float:  # fmt: skip
    """Return the voltage [V] at which a damper of some law gives the commanded force.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    command : force [N], positive against +x
    v, z : velocity [m/s]; (k,) states of the law
    limits : still [m/s], least [N/V] and v_max [V] of `affine_voltage`; `STILL`, `LEAST_SLOPE` and
        8 V are usual
    x : displacement [m]
    """
    f_0 = force_of_law(law, p, v, 0.0, z, x)
    slope = force_of_law(law, p, v, 1.0, z, x) - f_0
    still, least, v_max = limits
    return affine_voltage(command, v, f_0, slope, still, least, v_max)


def estimate_states(law: int, p: Row, v: float, V: float, dt: float, z: Row) -> None:
    """Move a law's estimated states on by a sample.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    v, V : velocity [m/s] and voltage [V], held over the sample
    dt : length of the sample [s]
    z : (k,) states of the law, moved on in place
    """
    now = record(Inputs, (0.0, v, 0.0, V, dt, 0.0, 0.0, False))
    advance_law(law, p, now, NO_EFFECT, z, z)


def affine_voltage(
    command: float, v: float, f_0: float, slope: float, still: float, least: float, v_max: float
) -> float:
    """Return the voltage [V] of a force f_0 + slope V that comes nearest to a command.

    Parameters
    ----------
    command : force [N]
    v : velocity [m/s]
    f_0, slope : force at 0 V [N] and its slope over voltage [N/V]
    still : speed [m/s] below which the voltage is zero
    least : smallest slope [N/V]; a smaller one is taken as this, with its sign (plus at zero)
    v_max : largest voltage [V]; the smallest is 0
    """
    if abs(v) < still:
        return 0.0
    if abs(slope) < least:
        slope = least * sign(slope)
    return limited((command - f_0) / slope, 0.0, v_max)


# Linear controllers in discrete time: one, or a table of them looked up by speed.
#
#         u_k = C x_k,   x_k+1 = A x_k + B y_k + W w_k
#
# `y` is the measured floor acceleration, `w` a second input: for anti-windup, w = rate (sat(u) - u)
# with the rate in 1/s; for LQG, the damper's force. Matrices of a table lie one after another in
# flat sequences, `row` says which one: `A` (rows n n), `B`, `W`, `C` (rows n).


def table_row(v: float, v_top: float, rows: int) -> int:
    """Return the row nearest to the speed |v| [m/s] of a table even over 0 .. v_top [m/s]."""
    share = abs(v) / v_top
    if share >= 1.0:
        return rows - 1
    return int(share * (rows - 1) + 0.5)


def command(n: int, C: Row, row: int, x: Row) -> float:
    """Return u = C x, in the unit of the design's command.

    Parameters
    ----------
    n : number of states
    C : (rows n,) flat
    row : which row of the table counts
    x : (n,) state
    """
    at = row * n
    total = 0.0
    for j in range(n):
        total += C[at + j] * x[j]
    return total


def advance(
    n: int, A: Row, B: Row, W: Row, row: int, x: Row, inputs: tuple[float, float], spare: Row
) -> None:
    """Move the state on by one sample, in place.

    Parameters
    ----------
    n : number of states
    A, B, W : (rows n n,), (rows n,), (rows n,) flat
    row : which row of the table counts
    x : (n,) state, moved on in place
    inputs : floor acceleration y [m/s2]; the second input w
    spare : (n,) or more, room to work
    """
    y, w = inputs
    at = row * n
    for i in range(n):
        total = B[at + i] * y + W[at + i] * w
        for j in range(n):
            total += A[(at + i) * n + j] * x[j]
        spare[i] = total
    for i in range(n):
        x[i] = spare[i]


def low_passed(filtered: float, before: float, now: float, corner: float, h: float) -> float:
    """Return a first-order low-pass after a sample, exactly, for a signal linear in between.

    Parameters
    ----------
    filtered : float
        The low-passed signal at the last sample, in the signal's unit.
    before, now : float
        The signal at the last sample and at this one.
    corner : float
        Corner frequency [rad/s]: 2 pi 18 for 18 Hz.
    h : float
        Sample period [s].
    """
    slope = (now - before) / h
    return now - slope / corner + (filtered - before + slope / corner) * exp(-corner * h)


def filtered_velocity(filtered: float, now: float, corner: float) -> float:
    """Return the rate of the low-passed displacement: corner (x - filtered) [m/s].

    It is the derivative of `low_passed` itself; no difference between samples is taken.
    """
    return corner * (now - filtered)


def leaky_integral(total: float, before: float, now: float, corner: float, h: float) -> float:
    """Return an integral after a sample: it forgets at a corner frequency.

    Exact for a signal linear between samples; of an acceleration it is the velocity above `corner`,
    without the drift of a sensor's bias.

    Parameters
    ----------
    total : the integral at the last sample, in the signal's unit times s
    before, now : the signal at the last sample and at this one
    corner : corner frequency [rad/s]
    h : sample period [s]
    """
    mean = low_passed(total * corner, before, now, corner, h)
    return mean / corner


def skyhook_command(v_absolute: float, gain: float) -> float:
    """Return the force [N] of a dashpot of `gain` [N s/m] hung from the sky.

    Karnopp, Crosby & Harwood (1974), J. Eng. Ind. 96(2), 619-626. An inverse law turns it into a
    voltage, which is zero where a damper cannot give that force.
    """
    return gain * v_absolute


def skyhook_switch(v_absolute: float, v: float, v_max: float) -> float:
    """Return the on-off skyhook voltage [V]: `v_max` while the damper would slow the mass down.

    `v_absolute` is the velocity of the mass [m/s], `v` the one across the damper [m/s].
    """
    return v_max if v_absolute * v > 0.0 else 0.0

"""Advances states in series with the fluid (a mount, a gap) and states that move by rates.

The series mass is so light that its force balance decides. On the falling branch of the viscous
part, and where the motion turns, a linearised step would throw it about: so its velocity at the end
of each substep is found by trials.
"""

from __future__ import annotations

from typing import NamedTuple

from .damper_source import advance_law, evaluate, felt_voltage, law_factors, net_force
from .linear import Row, solve_in_place
from .tuples import Inputs, Setup

IMPLICIT_STEP = 5e-4
"""Longest substep [s] of states that move by `rate`."""

_GAMMA = 1.0 - 0.5 * 2.0**0.5


def between(begin: Inputs, end: Inputs, share: float, dt: float) -> Inputs:
    """Return the inputs at a share of the way from begin to end.

    Parameters
    ----------
    begin, end : Inputs
    share : 0 at begin, 1 at end; motion and voltage are linear between, the rest is that of the end
    dt : length of the step that the result is for [s]
    """
    return Inputs(
        begin.x + share * (end.x - begin.x),
        begin.v + share * (end.v - begin.v),
        begin.a + share * (end.a - begin.a),
        begin.V + share * (end.V - begin.V),
        dt,
        end.energy,
        end.stick_force,
        end.sticks,
    )


def advance_implicit(setup: Setup, begin: Inputs, end: Inputs, z: Row, work: Row) -> None:
    """Advance the states that move by `rate` over a step, with inputs linear in time.

    Rosenbrock's method of order two and L-stable (ROS2: Verwer, Spee, Blom & Hundsdorfer 1999,
    SIAM J. Sci. Comput. 20(4)), Jacobian by differences. As many equal substeps as keep each below
    `IMPLICIT_STEP`.

    Parameters
    ----------
    setup : Setup
    begin, end : Inputs at begin and end of the step of end.dt [s]
    z : (k,) state, advanced in place
    work : room for `damper.room` floats or more
    """
    moving, n, size = setup.moving, setup.n_moving, len(z)
    f = work[0:size]
    g = work[size : 2 * size]
    y = work[2 * size : 3 * size]
    unused = work[3 * size : 4 * size]
    k1 = work[4 * size : 5 * size]
    k2 = work[5 * size : 6 * size]
    drift = work[6 * size : 7 * size]
    matrix = work[7 * size : 7 * size + n * n]
    copy = work[7 * size + n * n : 7 * size + 2 * n * n]
    count = max(1, int(end.dt / IMPLICIT_STEP + 0.999999))
    h = end.dt / count
    for k in range(count):
        now = between(begin, end, k / count, h)
        then = between(begin, end, (k + 1.0) / count, h)
        for i in range(size):
            y[i] = z[i]
        evaluate(setup, now, y, f, unused)
        evaluate(setup, then, y, g, unused)
        for i in range(n):
            at = int(moving[i])  # a whole number, but a float among the others of a store
            drift[i] = _GAMMA * (g[at] - f[at])  # gamma h times the rate's own rate
        for j in range(n):
            slot = int(moving[j])
            nudge = 1e-8 + 1e-6 * abs(z[slot])
            y[slot] = z[slot] + nudge
            evaluate(setup, then, y, unused, k1)
            y[slot] = z[slot]
            for i in range(n):
                at = int(moving[i])
                matrix[i * n + j] = -_GAMMA * h * (unused[at] - g[at]) / nudge
            # What grows is left to the explicit part: 1 - gamma h J would pass through zero there,
            # and the method keeps its order with any matrix.
            matrix[j * n + j] = 1.0 + max(matrix[j * n + j], 0.0)
        for i in range(n):
            k1[i] = f[int(moving[i])] + drift[i]
        for i in range(n * n):
            copy[i] = matrix[i]
        solve_in_place(copy, k1, n)
        for i in range(n):
            at = int(moving[i])
            y[at] = z[at] + h * k1[i]
        evaluate(setup, then, y, g, unused)
        for i in range(n):
            k2[i] = g[int(moving[i])] - 2.0 * k1[i] - drift[i]
        solve_in_place(matrix, k2, n)
        for i in range(n):
            z[int(moving[i])] += h * (1.5 * k1[i] + 0.5 * k2[i])


MOST_TRIALS = 60
"""How many speeds of a series mass are tried in a substep; two or three are the rule."""

MOST_SECANTS = 8
"""How many of them secants try before they are bracketed."""

CLOSE = 1e-6
"""Last change of a series mass's speed by a secant, relative; what is left is its square."""

SLOW = 1e-4
"""Speed of a series mass [m/s] below which it is found to that share of this one."""

INSTANT = 1e-9
"""Time [s] in which nothing moves; hooks may divide by it."""

SETTLE = 5e-3
"""Time [s] over which forces act on a series mass that comes to its balance; its own is 0.1 ms."""


class Balance(NamedTuple):
    """The balance of a series mass over a substep.

    `now` is what acts on the rod at its end, `now.dt` the time that goes by; `begin` the rod's
    velocity at its begin; `push` the time [s] over which forces act, the same unless the mass is to
    come to rest at once; `deflection`, `speed` of the series element at the start [m, m/s].
    """

    now: Inputs
    begin: float
    push: float
    deflection: float
    speed: float
    share: float


def advance_series(
    setup: Setup, begin: Inputs, end: Inputs, z: Row, deflection: int, speed: int
) -> None:
    """Advance a series element and the law's states over a step, rod and voltage linear.

    Implicit Euler for the series mass, the trapezoidal rule for the deflection between rod and
    fluid (but see `damping_share`), the law's states exactly. Secants, begun with the gain and the
    slope of the substep before, need two or three trials; what they do not find is bracketed.

    Parameters
    ----------
    setup : Setup
    begin, end : Inputs at begin and end of the step of end.dt [s]
    z : (k,) state, advanced in place
    deflection, speed : slots of the series element's states in `z` [m, m/s]
    """
    count = max(1, int(end.dt / IMPLICIT_STEP + 0.999999))
    h = end.dt / count
    gain = (end.v - begin.v) / count
    slope = 0.0
    for k in range(count):
        v0 = begin.v + k / count * (end.v - begin.v)
        now = between(begin, end, (k + 1.0) / count, h)
        was = z[speed]
        balance = Balance(now, v0, h, z[deflection], was, 0.5)
        found, slope = balanced_speed(setup, balance, was + gain, slope, z)
        share = damping_share(setup, balance, found, z)
        if share > 0.5:
            balance = Balance(now, v0, h, z[deflection], was, share)
            found, slope = balanced_speed(setup, balance, found, 0.0, z)
        gain = found - was
        z[deflection] += deflected(balance, found)
        z[speed] = found
        if setup.n_own > 0:
            V = felt_voltage(setup, now, z)
            middle = Inputs(
                now.x - z[deflection], 0.5 * (was + found), now.a, V, h, now.energy, 0.0, False
            )
            advance_law(setup.law, setup.p, middle, law_factors(setup, middle, z), z, z)


def deflected(balance: Balance, speed: float) -> float:
    """Return by how much the series element gives way over a substep that ends at a speed [m]."""
    now, begin, _, _, was, share = balance
    way: float = now.dt * ((1.0 - share) * (begin - was) + share * (now.v - speed))
    return way


def damping_share(setup: Setup, balance: Balance, speed: float, z: Row) -> float:
    """Return the `share` of a substep that ends at a speed: that a stiff element does not ring.

    By the trapezoidal rule what is stiff against the fluid and the mass swings from substep to
    substep: where it does, it settles within the one. All that is softer keeps the rule.

    Parameters
    ----------
    setup, balance : Setup, Balance by the trapezoidal rule
    speed : of the series mass at the end of the substep by that rule [m/s]
    z : (k,) state, kept
    """
    now, begin, push, apart, was, share = balance
    if (begin - was) * (now.v - speed) >= 0.0:
        return share
    way = 1.0 if speed > 0.0 else -1.0
    nudge = way * 1e-4 * max(abs(speed), SLOW)
    bent = Balance(now, begin, push, apart + now.dt * nudge, was, share)
    excess = speed_excess(setup, balance, speed, way, z)
    slope = (speed_excess(setup, balance, speed + nudge, way, z) - excess) / nudge
    stiff = (excess - speed_excess(setup, bent, speed, way, z)) / nudge
    if stiff <= 0.0:
        return share
    return max(share, min(1.0 + share - slope / stiff, 1.0))


def balanced_speed(
    setup: Setup, balance: Balance, guess: float, slope: float, z: Row
) -> tuple[float, float]:
    """Return the series mass's speed [m/s] and the slope of its excess there [1], 0 if not known.

    Parameters
    ----------
    setup, balance : Setup, Balance
    guess : a first speed [m/s]
    slope : of the excess over speed, from a trial before [1]; 0: there is none
    z : (k,) state, kept
    """
    speed, slope = by_secants(setup, balance, guess, slope, z)
    if slope <= 0.0:
        speed = by_brackets(setup, balance, z)
    return speed, slope


def by_secants(
    setup: Setup, balance: Balance, speed: float, slope: float, z: Row
) -> tuple[float, float]:
    """Return the series mass's speed [m/s] and the slope of its excess there [1], 0 if not found.

    Not found is what may stand still: friction that is a jump leaves nothing to a secant there.

    Parameters
    ----------
    setup, balance : Setup, Balance
    speed : a first guess [m/s]
    slope : of the excess over speed, from a guess before [1]; 0: there is none
    z : (k,) state, kept
    """
    way = 1.0 if speed > 0.0 else -1.0
    if setup.signed and balance.speed * speed <= 0.0:
        return speed, 0.0
    excess = speed_excess(setup, balance, speed, way, z)
    fresh = slope <= 0.0
    if fresh:
        nudge = way * 1e-4 * max(abs(speed), SLOW)
        slope = (speed_excess(setup, balance, speed + nudge, way, z) - excess) / nudge
    for _ in range(MOST_SECANTS):
        if slope <= 0.0:
            break
        change = -excess / slope
        speed += change
        if setup.signed and speed * way <= 0.0:
            break
        if abs(change) <= (CLOSE if fresh else CLOSE * CLOSE) * max(abs(speed), SLOW):
            return speed, slope
        before = excess
        excess = speed_excess(setup, balance, speed, way, z)
        slope = (excess - before) / change
        fresh = True
    return speed, 0.0


def by_brackets(setup: Setup, balance: Balance, z: Row) -> float:
    """Return the series mass's speed [m/s]: regula falsi with the Illinois rule, from rest upwards.

    Friction that can stop the mass does.
    """
    way = 1.0
    at_low = speed_excess(setup, balance, 0.0, 1.0, z)
    if at_low >= 0.0:
        way = -1.0
        at_low = -speed_excess(setup, balance, 0.0, -1.0, z)
        if at_low >= 0.0:
            return 0.0  # it stands still
    low, high, at_high, last = 0.0, 0.0, 0.0, 0
    speed: float = max(way * balance.speed, way * balance.now.v, 1e-6)
    for _ in range(MOST_TRIALS):
        excess = way * speed_excess(setup, balance, way * speed, way, z)
        if abs(excess) <= 1e-10 + 1e-9 * speed:
            break
        if excess < 0.0:
            at_high *= 0.5 if last < 0 else 1.0
            low, at_low, last = speed, excess, -1
        else:
            at_low *= 0.5 if last > 0 else 1.0
            high, at_high, last = speed, excess, 1
        if at_high > 0.0:
            speed = (low * at_high - high * at_low) / (at_high - at_low)
        else:
            speed *= 2.0
    return way * speed


def speed_excess(setup: Setup, balance: Balance, speed: float, way: float, z: Row) -> float:
    """Return by how much a speed exceeds what the forces give the series mass [m/s].

    Parameters
    ----------
    setup, balance : Setup, Balance
    speed : of the series mass at the end of the substep [m/s]
    way : direction of the friction, 1 or -1
    z : (k,) state, kept
    """
    now, _, push, apart, was, _ = balance
    deflection = apart + deflected(balance, speed)
    force = net_force(setup, now, way, 0.5 * (was + speed), deflection, speed, z)
    return speed - was - push * force  # type: ignore[no-any-return]

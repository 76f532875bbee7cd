"""Advances what is in series with the fluid: a mount, a gap, and the small mass behind them.

The series mass is so light that its force balance decides. On the falling branch of the viscous
part, and where the motion turns, a linearised step would throw it about: so its velocity at the end
of each substep is found by trials.
"""

from __future__ import annotations

from typing import NamedTuple

from .damper_source import advance_law, felt_voltage, law_factors, net_force
from .implicit import IMPLICIT_STEP, between
from .inputs import Inputs, Setup
from .linear import Row

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
    come to rest at once; `deflection`, `speed` of the series element at the begin [m, m/s].
    """

    now: Inputs
    begin: float
    push: float
    deflection: float
    speed: float


def advance_series(
    setup: Setup, begin: Inputs, end: Inputs, z: Row, deflection: int, speed: int
) -> None:
    """Advance a series element and the law's states over a step, rod and voltage linear.

    Implicit Euler for the series mass, the trapezoidal rule for the deflection between rod and
    fluid, the law's states exactly. Secants, begun with the gain and the slope of the substep
    before, need two or three trials; what they do not find is bracketed.

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
        balance = Balance(now, v0, h, z[deflection], was)
        found, slope = balanced_speed(setup, balance, was + gain, slope, z)
        gain = found - was
        z[deflection] += 0.5 * h * (v0 - was + now.v - found)
        z[speed] = found
        if setup.n_own > 0:
            V = felt_voltage(setup, now, z)
            middle = Inputs(
                now.x - z[deflection], 0.5 * (was + found), now.a, V, h, now.energy, 0.0, False
            )
            advance_law(setup.law, setup.p, middle, law_factors(setup, middle, z), z, z)


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
    now, begin, push, apart, was = balance
    deflection = apart + 0.5 * now.dt * (begin - was + now.v - speed)
    force = net_force(setup, now, way, 0.5 * (was + speed), deflection, speed, z)
    return speed - was - push * force  # type: ignore[no-any-return]

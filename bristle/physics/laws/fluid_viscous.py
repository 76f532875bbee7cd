"""A fluid viscous damper: a power of the speed, behind the spring of its oil and its brackets."""

from __future__ import annotations

from math import expm1

from ..law import Law, Shape
from ..parameter import Parameter
from .modified_bouc_wen import mean_share

V_REF = 0.1
"""Speed [m/s] at which `c` is given: its unit is the same for every exponent."""

MOST_TRIALS = 60
"""How many values are tried in a step; five or so are the rule."""

AT_ONCE = 1e-6
"""Time [s] within which a state follows what has none."""

CLOSE = 1e-9
"""Miss of a value, by its bracket, after which Newton's next one is off by rounding alone."""


def narrowed(low, high, tried, excess, slope):
    """Return a bracket without the part that cannot hold the root, and where to look next.

    Newton's step where that stays inside, else the middle.

    Parameters
    ----------
    low, high : the bracket
    tried : a value in it
    excess, slope : a function that rises, and its slope, at that value
    """
    if excess > 0.0:
        high = tried
    else:
        low = tried
    if slope > 0.0:
        new = tried - excess / slope
        if low <= new <= high:
            return low, high, new
    return low, high, 0.5 * (low + high)


def late_share(steep):
    """Return which share of a step's last change the force has followed, as a velocity rises [1].

    A step is taken at its mean velocity: what moves on by half a step's rise until the end, and
    relaxes as exp(-t/tau), has followed by this share; `steep` is the step by tau.
    """
    return (1.0 - 2.0 * mean_share(steep)) * expm1(-steep)


def steady(v, alpha):
    """Return the share of c [1] that is carried in steady motion at v [m/s]."""
    share = (abs(v) / V_REF) ** alpha
    return share if v >= 0.0 else -share


def flow(y, alpha):
    """Return the speed [m/s] at which the dashpot alone carries the share y of c."""
    speed = V_REF * abs(y) ** (1.0 / alpha)
    return speed if y >= 0.0 else -speed


def relaxation(y, give, alpha):
    """Return the time [s] in which the carried share of c relaxes where it is y >= 0."""
    through = flow(y, alpha)
    return max(give * alpha * y / through, AT_ONCE) if through > 0.0 else AT_ONCE


def carried_on(y, v, give, alpha, dt):
    """Return the share of c [1] that is carried after a step at constant velocity v [m/s].

    The spring takes up what the dashpot does not let through at the mean share. That lies between
    the share at the start and that of steady motion.
    """
    goal = steady(v, alpha)
    if y == goal or dt <= 0.0:
        return y
    if give <= 0.0:
        return goal
    share = mean_share(dt / relaxation(max(abs(y), abs(goal)), give, alpha))
    step = share * dt
    low, high, mean = min(y, goal), max(y, goal), goal
    width = high - low
    for _ in range(MOST_TRIALS):
        through = flow(mean, alpha)
        slope = give + step * through / (alpha * mean) if mean != 0.0 else 0.0
        excess = give * (mean - y) - step * (v - through)
        low, high, mean = narrowed(low, high, mean, excess, slope)
        if abs(excess) <= CLOSE * (give * width + step * abs(v)):
            break
    return y + (mean - y) / share


class FluidViscous(Law):
    """Fluid viscous damper: f = c y, a dashpot with a power of the speed behind a spring.

        give y' = v - V_r |y|^(1/alpha) sgn(y),   V_r = 0.1 m/s

    Steady motion gives f = c (|v|/V_r)^alpha sgn(v), so C = c/V_r^alpha of data sheets; the spring,
    that of the oil and the brackets, is k = c/give. alpha below 1 limits the force at speed, 2 is
    an orifice. Leaves out friction of seals and a gas force.
    """

    name = "fluid_viscous"
    parts = ("viscous",)
    contains = ("series element",)
    source = (
        "Constantinou & Symans (1993), Struct. Des. Tall Build. 2(2), 93-132 (power law); Makris & "
        "Constantinou (1991), J. Struct. Eng. 117(9), 2708-2724 (Maxwell element)"
    )
    states = {"carried": "1", "rod": "m/s"}
    starts = {"rod": "v"}
    parameters = {
        "c": Parameter(8.0, "N", (0.0, 1e8), "force of steady motion at 0.1 m/s"),
        "alpha": Parameter(0.6, "1", (0.1, 2.0), "exponent of the speed"),
        "give": Parameter(1e-3, "m", (0.0, 1.0), "deflection under c of the spring in series"),
    }
    shapes = {
        "alpha": Shape(0.2, 1.8, 6, ("c",)),
        "give": Shape(5e-4, 0.5, 5, ("c",)),
    }

    @staticmethod
    def viscous(q, z, p):
        at, now = steady(z.rod, p.alpha), steady(q.v, p.alpha)
        top = max(abs(z.carried), abs(at), abs(now))
        if at == now or top == 0.0:
            return p.c * z.carried
        late = late_share(q.dt / relaxation(top, p.give, p.alpha))
        return p.c * (z.carried + late * (now - at))

    @staticmethod
    def rate(q, z, p):
        give = max(p.give, AT_ONCE * V_REF)
        return (q.v - flow(z.carried, p.alpha)) / give, (q.v - z.rod) / AT_ONCE

    @staticmethod
    def advance(q, z, p):
        return carried_on(z.carried, q.v, p.give, p.alpha, q.dt), q.v

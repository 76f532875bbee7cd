"""A damper: base law, effects and their states, evaluated and advanced over a time step.

One source for both paths. `evaluate` gives the force at given motion, voltage and state; `step`
advances the state over a time step and gives the force at its end. Both take flat sequences (see
`weave.Layout`): lists inside FMUs, arrays under numba.
"""

from __future__ import annotations

from typing import Any

from ..errors import PhysicsError
from . import effects as _effects  # noqa: F401  (importing it registers the effects)
from .bingham import Bingham
from .damper_source import (
    evaluate_source,
    motion_source,
    pull_source,
    reach_source,
    series_source,
)
from .effect import effects_of
from .linear import Row, solve_in_place
from .lugre import LuGre
from .weave import LAW_PARAMETERS, LAW_STATES, Layout, weave

BINGHAM = 0
LUGRE = 1
LAWS: dict[str, Any] = {"bingham": Bingham, "lugre": LuGre}
LAW_CODES = {"bingham": BINGHAM, "lugre": LUGRE}

IMPLICIT_STEP = 5e-4
"""Longest substep [s] of states that move by `rate`."""

MOST_TRIALS = 60
"""How many speeds of a joint are tried in a substep; two or three are the rule."""

MOST_SECANTS = 8
"""How many of them secants try before they are bracketed."""

CLOSE = 1e-6
"""Last change of a joint's speed by a secant, relative; what is left is its square."""

SLOW = 1e-4
"""Speed of a joint [m/s] below which it is found to that share of this one."""

INSTANT = 1e-9
"""Time [s] in which nothing moves; hooks may divide by it."""

SETTLE = 5e-3
"""Time [s] over which forces act on a joint that comes to its balance; its own is 0.1 ms."""

_GAMMA = 1.0 - 0.5 * 2.0**0.5


def reweave() -> None:
    """Weave the damper's functions anew; call it after effects were registered late."""
    global LAYOUT, evaluate, evaluate_law, inner_motion, joint_pull, series_element, slip_reach
    LAYOUT = Layout("damper", LAW_PARAMETERS, LAW_STATES)
    inner_motion = weave("inner_motion", motion_source(LAYOUT), LAYOUT)
    slip_reach = weave("slip_reach", reach_source(LAYOUT), LAYOUT)
    series_element = weave("series_element", series_source(LAYOUT), LAYOUT)
    laws = {
        "LuGreP": LUGRE_VALUES,
        "BinghamP": BINGHAM_VALUES,
        "LuGre_viscous": LuGre.viscous,
        "LuGre_bristle": LuGre.bristle,
        "LuGre_rate": LuGre.rate,
        "LuGre_advance": LuGre.advance,
        "Bingham_viscous": Bingham.viscous,
        "Bingham_yielding": Bingham.yielding,
    }
    joint_pull = weave("joint_pull", pull_source(LAYOUT), LAYOUT, **laws)
    evaluate = weave("evaluate", evaluate_source(LAYOUT, "evaluate"), LAYOUT, **laws)
    # The same without any effect, for dampers that have none: it does not pay for the others.
    none = Layout("", LAW_PARAMETERS, LAW_STATES)
    evaluate_law = weave("evaluate_law", evaluate_source(none, "evaluate_law"), none, **laws)


def _values(law: Any) -> Any:
    from collections import namedtuple

    return namedtuple(law.__name__ + "Values", tuple(law.parameters))


LUGRE_VALUES = _values(LuGre)
BINGHAM_VALUES = _values(Bingham)
LAYOUT: Layout
evaluate: Any
evaluate_law: Any
inner_motion: Any
joint_pull: Any
series_element: Any
slip_reach: Any
reweave()


def advance_implicit(
    law: int, x0: float, v0: float, a0: float, V0: float, x1: float, v1: float, a1: float,
    V1: float, dt: float, energy: float, halt: float, halts: bool, z: Row, p: Row, on: Row,
    moving: Row, n_moving: int, work: Row,
) -> None:  # fmt: skip
    """Advance the states that move by `rate` over dt [s], in place, with inputs linear in time.

    Rosenbrock's method of order two and L-stable (ROS2: Verwer, Spee, Blom & Hundsdorfer 1999,
    SIAM J. Sci. Comput. 20(4)), Jacobian by differences. As many equal substeps as keep each below
    `IMPLICIT_STEP`.

    `moving` lists the slots of those states in `z`, `n_moving` says how many; `work` holds
    `work_size(len(z))` floats or more.
    """
    n = n_moving
    size = len(z)
    f = work[0:size]
    g = work[size : 2 * size]
    y = work[2 * size : 3 * size]
    unused = work[3 * size : 4 * size]
    k1 = work[4 * size : 5 * size]
    k2 = work[5 * size : 6 * size]
    drift = work[6 * size : 7 * size]
    matrix = work[7 * size : 7 * size + n * n]
    copy = work[7 * size + n * n : 7 * size + 2 * n * n]
    count = max(1, int(dt / IMPLICIT_STEP + 0.999999))
    h = dt / count
    for k in range(count):
        s, e = k / count, (k + 1.0) / count
        xs, vs, As, Vs = (
            x0 + s * (x1 - x0),
            v0 + s * (v1 - v0),
            a0 + s * (a1 - a0),
            V0 + s * (V1 - V0),
        )
        xe, ve, ae, Ve = (
            x0 + e * (x1 - x0),
            v0 + e * (v1 - v0),
            a0 + e * (a1 - a0),
            V0 + e * (V1 - V0),
        )
        for i in range(size):
            y[i] = z[i]
        evaluate(law, xs, vs, As, Vs, h, energy, halt, halts, y, p, on, f, unused)
        evaluate(law, xe, ve, ae, Ve, h, energy, halt, halts, y, p, on, g, unused)
        for i in range(n):
            drift[i] = _GAMMA * (g[moving[i]] - f[moving[i]])  # gamma h times the rate's own rate
        for j in range(n):
            slot = moving[j]
            nudge = 1e-8 + 1e-6 * abs(z[slot])
            y[slot] = z[slot] + nudge
            evaluate(law, xe, ve, ae, Ve, h, energy, halt, halts, y, p, on, unused, k1)
            y[slot] = z[slot]
            for i in range(n):
                matrix[i * n + j] = -_GAMMA * h * (unused[moving[i]] - g[moving[i]]) / nudge
            # What grows is left to the explicit part: 1 - gamma h J would pass through zero there,
            # and the method keeps its order with any matrix.
            matrix[j * n + j] = 1.0 + max(matrix[j * n + j], 0.0)
        for i in range(n):
            k1[i] = f[moving[i]] + drift[i]
        for i in range(n * n):
            copy[i] = matrix[i]
        solve_in_place(copy, k1, n)
        for i in range(n):
            y[moving[i]] = z[moving[i]] + h * k1[i]
        evaluate(law, xe, ve, ae, Ve, h, energy, halt, halts, y, p, on, g, unused)
        for i in range(n):
            k2[i] = g[moving[i]] - 2.0 * k1[i] - drift[i]
        solve_in_place(matrix, k2, n)
        for i in range(n):
            z[moving[i]] += h * (1.5 * k1[i] + 0.5 * k2[i])


def advance_joint(
    law: int, x0: float, v0: float, a0: float, V0: float, x1: float, v1: float, a1: float,
    V1: float, dt: float, energy: float, z: Row, p: Row, on: Row, travel: int, joint: int,
) -> None:  # fmt: skip
    """Advance a series element and the bristle over dt [s], in place, rod and voltage linear.

    The joint is so light that its force balance decides. On the falling branch of the viscous part,
    and where the motion turns, a linearised step would throw it about. So in each substep its
    velocity at the end is found by trials: implicit Euler for the joint, the trapezoidal rule for
    the travel between rod and fluid, the bristle exactly. Secants, begun with the gain and the
    slope of the substep before, need two or three; what they do not find is bracketed.

    `travel`, `joint` are the slots of the series element in `z`.
    """
    count = max(1, int(dt / IMPLICIT_STEP + 0.999999))
    h = dt / count
    gain = (v1 - v0) / count
    slope = 0.0
    for k in range(count):
        begin, e = v0 + k / count * (v1 - v0), (k + 1.0) / count
        x, v = x0 + e * (x1 - x0), v0 + e * (v1 - v0)
        a, V = a0 + e * (a1 - a0), V0 + e * (V1 - V0)
        apart, was = z[travel], z[joint]
        speed, slope = joint_speed(
            law, x, v, a, V, begin, h, h, energy, was + gain, slope, apart, was, z, p, on
        )
        gain = speed - was
        z[joint] = speed
        z[travel] = apart + 0.5 * h * (begin - was + v - speed)
        if law == 1:
            middle = 0.5 * (was + speed)
            slip = p[6] / slip_reach(x - z[travel], middle, h, energy, z, p, on)
            z[0] = lugre_advance(z[0], middle, h, slip)


def joint_speed(
    law: int, x: float, v: float, a: float, V: float, begin: float, h: float, push: float,
    energy: float, guess: float, slope: float, apart: float, was: float, z: Row, p: Row, on: Row,
) -> tuple[float, float]:  # fmt: skip
    """Return the joint's speed [m/s] and the slope of its excess there, 0 if it is not known.

    For the arguments see `joint_excess`; `guess` is a first speed, `slope` one from before or 0.
    """
    speed, slope = joint_by_secants(
        law, x, v, a, V, begin, h, push, energy, guess, slope, apart, was, z, p, on
    )
    if slope <= 0.0:
        speed = joint_by_brackets(law, x, v, a, V, begin, h, push, energy, apart, was, z, p, on)
    return speed, slope


def joint_by_secants(
    law: int, x: float, v: float, a: float, V: float, begin: float, h: float, push: float,
    energy: float, speed: float, slope: float, apart: float, was: float, z: Row, p: Row, on: Row,
) -> tuple[float, float]:  # fmt: skip
    """Return the joint's speed [m/s] and the slope of its excess there, 0 if it was not found.

    `speed` is a first guess and `slope` that of a guess before, 0 if there is none. Not found is
    what may stand still: friction that is a jump leaves nothing to a secant there.
    """
    way = 1.0 if speed > 0.0 else -1.0
    if law == 0 and was * speed <= 0.0:
        return speed, 0.0
    excess = joint_excess(law, x, v, a, V, begin, h, push, energy, speed, way, apart, was, z, p, on)
    fresh = slope <= 0.0
    if fresh:
        nudge = way * 1e-4 * max(abs(speed), SLOW)
        slope = joint_excess(
            law, x, v, a, V, begin, h, push, energy, speed + nudge, way, apart, was, z, p, on
        )
        slope = (slope - excess) / nudge
    for _ in range(MOST_SECANTS):
        if slope <= 0.0:
            break
        change = -excess / slope
        speed += change
        if law == 0 and speed * way <= 0.0:
            break
        if abs(change) <= (CLOSE if fresh else CLOSE * CLOSE) * max(abs(speed), SLOW):
            return speed, slope
        before = excess
        excess = joint_excess(
            law, x, v, a, V, begin, h, push, energy, speed, way, apart, was, z, p, on
        )
        slope = (excess - before) / change
        fresh = True
    return speed, 0.0


def joint_by_brackets(
    law: int, x: float, v: float, a: float, V: float, begin: float, h: float, push: float,
    energy: float, apart: float, was: float, z: Row, p: Row, on: Row,
) -> float:  # fmt: skip
    """Return the joint's speed [m/s]: regula falsi with the Illinois rule, from rest upwards.

    Friction that can stop the joint does.
    """
    way = 1.0
    at_low = joint_excess(law, x, v, a, V, begin, h, push, energy, 0.0, 1.0, apart, was, z, p, on)
    if at_low >= 0.0:
        way = -1.0
        at_low = -joint_excess(
            law, x, v, a, V, begin, h, push, energy, 0.0, -1.0, apart, was, z, p, on
        )
        if at_low >= 0.0:
            return 0.0  # it stands still
    low, high, at_high, last = 0.0, 0.0, 0.0, 0
    speed = max(way * was, way * v, 1e-6)
    for _ in range(MOST_TRIALS):
        excess = way * joint_excess(
            law, x, v, a, V, begin, h, push, energy, way * speed, way, apart, was, z, p, on
        )
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


def joint_excess(
    law: int, x: float, v: float, a: float, V: float, begin: float, h: float, push: float,
    energy: float, speed: float, way: float, apart: float, was: float, z: Row, p: Row, on: Row,
) -> float:  # fmt: skip
    """Return by how much `speed` [m/s] exceeds what the forces over `push` [s] give the joint.

    h [s] is the time that goes by, the same unless the joint is to come to its balance at once.
    x, v, a, V belong to the rod at the end, `begin` is its velocity at the begin, `way` the
    direction of the friction, `apart` and `was` the travel and the joint's speed at the begin.
    """
    travel = apart + 0.5 * h * (begin - was + v - speed)
    pull = joint_pull(law, x, v, a, V, h, energy, way, 0.5 * (was + speed), travel, speed, z, p, on)
    return speed - was - push * pull  # type: ignore[no-any-return]


def step(
    law: int, x0: float, v0: float, a0: float, V0: float, x1: float, v1: float, a1: float,
    V1: float, dt: float, energy: float, halt: float, halts: bool, z0: Row, p: Row, on: Row,
    moving: Row, n_moving: int, advances: bool, z1: Row, work: Row, active: bool = True,
) -> tuple[float, float]:  # fmt: skip
    """Advance a damper over dt [s]; return its force [N] at the end and the friction in it [N].

    Parameters
    ----------
    law : int
        `BINGHAM` or `LUGRE`.
    x0, v0, a0, V0, x1, v1, a1, V1 : float
        Motion of the rod [m, m/s, m/s2] and voltage [V] at begin and end. Give the end twice where
        the input is held: with the newest motion held the bristle leads by half a step and makes
        good the half step by which a held force lags behind (measured: half-sine peaks within
        0.7 % instead of 1.1 % at 2 ms).
    halt, halts : float, bool
        The force that would bring the motion to rest within the step [N], and whether it is known.
    z0, z1 : sequence of float
        State at begin (kept) and at end (filled).
    moving, n_moving, advances
        Slots of the states that move by `rate`, how many, and whether any moves by `advance`.
    work : sequence of float
        Room for `work_size()` floats.
    active : bool
        Whether any effect is on; without, only the bristle (slot 0 of the state) is advanced.
    """
    if not active:
        return step_law(law, v0, x1, v1, a1, V1, dt, energy, halt, halts, z0, p, on, z1, work)
    size = len(z0)
    for i in range(size):
        z1[i] = z0[i]
    travel, joint = series_element(on)
    slides = law == 1 and n_moving == 0 and joint < 0
    deflection = z0[0]
    if slides:
        xs, vs = inner_motion(x0, v0, a0, V0, dt, energy, z0, p, on)
        xe, ve = inner_motion(x1, v1, a1, V1, dt, energy, z0, p, on)
        middle = 0.5 * (vs + ve)
        slip = p[6] / slip_reach(0.5 * (xs + xe), middle, dt, energy, z0, p, on)
        deflection = lugre_advance(z0[0], middle, dt, slip)
        z1[0] = 0.5 * (z0[0] + deflection)  # the bristle's share of the heat is that of the middle
    if advances:
        # At the middle of the step: second order where the inputs move, exact where they are held.
        evaluate(
            law, 0.5 * (x0 + x1), 0.5 * (v0 + v1), 0.5 * (a0 + a1), 0.5 * (V0 + V1), dt, energy,
            halt, halts, z1, p, on, work[0:size], z1,
        )  # fmt: skip
        z1[0] = deflection
        # And on to the end, without time: what depends on a signal alone ends where that does.
        evaluate(law, x1, v1, a1, V1, 0.0, energy, halt, halts, z1, p, on, work[0:size], z1)
    z1[0] = deflection
    if joint >= 0:
        advance_joint(law, x0, v0, a0, V0, x1, v1, a1, V1, dt, energy, z1, p, on, travel, joint)
    if n_moving > 0:
        advance_implicit(
            law, x0, v0, a0, V0, x1, v1, a1, V1, dt, energy, halt, halts, z1, p, on, moving,
            n_moving, work,
        )  # fmt: skip
    return evaluate(  # type: ignore[no-any-return]
        law, x1, v1, a1, V1, dt, energy, halt, halts, z1, p, on, work[0:size], work[size : 2 * size]
    )


def step_law(
    law: int, v0: float, x1: float, v1: float, a1: float, V1: float, dt: float, energy: float,
    halt: float, halts: bool, z0: Row, p: Row, on: Row, z1: Row, work: Row,
) -> tuple[float, float]:  # fmt: skip
    """Do what `step` does for a damper without effects: only the bristle has to be advanced."""
    z1[0] = lugre_advance(z0[0], 0.5 * (v0 + v1), dt, p[6]) if law == 1 else z0[0]
    return evaluate_law(  # type: ignore[no-any-return]
        law, x1, v1, a1, V1, dt, energy, halt, halts, z1, p, on, work, z1
    )


def force_at(
    law: int, x: float, v: float, a: float, V: float, dt: float, energy: float, halt: float,
    halts: bool, z: Row, p: Row, on: Row, work: Row,
) -> tuple[float, float]:  # fmt: skip
    """Return force and friction [N] at a state, as `evaluate` does; nothing moves on.

    `work` holds as many floats as `z`, or more.
    """
    return evaluate(law, x, v, a, V, dt, energy, halt, halts, z, p, on, work, work)  # type: ignore[no-any-return]


def jump(
    law: int, x: float, v: float, a: float, V: float, dt: float, energy: float, z: Row, p: Row,
    on: Row, work: Row,
) -> float:  # fmt: skip
    """Bring the state, in place, to a voltage that has jumped to V [V]; return the force [N].

    No time goes by: states that depend on the voltage alone follow it, and a joint, whose mass is
    too small to be felt between samples, comes to rest in its new balance. dt [s] is what `Q.dt`
    tells the forces.
    """
    size = len(z)
    rates, after = work[0:size], work[size : 2 * size]
    evaluate(law, x, v, a, V, 0.0, energy, 0.0, False, z, p, on, rates, z)
    travel, joint = series_element(on)
    if joint >= 0:
        z[joint] = joint_speed(
            law,
            x,
            v,
            a,
            V,
            v,
            INSTANT,
            SETTLE,
            energy,
            z[joint],
            0.0,
            z[travel],
            z[joint],
            z,
            p,
            on,
        )[0]
    return evaluate(law, x, v, a, V, dt, energy, 0.0, False, z, p, on, rates, after)[0]  # type: ignore[no-any-return]


lugre_advance = LuGre.advance


def work_size(more: int = 0) -> int:
    """Return how many floats `step` needs as room to work, where states have so many `more`."""
    size = LAYOUT.z_size + more
    return 7 * size + 2 * size * size


def moving_states(law: str, switched_on: list[str]) -> list[int]:
    """Return the slots that move by `rate` when these effects are on; empty if none does.

    The bristle moves with them, unless a series element carries it along.
    """
    effects = [effect for effect in LAYOUT.effects if effect.name in switched_on]
    slots = [
        LAYOUT.states[effect.name + "." + state]
        for effect in effects
        if "rate" in effect.hooks()
        for state in effect.states
        if state not in effect.joint
    ]
    carried = any(effect.joint for effect in effects)
    return ([0] if law == "lugre" and not carried else []) + slots if slots else []


def advances(switched_on: list[str]) -> bool:
    """Return whether any of these effects moves its states by `advance`."""
    return any("advance" in e.hooks() for e in LAYOUT.effects if e.name in switched_on)


class DamperModel:
    """A damper's law, effects, parameters and state, ready to step in plain Python.

    Parameters
    ----------
    law : {"bingham", "lugre"}
    values : dict
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes its default. Start
        values of states end in `_0` ("bristle_deflection_0", "coil_lag.voltage_0").
    effects : list of str
        The effects that are on.
    """

    def __init__(
        self,
        law: str,
        values: dict[str, float] | None = None,
        effects: list[str] | None = None,
    ) -> None:
        values, effects = values or {}, effects or []
        series = [
            effect.name for effect in LAYOUT.effects if effect.joint and effect.name in effects
        ]
        if len(series) > 1:
            raise PhysicsError("{} are series elements: one is right.".format(" and ".join(series)))
        self.law = LAW_CODES[law]
        self.p = pack(law, values)
        self.on = [effect.name in effects for effect in LAYOUT.effects]
        self.active = any(self.on)
        self.moving = moving_states(law, effects)
        self.advances = advances(effects)
        self.z = [0.0] * LAYOUT.z_size
        self.z[0] = values.get("bristle_deflection_0", 0.0)
        for name, slot in LAYOUT.states.items():
            self.z[slot] = values.get(name + "_0", 0.0)
        self._spare = [0.0] * LAYOUT.z_size
        self._work = [0.0] * work_size()
        self._end = list(self.z)

    def force(
        self,
        x: float,
        v: float,
        a: float,
        V: float,
        dt: float,
        energy: float,
        halt: float,
        halts: bool,
    ) -> float:
        """Return the force [N] at the present state, without advancing it."""
        size = len(self.z)
        return evaluate(  # type: ignore[no-any-return]
            self.law, x, v, a, V, dt, energy, halt, halts, self.z, self.p, self.on,
            self._work[0:size], self._spare,
        )[0]  # fmt: skip

    def step(
        self,
        x: float,
        v: float,
        a: float,
        V: float,
        dt: float,
        energy: float,
        halt: float,
        halts: bool,
    ) -> float:
        """Advance over dt [s] with the given inputs held; return the force [N] at the end."""
        force = step(
            self.law, x, v, a, V, x, v, a, V, dt, energy, halt, halts, self.z, self.p, self.on,
            self.moving, len(self.moving), self.advances, self._end, self._work,
            self.active,
        )[0]  # fmt: skip
        self.z, self._end = self._end, self.z
        return force


def pack(law: str, values: dict[str, float]) -> list[float]:
    """Return the flat parameters of a law and of all effects; missing ones take their defaults."""
    p = [0.0] * LAYOUT.p_size
    for slot, (name, parameter) in enumerate(LAWS[law].parameters.items()):
        p[slot] = values.get(name, parameter.value)
    for effect in effects_of("damper"):
        for name, parameter in effect.parameters.items():
            key = effect.name + "." + name
            p[LAYOUT.parameters[key]] = values.get(key, parameter.value)
    return p

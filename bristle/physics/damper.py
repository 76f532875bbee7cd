"""A damper: law, effects and their states, evaluated and advanced over a time step.

One source for both paths. `evaluate` gives the force at given motion, voltage and state; `step`
advances the state over a time step and gives the force at its end. Both take records (`inputs`)
and flat sequences (`codegen.Slots`): lists inside FMUs, arrays under numba.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import PhysicsError
from .codegen import Slots
from .damper_setup import bake, fill, refusals, setup_from, state_places, store_size
from .damper_source import (
    LIBRARY,
    SETS,
    advance_law,
    evaluate,
    felt_voltage,
    functions_of,
    hold_law,
    inner_motion,
    law_factors,
    law_force,
    series_element,
    step_law,
)
from .implicit import advance_implicit
from .inputs import Inputs, Setup
from .linear import Row
from .rows import packed
from .series import INSTANT, SETTLE, Balance, advance_series, balanced_speed
from .tuples import record

__all__ = [
    "LIBRARY", "SETS", "DamperModel", "evaluate", "force_at", "functions_of", "hold_law", "jump",
    "law_force", "room", "setup_of", "start_states", "step", "step_law",
]  # fmt: skip


def step(
    setup: Setup, begin: Inputs, end: Inputs, z0: Row, z1: Row, work: Row
) -> tuple[float, float]:
    """Advance a damper over a step; return its force [N] at the end and the friction in it [N].

    Parameters
    ----------
    setup : Setup
    begin, end : Inputs
        At begin and end of the step of end.dt [s], which `begin` names too. Give the end twice
        where the input is held: with the newest motion held the bristle leads by half a step and
        makes good the half step by which a held force lags behind (measured: half-sine peaks within
        0.7 % instead of 1.1 % at 2 ms).
    z0, z1 : sequence of float
        State at begin (kept) and at end (filled).
    work : sequence of float
        Room for `room(len(z0))` floats.
    """
    if not setup.active:
        return step_law(setup.law, setup.p, begin, end, z0, z1)  # type: ignore[no-any-return]
    size = len(z0)
    for i in range(size):
        z1[i] = z0[i]
    deflection, speed = series_element(setup.on)
    n_own = setup.n_own if setup.n_moving == 0 and speed < 0 else 0
    moved = work[2 * size : 3 * size]
    if n_own > 0:
        xs, vs = inner_motion(setup, begin, z0)
        xe, ve = inner_motion(setup, end, z0)
        V = 0.5 * (felt_voltage(setup, begin, z0) + felt_voltage(setup, end, z0))
        inner = Inputs(
            0.5 * (xs + xe), 0.5 * (vs + ve), end.a, V, end.dt, end.energy, end.stick_force,
            end.sticks,
        )  # fmt: skip
        advance_law(setup.law, setup.p, inner, law_factors(setup, inner, z0), z0, moved)
        for i in range(n_own):  # the law's share of the heat is that of the middle
            z1[i] = 0.5 * (z0[i] + moved[i])
    if setup.advances:
        # At the middle of the step: second order where the inputs move, exact where they are held.
        middle = Inputs(
            0.5 * (begin.x + end.x), 0.5 * (begin.v + end.v), 0.5 * (begin.a + end.a),
            0.5 * (begin.V + end.V), end.dt, end.energy, end.stick_force, end.sticks,
        )  # fmt: skip
        evaluate(setup, middle, z1, work[0:size], z1)
        for i in range(n_own):
            z1[i] = moved[i]
        # And on to the end, without time: what depends on a signal alone ends where that does.
        evaluate(setup, without_time(end), z1, work[0:size], z1)
    for i in range(n_own):
        z1[i] = moved[i]
    if speed >= 0:
        advance_series(setup, begin, end, z1, deflection, speed)
    if setup.n_moving > 0:
        advance_implicit(setup, begin, end, z1, work)
    return evaluate(setup, end, z1, work[0:size], work[size : 2 * size])  # type: ignore[no-any-return]


def without_time(now: Inputs) -> Inputs:
    """Return the same inputs for a step in which no time goes by."""
    return Inputs(now.x, now.v, now.a, now.V, 0.0, now.energy, now.stick_force, now.sticks)


def force_at(setup: Setup, now: Inputs, z: Row, work: Row) -> tuple[float, float]:
    """Return force and friction [N] at a state, as `evaluate` does; nothing moves on.

    Parameters
    ----------
    setup, now : Setup, Inputs
    z : (k,) state, kept
    work : (k,) or more, room to work
    """
    if not setup.active:
        return law_force(setup.law, setup.p, now, z)  # type: ignore[no-any-return]
    return evaluate(setup, now, z, work, work)  # type: ignore[no-any-return]


def jump(setup: Setup, now: Inputs, z: Row, work: Row) -> float:
    """Bring the state to a voltage that has jumped to now.V [V]; return the force [N].

    No time goes by: states that depend on the voltage alone follow it, and a series mass, too small
    to be felt between samples, comes to rest in its new balance.

    Parameters
    ----------
    setup, now : Setup, Inputs; now.dt [s] is what `Q.dt` tells the forces
    z : (k,) state, changed in place
    work : (2k,) or more, room to work
    """
    size = len(z)
    rates, after = work[0:size], work[size : 2 * size]
    evaluate(setup, without_time(now), z, rates, z)
    deflection, speed = series_element(setup.on)
    if speed >= 0:
        instant = Inputs(now.x, now.v, now.a, now.V, INSTANT, now.energy, 0.0, False)
        balance = Balance(instant, now.v, SETTLE, z[deflection], z[speed])
        z[speed] = balanced_speed(setup, balance, z[speed], 0.0, z)[0]
    return evaluate(setup, now, z, rates, after)[0]  # type: ignore[no-any-return]


def room(size: int) -> int:
    """Return how many floats `step` needs as room to work, where the states are so many."""
    return 7 * size + 2 * size * size


def setup_of(
    law: str, values: Mapping[str, float], effects: Sequence[str], row: Any = list,
    whole: Any = list,
) -> Setup:  # fmt: skip
    """Return the setup of a damper, for its `functions_of`.

    Parameters
    ----------
    law : str
        A damper's law, such as "bingham".
    values : dict
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes its default.
    effects : sequence of str
        The effects that are on.
    row, whole : callable
        What makes sequences of numbers, of switches and slots, from lists.

    Raises
    ------
    PhysicsError
        If two effects are series elements.
    """
    names = [*values, *(f"{effect}.on" for effect in effects)]
    slots = functions_of(law, effects).slots
    baked = packed(*bake(law, names, slots))
    store, z = [0.0] * store_size(baked), [0.0] * slots.z_size
    if code := fill([*values.values(), *(1.0 for _ in effects)], baked, store, z):
        raise PhysicsError(refusals(slots)[code])
    setup = setup_from(store)
    moving = [int(slot) for slot in setup.moving[: setup.n_moving]]
    on = [switch != 0.0 for switch in setup.on]
    return setup._replace(p=row(setup.p), on=whole(on or [False]), moving=whole(moving or [0]))


def start_states(law: str, values: Mapping[str, float], slots: Slots) -> list[float]:
    """Return the states at the begin; start values end in `_0`: "coil_lag.voltage_0"."""
    z = [0.0] * slots.z_size
    for name, slot in state_places(law, slots).items():
        z[slot] = values.get(name, 0.0)
    return z


class DamperModel:
    """A damper's law, effects, parameters and state, ready to step in plain Python.

    Parameters
    ----------
    law : str
        A damper's law, such as "bingham".
    values : dict
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes its default. Start
        values of states end in `_0` ("bristle_deflection_0", "coil_lag.voltage_0").
    effects : list of str
        The effects that are on.

    Attributes
    ----------
    functions : Functions
        What it is made of; a user's own law or effect has functions of its own.
    """

    def __init__(
        self,
        law: str,
        values: dict[str, float] | None = None,
        effects: list[str] | None = None,
    ) -> None:
        values, effects = values or {}, effects or []
        self.functions = functions_of(law, effects)
        self.setup = setup_of(law, values, effects)
        self.law, self.p, self.on = self.setup.law, self.setup.p, self.setup.on
        self.active = self.setup.active
        self.moving = list(self.setup.moving[: self.setup.n_moving])
        self.advances = self.setup.advances
        self.z = start_states(law, values, self.functions.slots)
        self._work = [0.0] * room(len(self.z))
        self._end = list(self.z)
        self._force, self._step = map(self.functions.link, (force_at, step))
        self._hold_law = self.functions.made["hold_law"]

    def force(
        self, x: float, v: float, a: float, V: float, dt: float, energy: float,
        stick_force: float, sticks: bool,
    ) -> float:  # fmt: skip
        """Return the force [N] at the present state, without advancing it.

        Parameters
        ----------
        x, v, a, V : displacement [m], velocity [m/s], acceleration [m/s2], voltage [V]
        dt : length of the step [s]
        energy : dissipated so far [J]
        stick_force, sticks : force [N] that would stop the motion within dt; whether it is known
        """
        now = record(Inputs, (x, v, a, V, dt, energy, stick_force, sticks))
        return self._force(self.setup, now, self.z, self._work)[0]  # type: ignore[no-any-return]

    def step(
        self, x: float, v: float, a: float, V: float, dt: float, energy: float,
        stick_force: float, sticks: bool,
    ) -> float:  # fmt: skip
        """Advance over a step, the inputs held; return the force [N] at the end.

        Parameters
        ----------
        x, v, a, V, dt, energy, stick_force, sticks
            As in `force`.
        """
        now = record(Inputs, (x, v, a, V, dt, energy, stick_force, sticks))
        if self.active:
            force = self._step(self.setup, now, now, self.z, self._end, self._work)[0]
        else:
            force = self._hold_law(self.law, self.p, now, self.z, self._end)[0]
        self.z, self._end = self._end, self.z
        return force  # type: ignore[no-any-return]

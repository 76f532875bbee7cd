"""What a damper is to a design: at each speed a dashpot, and a gain from voltage to force.

In steady sliding at speed r = |v| the force is sgn(v) (r d(r) + b(r) V). The sign function is
smoothed, sgn(v) -> v/(|v| + eps), so that d stays finite at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..core.arrays import Array
from ..errors import DesignError
from ..physics.damper import DamperModel
from ..physics.effect import EFFECTS, effects_of
from ..physics.forms import split_form
from ..physics.laws import DEFAULT_OF_DESIGN, LEAST, Law, base_and_variant, law_names
from ..physics.tuples import Inputs
from .lmi import Solution
from .plant import Plant, StateSpace, Units


class Bank(NamedTuple):
    """Controllers of one order at several speeds: A (k, n, n), B (k, n, 1), C (k, 1, n).

    x' = A x + B y, u = C x; `W` (k, n, 1) is the column of a second input.
    """

    A: Array
    B: Array
    W: Array
    C: Array

    def at(self, k: int) -> StateSpace:
        """Return the controller k, from y to u."""
        return StateSpace(self.A[k], self.B[k], self.C[k], np.zeros((1, 1)))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles (k, n) [rad/s]."""
        values: NDArray[np.complex128] = np.linalg.eigvals(self.A).astype(np.complex128)
        return values


def reconstruct(s: Solution, plants: list[Plant], r: Array, units: Units) -> Bank:
    """Return the controllers at several speeds.

    N M^T = I - X Y with M = Y, N = Y^-1 - X(r) where Y is constant, and N = X, M^T = X^-1 - Y(r)
    where X is: either way no rate of the speed enters. A direct path D22 from command to
    measurement is taken out of y inside the controller.

    Parameters
    ----------
    s : the solution of the inequalities
    plants : k plants in `units`, one per speed
    r : (k,) m/s
    units : what command and measurement were divided by; the controllers are free of it
    """
    X, Y = s.X(r), s.Y(r)
    Ah, Bh, Ch = s.hats(r)
    n = len(s.X0)
    unit = np.broadcast_to(np.eye(n), X.shape)
    if s.varies in ("none", "X"):
        Mt, N = Y, np.linalg.solve(Y, unit) - X
    else:
        Mt, N = np.linalg.solve(X, unit) - Y, X
    A, B2, C2, D22 = (
        np.array([getattr(plant, name) for plant in plants]) for name in ("A", "B2", "C2", "D22")
    )
    inner = Ah - X @ A @ Y - Bh @ C2 @ Y - X @ B2 @ Ch
    right = np.linalg.solve(Mt.transpose(0, 2, 1), unit).transpose(0, 2, 1)  # M^-T
    A_K = np.linalg.solve(N, inner) @ right
    B_K = np.linalg.solve(N, Bh)
    C_K = Ch @ right
    A_K = A_K - B_K @ D22 @ C_K
    C_K = C_K / units.command
    return Bank(A_K, np.asarray(B_K / units.measurement), anti_windup(C_K), C_K)


def anti_windup(C: Array) -> Array:
    """Return C^T/(C C^T) (k, n, 1): the column that moves u by as much as it is fed."""
    squares = (C @ C.transpose(0, 2, 1))[:, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.where(squares > 0.0, C[:, 0] / squares, 0.0)
    return column[:, :, None]


def sampled(bank: Bank, h: float) -> Bank:
    """Return the bank in discrete time: exact for inputs held over the sample period h [s]."""
    k, n, _ = bank.A.shape
    together = np.zeros((k, n + 2, n + 2))
    together[:, :n, :n] = bank.A
    together[:, :n, n : n + 1] = bank.B
    together[:, :n, n + 1 :] = bank.W
    stepped = linalg.expm(together * h)
    return Bank(
        stepped[:, :n, :n], stepped[:, :n, n : n + 1], stepped[:, :n, n + 1 :], bank.C
    )  # fmt: skip


_LASTS = 0.25
"""How long the damper slides before its force is read [s]: coils and mounts have settled then."""
_STEPS = 100
_SPEEDS = 12
_SPEED = 0.02
"""Typical speed [m/s] of a law that has no speed of its own."""
_NUDGE = 1e-3
"""Displacement to either side at which the damper's stiffness is read [m]."""


@dataclass(frozen=True)
class DesignDamper:
    """A damper model: law, parameters, effects.

    Attributes
    ----------
    law : str
        A damper's law or a variant of one, such as "bingham_standard".
    values : mapping
        Name ("f_c", "gas_spring.k") to value in SI; what is missing takes the law's value.
    effects : tuple of str
        The effects that are on.
    v_max : float
        Largest voltage [V].
    known_to : float or None
        Largest speed [m/s] of the data behind the model; a design must not go beyond.
    """

    law: str = DEFAULT_OF_DESIGN
    values: Mapping[str, float] = field(default_factory=dict)
    effects: tuple[str, ...] = ()
    v_max: float = 8.0
    known_to: float | None = None

    def __post_init__(self) -> None:
        if split_form(self.law)[0] not in law_names():
            raise DesignError(f"damper: law = {self.law!r}; there are {', '.join(law_names())}.")
        if not self.kind.exact() or self.kind.felt:
            raise DesignError(
                f"damper: law = {self.law!r} has no closed form of steady sliding at a voltage."
            )
        if not (isfinite(self.v_max) and self.v_max > 0.0):
            raise DesignError(
                f"damper: v_max = {self.v_max!r} V leaves nothing to control; it must be positive."
            )
        if self.known_to is not None and not self.known_to > 0.0:
            raise DesignError(f"damper: known_to = {self.known_to!r} m/s must be positive.")
        known = dict(self.kind.parameters)
        available = {effect.name: effect for effect in effects_of("damper", self.kind.name)}
        for name in self.effects:
            if name not in available:
                raise DesignError(_unknown("effect", name, available))
            for key, parameter in available[name].parameters.items():
                known[f"{name}.{key}"] = parameter
        for name, value in self.values.items():
            if name not in known:
                raise DesignError(_unknown("parameter", name, known))
            low, high = known[name].bounds
            if not low <= value <= high:
                raise DesignError(f"damper: {name} = {value!r} lies outside {low:g} .. {high:g}.")

    @property
    def kind(self) -> type[Law]:
        """The law's class, without the variant."""
        return base_and_variant(self.law)[0]

    @property
    def speed(self) -> float:
        """A typical speed of the law [m/s]: that over which its viscous part falls."""
        _, over = self.kind.falling()
        return self.parameters()[over] if over else _SPEED

    def parameters(self) -> dict[str, float]:
        """Return the law's parameters, complete, in the law's order."""
        law, variant = base_and_variant(self.law)
        values = {
            name: float(self.values.get(name, parameter.value))
            for name, parameter in law.parameters.items()
        }
        return {**values, **variant.values}

    @property
    def follows_command(self) -> bool:
        """Whether the voltage changes the force at any of the law's usual speeds."""
        speeds = [share * self.speed for share in (1e-3, 0.1, 1.0, 10.0)]
        return any(self.sliding_force(v, 0.0) != self.sliding_force(v, self.v_max) for v in speeds)

    def sliding_force(self, v: float, V: float) -> tuple[float, float]:
        """Return the law's yield force [N] and its other force [N], the mean of both directions.

        In steady sliding at v > 0 [m/s] and V [V].
        """
        values = self.parameters()
        held, there = self.kind.sliding_force(values, v, V)
        _, back = self.kind.sliding_force(values, -v, V)
        return held, 0.5 * (there - back)

    def data(self) -> dict[str, Any]:
        """Return the damper as a table of a design file."""
        return {
            "law": self.law,
            "parameters": {**self.parameters(), **dict(self.values)},
            "effects": list(self.effects),
            "v_max": self.v_max,
            "known_to": self.known_to,
        }


def coefficients(damper: DesignDamper, r: Array, eps: float) -> tuple[Array, Array]:
    """Return d(r) [N s/m] and b(r) [N/V] at speeds r (k,) [m/s].

        d = Y_0/(r + eps) + F_0/r,   b = r (Y_V/(r + eps) + F_V/r)

    Y, F are the law's yield force and its other force in steady sliding, without voltage and per
    volt; F is the mean of both directions, for an accumulator's force at mid-stroke damps nothing.
    Effects enter as what they add to the force in steady sliding, read from the damper itself
    at some speeds, the mean of both directions; a slow effect as it is near its start. Elements in
    series with the fluid (mount, backlash) carry its force and are left out.
    """
    top = 1.0 if damper.kind.affine() else damper.v_max
    speed = np.maximum(r, LEAST)
    still, driven = (
        np.array([damper.sliding_force(v, V) for v in speed.tolist()]).T for V in (0.0, top)
    )
    per_volt = (driven - still) / top
    d = still[0] / (r + eps) + still[1] / speed
    b = r * (per_volt[0] / (r + eps) + per_volt[1] / speed)
    if _parallel(damper):
        speeds, still, driven = _added(damper, float(r.max()))
        jump, slope = still[0], (driven - still) / damper.v_max
        d = d + jump / (r + eps) + np.interp(r, speeds, (still - jump) / speeds)
        b = b + r * (slope[0] / (r + eps)) + np.interp(r, speeds, slope - slope[0])
    return d, b


def stiffness(damper: DesignDamper) -> float:
    """Return the force per displacement [N/m] that the damper's effects add: a gas spring's."""
    on = _parallel(damper)
    if not on:
        return 0.0
    v = damper.speed
    force = [
        sum(_slid(damper, sign * v, 0.0, x, on) for sign in (1.0, -1.0)) for x in (-_NUDGE, _NUDGE)
    ]
    return (force[1] - force[0]) / (4.0 * _NUDGE)


def spring(damper: DesignDamper) -> float:
    """Return the force per displacement [N/m] of the law itself: an accumulator's."""
    law, values = damper.kind, damper.parameters()
    elastic = law.hook("elastic")
    if elastic is None:
        return 0.0
    rest = law.State(*(0.0 for _ in law.states)) if law.states else ()
    force = [
        elastic(Inputs(x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False), rest, law.at(values))
        for x in (-_NUDGE, _NUDGE)
    ]
    return float(force[1] - force[0]) / (2.0 * _NUDGE)


def _parallel(damper: DesignDamper) -> tuple[str, ...]:
    """Return the effects that are on and not in series with the fluid."""
    return tuple(name for name in damper.effects if "motion" not in EFFECTS[name].hooks())


def _added(damper: DesignDamper, top: float) -> tuple[Array, Array, Array]:
    """Return speeds (k,), and what the effects add there to the force at 0 V and at v_max [N]."""
    speeds = np.geomspace(min(1e-2 * damper.speed, 1e-2 * top), top, _SPEEDS)
    forces = []
    for V in (0.0, damper.v_max):
        both = [
            [
                0.5 * (_slid(damper, v, V, 0.0, on) - _slid(damper, -v, V, 0.0, on))
                for on in (_parallel(damper), ())
            ]
            for v in speeds.tolist()
        ]
        forces.append(np.array([enriched - plain for enriched, plain in both]))
    return speeds, forces[0], forces[1]


def _slid(damper: DesignDamper, v: float, V: float, x: float, effects: tuple[str, ...]) -> float:
    """Return the mean force [N] of sliding past x [m] at v [m/s] and V [V], once settled."""
    p = damper.parameters()
    start = {
        f"{name}.{state}_0": V
        for name in effects
        for state, signal in EFFECTS[name].starts.items()
        if signal == "V"
    }
    bent = damper.kind.sliding_states(p, v, V)
    start |= {f"{name}_0": value for name, value in zip(damper.kind.states, bent, strict=True)}
    model = DamperModel(damper.kind.name, {**damper.values, **p, **start}, list(effects))
    dt = _LASTS / _STEPS
    total = 0.0
    for k in range(_STEPS):
        here = x + v * dt * (k + 0.5 - 0.75 * _STEPS)  # x is the middle of the second half
        force = model.step(here, v, 0.0, V, dt, 0.0, 0.0, False)
        total += force if 2 * k >= _STEPS else 0.0
    return 2.0 * total / _STEPS


def _unknown(what: str, name: str, known: Mapping[str, Any]) -> str:
    close = get_close_matches(name, known, n=1)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    return f'damper: no {what} is named "{name}". There are: {", ".join(sorted(known))}.{hint}'

"""A damper on a test bench, in plain Python: for tests of laws and effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from math import cos, inf, pi, sin
from typing import Any

import numpy as np

from bristle.physics import damper
from bristle.physics.damper import DamperModel
from bristle.physics.laws import laws_of
from bristle.physics.tuples import Inputs

HOUSE = """
schema = 1
title = "A damper in the paper's building"

[run]
stop = {stop}
step = {step}

[components.ground]
fmu = "SignalSource"
parameters = {{ {ground} }}

[components.structure]
fmu = "Structure"
parameters = {{ {structure} }}

[components.damper]
fmu = "{damper}"
parameters = {{ {parameters} }}

[connections]
"structure.ground_acceleration" = "ground.value"
"structure.damper_force" = "damper.force"
"damper.displacement" = "structure.base_displacement"
"damper.velocity" = "structure.base_velocity"
"""
"""A scenario, to be filled in with times in s, and with parameters as TOML has them."""

LAWS = tuple(law.name for law in laws_of("damper"))
NO_LAW = {law.name: dict.fromkeys(law.linear(), 0.0) for law in laws_of("damper")}
"""Parameters that leave nothing of a law: what remains is the effects."""


def force_at(
    law: str,
    *,
    x: float = 0.0,
    v: float = 0.0,
    V: float = 0.0,
    z: float = 0.0,
    values: Mapping[str, float] | None = None,
    effects: Iterable[str] = (),
) -> float:
    """Return a damper's force [N] at a motion, voltage and bristle deflection."""
    start = {**(values or {}), "bristle_deflection_0": z}
    return DamperModel(law, start, list(effects)).force(x, v, 0.0, V, inf, 0.0, 0.0, False)


class Bench:
    """A damper whose rod is moved: x, v and V linear over each step."""

    def __init__(
        self, law: str, values: Mapping[str, float] | None = None, effects: Iterable[str] = ()
    ) -> None:
        effects = list(effects)
        self.model = DamperModel(law, dict(values or {}), effects)
        self.last: tuple[float, float, float] | None = None
        self._step = self.model.functions.link(damper.step)
        self._work = [0.0] * damper.room(len(self.model.z))

    def state(self, name: str) -> float:
        return self.model.z[self.slot(name) if name != "bristle" else 0]

    def slot(self, name: str) -> int:
        return self.model.functions.slots.states[name]

    def move(self, x: float, v: float, V: float, dt: float) -> float:
        """Move on over dt [s] to x, v, V; return the force there."""
        x0, v0, V0 = self.last or (x, v, V)
        z1 = [0.0] * len(self.model.z)
        a = (v - v0) / dt
        m = self.model
        begin = Inputs(x0, v0, a, V0, dt, 0.0, 0.0, False)
        end = Inputs(x, v, a, V, dt, 0.0, 0.0, False)
        # As one that has effects takes it: without any, all their switches are asked.
        force, _ = self._step(m.setup._replace(active=True), begin, end, m.z, z1, self._work)
        m.z = z1
        self.last = (x, v, V)
        return float(force)

    def play(
        self, motion: Callable[[float], tuple[float, float]], V: Any, times: np.ndarray
    ) -> np.ndarray:
        """Return the forces at `times` (n,), the motion a function of time, V one too or fixed."""
        voltage = V if callable(V) else lambda _t: V
        clock = times.tolist()  # plain floats: laws run several times faster on them
        self.last = x, v, first = (*motion(clock[0]), voltage(clock[0]))
        forces = [self.model.force(x, v, 0.0, first, inf, 0.0, 0.0, False)]
        for before, t in pairwise(clock):
            forces.append(self.move(*motion(t), voltage(t), t - before))
        return np.array(forces)


def sine(
    amplitude: float, frequency: float, middle: float = 0.0
) -> Callable[[float], tuple[float, float]]:
    """Return x(t), v(t) of a sine of this amplitude [m] about `middle`."""
    omega = 2.0 * pi * frequency

    def motion(t: float) -> tuple[float, float]:
        return middle + amplitude * sin(omega * t), amplitude * omega * cos(omega * t)

    return motion


def loop_energy(forces: np.ndarray, velocities: np.ndarray, dt: float) -> float:
    """Return the work over one closed cycle [J]; the first sample is also the last."""
    return float(dt * np.sum(forces[1:] * velocities[1:]))

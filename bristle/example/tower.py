"""A base-isolated building on a shake table, with a damper between ground and base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bench import Signals
from .damper import STICK, Damper
from .excitation import RATE, Programme, ground, programme, times
from .hidden import Scales, Values
from .solve import FINE, ROUGH, integrate

Array = NDArray[np.float64]
SECONDS = 16.0
PLAN = (
    ("train_1", "quake", "steps"),
    ("train_2", "sweep", "sine"),
    ("train_3", "quake", "steps"),
    ("holdout_1", "quake", "sine"),
    ("holdout_2", "sweep", "steps"),
)
"""Runs: name, motion of the ground, voltage."""
LEVELS = ("base", "floor1", "floor2")
RATIO = 0.01
"""Damping ratio of the first and the last mode, by Rayleigh."""


@dataclass(frozen=True)
class Frame:
    """Three levels: masses [kg], stiffnesses [N/m] below each, Rayleigh's alpha [1/s], beta [s]."""

    masses: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    alpha: float
    beta: float


def frame(masses: Array, stiffnesses: Array) -> Frame:
    """Return a frame whose first and last mode have the damping RATIO."""
    k = np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
    k -= np.diag(stiffnesses[1:], 1) + np.diag(stiffnesses[1:], -1)
    root = np.sqrt(1.0 / masses)
    omega = np.sqrt(np.linalg.eigvalsh(root[:, None] * k * root[None, :]))
    low, high = float(omega[0]), float(omega[-1])
    return Frame(
        tuple(masses.tolist()),
        tuple(stiffnesses.tolist()),
        2.0 * RATIO * low * high / (low + high),
        2.0 * RATIO / (low + high),
    )


@dataclass(frozen=True)
class Tower:
    """A frame, its damper, and what is hidden in the isolation layer or the storeys."""

    frame: Frame
    damper: Damper
    hidden: Values
    scales: Scales

    def loads(
        self, q: list[float], volts: float, inner: list[float], rubbed: float
    ) -> tuple[list[float], float, list[float]]:
        """Return the absolute accelerations (3,) m/s2, the damper's force N, its states' rates.

        Parameters
        ----------
        q : list
            Displacements and velocities (6,) relative to the ground, base first [m, m/s].
        volts : float
            The commanded voltage [V].
        inner : list
            States of the damper.
        rubbed : float
            Share of the friction under the base [1].
        """
        f, x, v = self.frame, q[:3], q[3:]
        force, rates = self.damper.respond((x[0], v[0], 0.0), volts, inner)
        shear = [self._layer(x[0], v[0], rubbed) + force]
        for i in (1, 2):
            drift, rate = x[i] - x[i - 1], v[i] - v[i - 1]
            soft = 1.0
            if "crack_drift" in self.hidden:
                soft = 1.0 / (1.0 + (drift / self.hidden["crack_drift"]) ** 2)
            shear.append(f.stiffnesses[i] * (drift * soft + f.beta * rate))
            if i == 1 and "brace_gap" in self.hidden:
                taut = abs(drift) - self.hidden["brace_gap"]
                shear[1] += self.hidden["brace_k"] * float(np.copysign(max(taut, 0.0), drift))
        shear.append(0.0)
        pushes = [(shear[i + 1] - shear[i]) / f.masses[i] - f.alpha * v[i] for i in range(3)]
        return pushes, force, rates

    def _layer(self, x: float, v: float, rubbed: float) -> float:
        """Return what springs, rubbing and bumpers of the isolation layer bear [N]."""
        h, k = self.hidden, self.frame.stiffnesses[0]
        total = k * (x + self.frame.beta * v) + h.get("spring_5", 0.0) * x**5
        total += h.get("rub", 0.0) * rubbed
        if "stop_gap" in h and abs(x) > h["stop_gap"]:
            total += h["stop_k"] * (x - np.sign(x) * h["stop_gap"])
        return float(total)

    def perform(self, acceleration: Array, volts: Programme, rtol: float = FINE) -> Signals:
        """Return what ideal instruments show under a ground acceleration (n,) m/s2.

        Returns
        -------
        dict
            `time` s, the ground's acceleration, of every level displacement, velocity and absolute
            acceleration, `voltage` V and `force` N, each (n,) in SI.
        """
        t = times((acceleration.size - 1) / RATE)
        rub = ["rub"] if "rub" in self.hidden else []
        step = float(t[1])
        felt = acceleration.tolist()

        def rates(now: float, y: list[float]) -> list[float]:
            k = min(int(now / step), len(felt) - 2)
            shaken = felt[k] + (felt[k + 1] - felt[k]) * (now / step - k)
            inner, rubbed = y[6 : len(y) - len(rub)], y[-1] if rub else 0.0
            pushes, _, turning = self.loads(y[:6], volts.value(now), inner, rubbed)
            moved = [*y[3:6], *(push - shaken for push in pushes), *turning]
            return [*moved, (y[3] - abs(y[3]) * rubbed) / STICK] if rub else moved

        s = self.scales
        sizes = [0.1 * s.stroke] * 3 + [0.1 * s.speed] * 3
        sizes += self.damper.scales(s.stroke, s.speed) + [1.0] * len(rub)
        y = integrate(rates, [0.0] * len(sizes), sizes, t, volts.jumps, rtol)
        return {"time": t, "ground_acceleration": acceleration, **self._shown(t, y, volts)}

    def _shown(self, t: Array, y: Array, volts: Programme) -> Signals:
        """Return the response at the samples t (n,) s, of states y (n, m)."""
        command = [volts.value(now) for now in t.tolist()]
        inner = slice(6, 6 + len(self.damper.states))
        felt = [
            self.loads(row[:6], volt, row[inner], row[-1] if "rub" in self.hidden else 0.0)[:2]
            for row, volt in zip(y.tolist(), command, strict=True)
        ]
        shown: Signals = {}
        for i, level in enumerate(LEVELS):
            shown[f"{level}_displacement"], shown[f"{level}_velocity"] = y[:, i], y[:, 3 + i]
            shown[f"{level}_acceleration_absolute"] = np.array([one[0][i] for one in felt])
        return shown | {"voltage": np.array(command), "force": np.array([one[1] for one in felt])}


def plan(tower: Tower, rng: np.random.Generator) -> list[tuple[str, Array, Programme]]:
    """Return the runs: names, ground accelerations (n,) m/s2 and voltages.

    Each ground motion is scaled until the base moves by about 0.45 of the stroke.
    """
    runs = []
    for name, kind, volts in PLAN:
        shape, command = ground(kind, SECONDS, rng), programme(volts, SECONDS, rng)
        goal, peak = rng.uniform(0.4, 0.5) * tower.scales.stroke, 4.0
        for _ in range(3):
            shown = tower.perform(peak * shape, command, ROUGH)
            moved = float(np.max(np.abs(shown["base_displacement"])))
            if abs(moved / goal - 1.0) < 0.08:
                break
            peak *= min(max(goal / max(moved, 1e-9), 0.4), 2.0) ** 0.8
        runs.append((name, peak * shape, command))
    return runs

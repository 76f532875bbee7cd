"""The rigs of examples, drawn from a seed: a damper, and a frame around it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import copysign, exp, inf, pi, sin, sqrt, tanh
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from ..core.arrays import Array
from ..errors import RunError, StudyError
from . import devices
from .devices import Values
from .hidden import Scales

# The damper of an example: a yield force, a drag, and what may be hidden in it.
#
# Symbols: w speed across the fluid, Y yield force, D drag, E the voltage that the coil's field
# follows, m the bristle's share of its largest deflection.
#
#     fluid  = shape(w) (Y(E) m + D(E) w exp(-|w|/w_n)),   Y = Y_0 + Y_1 E,   D = D_0 + D_1 E
#     bingham     m = sgn w
#     lugre       m' = (w - |w| m)/l, and a damping c l m' beside

STICK, SETTLE = 2e-5, 2e-4
"""Travel [m] over which a yield force builds up where a free body has to come to rest, and the time
[s] within which the body then settles."""

STILL = 1e-8
"""Speed [m/s] below which a bench stands still: its spline leaves rest to rounding."""

NAMES = {
    "bingham": {"f_c": "Y_0", "f_v": "Y_1", "c_0": "D_0", "c_v": "D_1", "v_n": "w_n"},
    "lugre": {"sigma_2": "D_0", "sigma_b": "D_1", "v_n": "w_n", "sigma_1": "c"},
}
"""The library's names of values that are the same in both."""


def in_library_names(law: str, values: Values) -> dict[str, float]:
    """Return the values of a damper under the names, and in the form, that the library gives."""
    if law in devices.DEVICES:
        return devices.in_library_names(law, values)
    same = {name: values[own] for name, own in NAMES[law].items()}
    if law == "bingham":
        return same
    bent = {"sigma_a": values["Y_0"], "sigma_0": values["Y_1"], "a_0": 1.0}
    return {name: value / values["l"] for name, value in bent.items()} | same


@dataclass
class Damper:
    """A damper with what is hidden in it; states are a plain list in the order of `states`.

    `values` of the law, `hidden` of the effects, both in SI.
    """

    law: str
    values: Values
    hidden: Values = field(default_factory=dict)
    states: list[str] = field(init=False)

    def __post_init__(self) -> None:
        h = self.hidden
        groups = dict.fromkeys(devices.STATES.get(self.law, ()), True) | {
            "share": self.commanded and (self.law != "bingham" or "mount_k" in h),
            "field": "coil_tau" in h,
            "heat": "heat_capacity" in h,
            "piston": "mount_k" in h,
            "piston_speed": "mount_k" in h,
        }
        self.states = [name for name, there in groups.items() if there]

    @property
    def commanded(self) -> bool:
        """Whether a voltage commands it."""
        return self.law not in devices.DEVICES

    def scales(self, stroke: float, speed: float) -> list[float]:
        """Return the size of each state, for the integrator's tolerances."""
        sizes = devices.STATES.get(self.law, {}) | {
            "share": 1.0,
            "field": 1.0,
            "heat": 0.1,
            "piston": 0.1 * stroke,
        }
        return [sizes.get(name, speed) for name in self.states]

    def respond(
        self, motion: tuple[float, float, float], volts: float, states: list[float]
    ) -> tuple[float, list[float]]:
        """Return the force on the rod and the rates of the states.

        Parameters
        ----------
        motion : tuple
            Displacement [m], velocity [m/s] and acceleration [m/s2] of the rod.
        volts : float
            The commanded voltage [V].
        states : list
            In the order of `states`.
        """
        x, v, a = motion
        h, now = self.hidden, dict(zip(self.states, states, strict=True))
        rates: dict[str, float] = {}
        e = volts
        if "field" in now:
            e = now["field"]
            rates["field"] = (volts - e) / h["coil_tau"]
        if "field_limit" in h:
            e = h["field_limit"] * tanh(e / h["field_limit"])
        w = now.get("piston_speed", v)
        where = now.get("piston", x)
        fluid = self._fluid(w, e, now, rates) * self._shape(where, w)
        if "heat" in now:
            fluid *= exp(-now["heat"])
            rates["heat"] = fluid * w / h["heat_capacity"] - now["heat"] / h["heat_tau"]
        if "piston" in now:  # a light piston behind a rubber bush
            bush = h["mount_k"] * (x - where) + h["mount_c"] * (v - w)
            rates["piston"], rates["piston_speed"] = w, (bush - fluid) / h["mount_mass"]
            fluid = bush
        return fluid + self._beside(x, v, a), [rates[name] for name in self.states]

    def _fluid(self, w: float, e: float, now: dict[str, float], rates: dict[str, float]) -> float:
        """Return the law's force; the share's rate goes into `rates`."""
        p = self.values
        creep = 1.0 + self.hidden.get("creep_rise", 0.0) * exp(
            -((w / self.hidden.get("creep_speed", inf)) ** 2)
        )
        if not self.commanded:
            return devices.FORCE[self.law](p | {"R": creep * p.get("R", 0.0)}, w, now, rates)
        limit = creep * (p["Y_0"] + p["Y_1"] * e)
        drag = (p["D_0"] + p["D_1"] * e) * w * exp(-abs(w) / p["w_n"])
        if "share" not in now:
            return limit * (copysign(1.0, w) if abs(w) > STILL else 0.0) + drag
        m, length = now["share"], p.get("l", STICK)
        turn = w - abs(w) * m
        rates["share"] = turn / length
        return limit * m + p.get("c", limit * SETTLE / length) * turn + drag

    def _shape(self, x: float, w: float) -> float:
        """Return the factor of what changes the fluid's whole force."""
        h, factor = self.hidden, 1.0
        if "valve_ratio" in h:
            factor *= 1.0 + h["valve_ratio"] * tanh(w / h["valve_speed"])
        if "thinning" in h:
            factor /= 1.0 + h["thinning"] * abs(w)
        if "bore_loss" in h:
            factor *= 1.0 - h["bore_loss"] * exp(-((x / h["bore_length"]) ** 2))
        return factor

    def _beside(self, x: float, v: float, a: float) -> float:
        """Return the forces in parallel with the fluid."""
        h = self.hidden
        total = h.get("fluid_mass", 0.0) * a + devices.beside(self.law, self.values, x)
        if "gas_k" in h:  # a polytropic gas column that the rod shortens
            length, power = h["gas_length"], h["gas_power"]
            total += h["gas_k"] * length / power * ((1.0 - x / length) ** -power - 1.0)
        if "orifice" in h:
            total += copysign(h["orifice"] * abs(v) ** h["orifice_power"], v)
        if "ripple" in h:
            total += h["ripple"] * sin(2.0 * pi * x / h["ripple_length"])
        return total


# Motions of a bench, motions of the ground, and what the voltage does meanwhile.

RATE = 500.0
"""Samples per second of every recorder."""
V_MAX = 8.0  # V
HELD = {"low": 2.0, "high": 6.0}  # V


@dataclass(frozen=True)
class Programme:
    """A voltage over time: `value(t)` in V, continuous between the instants of `jumps` [s]."""

    value: Callable[[float], float]
    jumps: tuple[float, ...] = ()


@dataclass(frozen=True)
class Motion:
    """A prescribed motion: (x, v, a) in SI at any time, and the instants of its samples."""

    time: Array
    at: Callable[[float], tuple[float, float, float]] = field(repr=False)


def times(seconds: float) -> Array:
    """Return the instants (n,) of the samples [s]."""
    return np.arange(round(seconds * RATE) + 1) / RATE


def fade(t: Array, rise: float) -> Array:
    """Return a factor (n,) that rises smoothly from 0 to 1 within `rise` seconds."""
    q = np.clip(t / rise, 0.0, 1.0)
    return q**3 * (10.0 - 15.0 * q + 6.0 * q * q)


def smooth(t: Array, x: Array) -> Motion:
    """Return the motion through samples x (n,) m: a spline of order five."""
    spline = make_interp_spline(t, x, k=5)
    first, second = spline.derivative(1), spline.derivative(2)
    return Motion(t, lambda q: (float(spline(q)), float(first(q)), float(second(q))))


def bench_motion(
    kind: str, seconds: float, stroke: float, speed: float, rng: np.random.Generator
) -> Motion:
    """Return a motion from rest that stays within 0.75 of the stroke and the speed.

    Parameters
    ----------
    kind : str
        "multisine", "chirp" or "sine"; the sine swells and dies down.
    seconds : float
        Its length [s].
    stroke, speed : float
        Limits of displacement [m] to either side and of velocity [m/s].
    rng : numpy.random.Generator
        What draws frequencies and phases.
    """
    t = times(seconds)
    if kind == "multisine":
        x = np.zeros(t.size)
        for f in rng.uniform(0.4, 5.0, 12):
            x += np.sin(2.0 * np.pi * (f * t + rng.uniform())) / f
    elif kind == "chirp":
        low, high = 0.4, rng.uniform(4.0, 6.0)
        rate = np.log(high / low) / t[-1]
        f = low * np.exp(rate * t)
        x = np.sin(2.0 * np.pi * (f - low) / rate) / np.hypot(2.0 * np.pi * f / speed, 1.4 / stroke)
    else:
        f, slow = rng.uniform(1.0, 2.0), rng.uniform(0.15, 0.25)
        x = np.sin(2.0 * np.pi * f * t) * (0.55 - 0.45 * np.cos(2.0 * np.pi * slow * t))
    x = (x - x[0]) * fade(t, 0.6)
    x -= np.mean(x) * fade(t, 2.0)
    fastest = np.max(np.abs(np.gradient(x, t)))
    return smooth(t, x * min(speed / fastest, 0.75 * stroke / np.max(np.abs(x))))


def programme(kind: str, seconds: float, rng: np.random.Generator) -> Programme:
    """Return what the voltage does.

    "steps" between levels, a "sine" between 0 and 5 V, or held: "low" or "high".
    """
    if kind in HELD:
        level = HELD[kind]
        return Programme(lambda _t: level)
    if kind == "sine":
        f = rng.uniform(0.5, 1.5)
        return Programme(lambda t: 2.5 * (1.0 + sin(2.0 * pi * f * t)))
    edges = np.cumsum(np.round(rng.uniform(0.4, 1.0, int(3 * seconds)) * RATE) / RATE)
    edges = edges[edges < seconds]
    levels = rng.uniform(0.0, V_MAX, edges.size + 1)
    levels[1::4] = 0.0
    jumps, heights = tuple(edges.tolist()), levels.tolist()
    return Programme(lambda t: float(heights[bisect_right(jumps, t + 1e-9)]), jumps)


def ground(kind: str, seconds: float, rng: np.random.Generator) -> Array:
    """Return a ground acceleration (n,) of unit peak.

    "quake" is stationary noise through the filter of Kanai (1957) and Tajimi (1960) under an
    envelope; "sweep" a sine from 1 to 9 Hz.
    """
    t = times(seconds)
    if kind == "sweep":
        low, high = 1.0, 9.0
        a = np.sin(2.0 * np.pi * (low * t + 0.5 * (high - low) * t * t / t[-1]))
        a *= (0.3 + 0.7 * t / t[-1]) * (0.7 + 0.3 * np.sin(2.0 * np.pi * 0.2 * t))
    else:
        f = np.fft.rfftfreq(2 * t.size, 1.0 / RATE)
        r, damping = f / rng.uniform(2.0, 3.0), 0.5
        soil = (1.0 + 2j * damping * r) / (1.0 - r * r + 2j * damping * r)
        band = (f / 0.5) ** 2 / (1.0 + (f / 0.5) ** 2) / (1.0 + 1j * f / 14.0) ** 2
        noise = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
        a = np.fft.irfft(soil * band * noise, 2 * t.size)[: t.size]
        peak = rng.uniform(0.25, 0.4) * t[-1]
        a *= (t / peak) ** 2 * np.exp(2.0 * (1.0 - t / peak))
    a = a * fade(t, 0.3)
    return np.asarray(a / np.max(np.abs(a)))


# Integration of an example's equations: adaptive, restarted wherever the voltage jumps.

Rates = Callable[[float, list[float]], list[float]]
FINE, ROUGH = 1e-6, 1e-4
"""Relative tolerances: 1e-6 errs by 2e-5 of the RMS of a building's channels, 1e-4 by 1e-3."""

LONGEST = 0.02
"""Longest step [s]: where all is at rest the integrator would leap over a command that rises."""


def integrate(
    rates: Rates,
    start: Sequence[float],
    scales: Sequence[float],
    time: Array,
    jumps: Sequence[float],
    rtol: float = FINE,
) -> Array:
    """Return the states (n, m) at the instants `time`.

    Parameters
    ----------
    rates : callable
        Rates of the states [1/s of their units] from time [s] and states; smooth between `jumps`.
    start, scales : sequences
        First values (m,) of the states, and their sizes, for the tolerances.
    time : array
        Instants (n,) s, from the start to the end.
    jumps : sequence
        Instants at which the rates jump [s], each one of `time`.
    rtol : float
        Relative tolerance; the absolute one is a tenth of it, in the states' sizes.

    Raises
    ------
    RunError
        If the integrator does not get through.
    """
    found = np.empty((time.size, len(start)))
    found[0] = state = np.array(start, float)
    edges = [time[0], *(j for j in jumps if time[0] < j < time[-1]), time[-1]]
    for begin, end in pairwise(edges):
        inside = (time > begin + 1e-9) & (time <= end + 1e-9)
        # Just inside, so that a programme that jumps at `end` still gives what held before.
        asked = np.minimum(time[inside], end - 1e-8)
        solution = solve_ivp(
            lambda t, y: rates(t, y.tolist()), (begin, end - 1e-8), state, method="LSODA",
            t_eval=asked, rtol=rtol, atol=0.1 * rtol * np.array(scales), max_step=LONGEST,
        )  # fmt: skip
        if not solution.success or not np.all(np.isfinite(solution.y)):
            raise RunError(
                f"The rig's equations were not solved at {begin:.3f} s: {solution.message}"
            )
        found[inside], state = solution.y.T, solution.y[:, -1]
    return found


# A damper on a bench: the motion is prescribed, the force is measured.

Signals = dict[str, Array]
SECONDS = 10.0
PLAN = (
    ("train_1", "multisine", "steps"),
    ("train_2", "chirp", "sine"),
    ("train_3", "sine", "steps"),
    ("holdout_1", "multisine", "sine"),
    ("holdout_2", "sine", "steps"),
)
"""Runs: name, motion, voltage."""
BENCH_HELD = ("high", "low", "high", "low", "high")
"""Voltages of the same runs where it is held in each."""


def perform(damper: Damper, motion: Motion, volts: Programme, scales: Scales) -> Signals:
    """Return what ideal instruments show of one run.

    Parameters
    ----------
    damper : Damper
        The damper, with what is hidden in it.
    motion : Motion
        What the bench prescribes.
    volts : Programme
        The commanded voltage.
    scales : Scales
        Sizes of motion and force, for the integrator.

    Returns
    -------
    dict
        `time` s, `displacement` m, `velocity` m/s, `force` N and, where one commands the damper,
        `voltage` V, each (n,).
    """
    t = motion.time

    def rates(now: float, states: list[float]) -> list[float]:
        return damper.respond(motion.at(now), volts.value(now), states)[1]

    # The damper was switched on long before the recorder: the coil's field is there.
    start = [volts.value(float(t[0])) if name == "field" else 0.0 for name in damper.states]
    states = np.empty((t.size, 0))
    if start:
        sizes = damper.scales(scales.stroke, scales.speed)
        states = integrate(rates, start, sizes, t, volts.jumps)
    moved = [motion.at(now) for now in t.tolist()]
    command = [volts.value(now) for now in t.tolist()]
    force = [
        damper.respond(one, volt, row)[0]
        for one, volt, row in zip(moved, command, states.tolist(), strict=True)
    ]
    return {
        "time": t,
        "displacement": np.array([one[0] for one in moved]),
        "velocity": np.array([one[1] for one in moved]),
        **({"voltage": np.array(command)} if damper.commanded else {}),
        "force": np.array(force),
    }


def plan(
    scales: Scales, rng: np.random.Generator, held: bool = False
) -> list[tuple[str, Motion, Programme]]:
    """Return the runs of an example: names, motions and voltages, `held` in each or not."""
    runs = [
        (name, motion, BENCH_HELD[k] if held else volts)
        for k, (name, motion, volts) in enumerate(PLAN)
    ]
    return [
        (
            name,
            bench_motion(kind, SECONDS, scales.stroke, scales.speed * rng.uniform(0.8, 1.0), rng),
            programme(volts, SECONDS, rng),
        )
        for name, kind, volts in runs
    ]


def share(runs: list[Signals], bare: list[Signals]) -> float:
    """Return by how much of its RMS the force differs from that of the damper without secrets."""
    force = np.concatenate([run["force"] for run in runs])
    other = np.concatenate([run["force"] for run in bare])
    return float(np.sqrt(np.mean((force - other) ** 2) / np.mean(force**2)))


# A base-isolated building on a shake table, with a damper between ground and base.

TOWER_SECONDS = 16.0
TOWER_PLAN = (
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


def tower_plan(tower: Tower, rng: np.random.Generator) -> list[tuple[str, Array, Programme]]:
    """Return the runs: names, ground accelerations (n,) m/s2 and voltages.

    Each ground motion is scaled until the base moves by about 0.45 of the stroke.
    """
    runs = []
    for name, kind, volts in TOWER_PLAN:
        shape, command = ground(kind, TOWER_SECONDS, rng), programme(volts, TOWER_SECONDS, rng)
        goal, peak = rng.uniform(0.4, 0.5) * tower.scales.stroke, 4.0
        for _ in range(3):
            shown = tower.perform(peak * shape, command, ROUGH)
            moved = float(np.max(np.abs(shown["base_displacement"])))
            if abs(moved / goal - 1.0) < 0.08:
                break
            peak *= min(max(goal / max(moved, 1e-9), 0.4), 2.0) ** 0.8
        runs.append((name, peak * shape, command))
    return runs


CENTRE = {
    "bingham": {"Y_0": 1.3, "Y_1": 0.83, "D_0": 100.0, "D_1": 20.0, "w_n": 0.02},
    "lugre": {"Y_0": 1.3, "Y_1": 0.83, "D_0": 100.0, "D_1": 20.0, "w_n": 0.02, "l": 2e-3,
              "c": 5.0},
}  # fmt: skip
"""Dampers of about 10 N: forces N, N/V; drags N s/m, N s/(m V); speed m/s; length m; N s/m."""
FORCE, SPEED, STROKE = 10.0, 0.18, 0.02
DRIFT = 5e-3
"""Storeys drift by about 3 mm where the base moves by half the stroke."""
MASSES, STIFFNESSES = (1.97, 1.23, 1.23), (1057.0, 1366.0, 1366.0)
SPREAD = 0.12
"""Numbers of a rig lie up to this share off the table."""
LAYER = {"spring_5", "rub", "crack_drift", "stop_gap", "stop_k", "brace_gap", "brace_k"}
"""What is hidden in the building, not in its damper."""


def streams(seed: int) -> list[np.random.Generator]:
    """Return what draws the rig and its runs, what is hidden, and the noise."""
    return [np.random.default_rng(one) for one in np.random.SeedSequence(seed).spawn(3)]


def scales_of(rig: str, law: str) -> Scales:
    """Return what the numbers of a rig ("bench", "building") are measured in."""
    drift = DRIFT if rig == "building" else 0.0
    drop = CENTRE.get(law, CENTRE["lugre"])["w_n"]
    return Scales(FORCE, SPEED, STROKE, drop, drift)


def draw_damper(law: str, rng: np.random.Generator) -> Values:
    """Return the values of a damper's law."""
    table = devices.DEVICES.get(law) or CENTRE[law]
    spread = _spread(tuple(table.values()), rng)
    return dict(zip(table, spread.tolist(), strict=True))


def draw_frame(rng: np.random.Generator) -> Frame:
    """Return the frame of a building; its damper is drawn before."""
    return frame(_spread(MASSES, rng), _spread(STIFFNESSES, rng))


def tower_of(frame: Frame, law: str, values: Values, secret: Values) -> Tower:
    """Return a building with its damper, and what is hidden in either.

    Parameters
    ----------
    frame : of the building
    law, values : of its damper
    secret : what is hidden, of both
    """
    layer = {name: value for name, value in secret.items() if name in LAYER}
    inner = {name: value for name, value in secret.items() if name not in LAYER}
    return Tower(frame, Damper(law, values, inner), layer, scales_of("building", law))


def rig_of(answer: Mapping[str, Any]) -> Damper | Tower:
    """Return the true rig of an example, from what its sealed answer holds.

    Parameters
    ----------
    answer : mapping
        Of `sealed.unseal`.

    Raises
    ------
    StudyError
        If another version of bristle, which drew other rigs, has made the example.
    """
    law, draw = answer["law"], streams(int(answer["seed"]))[0]
    values = draw_damper(law, draw)
    told = in_library_names(law, values)
    if not all(np.isclose(told[name], value) for name, value in answer["base"].items()):
        raise StudyError(
            "the example was made by a version of bristle that drew other rigs: this one cannot "
            f"build it again. Make it anew with --seed {answer['seed']}."
        )
    secret = {name: float(value) for name, (value, _) in answer["values"].items()}
    if answer["rig"] == "bench":
        return Damper(law, values, secret)
    return tower_of(draw_frame(draw), law, values, secret)


def _spread(centre: tuple[float, ...], rng: np.random.Generator) -> Array:
    return np.array(centre) * (1.0 + rng.uniform(-SPREAD, SPREAD, len(centre)))


# The instruments of an example, with white noise, and the recorder that writes its files.

SHOWN_IN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}


def instruments(runs: Mapping[str, Signals], share: float) -> dict[str, float]:
    """Return the standard deviation of each instrument's noise in SI.

    Parameters
    ----------
    runs : mapping
        The first runs of the rig, as ideal instruments show them.
    share : float
        The noise as a share of each channel's RMS over these runs [1].
    """
    first = next(iter(runs.values()))
    return {
        name: share * sqrt(np.mean([np.mean(run[name] ** 2) for run in runs.values()]))
        for name in first
        if name != "time"
    }


def recorded(run: Signals, noise: Mapping[str, float], rng: np.random.Generator) -> Signals:
    """Return a run as instruments with that noise show it; channels without one are left out."""
    shown = {name: run[name] + s * rng.standard_normal(run[name].size) for name, s in noise.items()}
    return {"time": run["time"], **shown}


def write_csv(path: Path, run: Signals) -> None:
    """Write one run as the recorder of a laboratory would: millimetres and newtons."""
    titles, columns = [], []
    for name, x in run.items():
        factor, unit = SHOWN_IN.get(_unit(name), (1.0, _unit(name)))
        titles.append(f"{name} [{unit}]")
        columns.append(factor * x)
    np.savetxt(
        path, np.stack(columns, axis=1), fmt="%.6g", delimiter=",", header=",".join(titles),
        comments="",
    )  # fmt: skip


def _unit(channel: str) -> str:
    """Return the SI unit of a channel."""
    plain = {"time": "s", "voltage": "V", "force": "N"}
    kinds = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "absolute": "m/s2"}
    return plain.get(channel) or kinds[channel.rsplit("_", 1)[-1]]

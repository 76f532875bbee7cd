"""Excitations: what a laboratory prescribes to a damper or to the ground under a building.

A prescribed motion is a quintic spline through samples of a smooth signal, so displacement,
velocity and acceleration are consistent to rounding at every instant. It starts from rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly, make_interp_spline

from .kernel import FINE
from .rigs import V_MAX, Rig

Array = NDArray[np.float64]

RATE = 500.0  # Hz
MOTIONS = ("chirp", "multisine", "random", "swelling_sine")
VOLTAGES = ("constant", "sine", "steps", "random_steps")
GROUNDS = ("chirp", "quake", "random")


@dataclass(frozen=True)
class Experiment:
    """One run before the specimen answers.

    time (n,) s; volts (n - 1, FINE + 1) V, the command at equal points of each sample interval,
    both ends included; motion (6, n - 1) coefficients of x in the time since the sample, or
    ground (n,) m/s2, linear between samples.
    """

    time: Array
    volts: Array
    motion: Array
    ground: Array
    role: str
    about: dict[str, Any]

    @property
    def step(self) -> float:
        return float(self.time[1] - self.time[0])

    def command(self) -> Array:
        """Voltage at the samples, (n,) V: after a jump, where one falls on a sample."""
        return np.append(self.volts[:, 0], self.volts[-1, -1])


def _fade(t: Array, rise: float) -> Array:
    """From 0 to 1 with two continuous derivatives."""
    q = np.clip(t / rise, 0.0, 1.0)
    return q**3 * (10.0 - 15.0 * q + 6.0 * q * q)


def _lines(rng: np.random.Generator, t: Array, low: float, high: float, count: int) -> Array:
    f = np.exp(rng.uniform(np.log(low), np.log(high), count))
    size = rng.uniform(0.5, 1.0, count) / f  # about equal speeds
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    return np.sum(size[:, None] * np.sin(2.0 * np.pi * f[:, None] * t + phase[:, None]), axis=0)


def _band(rng: np.random.Generator, t: Array, low: float, high: float, tilt: float) -> Array:
    """Random signal in a band with soft edges; spectrum falls as f ** -tilt."""
    n = t.size + int(4.0 * RATE)
    f = np.fft.rfftfreq(n, t[1] - t[0])
    shape = np.zeros(f.size)
    inside = f > 0.0
    shape[inside] = f[inside] ** -tilt / (
        (1.0 + (low / f[inside]) ** 8) * (1.0 + (f[inside] / high) ** 10)
    )
    noise = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    return np.fft.irfft(shape * noise, n)[: t.size]


def _slow(rng: np.random.Generator, t: Array, floor: float) -> Array:
    """An amplitude that wanders between floor and 1 over seconds."""
    a = np.sin(2.0 * np.pi * rng.uniform(0.08, 0.25) * t + rng.uniform(0.0, 2.0 * np.pi))
    b = np.sin(2.0 * np.pi * rng.uniform(0.25, 0.5) * t + rng.uniform(0.0, 2.0 * np.pi))
    return floor + (1.0 - floor) * (0.5 + 0.35 * a + 0.15 * b)


def raw_motion(kind: str, t: Array, rng: np.random.Generator, rig: Rig, **how: float) -> Array:
    """Displacement (n,) before scaling, fade and limits.

    how: low, high Hz (band of chirp, multisine, random); frequency Hz (sine kinds).

    Raises
    ------
    ValueError
        If the kind is not known.
    """
    low, high = how.get("low", rng.uniform(0.25, 0.5)), how.get("high", rng.uniform(5.0, 8.0))
    if kind == "chirp":
        span = t[-1] if rng.random() < 0.5 else -t[-1]
        rate = np.log(high / low) / span
        start = low if span > 0 else high
        f = start * np.exp(rate * t)
        phase = 2.0 * np.pi * (f - start) / rate
        size = 1.0 / np.hypot(2.0 * np.pi * f / rig.speed, 1.0 / (0.7 * rig.stroke))
        return size * np.sin(phase) * _slow(rng, t, 0.5)
    if kind == "multisine":
        return _lines(rng, t, low, high, int(rng.integers(10, 20)))
    if kind == "random":
        return _band(rng, t, low, min(high, 6.0), 1.5)
    if kind in ("swelling_sine", "sine"):
        f = how.get("frequency", rng.uniform(0.8, 3.5))
        wave = np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 2.0 * np.pi))
        return wave * (_slow(rng, t, 0.02) if kind == "swelling_sine" else 1.0)
    if kind == "triangle":  # corners rounded: a quasi-static test at constant speed
        f = how.get("frequency", 0.2)
        return np.arcsin(0.999 * np.sin(2.0 * np.pi * f * t))
    raise ValueError(f"motion {kind!r}: there are {(*MOTIONS, 'sine', 'triangle')}")


def motion(
    kind: str, t: Array, rng: np.random.Generator, rig: Rig, size: float = 1.0, **how: float
) -> Array:
    """Coefficients (6, n - 1) of a motion within the rig's speed and stroke.

    size: share of the rig's top speed, or of 0.8 of its stroke where that is the tighter limit.
    """
    x = raw_motion(kind, t, rng, rig, **how)
    x = (x - x[0]) * _fade(t, how.get("rise", 0.6))
    x -= np.mean(x) * _fade(t, 2.0)
    top = size * rig.speed / np.max(np.abs(make_interp_spline(t, x, k=5).derivative()(t)))
    reach = size * 0.8 * rig.stroke / np.max(np.abs(x))
    return through(x, t) * min(top, reach)


def through(x: Array, t: Array) -> Array:
    """Coefficients (6, n - 1) of the smooth motion through samples x (n,) m that begin at rest."""
    pieces = PPoly.from_spline(make_interp_spline(t, x, k=5))
    # not-a-knot ends: the first and last pieces span several samples
    coefficients = np.empty((6, t.size - 1))
    for m in range(6):
        coefficients[m] = pieces(t[:-1], nu=m) / (1.0, 1.0, 2.0, 6.0, 24.0, 120.0)[m]
    coefficients[:3, 0] = 0.0  # the spline leaves rest to 1e-9; make it exact
    return _join(coefficients, t)


def _join(c: Array, t: Array) -> Array:
    """Makes the first piece meet the second: quintic Hermite from rest."""
    h = t[1] - t[0]
    end = np.array([c[0, 1], c[1, 1], 2.0 * c[2, 1]])
    system = np.array(
        [
            [h**3, h**4, h**5],
            [3 * h**2, 4 * h**3, 5 * h**4],
            [6 * h, 12 * h**2, 20 * h**3],
        ]
    )
    c[3:, 0] = np.linalg.solve(system, end)
    return c


def voltage(
    kind: str, t: Array, rng: np.random.Generator, level: float | None = None, **how: float
) -> Array:
    """Command (n - 1, FINE + 1) V, between 0 and V_MAX; jumps fall on samples.

    Raises
    ------
    ValueError
        If the kind is not known.
    """
    q = np.linspace(0.0, 1.0, FINE + 1)
    fine = t[:-1, None] + (t[1] - t[0]) * q[None, :]
    if kind == "constant":
        v = rng.uniform(1.0, 6.0) if level is None else level
        return np.full_like(fine, v)
    if kind == "sine":
        f = how.get("frequency", 2.0)
        return 2.5 * (1.0 + np.sin(2.0 * np.pi * f * fine))
    if kind in ("steps", "random_steps"):
        stay = (0.5, 1.2) if kind == "steps" else (0.12, 0.8)
        stay = (how.get("stay", stay[0]), how.get("stay", stay[1]))
        levels, edges = [], [0]
        stairs = np.array([0.0, 2.0, 4.0, 6.0, 8.0, 6.0, 4.0, 2.0]) * rng.uniform(0.85, 1.0)
        place = int(rng.integers(0, stairs.size))
        while edges[-1] < t.size - 1:
            levels.append(stairs[place] if kind == "steps" else rng.uniform(0.0, V_MAX))
            if kind == "random_steps" and rng.random() < 0.2:
                levels[-1] = 0.0
            place = (place + 1) % stairs.size
            edges.append(edges[-1] + max(int(rng.uniform(*stay) * RATE), 1))
        column = np.repeat(levels, np.diff(edges))[: t.size - 1]
        return np.repeat(column[:, None], FINE + 1, axis=1)
    raise ValueError(f"voltage {kind!r}: there are {VOLTAGES}")


def ground_motion(kind: str, t: Array, rng: np.random.Generator) -> Array:
    """Ground acceleration (n,) of unit peak.

    chirp: 1 to 10 Hz with an amplitude that varies. quake: stationary noise through the filters
    of Kanai (1957) and Tajimi (1960) with the high-pass of Clough and Penzien, under the envelope
    of Saragoni and Hart (1974). random: a band of noise.

    Raises
    ------
    ValueError
        If the kind is not known.
    """
    if kind == "chirp":
        low, high = rng.uniform(0.9, 1.2), rng.uniform(8.0, 10.0)
        phase = 2.0 * np.pi * (low * t + 0.5 * (high - low) * t * t / t[-1])
        a = np.sin(phase) * _slow(rng, t, 0.2) * (0.3 + 0.7 * (t / t[-1]))
    elif kind == "random":
        a = _band(rng, t, 0.8, 12.0, 0.3) * _slow(rng, t, 0.3)
    elif kind == "quake":
        n = t.size
        f = np.fft.rfftfreq(2 * n, t[1] - t[0])
        soil, damp = rng.uniform(1.8, 3.0), rng.uniform(0.4, 0.7)
        r = f / soil
        tajimi = (1.0 + 2j * damp * r) / (1.0 - r * r + 2j * damp * r)
        g = f / rng.uniform(0.3, 0.6)
        high = -g * g / (1.0 - g * g + 1.2j * g)
        low = 1.0 / (1.0 + 1j * f / 14.0) ** 2
        white = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
        a = np.fft.irfft(tajimi * high * low * white, 2 * n)[:n]
        peak = rng.uniform(0.15, 0.3) * t[-1]
        b = rng.uniform(1.5, 2.5)
        a = a * (t / peak) ** b * np.exp(b * (1.0 - t / peak))
    else:
        raise ValueError(f"ground motion {kind!r}: there are {GROUNDS}")
    a = a * _fade(t, 0.3)
    return a / np.max(np.abs(a))


def bench_experiment(
    rig: Rig,
    rng: np.random.Generator,
    kind: str,
    volts: str,
    role: str = "train",
    duration: float = 12.0,
    size: float = 1.0,
    level: float | None = None,
    **how: float,
) -> Experiment:
    """One bench run; how goes to the motion (low, high, frequency, rise) and the steps (stay)."""
    t = np.arange(round(duration * RATE) + 1) / RATE
    about = {"motion": kind, "voltage": volts, "size": size, "duration": duration, **how}
    coefficients = motion(kind, t, rng, rig, size, **how)
    command = voltage(volts, t, rng, level, **{k: v for k, v in how.items() if k == "stay"})
    return Experiment(t, command, coefficients, np.zeros(1), role, about)


def bench_plan(rig: Rig, rng: np.random.Generator, duration: float = 12.0) -> list[Experiment]:
    """Seven runs: four to fit, each with its own motion and voltage programme, three held out."""
    runs = []
    motions, volts = rng.permutation(MOTIONS), rng.permutation(VOLTAGES)
    for kind, programme in zip(motions, volts, strict=True):
        size = rng.uniform(0.6, 1.0)
        runs.append(bench_experiment(rig, rng, str(kind), str(programme), "train", duration, size))
    kinds = rng.permutation(MOTIONS)[:3]
    for kind, programme in zip(kinds, rng.permutation(VOLTAGES[1:]), strict=True):
        size = rng.uniform(0.6, 1.0)
        runs.append(
            bench_experiment(rig, rng, str(kind), str(programme), "holdout", duration, size)
        )
    return runs


def proposed(
    rig: Rig, signals: tuple[Array, Array], role: str, about: dict[str, Any]
) -> Experiment:
    """A bench run that somebody proposes: x (n,) m and V (n,) V at RATE, the motion faded in.

    Raises
    ------
    ValueError
        If the motion leaves the stroke or the voltage its range.
    """
    x, volts = signals
    t = np.arange(x.size) / RATE
    moved = (x - x[0]) * _fade(t, 0.6)
    if np.max(np.abs(moved)) > rig.stroke or volts.min() < -1e-9 or volts.max() > V_MAX + 1e-9:
        raise ValueError("the proposed run leaves the stroke or the range of the voltage")
    command = np.repeat(volts[:-1, None], FINE + 1, axis=1)
    return Experiment(t, command, through(moved, t), np.zeros(1), role, about)


def structure_experiment(
    rig: Rig,
    rng: np.random.Generator,
    kind: str,
    volts: str,
    role: str = "train",
    duration: float = 20.0,
    peak: float = 1.0,
    level: float | None = None,
) -> Experiment:
    """One run on the building; peak m/s2 of the ground."""
    t = np.arange(round(duration * RATE) + 1) / RATE
    about = {"ground": kind, "voltage": volts, "duration": duration, "peak": peak}
    ground = peak * ground_motion(kind, t, rng)
    command = voltage(volts, t, rng, level)
    return Experiment(t, command, np.zeros((6, 1)), ground, role, about)


def structure_plan(rig: Rig, rng: np.random.Generator, duration: float = 20.0) -> list[Experiment]:
    """Seven runs; peaks are 1 m/s2 and are set by the specimen's own response."""
    runs = []
    kinds = ["chirp", "quake", "random", "quake"]
    for kind, programme in zip(rng.permutation(kinds), rng.permutation(VOLTAGES), strict=True):
        runs.append(structure_experiment(rig, rng, str(kind), str(programme), "train", duration))
    kinds = ["chirp", "quake", "random"]
    for kind, programme in zip(rng.permutation(kinds), rng.permutation(VOLTAGES[1:]), strict=True):
        runs.append(structure_experiment(rig, rng, str(kind), str(programme), "holdout", duration))
    return runs


def with_peak(run: Experiment, factor: float) -> Experiment:
    """The same run under a stronger or weaker ground."""
    about = {**run.about, "peak": run.about["peak"] * factor}
    return replace(run, ground=run.ground * factor, about=about)

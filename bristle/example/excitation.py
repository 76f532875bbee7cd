"""Motions of a bench, motions of the ground, and what the voltage does meanwhile."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

Array = NDArray[np.float64]
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

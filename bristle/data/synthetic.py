"""Synthetic ground motions that have a name: a near-fault pulse and a stationary motion.

A formula and a seed make them, so they need no file and are the same on every machine. Both have
the same peak: scaled by one factor they stay comparable in peak ground acceleration.
"""

from __future__ import annotations

from functools import cache
from math import pi
from random import Random

import numpy as np

from ..core.arrays import Array
from .listing import Listing

PEAK = 3.0
"""Largest acceleration of each [m/s2]."""
STEP = 0.005
"""Between two samples [s]."""
DURATION = 20.0
"""Of each [s]; after the pulse the ground is at rest."""
PULSE, STATIONARY = "near_fault_pulse", "stationary_motion"

PERIOD = 1.0
"""Of the pulse [s]: that of magnitude 5.5 by log10(period) = -2.2 + 0.4 magnitude (same source)."""
CYCLES = 2.0
BEGIN = 1.0
"""Of the pulse [s]."""

SEED = 1
GROUND, GROUND_DAMPING = 5.0 * pi, 0.6
"""Angular frequency [rad/s] and damping ratio of firm ground (Kanai 1957)."""
LOWEST, LOWEST_DAMPING = 0.5 * pi, 0.6
"""Of the high-pass, a tenth of the ground's (Clough & Penzien)."""
HIGHEST = 25.0
"""Up to which the motion has components [Hz]."""
RISE = 1.0
"""Seconds in which the stationary motion swells from rest, and fades to it."""

_STATIONS = {
    PULSE: f"Synthetic: near-fault velocity pulse, period {PERIOD:g} s, {CYCLES:g} cycles",
    STATIONARY: f"Synthetic: stationary, Kanai-Tajimi spectrum of firm ground, seed {SEED}",
}
_SOURCES = {
    PULSE: "made by formula: Mavroeidis & Papageorgiou (2003), Bull. Seism. Soc. Am. 93(3)",
    STATIONARY: "made by formula: Shinozuka & Deodatis (1991), Appl. Mech. Rev. 44(4)",
}
NAMES = frozenset(_STATIONS)


def listings() -> list[Listing]:
    """Return one row per synthetic motion."""
    return [
        Listing(name, station, PEAK, DURATION, _SOURCES[name])
        for name, station in _STATIONS.items()
    ]


@cache
def read(name: str) -> tuple[Array, Array, str]:
    """Return times (n,) s, accelerations (n,) m/s2, and the source in words.

    Parameters
    ----------
    name : one of `NAMES`
    """
    t: Array = np.round(np.arange(round(DURATION / STEP) + 1) * STEP, 9)
    a = pulse(t) if name == PULSE else stationary(t, SEED)
    a = a * (PEAK / np.abs(a).max())
    a.flags.writeable = t.flags.writeable = False  # the same arrays for everybody who asks
    return t, a, f"{_STATIONS[name]}; {_SOURCES[name]}"


def pulse(t: Array) -> Array:
    """Return the acceleration of a velocity pulse (n,) without unit, its largest velocity near 1.

        v = (1 + cos(w s / cycles)) / 2  sin(w s),   |w s| <= pi cycles,   s from its middle

    after Mavroeidis & Papageorgiou (2003) with the phase at which the ground returns to its place.

    Parameters
    ----------
    t : (n,) times [s]
    """
    w = 2.0 * pi / PERIOD
    s = w * (t - BEGIN - 0.5 * CYCLES * PERIOD)
    bell = 0.5 * (1.0 + np.cos(s / CYCLES))
    fall = -0.5 * np.sin(s / CYCLES) / CYCLES
    a: Array = w * (bell * np.cos(s) + fall * np.sin(s))
    a[np.abs(s) >= pi * CYCLES] = 0.0
    return a


def stationary(t: Array, seed: int) -> Array:
    """Return a stationary acceleration (n,) without unit, swelling from rest and fading to it.

    Cosines of even spacing in frequency, their amplitudes from the power spectral density of the
    ground, their phases drawn (Shinozuka & Deodatis 1991). Python's `random` draws the same numbers
    in every version.

    Parameters
    ----------
    t : (n,) times [s]
    seed : of the phases
    """
    spacing = 0.5 / (t[-1] - t[0])  # the motion would repeat after twice its length
    f = (np.arange(round(HIGHEST / spacing)) + 0.5) * spacing
    draw = Random(seed)
    phases = np.array([2.0 * pi * draw.random() for _ in f])
    heights = np.sqrt(density(2.0 * pi * f))
    a = np.zeros(len(t))
    for height, frequency, phase in zip(heights, f, phases, strict=True):
        a += height * np.cos(2.0 * pi * frequency * t + phase)
    rest = np.minimum(np.minimum(t - t[0], t[-1] - t) / RISE, 1.0)
    found: Array = a * np.sin(0.5 * pi * rest) ** 2
    return found


def density(w: Array) -> Array:
    """Return the power spectral density (n,) of ground under white noise of 1, without unit.

    Kanai (1957) and Tajimi (1960) with the high-pass of Clough & Penzien.

    Parameters
    ----------
    w : (n,) angular frequencies [rad/s]
    """
    r, q = (w / GROUND) ** 2, (w / LOWEST) ** 2
    shear = 4.0 * GROUND_DAMPING**2 * r
    high = q**2 / ((1.0 - q) ** 2 + 4.0 * LOWEST_DAMPING**2 * q)
    found: Array = (1.0 + shear) / ((1.0 - r) ** 2 + shear) * high
    return found

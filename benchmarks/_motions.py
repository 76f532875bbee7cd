"""Ground motions for choosing a design, and those that it is reported on: no motion is both."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bristle.core.arrays import Array
from bristle.data import read_ground_motion
from bristle.errors import RecordError

G, KAPPA = 9.81, 0.45
STEP = 0.00025
"""Between two values of a motion [s]."""
DATA = Path(__file__).parents[2] / "shared" / "data" / "ground_motion"
NEWHALL = "northridge_1994_newhall_360_peer_rsn1044.csv"
REPORTED = (
    *(("El Centro", "el_centro_1940_ns", i, 31.18) for i in (0.2, 0.4, 0.6, 0.8)),
    *(("Newhall", NEWHALL, i, 39.98) for i in (0.3, 0.7)),
    *(("Sylmar", "northridge_1994_sylmar_360", i, 39.98) for i in (0.3, 0.7)),
)
KOBE = ("kobe_1995_nishi_akashi_000", "kobe_1995_shin_osaka_000")


def recorded(record: str, intensity: float, seconds: float) -> Array:
    """Return a record scaled to 0.45 times `intensity` [g], every 0.25 ms over `seconds`."""
    motion = read_ground_motion(record, DATA)
    scaled = motion.acceleration * (KAPPA * intensity * G / motion.peak)
    t = np.arange(round(seconds / 0.002) * 8 + 1) * STEP
    return np.interp(t, motion.time - motion.time[0], scaled, right=0.0)


def reported() -> dict[str, Array]:
    """Return the motions of the eight cases by name; Newhall's where its file is at hand."""
    found = {}
    for name, record, intensity, seconds in REPORTED:
        try:
            found[f"{name} {intensity:g} g"] = recorded(record, intensity, seconds)
        except RecordError:
            continue
    return found


def training(synthetic_runs: int = 10) -> list[Array]:
    """Return the motions for choosing: two records of Kobe at four intensities, 30 synthetic ones.

    Raises
    ------
    RecordError
        If the package with Kobe's records is not installed.
    """
    found = [recorded(record, i, 15.0) for record in KOBE for i in (0.2, 0.4, 0.6, 0.8)]
    for run in range(synthetic_runs):
        for k, intensity in enumerate((0.25, 0.5, 0.75)):
            found.append(synthetic(1000 + 10 * run + k, intensity, pulse=run % 2 == 1))
    return found


def synthetic(seed: int, intensity: float, pulse: bool, seconds: float = 12.0) -> Array:
    """Return white noise filtered by the ground under an envelope; with a pulse on top if wanted.

    Ground as Kanai and Tajimi have it, with a high-pass after Clough and Penzien and a low-pass at
    12 Hz; the pulse after Mavroeidis and Papageorgiou (2003), Bull. Seism. Soc. Am. 93(3).
    """
    random = np.random.default_rng(seed)
    h, whole = 0.01, 16.0
    t = np.arange(round(whole / h)) * h
    noise = random.standard_normal(len(t))
    corner, damping = random.uniform(8.0, 25.0), random.uniform(0.3, 0.7)
    w = 2.0 * np.pi * np.fft.rfftfreq(len(t), h)
    s = 1j * w / corner
    filtered = (1.0 + 2.0 * damping * s) / (1.0 + 2.0 * damping * s + s**2)
    low = w / 1.5
    filtered *= low**2 / (1.0 - low**2 + 1.2j * low) / (1.0 + (w / (2.0 * np.pi * 12.0)) ** 4)
    a = np.fft.irfft(np.fft.rfft(noise) * filtered, len(t))
    rise = random.uniform(1.0, 3.0)
    fall = rise + random.uniform(3.0, 7.0)
    a *= np.where(t < rise, (t / rise) ** 2, np.where(t < fall, 1.0, np.exp(-(t - fall) / 2.0)))
    a /= np.abs(a).max()
    if pulse:
        period, cycles = random.uniform(0.4, 1.6), random.uniform(1.5, 2.5)
        at, phase = t - random.uniform(2.5, 4.0), random.uniform(0.0, 2.0 * np.pi)
        bell = 0.5 * (1.0 + np.cos(2.0 * np.pi * at / (cycles * period)))
        bell[np.abs(at) >= cycles * period / 2.0] = 0.0
        a = a * random.uniform(0.2, 0.5) + bell * np.cos(2.0 * np.pi * at / period + phase)
        a /= np.abs(a).max()
    fine = np.arange(round(seconds / 0.002) * 8 + 1) * STEP
    return np.interp(fine, t, a * KAPPA * intensity * G)

"""Runs with residuals that are known: motion, voltage, coloured noise, and what is planted."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bristle.comparison.predictions import RunPrediction, coordinates_of

DT = 0.002


def motion(n, seed, kind="random"):
    """Return x, v, a, V of a multisine or a sine, the voltage in steps."""
    random = np.random.default_rng(seed)
    t = np.arange(n) * DT
    count = 1 if kind == "sine" else 12
    f = np.array([1.3]) if kind == "sine" else random.uniform(0.3, 6.0, count)
    size, phase = 0.012 / f / count**0.5, random.uniform(0.0, 2.0 * np.pi, count)
    w = 2.0 * np.pi * f
    angle = w[:, None] * t + phase[:, None]
    x, v = size @ np.sin(angle), (size * w) @ np.cos(angle)
    a = -(size * w**2) @ np.sin(angle)
    V = np.repeat(random.choice([0.0, 2.0, 4.0, 6.0], n // 400 + 1), 400)[:n]
    return x, v, a, V


def coloured(n, random, phi=0.0):
    """Return noise of unit variance, its correlation falling by phi per sample."""
    white = random.standard_normal(n + 500)
    return lfilter([np.sqrt(1.0 - phi**2)], [1.0, -phi], white)[500:]


def predictions_with(
    plant=None, *, count=3, n=4000, phi=0.0, noise=0.05, seed=0, kind="random", size=1.0
):
    """Return runs whose residual is `size` times the noise, and what `plant` adds [N].

    `plant` gets the coordinates of a run and returns (n,) in N.
    """
    out = []
    for k in range(count):
        random = np.random.default_rng(1000 * seed + k)
        x, v, a, V = motion(n, 17 * k + 3, kind)
        force = (1.0 + 0.6 * V) * np.tanh(v / 2e-3) + 30.0 * v
        along = coordinates_of(DT, x, v, a, V, force)
        error = size * noise * coloured(n, random, phi)
        if plant is not None:
            error = error + plant(along)
        zero = np.zeros((1, n))
        sigma = np.full(n, noise)
        out.append(
            RunPrediction(
                f"run_{k}", DT, force + error, force, sigma, noise, zero, along, np.zeros(n)
            )
        )
    return out

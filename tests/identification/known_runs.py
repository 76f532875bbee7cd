"""Runs on a bench with noise, whose law and parameters are known."""

from __future__ import annotations

import numpy as np

from bristle.identification.histories import DamperForces
from bristle.identification.problem import Run
from bristle.identification.smoothing import posterior_draws, smooth
from bristle.physics.laws import LAWS

DT, N = 0.002, 4000
T = np.arange(N) * DT


def motion(seed):
    """Return displacement, velocity, acceleration of a random multisine up to 8 Hz."""
    random = np.random.default_rng(seed)
    f, phase = random.uniform(0.5, 8.0, 12), random.uniform(0.0, 2.0 * np.pi, 12)
    size = 0.006 / f**0.7 * random.uniform(0.3, 1.0, 12)
    w = 2.0 * np.pi * f
    angle = w[:, None] * T + phase[:, None]
    x = size @ np.sin(angle)
    return x, (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)


def truth_of(law):
    random = np.random.default_rng(5)
    return {
        name: declared.value * (1.0 + 0.15 * random.uniform(-1.0, 1.0))
        for name, declared in LAWS[law].parameters.items()
        if name != "exponent"
    }


def bench_run(law, values, seed, noise=0.01):
    """Return a run with noise on every channel but the voltage."""
    random = np.random.default_rng(seed)
    x, v, a = motion(seed)
    V = 2.5 * (1.0 + np.sin(2.0 * np.pi * (0.5 + 0.4 * seed) * T))
    force = DamperForces(law, []).force(x, v, a, V, DT, values)
    sigma = [noise * np.std(y) for y in (x, v, force)]
    measured = [
        y + s * random.standard_normal(N) for y, s in zip((x, v, force), sigma, strict=True)
    ]
    smoothed = smooth(measured[0], measured[1], DT, (sigma[0], sigma[1]))
    draws = np.zeros((10, N, 4))
    draws[:, :, :3] = posterior_draws(
        N, DT, (sigma[0], sigma[1]), smoothed.jerk, (True, True), 10, seed
    )
    return Run(
        f"run {seed}", DT, smoothed.x, smoothed.v, smoothed.a, V, measured[2], sigma[2], draws
    )

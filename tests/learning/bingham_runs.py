"""Runs of a Bingham damper with something hidden in its force."""

from __future__ import annotations

import numpy as np

from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run

STEP = 0.002  # s
T = STEP * np.arange(3000)
VALUES = {"f_c": 1.3, "f_v": 0.83, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}
NOISE = 0.05  # N
NOWHERE = np.zeros((0, len(T), 4))


def runs(hidden=lambda x, v, V, F: F, samples=3000):
    """Return three runs of a Bingham damper with something hidden, the motion without noise."""
    out = []
    for seed in range(3):
        random = np.random.default_rng(seed)
        w = 2.0 * np.pi * random.uniform(0.4, 4.0, 8)
        angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
        size = 0.05 / w
        x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
        V = np.repeat(random.choice([0.0, 3.0, 6.0], 12), len(T) // 12)
        force = hidden(x, v, V, DamperForces("bingham", []).force(x, v, a, V, STEP, VALUES))
        force = force + NOISE * random.standard_normal(len(T))
        run = Run(f"run{seed}", STEP, x, v, a, V, force, NOISE, NOWHERE)
        out.append(run.of(slice(0, samples)))
    return Problem(out)

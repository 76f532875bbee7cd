"""Bench runs made from sines and a yield law, for tests of studies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RATE = 500.0
Columns = dict[str, NDArray[np.float64]]


def bench_run(seed: int, seconds: float = 6.0, noise: float = 0.01) -> Columns:
    """Return time [s], x [mm], v [mm/s], F [N] and U [V] of one run with noise on x, v and F."""
    generator = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    x, v = np.zeros_like(time), np.zeros_like(time)
    for _ in range(20):
        frequency, phase = generator.uniform(0.5, 5.0), generator.uniform(0.0, 6.28)
        amplitude, turn = generator.normal() * 3e-3 / frequency, 2.0 * np.pi * frequency
        x += amplitude * np.sin(turn * time + phase)
        v += amplitude * turn * np.cos(turn * time + phase)
    x, v = 0.05 * x / np.std(v), 0.05 * v / np.std(v)
    level = np.repeat(generator.choice([0.0, 2.0, 4.0, 6.0], 24), len(time) // 24 + 1)[: len(time)]
    force = (1.3 + 0.8 * level) * np.tanh(v / 2e-3) + 20.0 * v

    def measured(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values + noise * np.std(values) * generator.standard_normal(len(values))

    return {
        "time [s]": time,
        "x [mm]": 1e3 * measured(x),
        "v [mm/s]": 1e3 * measured(v),
        "F [N]": measured(force),
        "U [V]": level,
    }


def write(path: Path, columns: Columns) -> Path:
    """Write columns as CSV; return the path."""
    rows = np.column_stack(list(columns.values()))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    return path


def write_runs(folder: Path, count: int = 4, **choices: float) -> list[Path]:
    """Write runs with different motions; return their files."""
    return [write(folder / f"run_{k}.csv", bench_run(k, **choices)) for k in range(1, count + 1)]

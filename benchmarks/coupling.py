"""What the exchange of values between FMUs costs in accuracy: peaks, and a base that sticks."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pandas as pd

import bristle

from ._published import DRIFT, Case, half_sine, peak_errors, symbol
from ._rows import Row

GOALS = {
    ("gauss-seidel", 0.0005): 0.006,
    ("gauss-seidel", 0.002): 0.02,
    ("jacobi", 0.0005): None,
    ("jacobi", 0.002): None,
}
"""Largest error of a peak that is wanted, as a share, by algorithm and step [s]."""

SCENARIO = "half_sine_pulse"
STICKING = "bingham_half_sine_sticking"
STUCK = 8.0, 10.0
"""Between these times [s] the damper holds the base."""


def run() -> list[Row]:
    """Return the errors of peaks by algorithm and step, and the velocity of a stuck base."""
    rows = [row for wanted in GOALS for row in pulse(*wanted)]
    return [*rows, stuck_base()]


def pulse(algorithm: str, step: float) -> Iterator[Row]:
    """Yield the largest error of all peaks; then what is reported beside it, case by case."""
    overrides = {"run.algorithm": algorithm, "run.step": step}
    before = time.perf_counter()
    frames = [
        (case, bristle.run(SCENARIO, {**overrides, **case.overrides})) for case in half_sine()
    ]
    seconds = time.perf_counter() - before
    errors = {
        (case.name, column): error
        for case, frame in frames
        for column, error in peak_errors(case, frame).items()
    }
    worst = max(errors, key=lambda key: errors[key])
    goal = GOALS[algorithm, step]
    what = f"half-sine pulse, FMUs, {algorithm}, {1e3 * step:g} ms"
    yield Row(
        f"{what}: {len(errors)} peaks",
        f"largest error {errors[worst]:.3%}: {symbol(worst[1])} at {worst[0]}",
        f"<= {goal:.1%}" if goal else "",
        errors[worst] / goal if goal else None,
        f"{len(frames)} runs of {len(frames[0][1]) - 1:,} steps took {seconds:.2f} s",
    )
    for case, frame in frames:
        yield Row(f"{what}, {case.name}", _reported(case, frame))


def _reported(case: Case, frame: pd.DataFrame) -> str:
    """Return the error of each peak, how late the peaks are, and the displacement at the end."""
    each = ", ".join(f"{symbol(c)} {error:.3%}" for c, error in peak_errors(case, frame).items())
    late = ", ".join(
        f"{symbol(column)} {1e3 * (frame[column].abs().idxmax() - at):+.1f} ms"
        for column, at in case.times.items()
    )
    end = f"x_b(10 s) {1e3 * frame[DRIFT].iloc[-1]:.4g} mm, table {1e3 * case.end:.4g} mm"
    return f"peaks {each}; they come late by {late}; {end}"


def stuck_base() -> Row:
    """Return the RMS velocity of a base that a Bingham damper at 8 V holds."""
    frame = bristle.run(STICKING, {"voltage.level": 8.0, "run.step": 0.002})
    velocity = frame.loc[slice(*STUCK), "structure.base_velocity"]
    rms = 1e3 * float(np.sqrt(np.mean(velocity**2)))
    return Row(
        "RMS base velocity while stuck: Bingham, 8 V, half-sine, 8 to 10 s, 2 ms",
        f"{rms:.3g} mm/s",
        "<= 0.05 mm/s",
        rms / 0.05,
    )

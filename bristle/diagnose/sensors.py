"""Sensor faults, told from missing physics through what the channels say of each other.

Displacement and velocity are redundant: one is the rate of the other. So gain, sign, delay and
bias of either show without any model of the damper. A clipped channel repeats its extremes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identify.smooth import smooth
from ..records.measurement import Measurement

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel: "gain" [1], "sign" [1], "delay" [s], "bias", "clipping" [its unit].

    `std` is the uncertainty of `value`.
    """

    channel: str
    fault: str
    value: float
    std: float


def sensor_faults(runs: list[Measurement]) -> list[SensorFault]:
    """Return the faults that the redundancy of the channels shows, over all runs."""
    found = clipped(runs)
    both = [run for run in runs if run.has("displacement", "velocity")]
    if both:
        found += kinematic(both)
    return found


def kinematic(runs: list[Measurement]) -> list[SensorFault]:
    """Return what is wrong with velocity against the rate of displacement.

    velocity(t) = gain x'(t - delay) + bias, by least squares on x' smoothed from displacement
    alone; each value per run, its spread over runs as uncertainty.
    """
    rows = []
    for run in runs:
        rate = smooth(
            run["displacement"], None, run.step, (max(run.noise["displacement"], 1e-12), 1.0)
        )
        edge = max(10, len(rate.v) // 100)
        v, a = rate.v[edge:-edge], rate.a[edge:-edge]
        A = np.column_stack([v, -a, np.ones_like(v)])
        theta, *_ = np.linalg.lstsq(A, run["velocity"][edge:-edge], rcond=None)
        rows.append([theta[0], theta[1] / theta[0] if theta[0] else 0.0, theta[2]])
    values = np.array(rows)
    count = len(values)
    spread = values.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(3, np.inf)
    gain, delay, bias = np.median(values, axis=0)
    speed = float(np.median([np.std(run["velocity"]) for run in runs]))
    step = runs[0].step
    found = []
    if gain < 0.0:
        found.append(SensorFault("velocity", "sign", -1.0, 0.0))
        gain = -gain
    if abs(gain - 1.0) > max(6.0 * spread[0], 0.01):
        found.append(SensorFault("velocity", "gain", float(gain), float(spread[0])))
    if abs(delay) > max(6.0 * spread[1], 0.25 * step):
        late = "velocity" if delay > 0.0 else "displacement"
        found.append(SensorFault(late, "delay", float(abs(delay)), float(spread[1])))
    if abs(bias) > max(6.0 * spread[2], 0.01 * speed):
        found.append(SensorFault("velocity", "bias", float(bias), float(spread[2])))
    return found


def clipped(runs: list[Measurement]) -> list[SensorFault]:
    """Return the channels that repeat an extreme: their range ends before the motion does."""
    found = []
    for channel in ("force", "displacement", "velocity"):
        for run in runs:
            if not run.has(channel):
                continue
            values = run[channel]
            limit = _limit(values, run.noise.get(channel, 0.0))
            if limit is not None:
                found.append(SensorFault(channel, "clipping", limit, 0.0))
                break
    return found


def _limit(values: Array, noise: float) -> float | None:
    """Return the level at which a signal is cut off, None where it is not.

    At a cut the very same number comes many times in a row; a noisy signal never does that.
    """
    top = float(np.max(np.abs(values)))
    if top == 0.0:
        return None
    at_end = np.isclose(np.abs(values), top, rtol=0.0, atol=1e-9 * top)
    runs_of = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at_end.astype(int), [0]]))))[::2]
    longest = int(runs_of.max()) if len(runs_of) else 0
    return top if longest >= 5 and at_end.sum() >= 10 and noise < 0.2 * top else None

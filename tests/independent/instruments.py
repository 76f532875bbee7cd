"""What the recorder shows: faults of one channel, then noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

Array = NDArray[np.float64]
Signals = dict[str, Array]

BENCH = ("displacement", "velocity", "voltage", "force")
FAULTS = ("sensor_gain", "sensor_bias", "sensor_delay", "sensor_sign", "sensor_clipping")
LATEST = 0.1  # s, a later channel would be seen by eye
LOWEST = 0.25  # of the peak, clipping below that likewise


@dataclass(frozen=True)
class Fault:
    """One fault on one channel; value is a factor, an offset, s, or the level of clipping."""

    kind: str
    channel: str
    value: float

    def before_noise(self, run: Signals) -> Signals:
        if self.kind == "sensor_clipping":
            return run
        x = run[self.channel]
        if self.kind in ("sensor_gain", "sensor_sign"):
            shown = x * self.value
        elif self.kind == "sensor_bias":
            shown = x + self.value
        else:
            shown = late(run["time"], x, self.value, held=self.channel == "voltage")
        return {**run, self.channel: shown}

    def after_noise(self, run: Signals) -> Signals:
        if self.kind != "sensor_clipping":
            return run
        return {**run, self.channel: np.clip(run[self.channel], -self.value, self.value)}


def late(time: Array, x: Array, delay: float, held: bool) -> Array:
    """x as it was `delay` earlier; before the start the first value."""
    then = np.maximum(time - delay, time[0])
    if held:
        return x[np.searchsorted(time, then + 1e-9, side="right") - 1]
    return np.asarray(make_interp_spline(time, x, k=3)(then))


def rms(runs: list[Signals], channel: str) -> float:
    return float(np.sqrt(np.mean(np.concatenate([r[channel] for r in runs]) ** 2)))


def plant_fault(
    kind: str, channel: str, strength: float, runs: list[Signals], rng: np.random.Generator
) -> tuple[Fault, float]:
    """A fault that changes its channel by `strength` of its RMS, and the share reached.

    A wrong sign changes it by 2, whatever the strength. Delay and clipping stop at their limits.

    Raises
    ------
    ValueError
        If the fault is not known or the channel cannot have it.
    """
    if kind not in FAULTS or channel not in runs[0]:
        raise ValueError(f"fault {kind!r} on {channel!r}: there are {FAULTS}")
    size = rms(runs, channel)
    if kind == "sensor_sign":
        return Fault(kind, channel, -1.0), 2.0
    side = float(rng.choice([-1.0, 1.0]))
    if kind == "sensor_gain":
        return Fault(kind, channel, 1.0 + side * strength), strength
    if kind == "sensor_bias":
        return Fault(kind, channel, side * strength * size), strength

    def change(value: float) -> float:
        fault = Fault(kind, channel, value)
        pairs = [(r[channel], fault.after_noise(fault.before_noise(r))[channel]) for r in runs]
        return float(np.sqrt(np.mean(np.concatenate([a - b for a, b in pairs]) ** 2))) / size

    if kind == "sensor_delay":
        if channel == "force":
            raise ValueError("a late force is the effect `delay`, not a fault")
        low, high = 0.0, LATEST
    else:
        top = max(float(np.max(np.abs(r[channel]))) for r in runs)
        low, high = top, LOWEST * top
    if change(high) < strength:
        return Fault(kind, channel, high), change(high)
    value = float(brentq(lambda v: change(v) - strength, low, high, xtol=1e-4 * max(low, high)))
    return Fault(kind, channel, value), change(value)


def record(
    run: Signals, spread: dict[str, float], fault: Fault | None, rng: np.random.Generator
) -> Signals:
    """The run as recorded: fault, white noise of standard deviation `spread`, clipping."""
    shown = fault.before_noise(run) if fault else dict(run)
    shown = {
        name: x + spread[name] * rng.standard_normal(x.size) if name in spread else x
        for name, x in shown.items()
    }
    return fault.after_noise(shown) if fault else shown

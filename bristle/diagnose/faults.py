"""Sensor faults as they are told, and measurements without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..records.measurement import Measurement

Array = NDArray[np.float64]

ORDER = {"bias": 1, "sign": 2, "gain": 3, "delay": 4}
"""In which order faults are taken back: an offset is on what the instrument shows."""


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel.

    `fault` is "gain" [1], "sign" (-1), "delay" [s], "bias" or "clipping" [the channel's unit], or
    what an instrument does: "lag" [s, of first order], "high-pass" [1/s, its corner]; "derived" [s,
    how late] is a velocity that was computed from the displacement, "unrelated" (0) one of another
    motion. `std` is the uncertainty of `value`; `words` a sentence; `either` the channel that may
    have it instead, as far as the data tell.
    """

    channel: str
    fault: str
    value: float
    std: float
    words: str
    either: str = ""

    def as_dict(self) -> dict[str, object]:
        """Return what verdict.json holds of it."""
        told = {
            "channel": self.channel, "fault": self.fault, "value": self.value, "std": self.std,
            "words": self.words,
        }  # fmt: skip
        return {**told, "either": self.either} if self.either else told


def mended(runs: Sequence[Measurement], faults: Sequence[SensorFault]) -> list[Measurement]:
    """Return the measurements as they would be without the faults, so that physics can be judged.

    Displacement is the reference of velocity. Clipped samples count as not measured.
    """
    return [_mended(run, faults) for run in runs]


def _mended(run: Measurement, faults: Sequence[SensorFault]) -> Measurement:
    channels, measured = dict(run.channels), run.measured
    noise = dict(run.noise)
    for fault in sorted(faults, key=lambda one: ORDER.get(one.fault, 0)):
        if fault.channel not in channels:
            continue
        values = channels[fault.channel]
        if fault.fault == "sign":
            channels[fault.channel] = -values
        elif fault.fault == "gain":
            channels[fault.channel] = values / fault.value
            noise[fault.channel] = noise.get(fault.channel, 0.0) / abs(fault.value)
        elif fault.fault == "bias":
            channels[fault.channel] = values - fault.value
        elif fault.fault == "delay":
            channels[fault.channel] = earlier(values, fault.value / run.step)
        elif fault.fault in ("lag", "high-pass", "derived"):
            del channels[fault.channel]  # displacement says the same, without it
        elif fault.fault == "clipping":
            near = 1e-9 * float(np.max(np.abs(values)))
            inside = (values < values.max() - near) & (values > values.min() + near)
            measured = measured & inside
    return replace(run, channels=channels, measured=measured, noise=noise)


def earlier(values: Array, samples: float) -> Array:
    """Return a signal moved ahead in time by a number of samples, its last value held."""
    from scipy.interpolate import make_interp_spline

    index = np.arange(len(values), dtype=float)
    at = np.minimum(index + samples, len(values) - 1.0)
    return np.asarray(make_interp_spline(index, values, k=1)(np.maximum(at, 0.0)))

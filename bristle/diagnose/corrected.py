"""Measurements as they would be without the faults of their sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..data.command_limits import LIMITS
from ..data.corrections import Correction, set_right
from ..data.measurement import Measurement
from .clipping import beyond_range
from .faults import SensorFault

Array = NDArray[np.float64]

ORDER = {"bias": 1, "sign": 2, "gain": 3, "clock": 4, "delay": 5}
"""In which order faults are taken back: an offset is on what the instrument shows."""


def corrected(runs: Sequence[Measurement], faults: Sequence[SensorFault]) -> list[Measurement]:
    """Return the measurements as they would be without the faults, so that physics can be judged.

    Displacement is the reference of velocity. Clipped samples of a channel are lost, those of the
    others are not.
    """
    return [_corrected(run, faults) for run in runs]


def _corrected(run: Measurement, faults: Sequence[SensorFault]) -> Measurement:
    channels, lost, noise = dict(run.channels), dict(run.lost), dict(run.noise)
    for fault in sorted(faults, key=lambda one: ORDER.get(one.fault, 0)):
        if fault.channel not in channels or fault.run not in ("", run.name):
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
        elif fault.fault in ("clock", *LIMITS):
            known = [Correction(fault.channel, fault.fault, fault.value)]
            channels |= set_right({fault.channel: values}, run.step, known)
        elif fault.fault in ("lag", "high-pass", "derived"):
            del channels[fault.channel]  # displacement says the same, without it
        elif fault.fault == "clipping":
            lost[fault.channel] = beyond_range(values, noise.get(fault.channel, 0.0), fault.value)
    return replace(run, channels=channels, lost=lost, noise=noise)


def earlier(values: Array, samples: float) -> Array:
    """Return a signal moved ahead in time by a number of samples, its last value held."""
    from scipy.interpolate import make_interp_spline

    index = np.arange(len(values), dtype=float)
    at = np.minimum(index + samples, len(values) - 1.0)
    return np.asarray(make_interp_spline(index, values, k=1)(np.maximum(at, 0.0)))

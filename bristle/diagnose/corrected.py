"""Measurements as they would be without the faults of their sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data.command_limits import LIMITS
from ..data.corrections import TIMING, Correction, set_right
from ..data.cut_off import beyond_range
from ..data.measurement import Measurement
from ..data.timing import in_time
from .faults import SensorFault

ORDER = {"bias": 1, "sign": 2, "gain": 3}
"""In which order faults are taken back: an offset is on what the instrument shows."""


def corrected(runs: Sequence[Measurement], faults: Sequence[SensorFault]) -> list[Measurement]:
    """Return the measurements as they would be without the faults, so that physics can be judged.

    Displacement is the reference of velocity. Clipped samples of a channel are lost, those of the
    others are not.
    """
    return [_corrected(run, faults) for run in runs]


def _corrected(run: Measurement, faults: Sequence[SensorFault]) -> Measurement:
    channels, cut, noise = dict(run.channels), dict(run.saturated), dict(run.noise)
    timing: list[Correction] = []
    for fault in sorted(faults, key=lambda one: ORDER.get(one.fault, 0)):
        if fault.channel not in channels or fault.run not in ("", run.name):
            continue
        values = channels[fault.channel]
        if fault.fault in TIMING:
            timing.append(Correction(fault.channel, fault.fault, fault.value))
        elif fault.fault == "sign":
            channels[fault.channel] = -values
        elif fault.fault == "gain":
            channels[fault.channel] = values / fault.value
            noise[fault.channel] = noise.get(fault.channel, 0.0) / abs(fault.value)
        elif fault.fault == "bias":
            channels[fault.channel] = values - fault.value
        elif fault.fault in LIMITS:
            limit = [Correction(fault.channel, fault.fault, fault.value)]
            channels |= set_right({fault.channel: values}, run.step, limit)
        elif fault.fault in ("lag", "high-pass", "derived"):
            del channels[fault.channel]  # displacement says the same, without it
        elif fault.fault == "clipping":
            cut[fault.channel] = beyond_range(values, noise.get(fault.channel, 0.0), fault.value)
    known = {name: replace(run, saturated=cut).valid(name) for name in channels}
    moved = in_time(channels, known, run.step, timing)
    for name in moved.between:
        noise[name] = noise.get(name, 0.0) * moved.noise_left(name)
    return replace(
        run, channels=moved.channels, lost={**run.lost, **moved.lost}, saturated=cut, noise=noise
    )

"""Channels whose clock is late, or runs fast or slow, at the times of the others.

Values between two samples are interpolated linearly: a force that jumps would ring behind anything
smoother. That lowers white noise, by a share that is known, so that noise is estimated before.
Where a force bends so much between two samples that no line follows it, its value is not judged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .channels import DRIVE, is_smooth
from .corrections import TIMING, Correction
from .noise import Noise, estimate_noise
from .table import Array

Flags = NDArray[np.bool_]

_ALONE = np.ones(1)
_BINS = 20  # of the distances from a sample, where a clock goes through all of them
_EXACT = 1e-9  # steps within which a value lies on a sample

MISSED = 1e-3
"""Share of a force's standard deviation that a line between two samples may miss, where its noise
is smaller: a signal of a simulation has none, and bends everywhere."""


@dataclass(frozen=True)
class InTime:
    """Channels (n,) at the times of the others, and what is known of those that were moved.

    By name: `lost` (n,) where the record does not tell what it was at that time; `between` (n,) how
    far from a sample of the record the values are, as shares of a step; `noise` that of the record.
    """

    channels: dict[str, Array]
    lost: dict[str, Flags] = field(default_factory=dict)
    between: dict[str, Array] = field(default_factory=dict)
    noise: dict[str, Noise] = field(default_factory=dict)

    def noise_left(self, channel: str, taps: Array = _ALONE) -> float:
        """Return what is left of a channel's white noise behind a filter.

        Parameters
        ----------
        channel : its name, moved or not
        taps : (k,) of the filter
        """
        weights = taps / taps.sum()
        if channel not in self.between or is_smooth(channel):
            return float(np.sqrt(np.sum(weights**2)))
        shares, edges = np.histogram(self.between[channel], _BINS, (0.0, 1.0))
        middles = 0.5 * (edges[1:] + edges[:-1])
        if np.ptp(self.between[channel]) < 1.0 / _BINS:  # a delay, the same for all
            middles[:] = np.mean(self.between[channel])
        power = [np.sum(np.convolve(weights, [1.0 - w, w]) ** 2) for w in middles]
        return float(np.sqrt(np.average(power, weights=shares)))


def _error(y: Array, first: NDArray[np.int_], between: Array) -> Array:
    """Return what linear interpolation behind samples `first` (n,) misses where a signal bends."""
    places = np.clip(first[:, None] + np.arange(-1, 3), 0, len(y) - 1)
    bend = y[places] @ np.array([0.5, -0.5, -0.5, 0.5])
    return np.asarray(0.5 * between * (1.0 - between) * np.abs(bend))


def in_time(
    channels: Mapping[str, Array], known: Mapping[str, Flags], step: float,
    corrections: Sequence[Correction], begin: float = 0.0,
) -> InTime:  # fmt: skip
    """Return channels at the times at which the others were measured.

    Parameters
    ----------
    channels : name to (n,), evenly spaced
    known : by channel (n,) False where it says nothing, such as where a sample was filled in
    step : s
    corrections : those of other faults are passed over
    begin : s since the record began, from which on a clock gains
    """
    out = InTime(dict(channels))
    for name, y in channels.items():
        own = [one for one in corrections if one.channel == name and one.fault in TIMING]
        if not own:
            continue
        rate = float(np.prod([1.0 + one.value for one in own if one.fault == "clock"]))
        late = sum(one.value for one in own if one.fault == "delay")
        last = len(y) - 1
        wanted = (np.arange(len(y)) + (begin + late) / step) * rate - begin / step
        place = np.clip(wanted, 0.0, last)
        first = np.floor(place + _EXACT).astype(int)
        second = np.ceil(place - _EXACT).astype(int)
        there = (wanted > -0.5) & (wanted < last + 0.5) & known[name][first] & known[name][second]
        out.channels[name] = np.interp(place, np.arange(len(y)), y)
        out.between[name] = np.clip(place - first, 0.0, 1.0)
        out.noise[name] = estimate_noise(y)
        if not (is_smooth(name) or name in DRIVE):
            most = max(out.noise[name].std, MISSED * float(np.std(y)))
            there &= _error(y, first, out.between[name]) <= most
        if not there.all():
            out.lost[name] = ~there
    return out

"""Isolated spikes on a channel: one to three samples that stand out from those on either side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..quantity import plain, quantity
from .channels import DRIVE, channel_unit, device_channel
from .noise import is_switched
from .table import Array

LONGEST = 3
"""Samples in a row that are one spike; what lasts longer is no isolated one."""

_WINDOW = 2 * LONGEST + 1  # of the running median, which jumps with a step and not with a spike
_ABOVE_MOST = 8.0  # by what factor a spike exceeds what 99 % of the samples differ from it
_ABOVE_NOISE = 15.0  # standard deviations of the same, told from its median
_OF_RANGE = 0.03  # share of the channel's range that is worth a word
_INSIDE = 2.5  # by what factor more a spike stands out that stays inside the usual range
_TOLD = 3  # times that are told


class Spike(NamedTuple):
    """A spike: its channel, when [s], and how far it stands out, in the channel's SI unit."""

    channel: str
    time: float
    size: float


def find_spikes(y: Array) -> list[tuple[int, int]]:
    """Return the first sample and the one after the last of each spike of a channel (n,).

    Values that are missing are no spikes. A channel that is switched between levels has none.
    """
    good = np.flatnonzero(np.isfinite(y))
    if len(good) < 10 * _WINDOW or is_switched(y):
        return []
    from scipy.ndimage import median_filter

    there = y[good]
    apart = there - median_filter(there, _WINDOW, mode="nearest")
    size = np.abs(apart)
    low, high = np.quantile(there, [0.005, 0.995])
    least = max(
        _ABOVE_MOST * float(np.quantile(size, 0.99)),
        _ABOVE_NOISE * 1.4826 * float(np.median(size)),
        _OF_RANGE * float(high - low),
    )
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (size > least).astype(np.int8), [0]])))
    margin = _OF_RANGE * float(high - low)

    def stands_out(a: int, b: int) -> bool:
        """Return whether samples a to b are outside of the usual range, or alone and far off.

        A motion that turns back for a moment takes a yield force through its range and back.
        """
        part = there[a:b]
        if bool(np.all((part > high + margin) | (part < low - margin))):
            return True
        return b - a == 1 and float(size[a]) > _INSIDE * least

    return [
        (int(good[a]), int(good[b - 1]) + 1)
        for a, b in edges.reshape(-1, 2).tolist()
        if b - a <= LONGEST and 0 < a < b < len(there) and stands_out(a, b)
    ]


def spikes_of(time: Array, channels: Mapping[str, Array], *, mask: bool) -> tuple[Spike, ...]:
    """Return the spikes of all channels; with `mask` their samples are missing from then on.

    Parameters
    ----------
    time : (n,) s
    channels : name to (n,) in SI, NaN where a value is missing
    mask : whether to make their samples NaN, in place
    """
    found = []
    for channel, y in channels.items():
        commands = (device_channel(channel) or ("", channel))[1] in DRIVE
        for begin, end in find_spikes(y):
            if commands and _at_a_switch(y, begin, end):
                continue
            before, after = (part[np.isfinite(part)] for part in (y[:begin], y[end:]))
            beside = np.concatenate([before[-LONGEST:], after[:LONGEST]])
            part = y[begin:end] - float(np.median(beside))
            most = int(np.nanargmax(np.abs(part)))
            found.append(Spike(channel, float(time[begin + most]), float(part[most])))
            if mask:
                y[begin:end] = np.nan
    return tuple(found)


def _at_a_switch(y: Array, begin: int, end: int) -> bool:
    """Return whether samples of a command overshoot where it is switched from level to level."""
    before, after = y[max(begin - LONGEST, 0) : begin], y[end : end + LONGEST]
    if not (np.isfinite(before).any() and np.isfinite(after).any()):
        return False
    levels = np.array([np.nanmedian(before), np.nanmedian(after)])
    size = float(np.nanmax(np.min(np.abs(y[begin:end, None] - levels), axis=1)))
    return float(np.ptp(levels)) >= size


def spikes_text(spikes: tuple[Spike, ...]) -> str:
    """Return the spikes of one channel as people say it, the largest first."""
    ordered = sorted(spikes, key=lambda one: -abs(one.size))
    unit = channel_unit(spikes[0].channel)
    told = [
        f"{quantity(one.size, unit, fine=True)} at {plain(one.time, 5)} s"
        for one in ordered[:_TOLD]
    ]
    more = f" and {len(spikes) - _TOLD} more" if len(spikes) > _TOLD else ""
    what = "an isolated spike" if len(spikes) == 1 else f"{len(spikes)} isolated spikes"
    return f"{spikes[0].channel} has {what}: {', '.join(told)}{more}"

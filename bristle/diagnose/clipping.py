"""Channels whose range ends before the motion does."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare.names import joined
from ..data.channels import channel_unit
from ..data.cut_off import CHANNELS, ends_of, outermost
from ..data.measurement import Measurement
from ..quantity import quantity
from .faults import SensorFault
from .rule import SENSOR, DecisionRule

NAMED = 3
"""Runs that a sentence names; of more it says how many there are."""


def clipped(runs: Sequence[Measurement], rule: DecisionRule = SENSOR) -> list[SensorFault]:
    """Return the channels that repeat an extreme: their range ends before the motion does."""
    found = []
    for channel in CHANNELS:
        there = [run for run in runs if run.has(channel)]
        both = {run.name: ends_of(run, channel, rule.longest, rule.crowded) for run in there}
        ends = {name: cut for name, cut in both.items() if cut}
        if ends:
            every = [end for cut in ends.values() for end in cut]
            at = joined([quantity(end, channel_unit(channel), 4) for end in outermost(every)])
            named = joined([*ends]) if len(ends) <= NAMED else f"{len(ends)} runs"
            found.append(
                SensorFault(
                    channel, "clipping", max(map(abs, every)), 0.0,
                    f"{channel.capitalize()} repeats the very same extreme in {named}: its range "
                    f"ended at {at}.",
                    runs=tuple(ends) if len(ends) < len(runs) else (),
                )
            )  # fmt: skip
    return found

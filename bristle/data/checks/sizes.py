"""Looks at how large values are: what no damper does tells a wrong unit, or a turned command."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...quantity import quantity
from ..channels import DRIVE
from ..measurement import Measurement
from ..table import Array
from .finding import Finding

LARGEST = {
    "displacement": 10.0, "velocity": 20.0, "force": 1e8, "voltage": 1e3, "current": 100.0,
    "duty": 101.0, "field": 10.0,
}  # fmt: skip
"""What no damper on a bench reaches, in the units of the channels."""

STROKE = 1e-4
"""Range of a displacement [m] below which it is doubted: a rod plays as much in its mounts."""

SLOW = 5.0
"""Samples per second below which the time is doubted: no motion of a bench is so slow."""

NEVER = 0.02
"""Share of its largest value, positive, that a command which is turned does not pass."""

MOSTLY = 0.2
"""Share of its lowest value that the mean of such a command is below: noise about zero is not."""


def check_sizes(run: Measurement, velocity: Array | None) -> Iterator[Finding]:
    """Yield what no damper does: the sizes of motion, force, command and time of a run on a bench.

    Parameters
    ----------
    run : Measurement
    velocity : (n,) m/s, measured or derived, None where nothing moves
    """
    for channel, most in LARGEST.items():
        if channel in run.channels and (size := float(np.abs(run[channel]).max())) > most:
            yield _unit(run, channel, f"{channel} reaches {quantity(size, run.units[channel], 3)}")
    speed = 0.0 if velocity is None else float(np.abs(velocity).max())
    if "velocity" not in run.channels and speed > LARGEST["velocity"]:
        yield _unit(run, "displacement", f"the displacement moves at {quantity(speed, 'm/s', 3)}")
    moved = float(np.ptp(run["displacement"])) if "displacement" in run.channels else 0.0
    if 0.0 < moved < STROKE:
        yield _unit(run, "displacement", f"displacement moves by {quantity(moved, 'm', 3)} in all")
    if run.sampling.rate < SLOW:
        rate = quantity(run.sampling.rate, "Hz", 3)
        yield _unit(run, "time", f"by its times the run was sampled at {rate}")
    for channel in DRIVE:
        if channel in run.channels:
            yield from _turned(run, channel, run[channel])


def _unit(run: Measurement, channel: str, what: str) -> Finding:
    return Finding(
        "size", "warning", f"{what}: is the unit of the {channel} right?",
        f"Correct it with bristle study channels MY_RIG --channel {channel}=COLUMN@UNIT",
        run.name, channel,
    )  # fmt: skip


def _turned(run: Measurement, channel: str, values: Array) -> Iterator[Finding]:
    """Report a command that is below zero and never above: laws take more of it for more force."""
    low = float(values.min())
    if low < 0.0 and float(values.max()) <= -NEVER * low and float(np.mean(values)) < MOSTLY * low:
        yield Finding(
            "command sign", "warning",
            f"{channel} goes down to {quantity(low, run.units[channel], 3)} and never above zero: "
            "is its sign turned?",
            f"Turn it with bristle study channels MY_RIG --channel {channel}=-COLUMN",
            run.name, channel,
        )  # fmt: skip

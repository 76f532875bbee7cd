"""Ground motions that a shaking table can run: its displacement from a recorded acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, sosfiltfilt

from ..data.measurement import Measurement
from ..data.motion import GroundMotion, baked_in, read_ground_motion
from ..errors import RecordError
from .motions import Waveform

Array = NDArray[np.float64]

REST = 2.0
"""Rest before and after a record, in periods of the corner below which the table does not move."""


def displacement_of(acceleration: Array, step: float, corner: float) -> Array:
    """Return the displacement (n,) [m] of a table that runs a recorded acceleration.

    What is slower than the corner is left out at each integration: no table has the room for it.

    Parameters
    ----------
    acceleration : (n,) m/s2
    step : of the samples [s]
    corner : lowest frequency of the table [Hz]
    """
    low = butter(2, min(2.0 * corner * step, 0.5), "high", output="sos")
    many = round(REST / corner / step)
    moved = np.pad(acceleration, many)
    for _ in range(2):
        moved = cumulative_trapezoid(sosfiltfilt(low, moved), dx=step, initial=0.0)
    return np.asarray(sosfiltfilt(low, moved)[many : many + len(acceleration)])


def scalable(motion: GroundMotion, rate: float, seconds: float, corner: float) -> Waveform:
    """Return a ground motion as a waveform that can be scaled: its strongest stretch.

    Parameters
    ----------
    motion : as recorded
    rate : samples per second of the waveform
    seconds : its length
    corner : lowest frequency of the table [Hz]

    Raises
    ------
    RecordError
        If the ground does not move.
    """
    step = 1.0 / rate
    even = np.arange(motion.time[0], motion.time[-1] + 0.5 * step, step)
    felt = np.interp(even, motion.time, motion.acceleration)
    if not np.any(felt):
        raise RecordError(f"{motion.name}: the ground does not move in it.")
    count = min(round(seconds * rate) + 1, len(felt))
    power = np.concatenate([[0.0], np.cumsum(felt**2)])
    begin = int(np.argmax(power[count:] - power[:-count]))
    x = displacement_of(felt[begin : begin + count], step, corner)
    return Waveform("record", corner, 0.5 * rate, record=tuple(x.tolist()), name=motion.name)


def records_at_hand(
    runs: Sequence[Measurement], names: Sequence[str], folder: Path
) -> list[GroundMotion]:
    """Return the ground motions that can be scaled: named ones, built-in ones, those of runs.

    Parameters
    ----------
    runs : of a study
    names : of records, or files
    folder : what a relative path is relative to

    Raises
    ------
    RecordError
        If a record cannot be read.
    """
    found = [read_ground_motion(name, folder) for name in dict.fromkeys((*names, *baked_in()))]
    return found + [
        GroundMotion(
            run.time - run.time[0], run["ground_acceleration"],
            f"the ground motion of {run.name}", run.source,
        )
        for run in runs
    ]  # fmt: skip

"""Peaks and RMS values of a run's outputs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

_INTERESTING = re.compile(
    r"\.(.*acceleration(_absolute)?|base_displacement|drift\d*|displacement|force|voltage"
    r"|command_raw|stroke_ratio|value)$"
)


@dataclass(frozen=True)
class Summary:
    """One output over a whole run: the largest absolute value, when it came, and the RMS."""

    name: str
    unit: str | None
    peak: float
    time_of_peak: float
    rms: float


def summarise(frame: pd.DataFrame, everything: bool = False) -> list[Summary]:
    """Return peak and RMS of the Real outputs of a run, over all of its rows.

    Parameters
    ----------
    frame : DataFrame
        Results as `bristle.run` returns them.
    everything : bool
        Every Real output; otherwise those that a run is usually judged by (accelerations,
        drifts, forces, voltages), all if there are none of these.
    """
    names = [str(name) for name in frame if frame[name].dtype.kind == "f"]
    if not everything:
        names = [name for name in names if _INTERESTING.search(name)] or names
    units, time = frame.attrs["units"], frame.index.to_numpy()
    found = []
    for name in names:
        values = frame[name].to_numpy()
        at = int(np.argmax(np.abs(values)))
        rms = float(np.sqrt(np.mean(np.square(values))))
        peak = float(abs(values[at]))
        found.append(Summary(name, units.get(name), peak, float(time[at]), rms))
    return found

"""Peaks and RMS values of a run's outputs."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
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


def reals(frame: pd.DataFrame) -> list[str]:
    """Return the names of the Real outputs of a run."""
    return [str(name) for name in frame if frame[name].dtype.kind == "f"]


def foreign(frame: pd.DataFrame) -> set[str]:
    """Return the names of a run's components that are FMU files, as the results tell."""
    scenario = tomllib.loads(frame.attrs.get("made", {}).get("scenario", ""))
    components = scenario.get("components", {})
    return {name for name, part in components.items() if str(part.get("fmu")).endswith(".fmu")}


def judged_by(frame: pd.DataFrame) -> list[str]:
    """Return the outputs that a run is judged by; each component has at least one of them."""
    others, found = foreign(frame), set()
    for component, names in by_component(reals(frame)).items():
        chosen = [name for name in names if _INTERESTING.search(name)]
        found.update(names if component in others else chosen or names)
    return [name for name in reals(frame) if name in found]


def by_component(names: Iterable[str]) -> dict[str, list[str]]:
    """Return names of outputs such as "damper.force" by their component."""
    parts: dict[str, list[str]] = {}
    for name in names:
        parts.setdefault(name.partition(".")[0], []).append(name)
    return parts


def summarise(frame: pd.DataFrame, everything: bool = False) -> list[Summary]:
    """Return peak and RMS of the Real outputs of a run, over all of its rows.

    Parameters
    ----------
    frame : DataFrame
        Results as `bristle.run` returns them.
    everything : bool
        Every Real output; otherwise of each built-in component those that a run is usually judged
        by (accelerations, drifts, forces, voltages), or all if it has none of these, and of each
        foreign FMU all.
    """
    names = reals(frame) if everything else judged_by(frame)
    units, time = frame.attrs["units"], frame.index.to_numpy()
    found = []
    for name in names:
        values = frame[name].to_numpy()
        at = int(np.argmax(np.abs(values)))
        rms = float(np.sqrt(np.mean(np.square(values))))
        peak = float(abs(values[at]))
        found.append(Summary(name, units.get(name), peak, float(time[at]), rms))
    return found

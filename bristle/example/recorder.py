"""The instruments of an example, with white noise, and the recorder that writes its files."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from pathlib import Path

import numpy as np

from .bench import Signals

SHOWN_IN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}


def instruments(runs: Mapping[str, Signals], share: float) -> dict[str, float]:
    """Return the standard deviation of each instrument's noise in SI.

    Parameters
    ----------
    runs : mapping
        The first runs of the rig, as ideal instruments show them.
    share : float
        The noise as a share of each channel's RMS over these runs [1].
    """
    first = next(iter(runs.values()))
    return {
        name: share * sqrt(np.mean([np.mean(run[name] ** 2) for run in runs.values()]))
        for name in first
        if name != "time"
    }


def recorded(run: Signals, noise: Mapping[str, float], rng: np.random.Generator) -> Signals:
    """Return a run as instruments with that noise show it; channels without one are left out."""
    shown = {name: run[name] + s * rng.standard_normal(run[name].size) for name, s in noise.items()}
    return {"time": run["time"], **shown}


def write_csv(path: Path, run: Signals) -> None:
    """Write one run as the recorder of a laboratory would: millimetres and newtons."""
    titles, columns = [], []
    for name, x in run.items():
        factor, unit = SHOWN_IN.get(_unit(name), (1.0, _unit(name)))
        titles.append(f"{name} [{unit}]")
        columns.append(factor * x)
    np.savetxt(
        path, np.stack(columns, axis=1), fmt="%.6g", delimiter=",", header=",".join(titles),
        comments="",
    )  # fmt: skip


def _unit(channel: str) -> str:
    """Return the SI unit of a channel."""
    plain = {"time": "s", "voltage": "V", "force": "N"}
    kinds = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "absolute": "m/s2"}
    return plain.get(channel) or kinds[channel.rsplit("_", 1)[-1]]

"""Runs of a building to predict: what drives it, what was measured, where it begins."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..data.labels import Labels
from ..data.measurement import Measurement
from ..identify.drive import smooth_steps
from .in_building import Shaking, shaking_of

Array = NDArray[np.float64]

REST = 0.1
"""Share of a response's peak up to which it counts as at rest when the run begins."""
BEGIN = 0.02
"""Seconds over which the begin of a run is averaged."""


@dataclass(frozen=True)
class Trial:
    """A run to predict: what drives it, what was measured, and the samples that count.

    `measured` maps a response to its values (n,) and their noise; `window` (n,) says which samples
    are judged; `noise` are standard deviations of the ground's acceleration and of the command;
    `labels` is what is known of the whole run.
    """

    shaking: Shaking
    measured: dict[str, tuple[Array, float]]
    window: NDArray[np.bool_]
    noise: tuple[float, float]
    labels: Labels = field(default_factory=dict)


def trial_of(
    run: Measurement, name: str = "", judged: tuple[float, float] = (-np.inf, np.inf)
) -> Trial:
    """Return a measurement as a run to predict.

    Parameters
    ----------
    run : with the ground's acceleration
    name : what it is called; its own name by default
    judged : times [s] between which samples are judged
    """
    shaking = replace(shaking_of(run), name=name or run.name)
    drive, left = run.drive, 0.0
    if drive:
        smooth, left = smooth_steps(run[drive], run.noise.get(drive, 0.0), run.step)
        shaking = replace(shaking, command=smooth)
    window = (run.time >= judged[0]) & (run.time <= judged[1])
    ground = run.noise.get("ground_acceleration", 0.0)
    return Trial(shaking, _measured(run), window, (ground, left), run.labels)


def _measured(run: Measurement) -> dict[str, tuple[Array, float]]:
    """Return the responses that a run shows, and drifts from the displacements beside them."""
    found = {
        name: (run[name], run.noise.get(name, 0.0))
        for name in run.channels
        if name == "force" or name.startswith("drift") or _is_response(run, name)
    }
    floors = sorted(
        int(name.removeprefix("floor").partition("_")[0])
        for name in run.channels
        if name.startswith("floor") and name.endswith("_displacement")
    )
    for floor in floors:
        below = "base_displacement" if floor == 1 else f"floor{floor - 1}_displacement"
        if f"drift{floor}" in found or not run.has(below):
            continue
        above = f"floor{floor}_displacement"
        noise = np.hypot(run.noise.get(above, 0.0), run.noise.get(below, 0.0))
        found[f"drift{floor}"] = (run[above] - run[below], float(noise))
    return found


def _is_response(run: Measurement, name: str) -> bool:
    """Return whether a channel is compared: a velocity only where it stands for a displacement."""
    if not name.startswith(("base_", "floor")):
        return False
    level, _, what = name.partition("_")
    if what == "velocity":
        return not run.has(f"{level}_displacement")
    return what in ("displacement", "acceleration_absolute")


def begins_in_motion(trial: Trial) -> str:
    """Return the displacement or velocity that is not at rest when a run begins, "" for none."""
    first = max(1, round(BEGIN / trial.shaking.spacing))
    for name, (values, noise) in trial.measured.items():
        if not name.endswith(("_displacement", "_velocity")):
            continue
        begin = abs(float(np.mean(values[:first])))
        if begin > REST * float(np.max(np.abs(values))) + 4.0 * noise / np.sqrt(first):
            return name
    return ""

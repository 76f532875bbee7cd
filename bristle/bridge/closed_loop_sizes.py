"""Peak and RMS of the responses of a run that was simulated, as sensors would show them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .closed_loop_result import KINDS
from .closed_loop_runs import Trial
from .draws import Columns

Array = NDArray[np.float64]
Key = tuple[str, str]  # a response, and "peak" or "rms"


def names_of(columns: Columns, trial: Trial) -> dict[str, str]:
    """Return the responses and the outputs that give them: those measured, else all but speeds."""
    given = {name.removeprefix("structure."): name for name in columns if _shown(name)}
    given["force"] = "damper.force"
    if not trial.measured:
        return given
    every = given | {
        name.removeprefix("structure."): name
        for name in columns
        if name.startswith("structure.") and name.endswith("_velocity")
    }
    return {name: every[name] for name in trial.measured if name in every}


def _shown(name: str) -> bool:
    of_structure = name.startswith("structure.")
    what = ("_displacement", "_acceleration_absolute")
    return of_structure and (name.endswith(what) or name.startswith("structure.drift"))


def sizes_of(
    columns: Columns,
    names: dict[str, str],
    trial: Trial,
    generator: np.random.Generator,
    count: int,
) -> dict[Key, list[float]]:
    """Return peak and RMS by response as sensors would show them, for `count` draws of noise.

    Noise adds to a peak: a model without it would seem to be too small.

    Parameters
    ----------
    columns : every output (n,) of the simulation, in SI
    names : the responses, and the outputs that give them
    trial : the run, with the noise of its sensors and the samples that count
    generator : draws the noise
    count : how many draws; 0 for none, and no noise
    """
    found: dict[Key, list[float]] = {}
    for name, port in names.items():
        values = columns[port][trial.window]
        noise = trial.measured.get(name, (None, 0.0))[1] if count else 0.0
        for _ in range(count if noise > 0.0 else 1):
            shown = values + noise * generator.standard_normal(len(values)) if noise else values
            for kind in KINDS:
                found.setdefault((name, kind), []).append(size_of(shown, kind))
    return found


def size_of(values: Array, kind: str) -> float:
    """Return the peak or the RMS of a response (n,)."""
    if kind == "peak":
        return float(np.max(np.abs(values)))
    return float(np.sqrt(np.mean(values**2)))

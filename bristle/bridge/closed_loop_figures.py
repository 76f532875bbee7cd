"""Peaks and RMS of a run that was simulated in closed loop, with draws of what is uncertain."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ..data.model import StudyModel
from ..identify.run_labels import values_of_labels
from .closed_loop_result import KINDS, Predicted
from .closed_loop_runs import Trial
from .draws import Columns, Simulator, drawn_models
from .in_building import House

Array = NDArray[np.float64]
Key = tuple[str, str]  # a response, and "peak" or "rms"

DRAWS = 20
"""Draws of the parameters for a band; with more of them it gets a little narrower."""
FEWEST = 5
"""Draws that a band needs at least."""


@dataclass(frozen=True)
class Figures:
    """Peak and RMS by response, of the model as it is and of draws (draws,) of its errors.

    `missed` is the share of the force that the model misses beyond noise: it is taken to miss as
    much of a response.
    """

    best: dict[Key, float]
    drawn: dict[Key, Array]
    stroke: float
    failed: int
    missed: float = 0.0

    def band(self, key: Key) -> tuple[float, float] | None:
        """Return the 95 % band of what would be measured, None with too few draws."""
        values = self.drawn.get(key, np.zeros(0))
        count = len(values)
        if count < FEWEST:
            return None
        wide = float(student.ppf(0.975, count - 1) * np.std(values, ddof=1))
        wide *= float(np.sqrt(1.0 + 1.0 / count))
        centre = float(np.mean(values))
        wide = float(np.hypot(wide, 1.96 * self.missed * centre))
        return max(0.0, centre - wide), centre + wide

    def rows(self, trial: Trial, then: Figures | None) -> list[Predicted]:
        """Return a row per response and kind of figure."""
        out = []
        for (name, kind), best in self.best.items():
            measured = trial.measured.get(name)
            value = None
            if measured is not None:
                value = _size(measured[0][trial.window], kind)
            bands = self.band((name, kind)), None if then is None else then.band((name, kind))
            before = None if then is None else then.best[name, kind]
            run = trial.shaking.name
            out.append(Predicted(run, name, kind, value, best, bands[0], before, bands[1]))
        return out


def figures_of(
    model: StudyModel,
    place: tuple[House, bool],
    trial: Trial,
    draws: int,
    number: int,
    missed: float = 0.0,
) -> Figures:
    """Simulate a run with a model, and with draws of the errors of model and channels.

    Parameters
    ----------
    model : the law with the effects of all sites
    place : the building, and whether the model was identified on a bench
    trial : the run
    draws : how many draws make a band; 0 for none
    number : of the run, which tells its draws from those of others
    missed : share of the force that the model misses beyond noise

    Raises
    ------
    ScenarioError, RunError
        If the model as it is cannot be simulated.
    """
    house, bench = place
    model = model.with_values(values_of_labels(model.effects, trial.labels), origin="measured")
    generator = np.random.default_rng([7, number])
    with tempfile.TemporaryDirectory() as folder:
        simulator = Simulator(model, house, bench, trial.shaking, Path(folder))
        scenario = simulator.scenario()
        columns = simulator.response(scenario)
        names = _names(columns, trial)
        sensors = np.random.default_rng([8, number])  # the same for the models before and after
        best = {
            key: float(np.mean(values))
            for key, values in _sizes(columns, names, trial, sensors, DRAWS).items()
        }
        collected: dict[Key, list[float]] = {key: [] for key in best}
        failed = 0
        models = drawn_models(model, draws, generator) if draws else []
        for one in simulator.with_errors(scenario, models, trial.noise, generator):
            if one is None:
                failed += 1
                continue
            for key, values in _sizes(one, names, trial, generator, 1).items():
                collected[key] += values
    level = house.building.levels()[0]
    stroke = float(np.max(np.abs(columns[f"structure.{level}_displacement"])))
    drawn = {key: np.array(values) for key, values in collected.items()}
    return Figures(best, drawn, stroke, failed, missed)


def _names(columns: Columns, trial: Trial) -> dict[str, str]:
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


def _sizes(
    columns: Columns,
    names: dict[str, str],
    trial: Trial,
    generator: np.random.Generator,
    count: int,
) -> dict[Key, list[float]]:
    """Return peak and RMS by response as sensors would show them, for `count` draws of noise.

    Noise adds to a peak: a model without it would seem to be too small.
    """
    found: dict[Key, list[float]] = {}
    for name, port in names.items():
        values = columns[port][trial.window]
        noise = trial.measured.get(name, (None, 0.0))[1]
        for _ in range(count if noise > 0.0 else 1):
            shown = values + noise * generator.standard_normal(len(values)) if noise else values
            for kind in KINDS:
                found.setdefault((name, kind), []).append(_size(shown, kind))
    return found


def _size(values: Array, kind: str) -> float:
    """Return the peak or the RMS of a response (n,)."""
    if kind == "peak":
        return float(np.max(np.abs(values)))
    return float(np.sqrt(np.mean(values**2)))

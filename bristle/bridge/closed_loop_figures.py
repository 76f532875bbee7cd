"""Peaks and RMS of a run that was simulated in closed loop, with draws of what is uncertain."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ..data.model import StudyModel
from ..data.model_draws import drawn_models
from ..data.open_effects import OpenEffect, reach
from ..identify.run_labels import values_of_labels
from .closed_loop_result import MISSED, PARAMETERS, Predicted
from .closed_loop_runs import Trial
from .closed_loop_sizes import Key, names_of, size_of, sizes_of
from .draws import Simulator
from .in_building import House, studied_ports
from .left_open import Left, changes_left_open

Array = NDArray[np.float64]

DRAWS = 20
"""Draws of the parameters for a band; with more of them it gets a little narrower."""
FEWEST = 5
"""Draws that a band needs at least."""


@dataclass(frozen=True)
class Figures:
    """Peak and RMS by response, of the model as it is and of draws (draws,) of its errors.

    `missed` is the share of the force that the model misses beyond noise: it is taken to miss as
    much of a response. `left` are the changes by effects that the runs do not exclude, `lost` says
    of others of them why they cannot be simulated.
    """

    best: dict[Key, float]
    drawn: dict[Key, Array]
    stroke: float
    failed: int
    missed: float = 0.0
    left: Left = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)

    def band(self, key: Key) -> tuple[float, float] | None:
        """Return the 95 % band of what would be measured, None with too few draws."""
        if len(self.drawn.get(key, ())) < FEWEST:
            return None
        centre = float(np.mean(self.drawn[key]))
        below, above = (
            float(np.sqrt(sum(ends[side] ** 2 for ends in self._ends(key).values())))
            for side in (0, 1)
        )
        return max(0.0, centre - below), centre + above

    def parts(self, key: Key) -> dict[str, float]:
        """Return which share of a band's variance is from what, the largest first; none without."""
        if len(self.drawn.get(key, ())) < FEWEST:
            return {}
        power = {name: below**2 + above**2 for name, (below, above) in self._ends(key).items()}
        whole = sum(power.values())
        order = sorted((name for name in power if power[name] > 0.0), key=lambda n: -power[n])
        return {name: power[name] / whole for name in order}

    def _ends(self, key: Key) -> dict[str, tuple[float, float]]:
        """Return by cause how far the band reaches below and above its centre."""
        values = self.drawn[key]
        count, centre = len(values), float(np.mean(values))
        wide = float(student.ppf(0.975, count - 1) * np.std(values, ddof=1))
        wide *= float(np.sqrt(1.0 + 1.0 / count))
        misses = 1.96 * self.missed * centre
        ends = {PARAMETERS: (wide, wide), MISSED: (misses, misses)}
        return ends | {name: reach(changes[key]) for name, changes in self.left.items()}

    def rows(self, trial: Trial, then: Figures | None) -> list[Predicted]:
        """Return a row per response and kind of figure."""
        out = []
        for (name, kind), best in self.best.items():
            measured = trial.measured.get(name)
            value = None
            if measured is not None:
                value = size_of(measured[0][trial.window], kind)
            bands = self.band((name, kind)), None if then is None else then.band((name, kind))
            before = None if then is None else then.best[name, kind]
            run = trial.shaking.name
            parts = self.parts((name, kind)) if self.left else {}
            out.append(Predicted(run, name, kind, value, best, bands[0], before, bands[1], parts))
        return out


def figures_of(
    model: StudyModel,
    place: tuple[House, bool],
    trial: Trial,
    draws: int,
    number: int,
    missed: float = 0.0,
    effects: Sequence[OpenEffect] = (),
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
    effects : that the model's runs do not exclude, for a band that has them, too

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
        names = names_of(columns, trial)
        sensors = np.random.default_rng([8, number])  # the same for the models before and after
        best = {
            key: float(np.mean(values))
            for key, values in sizes_of(columns, names, trial, sensors, DRAWS).items()
        }
        collected: dict[Key, list[float]] = {key: [] for key in best}
        failed = 0
        models = drawn_models(model, draws, generator) if draws else []
        for one in simulator.with_errors(scenario, models, trial.noise, generator):
            if one is None:
                failed += 1
                continue
            for key, values in sizes_of(one, names, trial, generator, 1).items():
                collected[key] += values
    changes, lost = (
        ({}, {}) if not effects else changes_left_open(model, place, trial, effects, number)
    )
    across = studied_ports(house.building).displacement
    stroke = float(np.max(np.abs(columns[f"structure.{across}"])))
    drawn = {key: np.array(values) for key, values in collected.items()}
    return Figures(best, drawn, stroke, failed, missed, changes, lost)

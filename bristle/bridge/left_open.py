"""What effects that the runs do not exclude would change of a building's responses.

One effect at a time joins draws of the model, so that its part of a band is known.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data.model import StudyModel
from ..data.model_draws import drawn_models
from ..data.open_effects import OpenEffect, in_short, simulated_whole
from ..errors import PhysicsError, RunError, ScenarioError
from ..progress import tell
from .closed_loop_runs import Trial
from .closed_loop_sizes import Key, names_of, sizes_of
from .draws import Simulator
from .in_building import House

Array = NDArray[np.float64]
Left = dict[str, dict[Key, Array]]
"""By effect and figure, the changes (n,) by draws of its size."""

SIZES = 6
"""Sizes of an effect that are drawn, each in a draw of the model's parameters."""


def changes_left_open(
    model: StudyModel,
    place: tuple[House, bool],
    trial: Trial,
    effects: Sequence[OpenEffect],
    number: int,
) -> tuple[Left, dict[str, str]]:
    """Return what effects would change of peaks and RMS, by their labels.

    An effect with which the building cannot be simulated at one of its sizes has no changes: why
    comes second.

    Parameters
    ----------
    model : the law with the effects of all sites, whose parameters are drawn
    place : the building, and whether the model was identified on a bench
    trial : the run
    effects : that the model's runs do not exclude
    number : of the run, which tells its draws from those of others
    """
    models = drawn_models(model, SIZES, np.random.default_rng([9, number]))
    without = _figures(model, models, place, trial)
    tried: dict[str, list[dict[Key, float] | str]] = {}
    for k, effect in enumerate(effects, 1):
        tell(
            f"simulating {trial.shaking.name} with what its limits leave open: {effect.label} "
            f"({k} of {len(effects)})"
        )
        joined = [
            effect.joined(one, part) for one, part in zip(models, effect.parts(SIZES), strict=True)
        ]
        tried[effect.label] = [
            other if isinstance(other, str) else {key: other[key] - plain[key] for key in plain}
            for plain, other in zip(without, _tried(joined, place, trial), strict=True)
            if not isinstance(plain, str)
        ]
    whole, lost = simulated_whole(tried)
    return {
        label: {key: np.array([one[key] for one in draws]) for key in draws[0]}
        for label, draws in whole.items()
    }, lost


def _tried(
    models: list[StudyModel], place: tuple[House, bool], trial: Trial
) -> list[dict[Key, float] | str]:
    """Return the figures of models, or why they cannot be simulated."""
    try:
        return _figures(models[-1], models, place, trial)
    except (PhysicsError, RunError, ScenarioError) as error:
        return [in_short(error)] * len(models)


def _figures(
    model: StudyModel, models: list[StudyModel], place: tuple[House, bool], trial: Trial
) -> list[dict[Key, float] | str]:
    """Return peaks and RMS of models without noise, or why not, under a run's ground motion.

    Parameters
    ----------
    model : one that has the effects of the others
    models : with other values
    place, trial : as in `changes_left_open`
    """
    house, bench = place
    quiet = np.random.default_rng(0)  # it draws nothing
    with tempfile.TemporaryDirectory() as folder:
        simulator = Simulator(model, house, bench, trial.shaking, Path(folder))
        scenario = simulator.scenario()
        found: list[dict[Key, float] | str] = []
        for columns in simulator.without_noise(scenario, models):
            if isinstance(columns, RunError):
                found.append(in_short(columns))
                continue
            sizes = sizes_of(columns, names_of(columns, trial), trial, quiet, 0)
            found.append({key: values[0] for key, values in sizes.items()})
        return found

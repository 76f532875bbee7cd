"""Bands of a prediction, by draws of model, noise and effects that are not excluded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np
from scipy.stats import t as student

from ..campaign.campaign import Campaign, Variation
from ..core.arrays import Array
from ..core.progress import tell
from ..engine.coupled import Coupled
from ..engine.results import RunTable, statistic_of
from ..engine.run import left_data
from ..errors import PhysicsError, RunError, ScenarioError
from ..fmu.description import Value
from ..identification.problem import values_of_labels
from ..model.draws import OpenEffect, drawn_models, in_short, reach, simulated_whole
from ..model.model import Model
from ..physics.drive import VOLTAGE
from ..physics.forms import shown_law
from ..system.from_model import Parameters, source_of, values_of
from ..system.model import Signal
from .closed_loop_result import KINDS, MISSED, PARAMETERS, Predicted
from .excitation import PredictedRun
from .model_system import (
    BuildingWithFile,
    Excitation,
    building_system,
    loads,
    signals_of,
    studied_ports,
)

# A model's damper in a building, simulated as it is and with draws of what is uncertain.

Columns = Mapping[str, Array]


@dataclass(frozen=True)
class Simulator:
    """A model's damper in a building, under one ground motion.

    Parameters
    ----------
    model : Model
        The law with the effects of all sites.
    house : BuildingWithFile
    bench : bool
        Whether the model was identified on a bench.
    shaking : Excitation
        A built-in damper calls its command a voltage, whatever it is: its numbers are the same.
    known : mapping
        The range of the model's data, see `reach.told_range`; empty: it is not known.
    """

    model: Model
    house: BuildingWithFile
    bench: bool
    shaking: Excitation
    known: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def campaign(self) -> Campaign:
        """The model as it is, whose values are varied."""
        own = loads(self.model, self.house.building, self.bench)
        title = f"{shown_law(self.model.law)} in {self.house.building.name}"
        quiet = replace(self.shaking, force=None, drive=VOLTAGE)
        system = building_system(title, self.house, quiet, own, self._damper)
        return Campaign(system, Coupled())

    def response(self, values: Mapping[str, Value | Signal]) -> dict[str, Array]:
        """Return every output (n,) with these values, at the samples of the ground motion, SI."""
        return self.shown(self.rows(values))

    def rows(self, values: Mapping[str, Value | Signal]) -> RunTable:
        """Return every output at every step with these values."""
        table = self.campaign.run(Variation(values)).table
        assert table is not None
        return table

    def shown(self, table: RunTable) -> dict[str, Array]:
        """Return what rows hold at the samples of the ground motion."""
        return {name: column[:: self.shaking.fine] for name, column in table.values.items()}

    def with_errors(
        self, models: list[Model], noise: tuple[float, float], generator: np.random.Generator
    ) -> Iterator[dict[str, Array] | RunError]:
        """Yield the responses of other values, with noise on ground and command, or why not.

        Parameters
        ----------
        models : the model with other values
        noise : standard deviations of the ground's acceleration [m/s2] and the command
        generator : draws the noise
        """
        shaking, count = self.shaking, len(self.shaking.time)
        for model in models:
            ground = shaking.ground + noise[0] * generator.standard_normal(count)
            command = shaking.command
            if command is not None:
                command = command + noise[1] * generator.standard_normal()
            moved = replace(shaking, ground=ground, command=command, drive=VOLTAGE)
            yield self.tried({**signals_of(moved), **self.values(model)})

    def tried(self, values: Mapping[str, Value | Signal]) -> dict[str, Array] | RunError:
        """Return the response with these values, or why there is none."""
        try:
            return self.response(values)
        except RunError as error:
            return error

    def values(self, model: Model) -> dict[str, Value]:
        """Return the values of a model that differs in them alone, by names of the system."""
        own = loads(model, self.house.building, self.bench)
        # A mass that is drawn as zero is in no load, and must not stay what it is in the system.
        structure = {"attached_mass": 0.0, **own.structure}
        damper = {**values_of(model.at("damper", self.bench)), **own.damper}
        given = {"structure": structure, "damper": damper}
        return {f"{part}.{name}": x for part, values in given.items() for name, x in values.items()}

    def _damper(self, moving: Parameters) -> dict[str, Any]:
        """Return the table of the damper."""
        most = float(
            np.max(self.shaking.level if self.shaking.command is None else self.shaking.command)
        )
        limit = {VOLTAGE.limit: float(ceil(1.05 * most))} if most > VOLTAGE.largest else {}
        damper = self.model.at("damper", self.bench)
        values = {**values_of(damper), **self.known, **limit, **moving}
        return {**source_of(damper), "parameters": values}


# Peak and RMS of the responses of a run that was simulated, as sensors would show them.

Key = tuple[str, str]  # a response, and "peak" or "rms"


def names_of(columns: Columns, trial: PredictedRun) -> dict[str, str]:
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
    trial: PredictedRun,
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
                found.setdefault((name, kind), []).append(statistic_of(shown, kind))
    return found


# What effects that the runs do not exclude would change of a building's responses.
#
# One effect at a time joins draws of the model, so that its part of a band is known.

Left = dict[str, dict[Key, Array]]
"""By effect and figure, the changes (n,) by draws of its size."""

SIZES = 6
"""Sizes of an effect that are drawn, each in a draw of the model's parameters."""


def changes_not_excluded(
    model: Model,
    place: tuple[BuildingWithFile, bool],
    trial: PredictedRun,
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
    models: list[Model], place: tuple[BuildingWithFile, bool], trial: PredictedRun
) -> list[dict[Key, float] | str]:
    """Return the figures of models, or why they cannot be simulated."""
    try:
        return _figures(models[-1], models, place, trial)
    except (PhysicsError, RunError, ScenarioError) as error:
        return [in_short(error)] * len(models)


def _figures(
    model: Model,
    models: list[Model],
    place: tuple[BuildingWithFile, bool],
    trial: PredictedRun,
) -> list[dict[Key, float] | str]:
    """Return peaks and RMS of models without noise, or why not, under a run's ground motion.

    Parameters
    ----------
    model : one that has the effects of the others
    models : with other values
    place, trial : as in `changes_not_excluded`
    """
    house, bench = place
    quiet = np.random.default_rng(0)  # it draws nothing
    found: list[dict[Key, float] | str] = []
    simulator = Simulator(model, house, bench, trial.shaking)
    for one in models:
        columns = simulator.tried(simulator.values(one))
        if isinstance(columns, RunError):
            found.append(in_short(columns))
            continue
        sizes = sizes_of(columns, names_of(columns, trial), trial, quiet, 0)
        found.append({key: values[0] for key, values in sizes.items()})
    return found


DRAWS = 20
"""Draws of the parameters for a band; with more of them it gets a little narrower."""
FEWEST = 5
"""Draws that a band needs at least."""


@dataclass(frozen=True)
class Figures:
    """Peak and RMS by response, of the model as it is and of draws (draws,) of its errors.

    `missed` is the share of the force that the model misses beyond noise: it is taken to miss as
    much of a response. `left` are the changes by effects that the runs do not exclude, `lost` says
    of others of them why they cannot be simulated; `outside` by how much the damper leaves the data
    that the model is from, "" where it does not.
    """

    best: dict[Key, float]
    drawn: dict[Key, Array]
    stroke: float
    failed: int
    missed: float = 0.0
    left: Left = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    outside: str = ""

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

    def rows(self, trial: PredictedRun, then: Figures | None) -> list[Predicted]:
        """Return a row per response and kind of figure."""
        out = []
        for (name, kind), best in self.best.items():
            measured = trial.measured.get(name)
            value = None
            if measured is not None:
                value = statistic_of(measured[0][trial.window], kind)
            before = None if then is None else then.best[name, kind]
            run = trial.shaking.name
            parts = self.parts((name, kind)) if self.left else {}
            out.append(
                Predicted(run, name, kind, value, best, self.band((name, kind)), before, parts)
            )
        return out


def figures_of(
    model: Model,
    place: tuple[BuildingWithFile, bool],
    trial: PredictedRun,
    draws: int,
    number: int,
    missed: float = 0.0,
    effects: Sequence[OpenEffect] = (),
    known: Mapping[str, float] | None = None,
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
    known : the range of the model's data, see `reach.told_range`

    Raises
    ------
    ScenarioError, RunError
        If the model as it is cannot be simulated.
    """
    house, bench = place
    model = model.with_values(values_of_labels(model.effects, trial.labels), origin="measured")
    generator = np.random.default_rng([7, number])
    simulator = Simulator(model, house, bench, trial.shaking, known or {})
    table = simulator.rows({})
    outside, columns = left_data(simulator.campaign.system, "damper", table), simulator.shown(table)
    names = names_of(columns, trial)
    sensors = np.random.default_rng([8, number])  # the same for the models before and after
    best = {
        key: float(np.mean(values))
        for key, values in sizes_of(columns, names, trial, sensors, DRAWS).items()
    }
    collected: dict[Key, list[float]] = {key: [] for key in best}
    failed = 0
    models = drawn_models(model, draws, generator) if draws else []
    for one in simulator.with_errors(models, trial.noise, generator):
        if isinstance(one, RunError):
            failed += 1
            continue
        for key, values in sizes_of(one, names, trial, generator, 1).items():
            collected[key] += values
    changes, lost = (
        ({}, {}) if not effects else changes_not_excluded(model, place, trial, effects, number)
    )
    across = studied_ports(house.building).displacement
    stroke = float(np.max(np.abs(columns[f"structure.{across}"])))
    drawn = {key: np.array(values) for key, values in collected.items()}
    return Figures(best, drawn, stroke, failed, missed, changes, lost, outside)

"""A model's damper in a building, simulated as it is and with draws of what is uncertain."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data.model import StudyModel
from ..errors import RunError
from ..physics.drive import VOLTAGE
from ..physics.forms import shown_law
from ..scenario.model_parts import Parameters, source_of, values_of
from ..scenario.scenario import Scenario, load_scenario
from ..simulate.coupled import simulate
from .in_building import House, Shaking, loads, write_scenario, write_signals
from .scenario_files import part_text

Array = NDArray[np.float64]
Columns = Mapping[str, Array]


@dataclass(frozen=True)
class Simulator:
    """A model's damper in a building, under one ground motion.

    Parameters
    ----------
    model : StudyModel
        The law with the effects of all sites.
    house : House
    bench : bool
        Whether the model was identified on a bench.
    shaking : Shaking
        A built-in damper calls its command a voltage, whatever it is: its numbers are the same.
    folder : Path
        An empty folder for the scenario's files.
    """

    model: StudyModel
    house: House
    bench: bool
    shaking: Shaking
    folder: Path

    def scenario(self) -> Scenario:
        """Write the scenario of the model as it is; return it."""
        own = loads(self.model, self.house.building, self.bench)
        title = f"{shown_law(self.model.law)} in {self.house.building.name}"
        quiet = replace(self.shaking, force=None, drive=VOLTAGE)
        file, _ = write_scenario(
            self.folder, (title, "# The model's damper in the building."), self.house, quiet,
            own, self._damper,
        )  # fmt: skip
        return load_scenario(file)

    def response(self, scenario: Scenario) -> dict[str, Array]:
        """Return every output (n,) at the samples of the ground motion, in SI."""
        columns = simulate(scenario)
        return {name: values[:: self.shaking.fine] for name, values in columns.items()}

    def with_errors(
        self, scenario: Scenario, models: list[StudyModel], noise: tuple[float, float],
        generator: np.random.Generator,
    ) -> Iterator[dict[str, Array] | None]:  # fmt: skip
        """Yield the responses of other values, with noise on ground and command.

        Parameters
        ----------
        scenario : what `scenario` has returned
        models : the model with other values
        noise : standard deviations of the ground's acceleration [m/s2] and the command
        generator : draws the noise

        Yields
        ------
        dict or None
            As `response`; None where the run failed.
        """
        shaking, count = self.shaking, len(self.shaking.time)
        for model in models:
            ground = shaking.ground + noise[0] * generator.standard_normal(count)
            command = shaking.command
            if command is not None:
                command = command + noise[1] * generator.standard_normal()
            write_signals(
                self.folder, replace(shaking, ground=ground, command=command, drive=VOLTAGE)
            )
            try:
                yield self.response(self._with_values(scenario, model))
            except RunError:
                yield None
        write_signals(self.folder, replace(shaking, drive=VOLTAGE))

    def without_noise(
        self, scenario: Scenario, models: list[StudyModel]
    ) -> Iterator[dict[str, Array] | RunError]:
        """Yield the responses of other values under the ground motion as it is, or why not.

        Parameters
        ----------
        scenario : what `scenario` has returned
        models : the model with other values
        """
        for model in models:
            try:
                yield self.response(self._with_values(scenario, model))
            except RunError as error:
                yield error

    def _with_values(self, scenario: Scenario, model: StudyModel) -> Scenario:
        own = loads(model, self.house.building, self.bench)
        # A mass that is drawn as zero is in no load, and must not stay what it is in the scenario.
        structure = {"attached_mass": 0.0, **own.structure}
        given = {
            "structure": structure,
            "damper": {**values_of(model.at("damper", self.bench)), **own.damper},
        }
        parts = [
            replace(one, parameters={**one.parameters, **given.get(one.name, {})})
            for one in scenario.components
        ]
        return replace(scenario, components=tuple(parts))

    def _damper(self, moving: Parameters) -> str:
        """Return the text of the damper."""
        most = float(
            np.max(self.shaking.level if self.shaking.command is None else self.shaking.command)
        )
        limit = {VOLTAGE.limit: float(ceil(1.05 * most))} if most > VOLTAGE.largest else {}
        damper = self.model.at("damper", self.bench)
        return part_text("damper", source_of(damper), {**values_of(damper), **limit, **moving})

"""A system as plain data: values and signals in place of its own, saved and read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.engine.coupled import Coupled
from bristle.errors import PhysicsError, ScenarioError
from bristle.system.model import Signal
from bristle.system.scenario import load_scenario
from bristle.system.toml import save

TIME = np.arange(0.0, 0.5, 0.01)
QUAKE = Signal(TIME, np.sin(9.0 * TIME), "m/s2", "acceleration")


def test_a_signal_gives_the_rows_of_its_file(tmp_path: Path) -> None:
    stock = load_scenario("half_sine_pulse", {"run.stop": 0.5})
    shaken = stock.with_values({"ground.file": QUAKE, "damper.sigma_a": 700.0})
    file, signal = save(shaken, tmp_path / "shaken.toml")
    assert signal == tmp_path / "ground.csv"
    played, read = Coupled().run(shaken), Coupled().run(load_scenario(file))
    assert played.values.keys() == read.values.keys()
    for name, column in played.values.items():
        np.testing.assert_array_equal(column, read[name], name)
    assert not np.array_equal(played["damper.force"], Coupled().run(stock)["damper.force"])


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"nowhere.k": 1.0}, "no such component"),
        ({"damper.k": 1.0}, "no such parameter"),
        ({"damper.sigma_a": "stiff"}, "not a number"),
        ({"damper.sigma_a": QUAKE}, "plays no signal"),
        ({"structure.building.masses.9": 1.0}, "'9' is not there"),
    ],
)
def test_what_does_not_fit_is_refused(values: dict[str, float | str | Signal], words: str) -> None:
    with pytest.raises((ScenarioError, PhysicsError), match=words):
        load_scenario("half_sine_pulse").with_values(values)

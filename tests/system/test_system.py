"""A system as plain data: values and signals in place of its own, saved and read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bristle.campaign.campaign import Campaign, Statistic, Variation
from bristle.engine.cosimulation import Cosimulation, ignore
from bristle.engine.coupled import Coupled
from bristle.engine.instance import Instance, Message
from bristle.errors import PhysicsError, ScenarioError
from bristle.system.model import Signal
from bristle.system.scenario import load_scenario, make_system
from bristle.system.ssp_write import export_ssp
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


def test_an_output_is_not_set() -> None:
    with pytest.raises(ScenarioError, match="only parameters and inputs"):
        load_scenario("half_sine_pulse").with_values({"damper.force": 1.0})


@pytest.mark.parametrize(
    ("time", "values", "words"),
    [
        ([0.0, 1.0], [0.0, np.nan], "not finite"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], "shape"),
        ([0.0, 0.0], [0.0, 1.0], "do not rise"),
        ([-1.0, 0.0], [0.0, 1.0], "do not rise"),
    ],
)
def test_a_signal_that_no_file_could_hold_is_refused(
    time: list[float], values: list[float], words: str
) -> None:
    with pytest.raises(PhysicsError, match=words):
        Signal(np.array(time), np.array(values), "V")


def test_values_in_place_of_the_file_s_outlast_overrides() -> None:
    changed = load_scenario("half_sine_pulse").with_values(
        {"ground.file": QUAKE, "damper.sigma_a": 700.0, "structure.building.masses.0": 50.0}
    )
    again = load_scenario(changed, {"run.stop": 0.5})
    assert again.stop == 0.5
    assert again.components["ground"].signal is QUAKE
    assert again.components["damper"].values["sigma_a"] == 700.0
    assert again.components["structure"].building == changed.components["structure"].building
    other = load_scenario(changed, {"components.damper.parameters.sigma_a": 800.0})
    assert other.components["damper"].values["sigma_a"] == 800.0


def test_a_file_takes_the_place_of_a_signal() -> None:
    shaken = load_scenario("half_sine_pulse").with_values({"ground.file": QUAKE})
    ground = shaken.with_values({"ground.file": "other.csv"}).components["ground"]
    assert ground.signal is None
    assert ground.values["file"] == "other.csv"


def test_two_signals_of_one_name_are_two_files(tmp_path: Path) -> None:
    tables = {
        name: {"fmu": "SignalSource", "parameters": {"kind": "csv", "file": signal}}
        for name, signal in (
            (name, Signal(TIME, np.full(len(TIME), level), "V", "voltage", "voltage"))
            for name, level in (("low", 1.0), ("high", 2.0))
        )
    }
    two = make_system("two", {"stop": 0.1, "step": 0.01}, tables, {})
    file, *signals = save(two, tmp_path / "two.toml")
    assert len(set(signals)) == 2
    table = Coupled().run(load_scenario(file))
    assert (table["low.value"][0], table["high.value"][0]) == (1.0, 2.0)


def test_a_changed_building_is_saved_and_read_again(tmp_path: Path) -> None:
    changed = load_scenario("half_sine_pulse", {"run.stop": 0.2}).with_values(
        {"structure.building.masses.0": 50.0}
    )
    file, building = save(changed, tmp_path / "changed.toml")
    assert building == tmp_path / "structure_building.toml"
    one, other = Coupled().run(changed), Coupled().run(load_scenario(file))
    for name, column in one.values.items():
        np.testing.assert_array_equal(column, other[name], name)


def test_a_record_of_the_library_goes_by_its_name_beside_a_file_of_that_name(
    tmp_path: Path,
) -> None:
    file = tmp_path / "own.toml"
    save(load_scenario("no_damper"), file)
    record = load_scenario(file).components["ground"].values["record"]
    (tmp_path / str(record)).write_text("no record", encoding="utf-8")
    assert load_scenario(file).components["ground"].values["record"] == record


def test_a_name_too_long_for_a_file_is_no_file() -> None:
    long = 300 * "a"
    loaded = load_scenario("half_sine_pulse", {"ground.kind": "sine", "ground.file": long})
    assert loaded.components["ground"].values["file"] == long


def test_a_signal_is_packed_into_its_fmu(tmp_path: Path) -> None:
    shaken = load_scenario("half_sine_pulse", {"run.stop": 0.2}).with_values({"ground.file": QUAKE})
    export_ssp(shaken, tmp_path / "shaken.ssp")
    packed = Cosimulation(listen=ignore).run(load_scenario(tmp_path / "shaken.ssp"))
    name = "ground.value"
    np.testing.assert_allclose(packed[name], Coupled().run(shaken)[name], atol=1e-12)


def test_what_an_fmu_says_at_every_step_is_shown_once_a_run(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def talks(self: Instance) -> None:
        finished(self)
        for _ in range(3):
            self._listen(Message(self.name, "Warning", "the oil is hot"))

    finished = Instance.finish_initialisation
    monkeypatch.setattr(Instance, "finish_initialisation", talks)
    system = load_scenario("no_damper", {"run.stop": 0.01})
    for _ in range(2):
        Cosimulation().run(system)
    assert [record.message for record in caplog.records].count("ground: the oil is hot") == 2


def test_a_campaign_of_another_system_knows_no_run_of_the_first() -> None:
    system = load_scenario("half_sine_pulse", {"run.stop": 0.2})
    peak = (Statistic("damper.force", "peak", "N"),)
    first = Campaign(system, Coupled(), peak)
    found = first.run(Variation({})).numbers
    other = replace(first, system=system.with_values({"damper.sigma_a": 1e3}))
    assert other.runs == 0
    assert other.run(Variation({})).numbers != found

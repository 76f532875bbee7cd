"""`controller = FILE` of a component: the design that a run uses, and its building."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.component.controller_file import Controller, building_digest, read_controller
from bristle.data.building_file import read_building
from bristle.engine.run import run
from bristle.errors import ScenarioError
from bristle.physics.building import paper_building
from bristle.system.scenario import check_scenario, load_scenario, stock_scenarios
from bristle.system.toml import scenario_text

FROZEN = Path(__file__).parents[1] / "reference" / "controllers"
STOCK = next(path for path in stock_scenarios() if path.stem == "el_centro_0p6g_lpv")
OTHER_BUILDING = "schema = 1\nmasses = [2.0, 1.0, 1.0]\nstiffnesses = [1e3, 2e3, 2e3]\n"


def constant(volts: float) -> Controller:
    """Return an LPV controller that asks for the signed voltage w = (volts/y) y one sample late."""
    return Controller(
        kind="lpv", title="gain", n=1, rows=1, v_top=0.0, sample_period=0.004, A=[0.0], B=[1.0],
        W=[0.0], C=[volts], facts={"building": "paper"}, design={},
        building=building_digest(paper_building()),
    )  # fmt: skip


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """Return the file of the LPV scenario with a controller file beside it."""
    constant(2.0).save(tmp_path / "mine.json")
    text = STOCK.read_text(encoding="utf-8")
    changed = text.replace('fmu = "Lpv"', 'fmu = "Lpv"\ncontroller = "mine.json"')
    path = tmp_path / "scenario.toml"
    path.write_text(changed.replace("anti_windup = 200.0", "anti_windup = 0.0"), encoding="utf-8")
    return path


def building(folder: Path, text: str = OTHER_BUILDING) -> Path:
    path = folder / "other.toml"
    path.write_text(text + "damping_ratio = 0.01\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("engine", ["fmu", "compiled"])
def test_both_engines_run_the_controller_of_the_file(scenario: Path, engine: str) -> None:
    frame = run(scenario, {"run.stop": 3.0, "run.step": 0.002}, engine=engine)
    y = frame["structure.floor2_acceleration_absolute"].to_numpy()
    raw = frame["controller.command_raw"].to_numpy()
    # The file's law in the file's sample period: u_k = 2 y_(k-1), held over 4 ms.
    assert raw[4::2] == pytest.approx(2.0 * y[2:-1:2], rel=1e-9, abs=1e-12)
    assert np.array_equal(raw[2:-1:2], raw[3::2])


def test_a_frozen_design_in_a_file_is_the_table_with_more_rows(scenario: Path) -> None:
    file = FROZEN / "lpv.json"
    overrides = {"controller.controller": str(file), "controller.anti_windup": 200.0}
    frame = run(scenario, {**overrides, "run.stop": 31.18}, engine="compiled")
    peak = frame["structure.floor2_acceleration_absolute"].abs().max()
    assert peak == pytest.approx(6.353, rel=2e-3)


def test_the_text_of_a_scenario_keeps_the_controller(scenario: Path, tmp_path: Path) -> None:
    loaded = load_scenario(scenario)
    assert loaded.components["controller"].controller == tmp_path / "mine.json"
    again = tmp_path / "elsewhere" / "again.toml"
    again.parent.mkdir()
    again.write_text(scenario_text(loaded), encoding="utf-8")
    ours = load_scenario(again).components["controller"]
    assert (ours.kind, ours.controller) == ("Lpv", tmp_path / "mine.json")


def test_the_sample_period_is_the_files_and_cannot_be_set(scenario: Path) -> None:
    period = load_scenario(scenario).components["controller"].description.variables["sample_period"]
    assert period.start == period.minimum == period.maximum == 0.004
    with pytest.raises(ScenarioError, match="sample_period"):
        load_scenario(scenario, {"controller.sample_period": 0.002})


def line_of(path: Path, text: str) -> int:
    lines = path.read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


def edited(path: Path) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**content, "C": [9.0]}), encoding="utf-8")


def not_a_number(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"C":[2.0]', '"C":[NaN]'), encoding="utf-8")


def another_kind(path: Path) -> None:
    path.write_bytes((FROZEN / "hinf.json").read_bytes())


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (edited, "does not match its digest"),
        (not_a_number, "finite"),
        (another_kind, "takes 'lpv'"),
        (Path.unlink, 'there is no file "mine.json"'),
    ],
)
def test_a_spoilt_file_is_one_mistake_at_its_line_and_exit_code_2(
    scenario: Path, spoil, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil(scenario.parent / "mine.json")
    errors = [found for found in check_scenario(scenario) if found.level == "error"]
    assert [found.line for found in errors] == [line_of(scenario, "mine.json")]
    assert words in errors[0].text
    assert main(["run", str(scenario), "--engine", "compiled"]) == 2
    assert words in capsys.readouterr().err


def test_a_controller_of_another_building_is_refused(scenario: Path, tmp_path: Path) -> None:
    overrides = {"structure.building": str(building(tmp_path))}
    with pytest.raises(ScenarioError, match="designed for the building 'paper'") as caught:
        load_scenario(scenario, overrides)
    assert f":{line_of(scenario, 'mine.json')}:" in str(caught.value)


def test_so_is_the_design_that_a_component_carries(tmp_path: Path) -> None:
    overrides = {"structure.building": str(building(tmp_path))}
    with pytest.raises(ScenarioError, match="the design that Lpv carries: designed for"):
        load_scenario(STOCK, overrides)


def test_a_controller_for_that_building_is_taken(scenario: Path, tmp_path: Path) -> None:
    file = building(tmp_path)
    own = constant(1.0)._replace(building=building_digest(read_building(file)))
    own.save(tmp_path / "own.json")
    overrides = {"structure.building": str(file), "controller.controller": "own.json"}
    frame = run(scenario, {**overrides, "run.stop": 1.0}, engine="compiled")
    assert frame["controller.voltage"].max() > 0.0


def test_the_building_is_that_behind_the_sensors(scenario: Path, tmp_path: Path) -> None:
    text = scenario.read_text(encoding="utf-8")
    text = text.replace(
        '"controller.floor_acceleration" = "structure.floor2_acceleration_absolute"',
        '"controller.floor_acceleration" = "sensors.floor_acceleration_measured"\n'
        '"sensors.floor_acceleration" = "structure.floor2_acceleration_absolute"\n'
        '"sensors.base_displacement" = "structure.base_displacement"\n'
        '"sensors.base_velocity" = "structure.base_velocity"\n'
        '"sensors.damper_force" = "damper.force"',
    ).replace("[components.controller]", '[components.sensors]\nfmu = "Sensors"\n\n'
              "[components.controller]")  # fmt: skip
    scenario.write_text(text, encoding="utf-8")
    load_scenario(scenario)
    with pytest.raises(ScenarioError, match="designed for the building"):
        load_scenario(scenario, {"structure.building": str(building(tmp_path))})


@pytest.mark.parametrize("fmu", ["Skyhook", "ConstantVoltage"])
def test_only_designed_controllers_take_a_file(scenario: Path, fmu: str) -> None:
    with pytest.raises(ScenarioError, match=f"not {fmu}"):
        load_scenario(scenario, {"controller.fmu": fmu})


def test_a_controller_that_is_no_text_is_a_mistake(scenario: Path) -> None:
    with pytest.raises(ScenarioError, match=r"controller is 3: expected a text"):
        load_scenario(scenario, {"controller.controller": 3})


@pytest.mark.parametrize(
    ("component", "name", "value", "words"),
    [
        ("hinf", "inverse", "maxwell", "lugre, bingham"),
        ("hinf", "velocity", "smooth", "direct, filtered"),
        ("lpv", "velocity", "Direct", "direct, filtered"),
    ],
)
def test_texts_of_controllers_are_checked_before_the_run(
    component: str, name: str, value: str, words: str
) -> None:
    with pytest.raises(ScenarioError, match=rf'controller.{name} = "{value}"') as caught:
        load_scenario(f"el_centro_0p6g_{component}", {f"controller.{name}": value})
    assert words in str(caught.value)


def test_the_reference_designs_belong_to_the_stock_building() -> None:
    for file in FROZEN.glob("*.json"):
        controller = read_controller(file)
        controller.check_building(paper_building())
        assert math.isclose(controller.sample_period, 0.002)

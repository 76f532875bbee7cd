"""A designed controller in a scenario: the building must be the one that it was designed for."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.cli import main
from bristle.errors import ScenarioError
from bristle.fmu.build import build, plan
from bristle.physics.building import PAPER
from bristle.system.scenario import check_scenario, load_scenario

DESIGNED = ("el_centro_0p6g_lpv", "el_centro_0p6g_hinf", "el_centro_0p6g_clipped")


def building(folder: Path, *, stiffness: float = 1.0) -> str:
    """Write the paper's building with another isolation; return its path."""
    path = folder / "house.toml"
    k = [value * stiffness for value in PAPER["stiffnesses"]]
    a, b = PAPER["rayleigh"].values()
    path.write_text(
        f'schema = 1\nname = "house"\nmasses = {PAPER["masses"]}\nstiffnesses = {k}\n'
        f"rayleigh = {{ alpha = {a}, beta = {b} }}\n"
    )
    return str(path)


@pytest.mark.parametrize("name", DESIGNED)
def test_another_building_is_refused(name: str, tmp_path: Path) -> None:
    overrides = {"structure.building": building(tmp_path, stiffness=1.2)}
    (error,) = [f for f in check_scenario(name, overrides) if f.level == "error"]
    assert "designed for the building 'base-isolated two-storey model'" in error.text
    assert "not for 'house'" in error.text
    assert "[components.controller]" in error.text
    with pytest.raises(ScenarioError, match="Design a controller for this building"):
        load_scenario(name, overrides)


@pytest.mark.parametrize("name", DESIGNED)
def test_the_same_building_under_another_name_is_taken(name: str, tmp_path: Path) -> None:
    assert load_scenario(name, {"structure.building": building(tmp_path)})


@pytest.mark.parametrize("kind", ["Skyhook", "ConstantVoltage"])
def test_what_is_not_designed_goes_with_any_building(kind: str, tmp_path: Path) -> None:
    overrides = {"structure.building": building(tmp_path, stiffness=1.2)}
    name = "el_centro_0p6g_constant_voltage"
    if kind == "Skyhook":
        name, overrides["controller.fmu"] = "el_centro_0p6g_clipped", kind
    assert load_scenario(name, overrides)


def test_an_fmu_with_a_controller_of_its_own_is_judged_alike(tmp_path: Path) -> None:
    fmu = build(plan("Lpv", name="MyLpv"), tmp_path)
    mine = {"controller.fmu": str(fmu)}
    assert load_scenario("el_centro_0p6g_lpv", mine)
    other = {**mine, "structure.building": building(tmp_path, stiffness=1.2)}
    with pytest.raises(ScenarioError, match="designed for the building"):
        load_scenario("el_centro_0p6g_lpv", other)


def test_sensors_in_between_hide_nothing(tmp_path: Path) -> None:
    overrides = {"structure.building": building(tmp_path, stiffness=1.2)}
    assert load_scenario("el_centro_0p6g_lpv_sensors")
    with pytest.raises(ScenarioError, match="designed for the building"):
        load_scenario("el_centro_0p6g_lpv_sensors", overrides)


def test_a_wrong_building_is_one_mistake(tmp_path: Path) -> None:
    path = Path(building(tmp_path))
    path.write_text(path.read_text().replace("1057.0", "-1057.0"))
    with pytest.raises(ScenarioError, match="must be positive") as caught:
        load_scenario("el_centro_0p6g_lpv", {"structure.building": str(path)})
    assert "designed for" not in str(caught.value)


def test_the_command_refuses_with_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    house = building(tmp_path, stiffness=1.2)
    command = ["run", "el_centro_0p6g_lpv", "--engine", "compiled", "--out", str(tmp_path / "o")]
    assert main([*command, "--set", f"structure.building={house}"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("ScenarioError: ")
    assert error.count("\n") == 1
    assert not (tmp_path / "o").exists()

"""`bristle build`: an FMU of one's own, where a user expects it and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bristle.cli import main
from bristle.fmu.description import read_description

BUILDING = """\
schema = 1
name = "three floors"
masses = [3.0, 2.0, 2.0, 1.5]
stiffnesses = [1500.0, 3000.0, 2500.0, 2000.0]
base = "isolated"
damping_ratio = 0.02
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, empty but for a building."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.toml").write_text(BUILDING)
    return tmp_path


def test_a_building_becomes_an_fmu_with_its_ports_in_the_current_folder(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", "Structure", "--building", "my.toml", "--name", "Tower"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Tower.fmu: built, guid ")
    assert "floor3_displacement [m]" in said
    assert sorted(path.name for path in here.iterdir()) == ["Tower.fmu", "my.toml"]
    description = read_description(here / "Tower.fmu")
    assert description.name == "Tower"
    assert "floor3_velocity" in description.variables
    assert "floor4_velocity" not in description.variables


def test_what_stands_there_already_is_not_built_again(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["build", "ConstantVoltage", "--out", "deep/er", "--json"]
    assert main(command) == 0
    first = json.loads(capsys.readouterr().out)
    file = here / "deep" / "er" / "ConstantVoltage.fmu"
    before = file.stat().st_mtime_ns
    assert main(command) == 0
    second = json.loads(capsys.readouterr().out)
    assert (first.pop("built"), second.pop("built")) == (True, False)
    assert first == second
    assert first["outputs"][0] == {"name": "voltage", "unit": "V"}
    assert file.stat().st_mtime_ns == before
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_an_older_file_gives_way(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "Tower.fmu").write_text("not an FMU")
    assert main(["build", "Structure", "--building", "my.toml", "--name", "Tower"]) == 0
    assert read_description(here / "Tower.fmu").name == "Tower"


def test_a_record_is_baked_in(here: Path) -> None:
    rows = "".join(f"{0.01 * k:.2f},{(-1) ** k}\n" for k in range(100))
    (here / "shake.csv").write_text("time [s],acceleration [m/s2]\n" + rows)
    assert main(["build", "GroundMotion", "--record", "shake.csv", "--name", "Shake"]) == 0
    assert read_description(here / "Shake.fmu").variables["record"].start == "shake"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["Structur"], 'no component "Structur". Did you mean "Structure"?'),
        (["Structure", "--building", "gone.toml"], "gone.toml: there is no such file"),
        (["LuGreDamper", "--building", "my.toml"], "a building goes into Structure"),
        (["Structure", "--record", "my.toml"], "a record goes into GroundMotion"),
        (["GroundMotion", "--record", "gone.at2"], "gone.at2"),
        (["Structure", "--name", "a b"], '"a b" is no model name'),
        (["ConstantVoltage", "--out", "my.toml"], "my.toml: is a file"),
    ],
)
def test_what_cannot_be_built_is_one_message_and_leaves_nothing(
    here: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in here.iterdir()] == ["my.toml"]


def test_a_folder_of_that_name_is_left_alone(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "ConstantVoltage.fmu").mkdir()
    assert main(["build", "ConstantVoltage"]) == 2
    assert "is a folder" in capsys.readouterr().err

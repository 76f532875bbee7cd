"""What a run with overrides is called: title and folder follow what ran."""

from __future__ import annotations

from pathlib import Path

import pytest
from valid import VALID

from bristle.system.library import LONGEST_NAME, run_name
from bristle.system.scenario import load_scenario


@pytest.fixture
def write(tmp_path):
    """Return what writes a scenario file and returns its path."""

    def into_file(text):
        file = tmp_path / "kobe.toml"
        file.write_text(text)
        return file

    return into_file


TITLE = "El Centro, LuGre damper at 4 V"


def title(write, overrides):
    return load_scenario(write(VALID), overrides).title


@pytest.mark.parametrize(
    "overrides",
    [{}, {"voltage.level": 4}, {"voltage.level": 4.0}, {"run.step": 0.001}, {"damper.step": 0.001}],
)
def test_the_files_title_stands_while_it_is_true(write, overrides):
    assert title(write, overrides) == TITLE


def test_a_changed_voltage_and_record_are_the_title(write, tmp_path):
    record = tmp_path / "records" / "X.csv"
    record.parent.mkdir()
    record.write_text("time [s],acceleration [m/s2]\n0,0\n0.01,1\n0.02,0\n")
    found = title(write, {"voltage.level": 8.0, "ground.record": str(record)})
    assert "4 V" not in found
    assert "El Centro" not in found
    assert "level = 8 V" in found
    assert "record = X.csv" in found
    assert "records" not in found, "the file's name, not its folder"


def test_another_component_and_its_parameters_are_named(write):
    found = title(write, {"damper.fmu": "BinghamDamper", "damper.f_c": 2.0})
    assert "LuGre" not in found
    assert "BinghamDamper (f_c = 2 N)" in found


def test_a_title_that_is_given_is_kept(write):
    assert title(write, {"title": "mine", "voltage.level": 8.0}) == "mine"


def test_folders_are_named_after_what_is_set():
    file = Path("some", "kobe.toml")
    assert run_name(file, {}) == "kobe"
    assert run_name(file, {"voltage.level": 8}) == "kobe_voltage.level=8"
    both = run_name(file, {"voltage.level": 8, "ground.record": "X.AT2"})
    assert both == "kobe_voltage.level=8_ground.record=X.AT2"


def test_names_that_no_folder_can_have_are_told_apart():
    file = Path("kobe.toml")
    paths = [run_name(file, {"ground.record": f"{folder}/X.AT2"}) for folder in ("a", "b")]
    assert len(set(paths)) == 2
    for name in paths:
        assert name.startswith("kobe_ground.record=X.AT2-")
        assert "/" not in name
    many = [run_name(file, {f"damper.{'p' * 30}{i}": i for i in range(9)} | {"a.b": n})
            for n in (1, 2)]  # fmt: skip
    assert len(set(many)) == 2
    assert max(map(len, many)) <= LONGEST_NAME
    assert "/" not in run_name(file, {"a.b": "..\\../x y:*?"})

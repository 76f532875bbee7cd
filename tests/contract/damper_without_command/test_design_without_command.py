"""`design` refuses a damper whose voltage does nothing, in one clear message, for every kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.cli import main

DEAD = {
    "bingham": "f_v = 0.0, c_v = 0.0",
    "bingham without any force": "f_c = 0.0, f_v = 0.0, c_0 = 0.0, c_v = 0.0",
}


def designed(folder: Path, kind: str, parameters: str) -> int:
    file = folder / "my.toml"
    text = f'schema = 1\nkind = "{kind}"\n[damper]\nlaw = "bingham"\n'
    file.write_text(f"{text}parameters = {{ {parameters} }}\n")
    return main(["design", kind, str(file), "--out", str(folder / "my.json")])


@pytest.mark.parametrize("kind", ["hinf", "lpv", "lqg"])
@pytest.mark.parametrize("parameters", DEAD.values(), ids=list(DEAD))
def test_a_voltage_without_effect_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, parameters: str
) -> None:
    assert designed(tmp_path, kind, parameters) == 2
    said = capsys.readouterr().err
    assert "the voltage has no effect on the force" in said
    assert "unexpected" not in said
    assert not (tmp_path / "my.json").exists()


@pytest.mark.parametrize("parameters", ["f_c = 0.0, f_v = 0.0, c_0 = 0.0", "c_0 = 0.0, c_v = 0.0"])
def test_one_part_that_follows_it_is_enough(tmp_path: Path, parameters: str) -> None:
    assert designed(tmp_path, "lqg", parameters) == 0


@pytest.mark.parametrize("value", ["nan", "inf", "-1.0"])
def test_a_parameter_out_of_place_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], value: str
) -> None:
    assert designed(tmp_path, "lqg", f"f_v = {value}") == 2
    assert "f_v" in capsys.readouterr().err

"""`bristle export` and `bristle export-ssp` write native FMUs of FMI 3.0, and bristle runs them."""

from __future__ import annotations

from pathlib import Path

import pytest
from both_forms import needs_zig

from bristle.cli import main
from bristle.engine.run import run
from bristle.fmu.description import read_description
from bristle.native.zig import here

pytestmark = needs_zig

NATIVE = ["--native", "--fmi", "3", "--platform", here().name]
SCENARIO = """
schema = 1
title = "a controller and what it measures"
[run]
stop = 0.1
step = 0.01
[components.ground]
fmu = "GroundMotion"
parameters = { peak = 2.0 }
[components.skyhook]
fmu = "Skyhook"
parameters = { base_displacement = 0.001, base_velocity = 0.1, damper_force = 2.0 }
[connections]
"skyhook.floor_acceleration" = "ground.ground_acceleration"
"""


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "two.toml"
    file.write_text(SCENARIO)
    return file


def test_a_package_of_fmi_3_gives_the_rows_of_the_scenario(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["-o", "two.ssp", "--no-coupling-error"]
    assert main(["export-ssp", str(scenario), *out, *NATIVE]) == 0
    assert "two.ssp" in capsys.readouterr().out
    assert main(["import-ssp", "two.ssp", "--out", "imported"]) == 0
    found = sorted((tmp_path / "imported").rglob("*.fmu"))
    assert [read_description(path).version for path in found] == ["3.0", "3.0"]
    frame, wanted = run(tmp_path / "two.ssp"), run(scenario)
    assert list(frame.columns) == list(wanted.columns)
    for name in wanted:
        assert frame[name].to_numpy() == pytest.approx(wanted[name].to_numpy(), abs=1e-12), name


def test_what_knows_no_fmi_3_is_refused(scenario: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["export-ssp", str(scenario), "-o", "two.ssp"]
    assert main([*given, "--fmi", "3"]) == 2
    assert "--fmi 3 goes with --native" in capsys.readouterr().err
    assert not Path("two.ssp").exists()

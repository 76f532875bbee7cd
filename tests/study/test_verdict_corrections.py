"""What a verdict found in the data is written by one command, which the verdict names first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from made import write_runs

from bristle.cli import main
from bristle.data.corrections import Correction
from bristle.diagnosis.conclusion import corrections_of
from bristle.diagnosis.verdict import SCHEMA
from bristle.study import Study, create_study
from bristle.study.view import next_steps

LATE = {"channel": "force", "fault": "delay", "value": 0.004, "words": "late", "run": "run_2"}
CLOCK = {"channel": "force", "fault": "clock", "value": 8e-5, "words": "fast"}
CLIPPED = {"channel": "force", "fault": "clipping", "value": 9.0, "words": "cut"}
SHIFTED = {"channel": "voltage", "fault": "delay", "value": 0.004, "words": "an effect of all"}


def verdict(*sensors: dict[str, Any]) -> dict[str, Any]:
    return {
        "schema": SCHEMA, "kind": "effect", "effects": ["gas_spring"], "findings": [],
        "ranking": [], "sensors": list(sensors), "words": "", "reasons": [],
    }  # fmt: skip


def test_only_what_study_toml_can_set_right_is_a_correction() -> None:
    found = corrections_of(verdict(LATE, CLOCK, CLIPPED, SHIFTED), ["run_1", "run_2"])
    clock = Correction("force", "clock", 8e-5)
    assert found == {"run_1": [clock], "run_2": [Correction("force", "delay", 0.004), clock]}
    assert corrections_of(None, ["run_1"]) == {}


def test_the_check_writes_what_the_verdict_found_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = create_study(tmp_path / "rig", write_runs(tmp_path / "lab", 3, seconds=2.0)).study
    study.write_verdict(verdict(LATE, CLOCK, CLIPPED))
    for _ in range(2):  # the second time the verdict is of other data
        assert main(["study", "check", str(study.folder), "--correct"]) == 0
    assert "run_2: force is moved ahead by 4 ms" in capsys.readouterr().out
    runs = Study(study.folder).settings.runs
    assert [{one[:2]: one.value for one in run.corrections} for run in runs] == [
        {("force", "clock"): 8e-5},
        {("force", "delay"): 0.004, ("force", "clock"): 8e-5},
        {("force", "clock"): 8e-5},
    ]


def test_the_command_that_corrects_the_data_comes_before_the_effect() -> None:
    add = "bristle add rig gas_spring"
    commands = [one.command for one in next_steps(verdict(LATE), Path("rig"))]
    assert commands == ["bristle study check rig --correct", add]
    assert [one.command for one in next_steps(verdict(CLIPPED), Path("rig"))] == [add]

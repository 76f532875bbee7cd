"""The newest plan of a study stands in its report: as the next tests, or as measured."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import measurements_of
from bristle.data.table import from_arrays
from bristle.planning.folder import PlanFolder, PlannedRun, read_plan, write_plan
from bristle.planning.plan import OUTCOMES
from bristle.report.study_page import plan_section


@pytest.fixture
def study(tmp_path: Path) -> SimpleNamespace:
    time = np.arange(500) / 100.0
    signals = {"displacement": 1e-3 * np.sin(time) ** 2, "voltage": np.zeros(500)}
    runs = (PlannedRun("plan_1", "train", "a sine of 1 mm", time, signals),)
    table = {"header": ["question", "figure", "now", "then"], "rows": [["lag", "tau", "-", "1 ms"]]}
    write_plan(
        PlanFolder("bench", "rig", 100.0, runs), tmp_path / "plan", {OUTCOMES: json.dumps(table)}
    )
    return SimpleNamespace(folder=tmp_path, settings=SimpleNamespace(runs=[]))


def test_a_study_without_a_plan_has_no_section(tmp_path: Path) -> None:
    assert plan_section(SimpleNamespace(folder=tmp_path)) == ""  # type: ignore[arg-type]


def test_a_plan_is_the_next_tests_until_its_runs_are_in_the_study(study: SimpleNamespace) -> None:
    page = plan_section(study)  # type: ignore[arg-type]
    for part in ("Next tests", "a sine of 1 mm", "training", "1 ms"):
        assert part in page
    study.settings.runs = [SimpleNamespace(file="data/plan_1.csv")]
    assert "are measured" in plan_section(study)  # type: ignore[arg-type]


def test_a_second_plan_is_not_measured_by_the_runs_of_the_first(study: SimpleNamespace) -> None:
    first = read_plan(study.folder / "plan")
    time, signals = first.runs[0].time, first.runs[0].signals
    other = {**signals, "displacement": 1e-3 * np.sin(5.0 * time) ** 2}
    run = replace(first.runs[0], signals=other)
    table = (study.folder / "plan" / OUTCOMES).read_text()
    write_plan(replace(first, runs=(run,)), study.folder / "plan_2", {OUTCOMES: table})
    specs = {name: ChannelSpec(name) for name in ("time", "displacement")}
    study.settings.runs = [SimpleNamespace(file="data/plan_1.csv")]
    for motion, said in ((signals, "Next tests"), (other, "are measured")):
        arrays = {"time [s]": time, "displacement [m]": motion["displacement"]}
        measured = measurements_of(from_arrays(arrays, "data/plan_1.csv"), specs)
        study.read = lambda measured=measured: measured
        assert said in plan_section(study)  # type: ignore[arg-type]


def test_a_damaged_plan_is_told_and_the_report_goes_on(study: SimpleNamespace) -> None:
    (study.folder / "plan" / OUTCOMES).write_text("{")
    assert "plan cannot be read" in plan_section(study)  # type: ignore[arg-type]

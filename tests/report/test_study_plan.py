"""The newest plan of a study stands in its report: as the next tests, or as measured."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bristle.plan.folder import PlanFolder, PlannedRun, write_plan
from bristle.plan.outcome import OUTCOMES
from bristle.report.study_plan import plan_section


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


def test_a_damaged_plan_is_told_and_the_report_goes_on(study: SimpleNamespace) -> None:
    (study.folder / "plan" / OUTCOMES).write_text("{")
    assert "plan cannot be read" in plan_section(study)  # type: ignore[arg-type]

"""`bristle study roles`: what runs are for, changed in study.toml and nowhere else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from study.made import write_runs

from bristle.cli import main
from bristle.errors import StudyError
from bristle.study import Study, create_study


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return create_study(tmp_path / "rig", write_runs(tmp_path / "lab", 4), law="bingham").study


def test_roles_are_changed_and_all_else_stays(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    file = study.folder / "study.toml"
    file.write_text(file.read_text().replace('title = "rig"', 'title = "rig" # of the lab'))
    order = ["study", "roles", str(study.folder), "--test", "run_4", "--train", "data/run_2.csv"]
    assert main([*order, "--holdout", "run_1"]) == 0
    assert "test     data/run_4.csv" in capsys.readouterr().out
    assert "# of the lab" in file.read_text()
    now = Study(study.folder)
    assert [run.role for run in now.settings.runs] == ["holdout", "train", "train", "test"]
    assert len(now.runs().train) == 2


def test_a_run_that_was_left_out_comes_back(study: Study) -> None:
    without = study.with_roles({"run_1": "exclude"})
    assert [run.file for run in without.settings.excluded] == ["data/run_1.csv"]
    assert not without.with_roles({"data/run_1.csv": "train"}).settings.excluded


def test_without_roles_they_are_shown(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    before = (study.folder / "study.toml").read_bytes()
    assert main(["study", "roles", str(study.folder), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["role"] for row in rows] == ["train", "holdout", "train", "train"]
    assert (study.folder / "study.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("roles", "words"),
    [
        ({"run_9": "train"}, "no run is called"),
        ({"run_1": "judge"}, "role"),
        ({"run_2": "train"}, "held out"),
        ({f"run_{k}": "exclude" for k in (1, 2, 3, 4)}, "no run would be left"),
        ({f"run_{k}": "holdout" for k in (1, 2, 3, 4)}, "for training"),
    ],
)
def test_what_leaves_nothing_to_fit_to_or_to_judge_by_is_refused(
    study: Study, roles: dict[str, str], words: str
) -> None:
    before = (study.folder / "study.toml").read_bytes()
    with pytest.raises(StudyError, match=words):
        study.with_roles(roles)
    assert (study.folder / "study.toml").read_bytes() == before


def test_one_run_has_one_role(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    order = ["study", "roles", str(study.folder), "--test", "run_1", "--train", "run_1"]
    assert main(order) == 2
    assert "two roles" in capsys.readouterr().err

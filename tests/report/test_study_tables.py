"""The tables of a study's report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write

from bristle.report.study_page import data_table
from bristle.study import Study, create_study
from bristle.study.run_facts import RunChoices


def roles(study: Study, test: bool = False) -> dict[str, str]:
    measured = [*study.runs().all, *(study.read("test") if test else [])]
    return {row[0]: row[1] for row in data_table(study, measured)[1]}


@pytest.mark.parametrize("name", ["elastic_mount", "blast", "first_last"])
def test_the_parts_of_a_single_run_have_their_role_whatever_its_name(tmp_path: Path, name: str):
    files = [write(tmp_path / f"{name}.csv", bench_run(1, 2.0))]
    files.append(write(tmp_path / "final_last.csv", bench_run(2, 2.0)))
    choices = RunChoices(test=["final*"])
    study = create_study(tmp_path / "rig", files, law="bingham", runs=choices).study
    assert roles(study, test=True) == {
        f"{name}, first 70%": "train", f"{name}, last 30%": "held out", "final_last": "test",
    }  # fmt: skip


def test_the_pieces_of_a_run_that_is_split_at_a_gap_have_their_role(tmp_path: Path):
    there = np.ones(1446, dtype=bool)
    there[1000:1006] = False
    columns = {key: values[:1446][there] for key, values in bench_run(1).items()}
    study = Study.create(tmp_path / "rig", [write(tmp_path / "run.csv", columns)])
    assert roles(study) == {"run (1 of 2)": "train", "run (2 of 2)": "held out"}


def test_runs_of_one_file_have_their_role(tmp_path: Path):
    runs = [bench_run(k, 2.0) for k in range(4)]
    joined = {key: np.concatenate([run[key] for run in runs]) for key in runs[0]}
    study = create_study(
        tmp_path / "rig", [write(tmp_path / "all.csv", joined)], runs=RunChoices(split="restart")
    ).study
    assert roles(study) == {
        "all run 1": "train", "all run 2": "held out", "all run 3": "train", "all run 4": "train",
    }  # fmt: skip

"""Runs of which two files have one stem: each has a name of its own, by which it is corrected."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write, write_runs

from bristle.data.corrections import Correction
from bristle.data.measurement import names_of_files
from bristle.errors import StudyError
from bristle.report.study_page import data_table
from bristle.study.extend import extend_study
from bristle.study.inputs import measurements, runs_of
from bristle.study.study import Study


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["data/a.csv", "data/b.csv"], ["a", "b"]),
        (["data/a.csv", "data/a.txt", "data/b.csv"], ["a.csv", "a.txt", "b"]),
        (["data/a.csv", "data/a.csv.gz"], ["a.csv", "a.csv.gz"]),
        (["data/a.csv", "data/a.txt", "data/a.csv.csv"], ["data/a.csv", "a.txt", "a.csv.csv"]),
        (["one/a.csv", "two/a.csv"], ["one/a.csv", "two/a.csv"]),
        # The first piece of a.csv would have the name of the other file.
        (["data/a.csv", "data/a (1 of 2).csv"], ["a.csv", "a (1 of 2)"]),
    ],
)
def test_no_two_runs_have_one_name(files, names):
    assert names_of_files(files) == names


@pytest.fixture
def study(tmp_path: Path) -> Study:
    files = write_runs(tmp_path / "lab", 3, seconds=2.0)
    other = write(tmp_path / "lab" / "run_1.txt", bench_run(7, 2.0))
    return Study.create(tmp_path / "rig", [*files, other], law="bingham")


def test_a_correction_is_of_the_run_that_is_named(study: Study):
    assert [run.name for run in study.read()] == ["run_1.csv", "run_2", "run_3", "run_1.txt"]
    study = study.with_corrections({"run_1.txt": [Correction("force", "gain", 1.25)]})
    assert [len(run.corrections) for run in study.settings.runs] == [0, 0, 0, 1]
    study = study.with_roles({"run_1.csv": "exclude"})
    assert [run.file for run in study.settings.excluded] == ["data/run_1.csv"]
    # The others keep their names, and so does the one that is left out.
    assert [run.name for run in study.read()] == ["run_2", "run_3", "run_1.txt"]
    assert data_table(study, study.read())[1][-1][:2] == ["run_1.csv", "left out"]
    study = study.with_roles({"run_1.csv": "train", "run_1.txt": "test"})
    assert {run.file: run.role for run in study.settings.runs} == {
        "data/run_1.csv": "train", "data/run_2.csv": "holdout", "data/run_3.csv": "train",
        "data/run_1.txt": "test",
    }  # fmt: skip


def test_a_name_that_could_be_either_is_refused(study: Study):
    there = r'no run is called "run_1"; there are run_1\.csv, run_2, run_3, run_1\.txt\.'
    with pytest.raises(StudyError, match=there):
        study.with_corrections({"run_1": [Correction("force", "gain", 1.25)]})
    with pytest.raises(StudyError, match=there):
        study.with_roles({"run_1": "exclude"})
    with pytest.raises(StudyError, match=there):
        study.with_roles({"run_1": "test"})


def test_a_run_that_is_added_has_a_name_of_its_own(tmp_path: Path):
    study = Study.create(tmp_path / "rig", write_runs(tmp_path / "lab", 3, seconds=2.0))
    plain = write(tmp_path / "new" / "run_2.csv", bench_run(8, 2.0))
    packed = plain.with_name("run_2.csv.gz")
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    study = extend_study(study, [packed], roles={packed.name: "train"}).study
    assert [run.name for run in study.read()] == ["run_1", "run_2.csv", "run_3", "run_2.csv.gz"]


def test_files_of_one_name_are_told_apart_without_a_study(tmp_path: Path):
    for folder in ("one", "two"):
        write(tmp_path / folder / "a.csv", bench_run(len(folder) + ord(folder[0]), 2.0))
    gap = bench_run(3, 2.0)
    gap = {name: np.delete(x, np.arange(400, 500)) for name, x in gap.items()}
    write(tmp_path / "b.csv", gap)
    files = [tmp_path / name for name in ("one/a.csv", "two/a.csv", "b.csv")]
    names = {run.name for run in runs_of(measurements(files), []).all}
    assert names == {str(files[0]), str(files[1]), "b (1 of 2)", "b (2 of 2)"}

"""A run that does not belong is left out, and every place that counts runs says so."""

from __future__ import annotations

import pytest
from made import write_runs

from bristle.cli import main
from bristle.errors import StudyError
from bristle.report.study_page import data_table
from bristle.study.study import Study


@pytest.fixture
def folder(tmp_path):
    files = write_runs(tmp_path / "lab", count=4, seconds=2.0)
    Study.create(tmp_path / "rig", files, law="bingham_standard")
    return tmp_path / "rig"


def test_an_excluded_run_is_read_by_nothing_and_said_to_be_left_out(folder, capsys):
    path = folder / "study.toml"
    before = path.read_text(encoding="utf-8")
    capsys.readouterr()
    Study(folder).with_roles({"run_3": "exclude"})
    assert main(["study", "check", str(folder)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert 'Left out by role = "exclude" in study.toml: data/run_3.csv.' in told
    text = path.read_text(encoding="utf-8")
    assert text == before.replace(
        'file = "data/run_3.csv"\nrole = "train"',
        'file = "data/run_3.csv"\nrole = "exclude" # was train',
    )
    (folder / "data" / "run_3.csv").write_text("no numbers\n", encoding="utf-8")  # not read
    study = Study(folder)
    assert [run.name for run in study.read()] == ["run_1", "run_2", "run_4"]
    assert "run_3" in study.runs().notes[-1]
    rows = data_table(study, study.read())[1]
    assert rows[-1][:2] == ["run_3", "left out"]
    assert len(rows) == 4
    assert "data/run_3.csv" in study._repr_html_()


def test_corrections_reach_their_run_behind_one_that_is_left_out(folder):
    study = Study(folder).with_roles({"run_1": "exclude"})
    from bristle.data.corrections import Correction

    study = study.with_corrections({"run_4": [Correction("force", "gain", 1.2)]})
    assert [len(run.corrections) for run in study.settings.runs] == [0, 0, 1]


def test_names_that_are_no_run_and_leaving_out_all_are_refused(folder):
    study = Study(folder)
    with pytest.raises(StudyError, match='no run is called "run_9"; there are run_1'):
        study.with_roles({"run_9": "exclude"})
    with pytest.raises(StudyError, match="no run would be left"):
        study.with_roles(dict.fromkeys(["run_1", "run_2", "run_3", "run_4"], "exclude"))
    path = folder / "study.toml"
    text = path.read_text(encoding="utf-8")
    every = text.replace('role = "train"', 'role = "exclude"')
    path.write_text(every.replace('role = "holdout"', 'role = "exclude"'), encoding="utf-8")
    with pytest.raises(StudyError, match="every run has role"):
        Study(folder)
    path.write_text(text.replace('role = "train"', 'role = "left"', 1), encoding="utf-8")
    with pytest.raises(StudyError, match="There are: train, holdout, test, exclude"):
        Study(folder)


def test_a_table_of_runs_leaves_runs_out(tmp_path):
    files = write_runs(tmp_path / "lab", count=4, seconds=2.0)
    table = tmp_path / "runs.csv"
    roles = ("train", "holdout", "exclude", "train")
    lines = [f"{file.name},{role}" for file, role in zip(files, roles, strict=True)]
    table.write_text("\n".join(["file,role", *lines]), encoding="utf-8")
    words = ["study", "new", str(tmp_path / "rig"), "--data", *map(str, files)]
    assert main([*words, "--runs", str(table)]) == 0
    settings = Study(tmp_path / "rig").settings
    assert [run.file for run in settings.excluded] == ["data/run_3.csv"]
    assert len(settings.runs) == 3


def test_leaving_out_the_last_run_held_out_is_refused_before_it_is_written(folder):
    before = (folder / "study.toml").read_bytes()
    with pytest.raises(StudyError, match="no run would be held out") as refused:
        Study(folder).with_roles({"run_2": "exclude"})
    assert (folder / "study.toml").read_bytes() == before
    words = str(refused.value)
    assert "one of run_1, run_3, run_4 as RUN" in words
    assert f"bristle study roles {folder} --exclude run_2 --holdout RUN" in words
    assert main(["study", "roles", str(folder), "--exclude", "run_2", "--holdout", "run_1"]) == 0
    assert Study(folder).runs().holdout[0].name == "run_1"


def test_a_copy_of_a_run_is_left_out_of_a_new_study(tmp_path, capsys):
    files = write_runs(tmp_path / "lab", count=3, seconds=2.0)
    copy = tmp_path / "lab" / "copy.csv"
    copy.write_bytes(files[0].read_bytes())
    rig = tmp_path / "rig"
    assert main(["study", "new", str(rig), "--data", str(tmp_path / "lab")]) == 0
    told = capsys.readouterr().out
    said = " ".join(told.split())
    assert "run_1.csv is the same measurement as copy.csv, and is left out" in said
    swap = next(line for line in told.splitlines() if "--exclude" in line)
    order = swap.partition("bristle ")[2].split()
    assert main(["study", "check", str(rig)]) == 0
    assert main(order) == 0
    assert [run.name for run in Study(rig).settings.excluded] == ["data/copy.csv"]
    assert main(["study", "check", str(rig)]) == 0


def test_a_run_that_is_in_two_roles_is_named_with_the_command_that_leaves_it_out(folder):
    (folder / "data" / "run_2.csv").write_bytes((folder / "data" / "run_1.csv").read_bytes())
    with pytest.raises(StudyError, match="it tests nothing") as refused:
        Study(folder).runs()
    assert str(refused.value).endswith(
        f"leave one out: bristle study roles {folder} --exclude run_1"
    )

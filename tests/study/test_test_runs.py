"""Test runs: no choice sees them, and the study counts how often they are opened."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write, write_runs

import bristle
from bristle.cli import main
from bristle.errors import RecordError, StudyError
from bristle.report.study_page import gather, render
from bristle.study import Study, create_study
from bristle.study.data_check import check_data
from bristle.study.run_facts import RunChoices
from bristle.study.steps import FILE, uses_of_test_set

SECONDS = 2.0


def made(folder: Path, factor: float = 1.0, seconds: float = SECONDS) -> Study:
    """Return a study of three runs and a test run, whose force is multiplied by a factor."""
    files = write_runs(folder / "lab", 3, seconds=seconds)
    last = bench_run(9, seconds)
    last["F [N]"] = factor * last["F [N]"]
    files.append(write(folder / "lab" / "final.csv", last))
    return create_study(
        folder / "rig", files, law="bingham", runs=RunChoices(test=["final*"])
    ).study


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return made(tmp_path)


def roles(study: Study) -> list[str]:
    return [run.role for run in study.settings.runs]


def test_roles_of_the_other_runs_are_those_without_it(study: Study) -> None:
    assert roles(study) == ["train", "holdout", "train", "test"]
    assert [run.name for run in study.runs().all] == ["run_1", "run_3", "run_2"]
    assert [run.name for run in study.read("test")] == ["final"]


def test_the_command_takes_names_and_files_of_their_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_runs(tmp_path / "lab", 4, seconds=2.0)
    write(tmp_path / "later" / "new.csv", bench_run(9, 2.0))
    new = ["study", "new", str(tmp_path / "rig"), "--data", str(tmp_path / "lab" / "*.csv")]
    assert main([*new, "--test", "run_4*", str(tmp_path / "later" / "*.csv")]) == 0
    said = capsys.readouterr().out
    assert "Test runs, which no fit and no verdict sees: run_4.csv, new.csv." in said
    assert roles(Study(tmp_path / "rig")) == ["train", "holdout", "train", "test", "test"]
    assert main([*new[:2], str(tmp_path / "other"), *new[3:], "--test", "run_7*"]) == 2
    assert "no file of --data has such a name" in capsys.readouterr().err


def test_a_table_of_runs_may_name_them(tmp_path: Path) -> None:
    files = write_runs(tmp_path, 4, seconds=2.0)
    table = tmp_path / "runs.csv"
    listed = ("test", "train", "holdout", "train")
    lines = [f"{file.name},{role}" for file, role in zip(files, listed, strict=True)]
    table.write_text("\n".join(["file,role", *lines]) + "\n")
    study = create_study(tmp_path / "rig", files, runs=RunChoices(table=table)).study
    assert roles(study) == list(listed)
    table.write_text("\n".join(["file,role", *(f"{f.name},test" for f in files)]) + "\n")
    with pytest.raises(StudyError, match="all files are"):
        create_study(tmp_path / "other", files, runs=RunChoices(table=table))


def test_one_run_beside_test_runs_is_split_in_time(tmp_path: Path) -> None:
    files = write_runs(tmp_path, 2, seconds=2.0)
    study = create_study(tmp_path / "rig", files, runs=RunChoices(test=[files[0]])).study
    runs = study.runs()
    assert [len(run.time) for run in runs.all] == [700, 315]
    assert runs.holdout[0].source.endswith("run_2.csv")


def test_guesses_of_channels_do_not_see_a_test_run(tmp_path: Path) -> None:
    last = bench_run(9, 2.0)
    last["F [N]"] = -last["F [N]"]  # alone, it would be turned
    first = write(tmp_path / "a.csv", last)
    files = [first, *write_runs(tmp_path, 2, seconds=2.0)]
    study = create_study(tmp_path / "rig", files, runs=RunChoices(test=[first])).study
    assert study.settings.channels["force"].sign == 1
    assert create_study(tmp_path / "other", files).study.settings.channels["force"].sign == -1


@pytest.mark.parametrize(
    ("test", "told"),
    [(["run_7*"], "no file of the data is run_7"), (["*"], "all files are")],
)
def test_a_choice_that_cannot_be_is_refused(tmp_path: Path, test: list[str], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        create_study(
            tmp_path / "rig", write_runs(tmp_path, 3, seconds=2.0), runs=RunChoices(test=test)
        )
    assert not (tmp_path / "rig").exists()


def test_a_damaged_or_repeated_test_run_is_refused_when_the_study_is_made(tmp_path: Path) -> None:
    files = write_runs(tmp_path, 3, seconds=2.0)
    files[2].write_text("no measurement")
    with pytest.raises(RecordError, match=r"run_3\.csv"):
        create_study(tmp_path / "rig", files, runs=RunChoices(test=[files[2]]))
    files[2].write_bytes(files[0].read_bytes())
    with pytest.raises(StudyError, match="same measurement, and one of them is a test run"):
        create_study(tmp_path / "rig", files, runs=RunChoices(test=[files[2]]))


def test_fits_and_verdicts_do_not_read_a_test_run(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bristle.diagnosis import Diagnosis
    from bristle.study import steps as learning

    study.files("test")[0].write_text("not a measurement")
    found = bristle.identify(study)
    assert found.step is not None
    seen: list[str] = []

    def diagnosed(train, holdout, *given, **more):
        seen.extend(run.name for run in (*train, *holdout))
        return Diagnosis("none", (), ("Nothing is missing.",))

    monkeypatch.setattr(learning, "diagnose_rig", diagnosed)
    bristle.diagnose(study)
    assert sorted(seen) == ["run_1", "run_2", "run_3"]
    assert bristle.compare(study).z > 0.0
    assert study.plot() is not None
    assert uses_of_test_set(study) == ()
    with pytest.raises(RecordError, match=r"final\.csv"):
        check_data(study)
    with pytest.raises(RecordError, match=r"final\.csv"):
        bristle.compare(study, role="test")
    assert uses_of_test_set(study) == ()  # nobody saw an error


def test_openings_are_counted_and_told(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    first = bristle.compare(study, "bingham", role="test")
    assert first.sentences[0].startswith("On the test runs the model misses")
    assert first.sentences[-1].endswith("they are opened for the first time.")
    study.add_step("add gas_spring", "to see", study.model().with_effect("gas_spring"))
    assert "2 times" in bristle.compare(study, role="test").sentences[-1]
    assert main(["compare", str(study.folder), "--role", "test", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (
        "These runs have been opened 3 times: their error is no longer" in answer["sentences"][-1]
    )
    assert answer["held_out"] is True
    assert answer["role"] == "test"
    assert [one["step"] for one in answer["test_openings"]] == [0, 1, 1]
    assert all(one["date"].startswith("20") for one in answer["test_openings"])
    study.undo()
    assert len(uses_of_test_set(study)) == 3  # what was seen stays seen
    bristle.compare(study)
    assert len(uses_of_test_set(study)) == 3


@pytest.mark.slow  # two reports of a study
def test_the_report_opens_them_unless_they_are_to_stay_closed(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    assert main(["report", str(study.folder), "--keep-test-closed", "--out", str(page)]) == 0
    assert "They stay closed." in page.read_text()
    assert uses_of_test_set(study) == ()
    text = render(gather(study))
    assert "Error on the test runs" in text
    assert "opened for the first time" in text
    assert "1 test run" in text
    assert len(uses_of_test_set(study)) == 1
    capsys.readouterr()


def test_the_data_check_tells_of_their_files_and_of_nothing_else(tmp_path: Path) -> None:
    plain = create_study(tmp_path / "plain", write_runs(tmp_path / "lab", 3, seconds=SECONDS)).study
    absurd = made(tmp_path, factor=1e3)
    own = check_data(absurd)
    others = [one for one in own.findings if one.run != "final"]
    assert others == list(check_data(plain).findings)
    assert [run.name for run in own.runs][-1] == own.excitations[-1].run == "final"
    still = absurd.files("test")[0]
    rows = np.loadtxt(still, delimiter=",", skiprows=1)
    rows[:, 3] = 0.0
    header = still.read_text().splitlines()[0]
    np.savetxt(still, rows, "%.9g", ",", header=header, comments="")
    found = [one for one in check_data(absurd).findings if one.run == "final"]
    assert any(one.channel == "force" for one in found)


def test_a_study_without_test_runs_says_how_to_have_them(tmp_path: Path) -> None:
    study = create_study(tmp_path / "rig", write_runs(tmp_path, 2, seconds=2.0)).study
    with pytest.raises(StudyError, match='no run has role = "test"'):
        bristle.compare(study, role="test")
    with pytest.raises(StudyError, match="role is"):
        bristle.compare(study, role="final")


@pytest.mark.parametrize("text", ["{}", '{"schema": 1, "openings": 5}', "no json"])
def test_a_damaged_count_is_not_taken_for_none(study: Study, text: str) -> None:
    (study.folder / FILE).write_text(text)
    with pytest.raises(StudyError, match=FILE):
        bristle.compare(study, role="test")


@pytest.mark.slow  # two studies are identified and diagnosed
def test_an_absurd_test_run_changes_no_byte_of_model_and_verdict(tmp_path: Path) -> None:
    studies = [made(tmp_path / name, factor, 6.0) for name, factor in (("a", 1.0), ("b", -1e3))]
    for study in studies:
        bristle.identify(study)
        bristle.diagnose(study)
    for name in ("model.toml", "verdict.json"):
        one, other = ((study.folder / name).read_bytes() for study in studies)
        assert one == other

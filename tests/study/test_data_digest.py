"""A result on other data than there are now is known, and one that was under way is refused."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from made import bench_run, write, write_runs

from bristle.data.corrections import Correction
from bristle.errors import StudyError
from bristle.study.steps import create_study
from bristle.study.study import Study, data_digest, other_data

VERDICT = {"schema": 2, "kind": "none", "effects": []}


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """Return a study with a step, a test run and an extra channel."""
    files = write_runs(tmp_path / "lab", 4, seconds=2.0)
    study = create_study(tmp_path / "rig", files, law="bingham").study
    file = study.folder / "study.toml"
    file.write_text(file.read_text() + '\n[extra.torque]\ncolumn = "F [N]"\nunit = "N"\n')
    study = Study(study.folder).with_roles({"run_4": "test"})
    study.add_step("identify bingham", "to see", study.model())
    return Study(study.folder)


def edited(old: str, new: str) -> Callable[[Study], None]:
    def edit(study: Study) -> None:
        file = study.folder / "study.toml"
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new, 1))

    return edit


def measured_again(name: str) -> Callable[[Study], None]:
    return lambda study: (write(study.folder / "data" / name, bench_run(9, 2.0)), None)[1]


label = edited('file = "data/run_2.csv"', 'file = "data/run_2.csv"\ntemperature = 55.0')
extra = edited("[extra.torque]", "[extra.moment]")
CHANGES = {
    "label": (label, "Runs, their roles, labels, corrections or channels in study.toml are"),
    "extra": (extra, "Runs, their roles, labels, corrections or channels in study.toml are"),
    "file": (measured_again("run_1.csv"), "The contents of files in data/ are"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_data_that_a_fit_sees_make_its_model_one_of_other_data(study: Study, change: str) -> None:
    act, told = CHANGES[change]
    assert other_data(study) == ""
    act(study)
    sentence = f"{told} no longer those that the present model was identified with."
    assert other_data(Study(study.folder)) == sentence


def test_a_building_with_other_numbers_makes_the_model_one_of_other_data(study: Study) -> None:
    house = study.folder / "house.toml"
    house.write_text("k = [1.0, 2.0]  # N/m\n")
    before = data_digest(study.folder, study.settings, house.name)
    house.write_text("k = [1.0,2.0]\n")
    assert data_digest(study.folder, study.settings, house.name) == before
    house.write_text("k = [1.0, 3.0]\n")
    assert data_digest(study.folder, study.settings, house.name) != before


@pytest.mark.parametrize(
    "act", [edited('title = "rig"', 'title = "bench"'), measured_again("run_4.csv")]
)
def test_titles_and_test_runs_do_not_count(study: Study, act: Callable[[Study], None]) -> None:
    act(study)
    assert other_data(Study(study.folder)) == ""


def test_a_study_that_was_cloned_is_of_the_same_data(study: Study, tmp_path: Path) -> None:
    clone = shutil.copytree(study.folder, tmp_path / "clone", copy_function=shutil.copyfile)
    for file in (clone / "data").glob("*"):  # as git does on Windows
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    assert other_data(Study(clone)) == ""


@pytest.mark.parametrize(
    ("act", "told"),
    [
        (label, "runs, their roles, labels, corrections or channels in study.toml have been"),
        (measured_again("run_2.csv"), "the contents of files in data/ have been"),
        (
            lambda study: Study(study.folder).with_corrections(
                {"run_1": [Correction("force", "gain", 2.0)]}
            ),
            "corrections or channels in study.toml have been",
        ),
    ],
)
def test_a_result_on_data_that_were_changed_meanwhile_is_refused(study, act, told) -> None:
    model = study.model()  # as a diagnosis, a fit and learning begin
    act(study)
    there = sorted(str(one) for one in study.folder.rglob("*"))
    match = f"{told} changed meanwhile.*Nothing is written; run this again"
    with pytest.raises(StudyError, match=match):
        study.write_verdict(VERDICT)
    with pytest.raises(StudyError, match=match):
        study.add_step("identify bingham", "to see", model)
    assert sorted(str(one) for one in study.folder.rglob("*")) == there
    again = Study(study.folder)
    again.model()
    again.write_verdict(VERDICT)
    assert not (again.verdict() or {}).get("notes")


def test_a_verdict_on_other_data_says_so(study: Study) -> None:
    study.write_verdict({**VERDICT, "notes": ["first"]})
    assert (study.verdict() or {})["notes"] == ["first"]
    label(study)
    note, first = (Study(study.folder).verdict() or {})["notes"]
    assert note == (
        "Runs, their roles, labels, corrections or channels in study.toml are no longer those of "
        f"this verdict. Diagnose again:  bristle diagnose {study.folder}"
    )
    assert first == "first"

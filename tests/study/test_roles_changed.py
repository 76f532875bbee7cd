"""`bristle study roles`: what runs are for, changed in study.toml and nowhere else."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from made import write_runs

import bristle
from bristle.cli import main
from bristle.data.corrections import Correction
from bristle.errors import StudyError
from bristle.study import Study, create_study
from bristle.study.history import EARLIER
from bristle.study.identify import identify_study
from bristle.study.run_facts import a_third, roles_of


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study that tests take a copy of."""
    folder = tmp_path_factory.mktemp("made")
    return create_study(folder / "rig", write_runs(folder / "lab", 4), law="bingham").study.folder


@pytest.fixture(scope="module")
def made_and_judged(made: Path) -> Path:
    """Return the same with an identified model and a verdict on it."""
    return judged(Study(shutil.copytree(made, made.parent / "judged" / "rig"))).folder


@pytest.fixture
def study(made: Path, tmp_path: Path) -> Study:
    return Study(shutil.copytree(made, tmp_path / "rig"))


@pytest.fixture
def known(made_and_judged: Path, tmp_path: Path) -> Study:
    return Study(shutil.copytree(made_and_judged, tmp_path / "known" / "rig"))


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


def judged(study: Study) -> Study:
    """Return a study with an identified model and a verdict on it."""
    identified = identify_study(study)
    assert identified.step is not None
    now = Study(study.folder)
    now.model()
    now.write_verdict({"schema": 7, "kind": "none", "findings": [], "sensors": []})
    return now


def notes(study: Study) -> str:
    return "\n".join(study.runs().notes)


@pytest.mark.parametrize(
    "change",
    [
        lambda study: study.with_roles({"run_3": "holdout"}),
        lambda study: study.with_roles({"run_3": "exclude"}),
        lambda study: study.with_mask(),
        lambda study: study.with_corrections({"run_1": [Correction("force", "bias", 1.0)]}),
    ],
)
def test_other_data_set_the_verdict_aside_and_say_that_the_model_is_of_others(
    known: Study, change: Callable[[Study], Study]
) -> None:
    assert "no longer" not in notes(known)
    then = change(known)
    assert not (then.folder / "verdict.json").is_file()
    assert json.loads((then.folder / "history/001" / EARLIER).read_text())["kind"] == "none"
    assert "no longer those that the present model was identified with" in notes(then)
    assert "bristle identify" in notes(then)
    identify_study(then)
    assert "no longer" not in notes(Study(known.folder))


def test_what_study_toml_cannot_hold_is_not_written(study: Study) -> None:
    before = (study.folder / "study.toml").read_bytes()
    with pytest.raises(StudyError, match=r"study\.toml:\d+: .*there is no fault"):
        study.with_corrections({"run_1": [Correction("force", "zero", 1.0)]})
    assert (study.folder / "study.toml").read_bytes() == before
    assert not (study.folder / ".study.toml").exists()


def test_what_no_fit_and_no_judge_sees_leaves_verdict_and_model(study: Study) -> None:
    study = judged(study.with_roles({"run_4": "test"}))
    file = study.folder / "study.toml"
    file.write_text(file.read_text().replace('title = "rig"', 'title = "another title"'))
    then = Study(study.folder).with_roles({"run_4": "exclude"})
    assert (then.folder / "verdict.json").is_file()
    assert "no longer" not in notes(then)


def test_a_step_that_is_undone_brings_back_the_data_of_the_one_before(known: Study) -> None:
    then = known.with_roles({"run_3": "holdout"})
    identify_study(then)
    Study(known.folder).undo()
    assert "no longer" in notes(Study(known.folder))
    back = Study(known.folder).with_roles({"run_3": "train"})
    assert "no longer" not in notes(back)


def test_the_command_says_what_to_do_next(known: Study, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "roles", str(known.folder), "--holdout", "run_3"]) == 0
    assert "Identify it again:  bristle identify" in capsys.readouterr().out


def test_a_study_that_was_opened_before_is_not_compared_by_its_old_roles(study: Study) -> None:
    Study(study.folder).with_roles({"run_3": "holdout"})
    with pytest.raises(StudyError, match="open the study again first"):
        bristle.compare(study)


def test_no_level_of_a_campaign_is_wholly_held_out() -> None:
    speeds, pressures = ("speed1", "speed3", "speed6"), ("050psi", "100psi", "150psi")
    names = [f"{speed}_{pressure}.csv" for speed in speeds for pressure in pressures]
    held, said = a_third(names)
    assert "of each level" in said
    for level in (*speeds, *pressures):  # every third run would be all of 150 psi
        assert sum(level in names[k] for k in held) == 1
    assert a_third([f"run_{k}.csv" for k in range(7)]) == ({1, 4}, "every third run")
    assert a_third(["sine_5mm.csv", "sine_8mm.csv"])[0] == {1}


@pytest.mark.parametrize(
    ("names", "held"),
    [
        (["Messung_1", "Messung_2", "Kontrolle_1"], ["Kontrolle_1"]),
        (["train_1", "Prüfung_1"], ["Prüfung_1"]),
        (["run_1", "test_2", "run_3"], ["test_2"]),  # the second of three as ever
        (["test_1", "run_2", "run_3"], ["run_2"]),
    ],
)
def test_names_tell_what_is_held_out_where_they_mean_it(names, held) -> None:
    roles, _ = roles_of([f"{name}.csv" for name in names], [False] * len(names))
    assert [name for name, role in zip(names, roles, strict=True) if role == "holdout"] == held

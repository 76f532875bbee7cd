"""A study learns the effect that somebody else's generator hid, and says so in its verdict."""

from __future__ import annotations

import re

import pandas as pd
import pytest

from bristle.cli import main
from bristle.core.progress import telling
from bristle.diagnosis import Diagnosis
from bristle.errors import RecordError, StudyError
from bristle.study import steps
from bristle.study.api import diagnose
from bristle.study.auto import complete
from bristle.study.steps import (
    add_effects,
    before_after,
    compare_study,
    create_study,
    diagnose_study,
    predictions,
)
from bristle.study.study import Study
from bristle.study.view import added_view
from bristle.view.terminal import text
from tests.independent.generate import make_case

UNITS = {"time": "s", "displacement": "m", "velocity": "m/s", "voltage": "V", "force": "N"}


@pytest.fixture
def study(bench_study):
    """Return the study of a bench with a hidden gas spring, which a test may change."""
    return Study(bench_study)


def test_a_channel_that_the_study_turns_is_told_with_the_verdict(study, monkeypatch):
    nothing = lambda *_given, **_more: Diagnosis("none", (), ("Nothing is missing.",))  # noqa: E731
    monkeypatch.setattr(steps, "diagnose_rig", nothing)
    path = study.folder / "study.toml"
    text = path.read_text()
    begin = text.index("[channels.force]")
    path.write_text(text[:begin] + text[begin:].replace("sign = 1", "sign = -1", 1))
    diagnose_study(Study(study.folder))
    told = Study(study.folder).verdict()
    assert told is not None
    assert told["sensors"] == []  # a sign that the study turns is no fault of a sensor
    assert "Force has the other sign in its files; study.toml reverses it." in told["notes"]


def test_before_and_after_are_the_models_that_diagnose_and_add_have_judged(study):
    verdict = study.verdict()
    pair = before_after(study)
    assert (pair.effects, pair.step) == (("gas_spring",), None)
    found = predictions(study, pair)
    assert found.z_before == pytest.approx(compare_study(study).z, rel=1e-9)
    # Refitted as the diagnosis had it; the noise expected of it is drawn anew.
    assert found.z_after == pytest.approx(verdict["z_holdout_after"], rel=0.01)
    assert pair.after.values == {**pair.after.values, **verdict["refined"]["values"]}

    step = add_effects(study, ["gas_spring"]).step
    added = before_after(study)
    assert (added.effects, added.step) == (("gas_spring",), step.number)
    assert added.before.effects == ()
    again = predictions(study, added)
    assert again.z_before == pytest.approx(step.before["z_holdout"], rel=0.01)
    assert again.z_after == pytest.approx(compare_study(study).z, rel=1e-9)
    study.undo()  # the verdict on the model before is there again, with what it refined
    assert before_after(study) == pair


def test_what_a_diagnosis_refined_is_of_its_own_model_and_law(study):
    verdict = study.verdict()
    other = {"laws": [{}], "law": "lugre", "command": "linear", "law_before": "bingham"}
    study.write_verdict({**verdict, **other})
    assert before_after(study) is None
    study.write_verdict({key: verdict[key] for key in verdict if key != "refined"})
    assert before_after(study) is None  # a verdict that an earlier version wrote


def test_adding_tells_where_the_verdict_is_about_another_law(study):
    study.write_verdict({**study.verdict(), "law": "lugre", "command": "linear"})
    added = add_effects(study, ["gas_spring"])
    assert added.as_dict()["other_law"] == "lugre"
    told = text(added_view(added, study.folder))
    assert "The verdict is about the law lugre; this model has bingham." in told
    assert "--law lugre" in told


def test_a_unit_in_the_title_of_a_column_is_not_told_twice(study, tmp_path, capsys):
    files = [str(path) for path in sorted((study.folder / "data").glob("*.csv"))]
    assert main(["study", "new", str(tmp_path / "again"), "--data", *files]) == 0
    told = capsys.readouterr().out
    assert re.search(r"^  force +force \[N\]  +its name", told, re.MULTILINE)


def test_an_effect_that_is_there_already_is_refused(study):
    with pytest.raises(StudyError, match="in the model already"):
        add_effects(study, ["gas_spring", "gas_spring"])
    assert study.model().effects == ()


def test_an_effect_of_the_other_law_is_refused(study, tmp_path):
    files = sorted((study.folder / "data").glob("*.csv"))
    other = create_study(tmp_path / "other", files, law="lugre").study
    with pytest.raises(StudyError, match="cannot join the law lugre; it joins bingham"):
        add_effects(other, ["presliding"])
    assert len(other.steps()) == 1


@pytest.mark.parametrize("command", ["diagnose", "add", "study auto"])
def test_a_folder_that_is_no_study_is_refused(tmp_path, capsys, command):
    words = [*command.split(), str(tmp_path)] + (["gas_spring"] if command == "add" else [])
    assert main(words) == 2
    assert str(tmp_path) in capsys.readouterr().err


class Killed(BaseException):
    """Stands for a signal: nothing may catch it."""


@pytest.mark.slow  # curves are learned, stopped midway, and learned on
def test_what_was_learnt_before_a_kill_is_kept(study):
    steps = len(study.steps())

    def killed(_text):
        if len(study.steps()) > steps:
            raise Killed

    with telling(killed), pytest.raises(Killed):
        complete(study)
    again = Study(study.folder)
    assert list(again.model().effects) == ["gas_spring"]
    assert len(again.steps()) == steps + 1
    learnt = complete(again)
    assert learnt.verdict.kind == "none"
    assert learnt.steps == ()
    assert len(again.steps()) == steps + 1


def test_a_kill_within_a_diagnosis_leaves_the_study_as_it_was(study, monkeypatch):
    before = (study.folder / "verdict.json").read_text()

    def killed(*_arguments, **_choices):
        raise Killed

    monkeypatch.setattr(steps, "diagnose_rig", killed)
    with pytest.raises(Killed):
        complete(study)
    assert Study(study.folder).model().effects == ()
    assert (study.folder / "verdict.json").read_text() == before


@pytest.mark.slow  # a diagnosis of frames; by default one of files
def test_frames_are_diagnosed_without_a_study():
    case = make_case(1, "gas_spring", strength=0.15, duration=4.0)
    frames = {
        run["name"]: pd.DataFrame({f"{name} [{UNITS[name]}]": run[name] for name in UNITS})
        for run in case.runs
        if run["name"] in ("train_1", "train_2", "holdout_1")
    }
    held = {"holdout_1": frames.pop("holdout_1")}
    found = diagnose(frames, "bingham", holdout=held)
    assert (found.kind, found.effects) == ("effect", ("gas_spring",))
    first, second = frames.values()
    again = diagnose([first, *held.values(), second], "bingham")  # every third run is held out
    assert again.after.z == pytest.approx(found.after.z)


def test_no_frame_is_no_diagnosis():
    with pytest.raises(RecordError, match="one run or more"):
        diagnose([])

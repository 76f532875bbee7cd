"""A law and its effects sought together, and unknown errors lowered effect by effect."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from studies import case_study

from bristle.cli import main
from bristle.diagnosis.trials import Trial, judge
from bristle.errors import StudyError
from bristle.identification.histories import counted
from bristle.model.model import Model, new_model
from bristle.physics.building import paper_building
from bristle.physics.effect import EFFECTS
from bristle.study import auto, steps
from bristle.study.api import diagnose, identify
from bristle.study.auto import MOST_EFFECTS, complete
from bristle.study.forms import law_command, law_or_all, with_law
from bristle.study.history import Step
from bristle.study.learn import opened_at
from bristle.study.steps import add_unproven, create_study, diagnose_study
from bristle.study.study import Study
from bristle.study.unproven import unproven
from bristle.study.view import next_steps
from tests.independent.generate import make_case
from tests.made import bench_run, write_runs

NOISE = np.random.default_rng(1).standard_normal(6000) ** 2
NAMES = ("gas_spring", "stribeck", "coil_lag", "saturation", "drift", "asymmetry")


def trial(z, *effects):
    losses = NOISE / NOISE.mean() * z**2
    return Trial(Model("bingham", effects), z, z, z, losses, np.sqrt(NOISE))


def verdict(kind, z, *gains):
    """Return a diagnosis of a model with this z; `gains` are z with one more effect."""
    tried = tuple(trial(after, name) for name, after in gains)
    return SimpleNamespace(
        kind=kind, effects=(), before=trial(z), trials=tried, laws=None, findings={},
        noise_known=True,
    )  # fmt: skip


class Folder:
    """A study in name alone: it counts the effects of its model."""

    settings = SimpleNamespace(law="", has_building=False, runs=())
    history = SimpleNamespace(numbers=lambda: [])
    folder = Path("nowhere")

    def __init__(self):
        self.names = []

    def model(self):
        found = new_model("bingham").with_values({"f_c": 1.0})
        return SimpleNamespace(law="bingham", facts=found.facts, effects=list(self.names))


@pytest.fixture
def folder(monkeypatch):
    """Return a folder to which `add_effects` adds, without any fit."""
    made = Folder()

    def add(study, names, **_given):
        study.names += names
        return SimpleNamespace(step=f"add {names[0]}")

    monkeypatch.setattr(auto, "add_effects", add)
    monkeypatch.setattr(auto, "promise_of", lambda *_given: 0.6)
    return made


def told(monkeypatch, answers):
    """Let the diagnoses be these, one after the other."""
    found = iter(answers)
    monkeypatch.setattr(auto, "diagnose_study", lambda _study, **_given: next(found))


@pytest.mark.parametrize(
    ("kind", "left", "most"),
    [("unknown", 0.2, inf), ("ambiguous", 0.2, inf), ("unknown", 0.1, inf), ("unknown", 0.1, -1.0)],
)
def test_an_error_that_remains_is_lowered_by_what_is_not_proven(
    folder, monkeypatch, kind, left, most
):
    """Where it takes half of the error, the verdict is made anew: here nothing is missing then.

    Unless enough was spent.
    """
    found = verdict(kind, 6.0, ("stribeck", 4.0))
    told(monkeypatch, [found, verdict("none", 1.0)])
    step = Step(2, "add stribeck, drift (not proven)", "", {"error_share_holdout": 0.25})
    step.after["error_share_holdout"] = left
    asked, added = [], []

    def chosen(*given):
        asked.append(given)
        model = Model("bingham", ("stribeck", "drift"))
        return SimpleNamespace(model=model, law="", written={}, cut=most < 0.0)

    def add(_study, law, names, values, of):
        added.append((law, names, of))
        return step, ""

    monkeypatch.setattr(auto, "opened_at", lambda *_: ("damper", "opened"))
    monkeypatch.setattr(auto, "write_effects", lambda _study, _texts: None)
    monkeypatch.setattr(auto, "unproven", chosen)
    monkeypatch.setattr(auto, "add_unproven", add)
    with counted(most):
        done = complete(folder)
    assert asked == [("opened", found.trials, (), MOST_EFFECTS, True)]
    assert added == [("", ("stribeck", "drift"), found)]
    assert done.steps == done.unproven == (step,)
    stays = left > 0.125 or most < 0.0
    assert done.verdict.kind == (kind if stays else "none")
    assert done.anew is not stays
    assert bool(done.refuted) is (most < 0.0)
    assert done.promise == (0.6 if stays else 1.0)


def test_where_held_out_runs_refute_a_dependence_on_a_label_the_look_goes_on_without(
    folder, monkeypatch
):
    told(monkeypatch, [verdict("unknown", 6.0)])
    by_oil = SimpleNamespace(labels={"oil": "oil"})
    monkeypatch.setitem(EFFECTS, "f_c_by_oil", by_oil)
    step = Step(2, "add stribeck (not proven)", "")

    def chosen(_opened, _trials, _laws, _most, labels):
        names = ("f_c_by_oil",) if labels else ("stribeck",)
        return SimpleNamespace(model=Model("bingham", names), law="", written={}, cut=False)

    def add(_study, _law, names, _values, _of):
        return (step, "") if names == ("stribeck",) else (None, "Not kept: add f_c_by_oil.")

    monkeypatch.setattr(auto, "opened_at", lambda *_: ("damper", "opened"))
    monkeypatch.setattr(auto, "write_effects", lambda _study, _texts: None)
    monkeypatch.setattr(auto, "unproven", chosen)
    monkeypatch.setattr(auto, "add_unproven", add)
    done = complete(folder)
    assert done.unproven == (step,)
    assert done.refuted == "Not kept: add f_c_by_oil."


def test_what_the_held_out_runs_refute_is_not_kept(bench_study, monkeypatch):
    study = Study(bench_study)
    found, before = diagnose_study(study), study.model()
    worse = SimpleNamespace(model=before, before={"error_share_holdout": 0.079})
    worse.after = {"error_share_holdout": 0.121}
    monkeypatch.setattr(steps, "identify_with", lambda *_given: worse)
    step, why = add_unproven(study, "", ("flattening",), before.values, found)
    assert step is None
    assert why.startswith("Not kept: add flattening.")
    assert "rises from 7.9 % to 12.1 % of the force" in why
    assert study.model().values == before.values


def test_only_what_is_proven_is_added_where_that_is_asked_for(folder, monkeypatch):
    told(monkeypatch, [verdict("unknown", 6.0, ("stribeck", 4.0))])
    assert complete(folder, proven=True).steps == ()
    assert folder.names == []


def test_what_is_explained_gets_no_further_effect(folder, monkeypatch):
    told(monkeypatch, [verdict("none", 1.0)])
    done = complete(folder)
    assert not done.unproven
    assert done.promise == 1.0
    assert folder.names == []


@pytest.mark.parametrize("most", [inf, -1.0])
def test_a_named_effect_is_added_unless_enough_was_spent(folder, monkeypatch, most):
    first = verdict("effect", 6.0)
    first.effects = ("stribeck",)
    told(monkeypatch, [first, verdict("none", 1.0)])
    with counted(most):
        done = complete(folder)
    enough = most < 0.0
    assert folder.names == ([] if enough else ["stribeck"])
    assert done.verdict.kind == ("effect" if enough else "none")
    assert bool(done.refuted) is enough


def test_folds_of_the_training_runs_choose_what_lowers_their_error(bench_study):
    study = Study(bench_study)
    opened = opened_at(study, "", with_law(study.model(), "bingham_standard"))[1]
    assert opened.before.model.law == "bingham"  # the variant is in its values
    opened = opened_at(study, "")[1]
    found = unproven(opened, (), (), 1)
    assert (found.model.effects, found.law) == (("gas_spring",), "")
    known = replace(opened, before=judge(found.model, opened.problem, opened.held_out))
    assert unproven(known, (), (), 2).model.effects == ("gas_spring",), "nothing else is missing"
    stood_in = judge(opened.before.model.with_effect("duffing"), opened.problem, opened.held_out)
    found = unproven(opened, (stood_in,), (), 2)
    assert found.model.effects == ("gas_spring",), "what came first has nothing left to do"


def test_in_a_building_identify_alone_refuses_all_laws():
    run = bench_run(1, seconds=2.0)
    with pytest.raises(StudyError, match=r"on a test bench alone.* let diagnose seek it"):
        identify(run, "all", building=paper_building())


def test_a_model_takes_another_law_with_the_effects_that_can_join_it():
    model = new_model("bingham", ("gas_spring", "stribeck"))
    assert list(with_law(model, "dahl[quadratic]").effects) == ["gas_spring", "stribeck"]
    assert list(with_law(model, "bouc_wen").effects) == ["stribeck"]  # it has a spring
    assert law_command("rig", "lugre_standard[quadratic]").split()[1:] == [
        "identify", "rig", "--law", "lugre_standard", "--command", "quadratic",
    ]  # fmt: skip
    assert law_command("rig", "dahl").endswith("rig --law dahl")


def test_a_law_that_nobody_chose_is_sought_until_the_model_has_another_or_an_effect(tmp_path):
    files = write_runs(tmp_path / "lab", seconds=2.0)
    free = create_study(tmp_path / "free", files).study
    assert 'law = "all"' in (free.folder / "study.toml").read_text()
    assert (free.model().law, law_or_all(free, None)) == ("lugre", "all")
    assert law_or_all(free, "lugre") == "lugre"
    free.add_step("add gas_spring", "by hand", new_model("lugre", ("gas_spring",)), {}, {})
    assert law_or_all(free, None) is None
    free.add_step("identify tanh", "by hand", new_model("tanh"), {}, {})
    assert law_or_all(free, None) is None
    assert law_or_all(free, "all") == "all"
    chosen = create_study(tmp_path / "chosen", files, law="lugre").study
    assert "law" not in (chosen.folder / "study.toml").read_text()
    assert law_or_all(chosen, None) is None


def test_a_law_that_there_is_not_is_told_with_those_that_there_are(tmp_path):
    study = create_study(tmp_path / "rig", write_runs(tmp_path / "lab", seconds=2.0)).study
    with pytest.raises(StudyError, match=r'no law "bingam"\. Did you mean "bingham"'):
        diagnose_study(study, law="bingam")


def test_study_toml_takes_all_laws_or_none(tmp_path):
    path = create_study(tmp_path / "rig", write_runs(tmp_path / "lab", seconds=2.0)).study.folder
    text = (path / "study.toml").read_text()
    (path / "study.toml").write_text(text.replace('law = "all"', 'law = "dahl"'))
    with pytest.raises(StudyError, match=r':5: law = .*"dahl".*"all", which seeks the law'):
        Study(path).settings  # noqa: B018


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """Return the folder of a study of a Bingham damper with a hidden gas spring, begun as LuGre."""
    case = make_case(1, "gas_spring", strength=0.15, duration=4.0)
    study = Study(case_study(case, tmp_path_factory.mktemp("law_free")))
    study.add_step("begin", "by hand", new_model("lugre"), {}, {})
    return study.folder


@pytest.mark.slow  # law free: every law with every effect
def test_the_pair_of_law_and_effect_is_found(hidden, capsys):
    assert main(["diagnose", str(hidden), "--law", "all"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("Missing from the law bingham: gas spring.")
    assert 0 < shown.find("--law bingham\n") < shown.find("bristle add")
    found = json.loads((hidden / "verdict.json").read_text())
    assert (found["schema"], found["kind"], found["effects"]) == (2, "effect", ["gas_spring"])
    assert (found["law"], found["command"], found["law_before"]) == ("bingham", "linear", "lugre")
    best = found["laws"][0]
    assert best["law"] not in ("bingham", "lugre")  # a law with a spring stands for the missing one
    assert found["z_holdout_after"] < 1.1 < best["z_holdout"]
    with pytest.raises(StudyError, match="has the law lugre"):
        diagnose_study(Study(hidden), law="dahl")


@pytest.mark.slow  # law free by study auto
def test_auto_takes_the_law_and_adds_the_effect(hidden):
    study = Study(hidden)
    done = complete(study, law="all")
    assert (study.model().law, list(study.model().effects)) == ("bingham", ["gas_spring"])
    assert done.verdict.kind == "none"
    assert [step.what for step in done.steps] == ["identify bingham", "add gas_spring"]
    taken = done.steps[0]
    kept = json.loads((hidden / "history" / f"{taken.number:03}" / "verdict.json").read_text())
    error = kept["error"]["holdout"]["share"]
    assert error == taken.after["error_share_holdout"]  # of the model that the step keeps


@pytest.mark.slow  # law free: every law with every effect
def test_no_effect_is_named_where_a_law_explains_the_runs():
    case = make_case(2, "none", duration=4.0)
    runs = [
        {name: run[name] for name in ("time", "displacement", "velocity", "voltage", "force")}
        for run in case.runs
    ]
    held_out = [runs[k] for k, run in enumerate(case.runs) if run["role"] == "holdout"]
    train = [runs[k] for k, run in enumerate(case.runs) if run["role"] == "train"]
    found = diagnose(train, "all", holdout=held_out)
    assert (found.kind, found.effects, found.law) == ("none", (), "bingham")
    fitted = identify(train, "all", holdout=held_out)
    assert fitted.model.law.startswith("bingham")
    assert len(fitted.as_dict()["laws"]) == len(fitted.laws) > 8


def test_laws_of_which_two_effects_were_not_tried_are_advised_first() -> None:
    verdict = {"kind": "unknown", "not_tried": {"two_effects": ["dahl[quadratic]", "dahl"]}}
    first, second, *_ = next_steps(verdict, Path("rig"))
    assert first.command == "bristle study auto rig --law dahl"
    assert second.command == "bristle learn rig"

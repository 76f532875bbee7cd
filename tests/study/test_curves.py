"""`bristle learn`: what a study's library has no name for becomes an effect of the study."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bristle.cli import main
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.trials import Trial
from bristle.diagnosis.verdict import SCHEMA
from bristle.errors import StudyError
from bristle.identification.problem import Problem
from bristle.learning.closed_forms import Closed, formula_of
from bristle.learning.curve import Curve
from bristle.learning.fit import Fitted, LearnedCurve
from bristle.learning.result import LearnedEffect
from bristle.learning.view import draw_curve
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.study import learn as curves
from bristle.study.identify import identify_study
from bristle.study.learn import learn_effect
from bristle.study.steps import add_effects
from bristle.study.study import Study

OPENED = curves.opened_at
KNOTS = np.linspace(-0.015, 0.015, 13)  # m
NONE = np.zeros(0)


def trial(z: float) -> Trial:
    return Trial(Model("bingham"), z, z, 0.1 * z, NONE, NONE)


def found_of(refused: str = "", **other: Any) -> LearnedCurve:
    """Return a spring of 300 N/m, or another curve, that was learned, or refused."""
    curve = Curve("force", "displacement", (), tuple(KNOTS), tuple(300.0 * KNOTS))
    best = replace(Fitted(curve, (0.05,) * 13, trial(1.02), 1.0), **other)
    return LearnedCurve("learned_1", trial(6.0), best, (), refused)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return the folder of a study of a bench whose bore is worn at mid-stroke."""
    folder = tmp_path_factory.mktemp("curves") / "rig"
    assert main(["example", "bench", str(folder), "--effect", "worn_bore", "--quiet"]) == 0
    return folder


@pytest.fixture
def study(made, tmp_path):
    return Study(shutil.copytree(made, tmp_path / "rig"))


@pytest.fixture
def learned(monkeypatch):
    """Let nothing be fitted: what was learned is given."""

    def given(refused: str = "") -> None:
        monkeypatch.setattr(curves, "opened_at", lambda study, at: ("damper", None))

        def learn(_opened, name, **_options):
            return replace(found_of(refused), name=name)

        monkeypatch.setattr(curves, "learn", learn)
        monkeypatch.setattr(curves, "close", lambda *_: None)

    return given


def test_a_curve_that_no_study_could_read_is_refused_and_nothing_is_written(
    study, learned, monkeypatch
):
    learned()
    monkeypatch.setattr(curves, "flaw_of", lambda name, text: "force jumps by 3 with q.v.")
    found = learn_effect(study)
    assert found.file is None
    assert found.sentences()[0].startswith("Nothing was learned. An added force along ")
    assert found.sentences()[0].endswith(" can be no effect: force jumps by 3 with q.v.")
    assert not list(study.effects_folder.glob("learned_*.py"))


def test_a_learned_curve_is_an_effect_of_the_study(study, learned):
    learned()
    found = learn_effect(study)
    assert found.file == study.effects_folder / "learned_1.py"
    assert "KNOTS" in found.file.read_text()
    assert found.picture is not None
    assert found.picture.read_bytes().startswith(b"\x89PNG")
    # The report shows what was learned from here.
    kept = json.loads((study.reports_folder / "learned_1.json").read_text())
    assert kept == found.as_dict()
    first, second = found.sentences()
    assert "from 6.00 to 1.02" in first
    assert "a spring of 300 N/m" in second
    # bristle made the file here: its text needs no consent, and the next one has another name.
    assert study.usable_effects() == []
    told = json.loads(json.dumps(found.as_dict()))
    assert told["forms"][0]["name"] == "line"
    ends = np.array(told["knots"])[[0, -1]]
    assert np.array(told["nearest"]["along"])[[0, -1]] == pytest.approx(ends)
    assert np.array(told["nearest"]["values"]) == pytest.approx(
        found.forms[0].at(np.array(told["nearest"]["along"]))
    )
    again = learn_effect(study)
    assert again.file is not None
    assert again.file.name == "learned_2.py"


def beside(monkeypatch, study, name: str = "") -> None:
    """Let another process learn a curve of the same study while a first one is learned."""
    learn = curves.learn

    def slow(opened, own, **options):
        monkeypatch.setattr(curves, "learn", learn)
        learn_effect(Study(study.folder), name=name)
        return learn(opened, own, **options)

    monkeypatch.setattr(curves, "learn", slow)


def test_of_two_curves_learned_at_once_each_has_a_name(study, learned, monkeypatch):
    learned()
    beside(monkeypatch, study)
    first = learn_effect(study)
    assert first.file == study.effects_folder / "learned_2.py"
    assert first.name == "learned_2"
    assert study.usable_effects() == []
    assert "learned_2 is an added force" in first.sentences()[0]
    for name in ("learned_1", "learned_2"):
        assert f'name = "{name}"' in (study.effects_folder / f"{name}.py").read_text()
        assert json.loads((study.reports_folder / f"{name}.json").read_text())["name"] == name


def test_a_name_that_was_taken_meanwhile_is_refused(study, learned, monkeypatch):
    learned()
    beside(monkeypatch, study, "bore")
    with pytest.raises(StudyError, match='an effect is named "bore" already'):
        learn_effect(study, name="bore")


def test_what_is_refused_leaves_the_study_as_it_was(study, learned):
    learned("The best curve does not lower the error.")
    before = sorted(path.name for path in study.folder.rglob("*"))
    found = learn_effect(study)
    assert found.file is None
    assert found.sentences() == ["Nothing was learned. The best curve does not lower the error."]
    assert sorted(path.name for path in study.folder.rglob("*")) == before


class House:
    """The sites of a building as `learn_effect` asks for them, with the z of each."""

    lacking = None

    def __init__(self, **z: float) -> None:
        self.z = z

    def sites(self):
        return tuple(self.z)

    def prepare(self, site):
        problem = Problem([])
        return Prepared(trial(self.z[site]), problem, problem)


@pytest.fixture
def house(study, learned, monkeypatch):
    """Let the study be that of a building in which nothing is learned."""
    learned("No curve lowers the error.")
    monkeypatch.setattr(type(study.settings), "has_building", True)
    monkeypatch.setattr(curves, "opened_at", OPENED)
    monkeypatch.setattr(curves, "_rig", lambda _: House(damper=3.0, layer=1.2, storey1=2.0))
    return study


def test_in_a_building_a_curve_is_learned_where_the_model_errs_most(house):
    assert learn_effect(house).sentences()[0] == (
        "Nothing was learned at the damper. No curve lowers the error."
    )


def test_where_the_verdict_is_unknown_comes_first(house):
    found = [{"site": "damper", "kind": "effect"}, {"site": "layer", "kind": "unknown"}]
    house.write_verdict({"schema": SCHEMA, "kind": "unknown", "findings": found})
    assert "at the isolation layer." in learn_effect(house).sentences()[0]
    assert "at storey 1." in learn_effect(house, at="storey1").sentences()[0]


def test_a_site_that_the_runs_do_not_show_is_refused(house):
    with pytest.raises(StudyError, match=r"the site storey7; they show damper, layer, storey1"):
        learn_effect(house, at="storey7")


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"parts": ["yield"]}, "the isolation layer has no yield; there are force, friction"),
        ({"along": ["voltage"]}, "the isolation layer has no voltage; there are displacement"),
        ({"parts": ["spring"], "along": ["displacement"]}, "no such part is learned"),
    ],
)
def test_what_a_layer_does_not_have_is_refused(house, asked, told):
    with pytest.raises(StudyError, match=told):
        learn_effect(house, at="layer", **asked)


def test_the_stiffness_beside_a_curve_is_told(study, learned, monkeypatch):
    learned()
    line = replace(trial(1.01), model=Model("linear_layer", (), {"k": 1012.3}))
    curve = Curve("slip", "slip", (), (0.0004, 0.009), (0.4, 0.8), at="layer")
    found = found_of(curve=curve, std=(0.01,) * 2, trial=line)
    monkeypatch.setattr(curves, "learn", lambda *_, **__: found)
    assert learn_effect(study).sentences()[-1] == (
        "Beside it, the linear stiffness there is 1012 N/m."
    )


def test_elastic_slip_elements_are_told_one_by_one(study, learned, monkeypatch):
    learned()
    curve = Curve("slip", "slip", (), (0.0004, 0.002, 0.009), (0.4, 0.0, 0.8))
    found = found_of(curve=curve, std=(0.01,) * 3)
    monkeypatch.setattr(curves, "learn", lambda *_, **__: found)
    first, second = learn_effect(study).sentences()
    assert first.startswith("learned_1 is parallel elastic-slip elements. With it")
    assert second == "They give way with 0.4 N at 0.4 mm, 0.8 N at 9 mm of travel."


def test_a_surface_is_told_with_what_its_data_do_not_reach(study, learned, monkeypatch):
    learned()
    knots, levels = (-0.01, 0.0, 0.01), (0.0, 2.0, 8.0)
    values = tuple(2.0 * np.tanh(200.0 * x - V + 3.0) for V in levels for x in knots)
    surface = Curve(
        "force", "displacement", (), knots, values, (8,), across="voltage", levels=levels,
    )  # fmt: skip
    found = found_of(curve=surface, std=(0.05,) * 9)
    monkeypatch.setattr(curves, "learn", lambda *_, **__: found)
    told = learn_effect(study)
    assert told.sentences()[0].startswith(
        "learned_1 is an added force over displacement and the command."
    )
    assert told.sentences()[1].startswith("1 of its 9 values continues")
    assert told.as_dict()["continued"] == ["row_3[3]"]
    assert told.picture.stat().st_size > 10_000
    assert 'assumed = ("row_3[3]",)' in told.file.read_text()


def test_a_formula_over_a_memory_is_written_with_the_time_that_was_fitted(
    study, learned, monkeypatch
):
    learned()
    knots = np.linspace(0.0, 0.1, 13)  # m/s
    curve = Curve("force", "recent_speed", (("tau", 0.5),), tuple(knots), tuple(30.0 * knots))
    found = found_of(curve=curve)
    monkeypatch.setattr(curves, "learn", lambda *_, **__: found)

    def closed(_opened, _name, _best, forms):
        formula = formula_of(forms[0], curve)
        values = {f"learned_1.{n}": value for n, value, _ in formula.parameters}
        model = Model("bingham", ("learned_1",), values | {"learned_1.tau": 0.7})
        std = dict.fromkeys(("tau", *(n for n, _, _ in formula.parameters)), 0.01)
        return Closed(forms[0], formula, replace(trial(1.01), model=model), std)

    monkeypatch.setattr(curves, "close", closed)
    told = learn_effect(study)
    study.usable_effects()
    assert EFFECTS["learned_1"].parameters["tau"].value == pytest.approx(0.7)
    assert "KNOTS" not in told.file.read_text()


def test_a_dry_run_writes_no_effect(study, learned):
    learned()
    assert learn_effect(study, write=False).file is None
    assert not (study.effects_folder / "learned_1.py").exists()


def test_a_name_that_is_taken_is_refused(study, learned):
    learned()
    with pytest.raises(StudyError, match="gas_spring"):
        learn_effect(study, name="gas_spring")


@pytest.mark.parametrize("name", ["two words", "1st", "../outside", "class"])
def test_a_name_that_is_no_word_is_refused(study, learned, name):
    learned()
    with pytest.raises(StudyError, match="name"):
        learn_effect(study, name=name)
    assert not list(study.folder.parent.glob("outside*"))


@pytest.mark.parametrize(("option", "value"), [("--along", "speeds"), ("--as", "yields")])
def test_a_signal_or_part_that_there_is_not_is_told(study, capsys, option, value):
    assert main(["learn", str(study.folder), option, value]) == 2
    told = capsys.readouterr().err
    assert value in told
    assert "Did you mean" in told


@pytest.mark.slow  # a formula is learned and compiled
def test_the_hidden_formula_comes_back_and_the_study_goes_on_with_it(study):
    identify_study(study)
    found = learn_effect(Study(study.folder))
    assert found.closed is not None
    assert found.closed.form.name == "bell"
    assert found.closed.trial.z < 1.05
    values = {name: value for name, value, _ in found.closed.formula.parameters}
    assert values["m"] == pytest.approx(-0.4714, rel=5e-3)  # sealed/answer.txt of this seed
    assert values["d"] == pytest.approx(5.201e-3, rel=5e-3)  # m
    added = add_effects(Study(study.folder), ["learned_1"])
    assert added.identified.after["z_holdout"] < 1.05
    # Nothing is left: a second curve is refused.
    again = learn_effect(Study(study.folder))
    assert again.file is None
    assert "Nothing was learned" in again.sentences()[0]


def test_a_value_that_the_runs_hardly_tell_flattens_no_others():
    y = 300.0 * KNOTS
    wild = (*(0.05,) * 12, 100.0 * float(np.ptp(y)))
    (axes,) = draw_curve(LearnedEffect(found_of(std=wild))).figure.axes
    low, high = axes.get_ylim()
    (line,) = [one for one in axes.lines if one.get_label() == "learned"]
    shown = np.ptp(line.get_ydata())
    assert 1.0 <= (high - low) / shown <= 3.5

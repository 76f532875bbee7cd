"""What a study's outputs say of it: its runs, how the error fell, what is still to be seen."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from bristle.diagnosis.law_trials import OtherLaw
from bristle.model.model import new_model
from bristle.study import RunFile, Settings, Step
from bristle.study.steps import Created
from bristle.study.view import created_view, diagnosed_view, story_view, study_view
from bristle.view import terminal

BEGAN, NOW = new_model("bingham"), new_model("bingham", ("gas_spring",))
FULL = {"z_holdout": 1.0, "error_holdout": 0.5, "error_share_holdout": 0.05}
ERROR = {
    "rms": 0.5, "share": 0.05, "rms_counted": 0.5, "signal_counted": 10.0, "rms_all": 0.5,
    "signal_all": 10.0, "samples": 1000, "total": 1000, "left_out": {},
}  # fmt: skip
LESS = {**ERROR, "rms": 0.25, "share": 0.025, "rms_counted": 0.25, "rms_all": 0.25}
FOUND = {
    "site": "damper", "kind": "effect", "effects": ["duffing"], "z_holdout_before": 3.0,
    "error_holdout_before": ERROR, "error_holdout_after": LESS,
}  # fmt: skip
EFFECT = {
    "kind": "effect", "effects": ["duffing"], "error": {"holdout": ERROR}, "findings": [FOUND],
}  # fmt: skip


def study(*after, roles=("train", "holdout")):
    """Return a study whose last step added an effect; `after` is what each step came to."""
    steps = [Step(0, "begin with bingham", "made")]
    steps += [Step(k, f"step {k}", "", {}, one) for k, one in enumerate(after, 1)]
    runs = tuple(RunFile(f"data/{k}.csv", role) for k, role in enumerate(roles))
    return SimpleNamespace(
        folder="rig", settings=Settings("A damper", "bench", runs, {}), steps=lambda: steps,
        model=lambda to_show=False: NOW, model_of=lambda step, to_show=False: BEGAN,
        verdict=dict,
    )  # fmt: skip


def told(*after, **verdict):
    return terminal.text(story_view(study(*after), {"kind": "none", **verdict}))


def test_the_error_falls_from_the_first_judged_step_to_the_last():
    before = {**FULL, "error_holdout": 2.5, "error_share_holdout": 0.25}
    assert "held-out runs: 2.5 N (25.0 %) -> 0.5 N (5.0 %)." in told(before, FULL)


def test_of_one_judged_step_the_error_is_told_once():
    assert "Force error on the held-out runs: 0.5 N (5.0 %)." in told(FULL)


def test_what_a_further_effect_gains_is_told():
    assert "with Duffing spring 0.25 N (2.5 %)" in " ".join(told(FULL, **EFFECT).split())


def test_no_effect_is_advised_beside_a_model_that_the_verdict_did_not_see():
    lower = {"effects": [], "gains": [{"effects": ["stribeck"], "gain": 0.5}]}
    shown = told(FULL, kind="unknown", law="lugre", **lower)
    assert "bristle compare rig" in shown
    assert "bristle add" not in shown


def test_a_law_that_explains_what_is_named_is_told_whatever_the_length():
    other = OtherLaw("tanh[quadratic]", 0.96, 0.998)
    found = {**FOUND, "other_law": other.as_dict()}
    long = [f"Reason {k}. {'It is long. ' * 30}".strip() for k in range(4)]
    verdict = {**EFFECT, "findings": [found], "reasons": [*long, other.sentence(added=True)]}
    shown = " ".join(terminal.text(diagnosed_view(verdict, Path("rig"))).split())
    assert "the law tanh with a quadratic command leaves 0.96 times the noise" in shown
    assert "Next: bristle diagnose rig --law all # tries every law" in shown
    assert "bristle add rig duffing" in shown


@pytest.mark.parametrize(
    ("roles", "says"),
    [
        (("train",), "1 run, its last part held out."),
        (("train", "holdout"), "2 runs, 1 of them held out."),
        (("train", "train"), "2 runs, 0 of them held out."),
    ],
)
def test_of_a_single_run_the_last_part_is_held_out(roles, says):
    own = study(roles=roles)
    made = Created((), {}, (), (), own)
    assert created_view(made).title == f"rig: a study of {says}"
    assert f"rig: {says}" in terminal.text(study_view(own))

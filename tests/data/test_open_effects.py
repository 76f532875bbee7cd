"""What limits leave open: sizes whose 95 % point is the limit, and models with such an effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bristle.errors import StudyError
from bristle.model.draws import (
    LeftOpen,
    OpenEffect,
    has_covariance,
    in_short,
    joint_errors,
    left_open,
    open_effects,
    simulated_whole,
    widest,
)
from bristle.model.model import new_model

SPRING = {
    "effect": "gas_spring", "parameter": "k", "unit": "N/m", "side": "below", "limit95": 40.0,
    "others": {}, "moved": {"c_0": -3.0, "f_c": -9.0, "gone": 1.0},
}  # fmt: skip
LAG = {**SPRING, "effect": "coil_lag", "why": "the command is constant"}
CORE = {
    **SPRING, "effect": "saturation", "parameter": "V_s", "side": "above", "limit95": 20.0,
    "others": {"shape": 2.0}, "moved": {},
}  # fmt: skip


def verdict(*limits: dict[str, object], site: str = "damper") -> dict[str, object]:
    return {"findings": [{"site": site, "limits": list(limits)}]}


def spring() -> OpenEffect:
    return open_effects(verdict(SPRING), new_model("bingham"))[0][0]


def test_nineteen_of_twenty_sizes_are_below_the_limit() -> None:
    parts = np.array(spring().parts(2000))
    assert not spring().signed
    assert np.mean(parts < 1.0) == pytest.approx(0.95, abs=1e-3)
    assert parts.min() > 0.0
    ratio = OpenEffect("asymmetry", "asymmetry", "ratio", 0.1, False, {}, {})
    parts = np.array(ratio.parts(2000))
    assert ratio.signed
    assert np.mean(np.abs(parts) < 1.0) == pytest.approx(0.95, abs=1e-3)
    assert np.mean(parts) == pytest.approx(0.0, abs=1e-9)
    for few in (spring().parts(4), ratio.parts(4)):
        assert np.sqrt(np.mean(np.square(few))) == pytest.approx(1.0 / 1.96)


def test_the_effect_joins_and_the_models_own_parameters_move_along() -> None:
    model = new_model("bingham").with_values({"c_0": 60.0, "f_c": 2.0})
    joined = spring().joined(model, 0.5)
    values = joined.values
    assert values["gas_spring.k"] == 20.0
    assert values["c_0"] == 58.5
    assert values["f_c"] == 0.0  # its bound
    assert {values[f"gas_spring.{name}"] for name in ("preload", "k_2", "k_3")} == {0.0}
    assert "gas_spring" not in model.effects


def test_a_parameter_that_is_not_free_does_not_move() -> None:
    model = new_model("bingham").with_values({"c_0": 60.0})
    held = replace(model, fixed=(*model.fixed, "c_0"))
    assert spring().joined(held, 1.0).values["c_0"] == 60.0


def test_an_effect_that_vanishes_as_its_parameter_grows() -> None:
    (core,), *_ = open_effects(verdict(CORE), new_model("bingham"))
    assert (core.falls, core.signed) == (True, False)
    assert core.own(0.5)["V_s"] == 40.0
    assert core.own(2.0)["V_s"] == 10.0
    assert core.own(2.0)["shape"] == 2.0
    assert core.own(0.0)["V_s"] > 1e3  # none of it


def test_what_has_no_limit_or_is_in_the_model_is_not_open() -> None:
    model = new_model("bingham", ("gas_spring",))
    found, _, unlimited = open_effects(verdict(SPRING, LAG, CORE), model)
    assert [one.name for one in found] == ["saturation"]
    assert unlimited == ["coil_lag"]
    assert open_effects({}, model) == ([], [], [])


def test_a_limit_of_the_sampling_is_none_of_the_damper() -> None:
    play = {**SPRING, "effect": "backlash", "parameter": "gap", "limit95": 3e-6, "coarse": True}
    model = new_model("bingham")
    found = open_effects(verdict(SPRING, play), model)
    assert [one.name for one in found.effects] == ["gas_spring"]
    assert found.unresolved == ["backlash"]
    effects, notes = left_open(
        {**verdict(play), "kind": "none", "effects": []}, model, Path("my_rig")
    )
    assert effects == []
    assert notes == [
        "the limit of backlash is only the smallest size that the sampling of the runs resolves: "
        "it widens no band"
    ]
    two = LeftOpen([], ["backlash", "coil_lag"], [])
    assert two.notes(Path("my_rig")) == [
        "the limits of backlash, coil_lag are only the smallest size that the sampling of the runs "
        "resolves: they widen no band"
    ]


def test_a_verdict_that_the_data_do_not_allow_has_no_limits() -> None:
    told = {"kind": "insufficient", "effects": [], "findings": []}
    with pytest.raises(StudyError, match="the data do not allow a verdict"):
        left_open(told, new_model("bingham"), Path("my_rig"))


def test_an_effect_is_drawn_whole_or_not_at_all() -> None:
    whole, lost = simulated_whole({"spring": [1.0, 2.0], "play": [1.0, "it stops"], "none": []})
    assert whole == {"spring": [1.0, 2.0]}
    assert lost == {"play": "it stops"}
    assert in_short("it stops.\n  A shorter step would be right.") == "it stops"


def test_the_widest_effect_is_worth_a_test_from_a_tenth_of_the_variance_on() -> None:
    parts = [{"all": 0.7, "spring": 0.3}, {"all": 1.0}]
    assert widest(parts, ("all",)) == ("spring", pytest.approx(0.15))
    assert widest([*parts, {"all": 1.0}, {"all": 1.0}], ("all",)) == ("", 0.0)
    assert widest([], ("all",)) == ("", 0.0)


def test_what_a_known_effect_takes_up_is_in_the_band_of_its_parameters() -> None:
    taken = {"effect": "duffing", "why": "gas_spring.k_3 of the model absorbs it"}
    by_law = {"effect": "saturation", "why": "f_v of the model absorbs it"}
    assert open_effects(
        verdict(taken, by_law), new_model("bingham", ("gas_spring",))
    ).unlimited == ["saturation"]


def test_a_storeys_limit_is_of_that_storey() -> None:
    soft = {
        **SPRING, "effect": "storey_softening", "parameter": "d_half", "side": "above",
        "limit95": 0.02, "others": {"shape": 2.0}, "moved": {},
    }  # fmt: skip
    both = {"findings": [{"site": f"storey{k}", "limits": [soft]} for k in (1, 2)]}
    found, *_ = open_effects(both, new_model("lugre"))
    assert [one.label for one in found] == ["storey_softening", "storey_softening (storey2)"]
    assert [one.own(1.0)["which"] for one in found] == [1.0, 2.0]


def test_joint_errors_are_those_of_the_covariance() -> None:
    model = new_model("bingham").with_values({"f_c": 2.0, "c_0": 60.0}, {"f_c": 0.2, "c_0": 3.0})
    assert not has_covariance(model)  # whether they go together is not known
    covariance = np.array([[0.04, -0.5], [-0.5, 9.0]])
    model = model.with_covariance(["f_c", "c_0"], covariance)
    assert has_covariance(model)
    errors = joint_errors(model)
    np.testing.assert_allclose(errors.root @ errors.root.T, covariance)
    assert errors.values(np.zeros(2)) == {"f_c": 2.0, "c_0": 60.0}
    assert errors.values(np.array([1e9, 1e9]))["f_c"] in (0.0, errors.high[0])

"""The law of a building's damper, sought with its effects as on a bench."""

from __future__ import annotations

import numpy as np
import pytest
from shaken import building, measured, shake

from bristle.diagnosis import diagnose_rig, law_trials
from bristle.diagnosis.building_numbers import moved
from bristle.diagnosis.rig_runs import BuildingRuns
from bristle.errors import RecordError
from bristle.identification.building_sites import ANY_LAW, blind_at_rest
from bristle.model.model import Model

HOUSE = building(1, True, 3)
FEW = ("tanh", "dahl")


def damper(x, v):
    """A damper's force [N], as the law tanh has it."""
    return 1.2 * np.tanh(v / 0.02) + 8.0 * v


def runs(more=None, **given):
    made = [shake(HOUSE, seed, damper, samples=1500) | (more or {}) for seed in (1, 2, 3)]
    found = [measured(one, k, name=f"run{k}", **given) for k, one in enumerate(made)]
    return found[:2], found[2:]


@pytest.fixture
def few(monkeypatch):
    """Let there be two laws alone."""
    monkeypatch.setattr(law_trials, "law_names", lambda: FEW)


def test_the_law_of_the_damper_is_found_in_the_building(few):
    found = diagnose_rig(*runs(), Model("lugre"), HOUSE, any_law=True, named="lugre")
    assert (found.kind, found.effects, found.law) == ("none", (), "tanh")
    assert set(found.findings) == {"storey1", "layer", "damper"}
    assert [row.law for row in found.laws.rows] == ["tanh", "dahl"]
    told = found.as_dict()
    assert (told["law"], told["law_before"], told["force"]) == ("tanh", "lugre", "measured")


def test_all_laws_are_held_against_the_samples_that_every_law_tells():
    assert blind_at_rest(ANY_LAW)
    assert not blind_at_rest("lugre")
    sought, known = (
        BuildingRuns(*runs(), Model("lugre"), HOUSE, any_law=any_law).damper[0].runs[0]
        for any_law in (True, False)
    )
    assert len(sought.force) < len(known.force)
    assert np.min(np.abs(sought.v)) > np.min(np.abs(known.v))


@pytest.mark.slow  # a building, law free
def test_a_stiffness_that_the_file_has_wrong_is_no_effect_of_the_law_that_is_found(few):
    file = moved(HOUSE, np.array([1.0, 0.0, 0.0, 0.0]))
    hidden = runs({"voltage": np.full(1500, 2.0)}, without=("force",))
    found = diagnose_rig(*hidden, Model("lugre"), file, any_law=True, named="lugre")
    assert (found.kind, found.law) == ("none", "tanh")
    assert "stiffness of isolation -2.7%" in found.words


def test_without_a_damper_no_law_is_sought():
    bare = runs(without=("force",))
    with pytest.raises(RecordError, match="no law of a damper can be sought"):
        diagnose_rig(*bare, Model("lugre"), HOUSE, any_law=True)


def test_the_law_that_is_supposed_keeps_the_effects_of_the_other_sites():
    present = Model("lugre", ("duffing", "gas_spring"), {"duffing.k_3": 1e6, "gas_spring.k": 9.0})
    rig = BuildingRuns(*runs(), present, HOUSE)
    rig.suppose(Model("tanh", ("gas_spring",), {"gas_spring.k": 8.0}))
    assert rig.part("damper").law == "tanh"
    assert rig.part("damper").values == {"gas_spring.k": 8.0}
    assert rig.part("layer").effects == ("duffing",)
    assert rig.part("layer").values == {"duffing.k_3": 1e6}

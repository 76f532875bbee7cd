"""A building's study from its files to an effect added and taken back."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from shaken import building, friction
from studies import house_study

from bristle.diagnosis.conclusion import VerdictContext, conclude
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.errors import StudyError
from bristle.identification.rig import at_site, unassigned
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.study.identify import identify_study


def test_damper_beside_a_hidden_spring_keeps_its_values(tmp_path):
    study = house_study(tmp_path, friction)
    model = study.model().with_effect("duffing")
    found = identify_study(study, model=model, starts=1, write=False)
    assert found.before == {}  # of the law at its defaults nobody asks
    layer = next(note for note in found.notes if "layer: " in note)
    k = float(layer.split("k = ")[1].split()[0])
    assert k == pytest.approx(building(1, True, 6).stiffnesses[0], rel=0.03)
    assert json.dumps(found.as_dict())


def test_effect_without_a_site_is_refused(tmp_path):
    study = house_study(tmp_path)
    model = study.model().with_effect("gas_spring")
    with pytest.raises(StudyError, match=r"gas_spring: acts at no site.*storey1, layer"):
        identify_study(study, model=model)


def test_each_effect_acts_at_its_own_site():
    model = Model("lugre", ("stribeck", "duffing", "storey_softening"), {"sigma_a": 1.0})
    sites = ("damper", "layer", "storey1", "storey2")
    placed = {site: at_site(model, site, sites).effects for site in sites}
    assert placed == {
        "damper": ("stribeck",), "layer": ("duffing",), "storey1": ("storey_softening",),
        "storey2": ("storey_softening",),
    }  # fmt: skip
    second = replace(model, values={"storey_softening.which": 2.0})
    assert at_site(second, "storey1", sites).effects == ()
    assert at_site(model, "damper", ("damper",)).effects == ("stribeck", "duffing")
    assert unassigned(model, ["damper", "layer"]) == ["storey_softening"]


def test_wrong_load_cell_is_a_sensor_fault_and_no_effect():
    cell = SiteDiagnosis("force", "effect", ("force_gain",), 3.0, 1.0, 1.0, 0.01, coordinate="1.15")
    found = conclude({"layer": cell}, VerdictContext())
    assert (found.kind, found.effects) == ("none", ())
    assert [(f.channel, f.kind, f.value) for f in found.sensors] == [("force", "gain", 1.15)]
    assert "1.15 times" in found.as_dict()["sensors"][0]["words"]


def test_mass_of_the_base_is_a_rival_in_words_alone():
    damper = SiteDiagnosis("damper", "effect", ("fluid_inertia",), 2.0, 1.0, 1.0, float("nan"))
    found = conclude({"damper": damper}, VerdictContext("reconstructed"))
    assert (found.kind, found.effects) == ("effect", ("fluid_inertia",))
    assert all(name in EFFECTS for name in found.effects)
    assert found.alternatives == ("a mass of the base that the file does not know",)
    assert "a load cell at the damper would distinguish them" in found.words

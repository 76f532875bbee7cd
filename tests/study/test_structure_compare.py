"""Every site of a building held against its runs: the one that fails is named, others are not."""

from __future__ import annotations

import pytest
from studies import STIFFENING, house_study

from bristle.report.study_page import gather, render
from bristle.study.identify import identify_study
from bristle.study.steps import compare_study, comparer
from bristle.study.study import Study


def dashpot(x, v):
    """Return the force [N] of a damper that the law can follow exactly."""
    return 8.0 * v


SITES = {"damper", "layer", "storey1"}


@pytest.fixture(scope="module")
def stiff(tmp_path_factory) -> Study:
    """Return an identified study of a house whose isolation springs grow stiffer."""
    study = house_study(tmp_path_factory.mktemp("stiff"), dashpot)
    identify_study(study, starts=2)
    return study


@pytest.fixture(scope="module")
def clean(tmp_path_factory) -> Study:
    """Return an identified study of a house that is as its model says."""
    study = house_study(tmp_path_factory.mktemp("clean"), dashpot, None)
    identify_study(study, starts=2)
    return study


def test_the_layer_whose_spring_stiffens_is_the_worst_site_along_displacement(stiff):
    found = compare_study(stiff)
    assert {one.site for one in found.sites} == SITES
    assert [one.z for one in found.sites] == sorted((o.z for o in found.sites), reverse=True)
    worst, *others = found.sites
    assert (found.site, worst.site, worst.fails) == ("layer", "layer", True)
    assert worst.z == found.z > 1.5
    assert worst.pattern.coordinate == found.first.coordinate == "displacement"
    assert not any(one.fails for one in others)
    how, where, _ = found.sentences
    assert "misses the force of the isolation layer" in how
    assert "the damper and storey 1 are right within their noise" in how
    assert where.startswith("The error depends mainly on displacement")
    assert "it pushes back" in where


def test_no_site_of_a_clean_building_fails(clean):
    for role in ("holdout", "train"):
        found = compare_study(clean, role=role)
        assert {one.site for one in found.sites} == SITES
        assert not any(one.fails for one in found.sites)
        assert all(0.85 < one.z < 1.1 for one in found.sites)
        assert found.site == "damper"
        assert "which the noise explains" in found.sentences[0]
        assert "the isolation layer and storey 1 are right within their noise" in found.sentences[0]
        assert "fails" not in " ".join(found.sentences)


@pytest.mark.slow  # a second: another site; by default the layer
def test_a_storey_that_softens_is_named_along_its_drift(tmp_path):
    def softening(x, v):
        force = -3.0e7 * (x[1] - x[0]) ** 3
        return [-force, force]

    study = house_study(tmp_path, dashpot, softening)
    identify_study(study, starts=2)
    found = compare_study(study)
    assert {one.site for one in found.sites if one.fails} == {"storey1"}
    assert found.quantity == "shear of storey 1"
    assert found.first.coordinate == "displacement"
    assert found.sentences[1].startswith("The error depends mainly on drift: ")


def test_a_wrong_damper_is_the_worst_site_of_a_clean_building(clean):
    found = comparer(clean).compare(clean.model().with_values({"c_0": 12.0}))
    assert (found.site, found.sites[0].site) == ("damper", "damper")
    assert found.z > 1.5
    assert {one.site for one in found.sites if one.fails} == {"damper"}


def test_the_site_stays_the_same_for_all_models_of_a_history(stiff):
    against = comparer(stiff)
    better = stiff.model().with_effect("duffing")
    better = better.with_values({"duffing.k_3": STIFFENING, "duffing.shape": 3.0})
    found = against.compare(better)
    assert (against.site, found.site) == ("layer", "layer")
    assert not any(one.fails for one in found.sites)
    assert found.z == pytest.approx(1.0, abs=0.1)
    assert against.compare(better.only(())).z > 1.5


def test_the_report_tells_of_every_site(stiff):
    page = render(gather(stiff))
    for name in ("isolation layer", "storey 1", "damper"):
        assert f">{name}</td>" in page

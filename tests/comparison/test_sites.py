"""Sites of a building: which one fails, which ones chance explains, and how they are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from predictions_made import predictions_with

from bristle.comparison.comparison import compare_sites, site_errors
from bristle.comparison.names import site_names


def spring(along):
    return 2e5 * along["displacement"] ** 3


def building(plants, **choices):
    """Return held runs by site; `plants` name what each site's model misses, None nothing."""
    return {
        site: [
            replace(one, site=site, quantity="force")
            for one in predictions_with(plant, seed=50 + k, **choices)
        ]
        for k, (site, plant) in enumerate(plants.items())
    }


def test_the_site_that_misses_a_spring_is_the_worst_and_the_others_are_right():
    found = compare_sites(building({"damper": None, "layer": spring, "storey1": None}))
    assert [one.fails for one in found.sites] == [True, False, False]
    assert found.site == found.sites[0].site == "layer"
    assert found.sites[0].pattern.coordinate == "displacement"
    assert found.sites[0].total == found.total
    assert not found.right
    assert found.sentences[0].count("the damper and storey 1 are right within their noise") == 1


def test_every_site_that_fails_is_named():
    plants = {"damper": None, "layer": spring, "storey1": lambda c: 2.0 * spring(c)}
    found = compare_sites(building(plants))
    assert [one.site for one in found.sites] == ["storey1", "layer", "damper"]
    assert [one.fails for one in found.sites] == [True, True, False]
    z = f"{found.sites[1].z:.3g}"
    assert f"it fails too at the isolation layer (z = {z})" in found.sentences[0]
    assert "the damper is right within its noise" in found.sentences[0]
    assert "depends mainly on drift" in found.sentences[1]


@pytest.mark.parametrize("phi", [0.0, 0.95])
def test_of_twenty_sites_that_are_right_none_fails(phi):
    plants = dict.fromkeys(f"storey{k}" for k in range(1, 21))
    found = site_errors(building(plants, count=1, n=2500, phi=phi))
    assert len(found) == 20
    assert not any(one.fails for one in found)
    if phi:  # by z alone some would
        assert max(one.z for one in found) > 1.1


def test_a_site_compared_at_length_may_be_chosen():
    found = compare_sites(building({"damper": None, "layer": spring}), "damper")
    assert found.site == "damper"
    assert found.right
    assert found.sites[0].site == "layer"
    assert "it fails too at the isolation layer" not in found.sentences[0]
    assert "it fails at the isolation layer" in found.sentences[0]


def test_a_site_with_too_few_samples_is_said_to_tell_nothing():
    held = building({"damper": None, "layer": None})
    held["layer"] = [
        replace(
            one, measured=one.measured[:60], predicted=one.predicted[:60], sigma=one.sigma[:60],
            spread=one.spread[:, :60], coordinates={n: y[:60] for n, y in one.coordinates.items()},
            numerical=np.zeros(60),
        )
        for one in held["layer"]
    ]  # fmt: skip
    found = compare_sites(held)
    assert [(one.site, one.identifiable) for one in found.sites] == [
        ("damper", True),
        ("layer", False),
    ]
    assert "the isolation layer: too few samples for a statement" in found.sentences[0]
    assert found.as_dict()["sites"][1]["fails"] is False


@pytest.mark.parametrize(
    ("sites", "words"),
    [
        (["damper"], "the damper"),
        (["storey2", "layer"], "the isolation layer and storey 2"),
        (["storey2", "storey1", "damper"], "the damper and storeys 1 and 2"),
        ([f"storey{k}" for k in (1, 2, 3, 5, 6, 7, 9, 10)], "storeys 1 to 3, 5 to 7, 9 and 10"),
    ],
)
def test_sites_are_named_together(sites, words):
    assert site_names(sites) == words

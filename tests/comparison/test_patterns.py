"""Along which coordinate a residual is organised: planted ones are found, chance is not."""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest
from predictions_made import coloured, motion, predictions_with

from bristle.comparison.comparison import compare_predictions
from bristle.comparison.patterns import (
    Finder,
    block_length,
    correlation_time,
)
from bristle.comparison.predictions import coordinates_of

DT = 0.002


def found(held):
    """Return the patterns of a residual."""
    finder = Finder(
        [h.normalised for h in held], [h.residual for h in held], [h.along() for h in held]
    )
    return finder.ranked(finder.normalised)


@pytest.mark.slow  # hundreds of comparisons: the rate of false alarms
@pytest.mark.parametrize(
    ("kind", "phi"),
    [
        ("sine", 0.9),
        # Two seconds each: other noise and motion, the first is by default.
        pytest.param("random", 0.9, marks=pytest.mark.slow),
        pytest.param("sine", 0.0, marks=pytest.mark.slow),
        pytest.param("random", 0.0, marks=pytest.mark.slow),
    ],
)
def test_a_true_model_is_accused_no_more_often_than_stated(kind, phi):
    """At 5 and 1 %, all coordinates together, on white and on coloured noise."""
    along = [
        coordinates_of(DT, *motion(2000, k, kind), np.sin(np.arange(2000) / 50.0)) for k in range(3)
    ]
    chances = []
    for seed in range(100):
        random = np.random.default_rng(seed)
        r = [coloured(2000, random, phi) for _ in along]
        finder = Finder(r, r, along, flips=299, seed=seed)
        chances.append(min(one.p for one in finder.ranked(finder.normalised)))
    chances = np.array(chances)
    # Bounds that a binomial of the stated rate passes but in one case of a thousand.
    assert np.mean(chances <= 0.05) <= 0.13
    assert np.mean(chances <= 0.01) <= 0.05
    # And it is a chance, not a number that never falls.
    assert 0.3 < np.mean(chances <= 0.5) < 0.7


def heating(along):
    energy = along["dissipated_energy"]
    return -0.15 * along["direction"] * (energy / energy.max() - 0.5)


PLANTED = {
    "displacement": lambda c: 4.0 * c["displacement"] + 3.0e4 * c["displacement"] ** 3,
    "speed": lambda c: 0.8 * c["velocity"],
    "velocity": lambda c: 0.06 * np.exp(-(((c["velocity"] - 0.05) / 0.02) ** 2)),
    "acceleration": lambda c: 0.05 * c["acceleration"],
    "voltage": lambda c: 0.012 * c["direction"] * (c["voltage"] - 3.0),
    "voltage_rate": lambda c: -2e-3 * c["direction"] * c["voltage_rate"],
    "direction": lambda c: 0.04 * c["direction"],
    "time_since_reversal": lambda c: (
        -0.12 * c["direction"] * np.exp(-c["time_since_reversal"] / 0.02)
    ),
    "dissipated_energy": heating,
}


@pytest.mark.parametrize("coordinate", PLANTED)
@pytest.mark.parametrize("phi", [0.0, 0.8])
def test_a_planted_residual_is_found_along_its_coordinate(coordinate, phi):
    first = found(predictions_with(PLANTED[coordinate], phi=phi))[0]
    assert first.significant
    told = {first.coordinate, *first.alike}
    # Energy and time grow together; an even motion has little else to tell them apart by.
    same = {"dissipated_energy": {"time"}}.get(coordinate, set())
    assert coordinate in told or told & same
    assert first.coordinate == coordinate or first.coordinate in same or coordinate in first.alike


def test_the_share_is_that_of_the_planted_part():
    plant = PLANTED["displacement"]
    held = predictions_with(plant)
    part = np.concatenate([plant(h.coordinates)[h.skip :] for h in held])
    residual = np.concatenate([h.residual for h in held])
    truth = np.mean((part - part.mean()) ** 2) / np.mean(residual**2)
    first = found(held)[0]
    assert first.share == pytest.approx(truth, abs=0.05)  # bins have a width
    assert first.of_excess == pytest.approx(1.0, abs=0.15)


def test_the_means_in_bins_are_those_of_the_planted_part():
    first = found(predictions_with(PLANTED["displacement"]))[0]
    expected = 4.0 * first.centre + 3.0e4 * first.centre**3
    inner = slice(2, -2)  # the outermost bins are wide
    off = (first.mean - expected)[inner] / first.std[inner]
    assert np.mean(np.abs(off) < 3.0) > 0.9


def test_a_pattern_along_a_periodic_motion_is_not_hidden_by_its_period():
    """A shift by whole periods brings the pattern back; signs of blocks do not."""
    first = found(predictions_with(lambda c: 4.0 * c["displacement"], kind="sine"))[0]
    assert first.significant
    assert "displacement" in (first.coordinate, *first.alike)
    # In a sine the acceleration is the displacement: that is said, not guessed.
    assert {"displacement", "acceleration"} <= {first.coordinate, *first.alike}


def test_a_ripple_along_the_stroke_is_seen():
    first = found(predictions_with(lambda c: 0.1 * np.sin(2.0 * np.pi * c["displacement"] / 3e-3)))[
        0
    ]
    assert (first.coordinate, first.significant) == ("displacement", True)


def test_what_is_left_after_the_first_is_found_next():
    held = predictions_with(lambda c: PLANTED["displacement"](c) + PLANTED["voltage_rate"](c))
    finder = Finder(
        [h.normalised for h in held], [h.residual for h in held], [h.along() for h in held]
    )
    first = finder.ranked(finder.normalised)[0]
    assert first.coordinate == "displacement"
    left = finder.without(finder.normalised, first)
    assert np.mean(left**2) < np.mean(finder.normalised**2)
    second = finder.ranked(left, leave_out=["displacement"])[0]
    assert (second.coordinate, second.turned) == ("voltage_rate", True)
    assert second.significant


def test_blocks_are_longer_than_the_correlation():
    random = np.random.default_rng(4)
    for phi in (0.0, 0.9, 0.97):
        r = [coloured(6000, random, phi) for _ in range(3)]
        truth = (1.0 + phi) / (1.0 - phi)
        assert correlation_time(r[0]) == pytest.approx(truth, rel=0.5)
        assert block_length(r) >= min(6.0 * truth, 600)
    assert block_length([np.ones(500)]) == 40


def test_a_comparison_of_18_000_samples_takes_less_than_a_second():
    held = predictions_with(PLANTED["displacement"], n=6000)
    compare_predictions(held)
    begin = process_time()
    compare_predictions(held)
    assert process_time() - begin < 1.0


def test_the_same_runs_give_the_same_places():
    held = predictions_with(PLANTED["voltage"], phi=0.5)
    first, again = found(held), found(held)
    assert [(one.coordinate, one.share, one.p) for one in first] == [
        (one.coordinate, one.share, one.p) for one in again
    ]

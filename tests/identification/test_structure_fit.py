"""A building identified from its response: the truth lies in its intervals."""

from __future__ import annotations

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.errors import RecordError
from bristle.identification.building_fit import identify_structure
from bristle.physics.building import frequencies


def off(b, factor=1.3):
    """Return the same masses with other stiffnesses to begin with."""
    K = tuple(tuple(factor * value for value in row) for row in b.K)
    return b._replace(K=K, stiffnesses=tuple(factor * k for k in b.stiffnesses))


def errors(fit, b, ratio=0.02):
    """Return the errors of stiffnesses and ratios in their standard deviations."""
    k = (fit.stiffnesses - np.array(b.stiffnesses)) / fit.std_stiffnesses
    return np.concatenate([k, (fit.damping_ratios - ratio) / fit.std_damping_ratios])


@pytest.mark.parametrize(
    ("floors", "isolated", "damper"),
    [(1, False, None), (3, False, None), (2, True, None), (2, True, friction)],
)
def test_the_truth_lies_in_its_intervals(floors, isolated, damper):
    found, z = [], []
    for seed in range(6):
        b = building(floors, isolated, seed)
        run = measured(shake(b, seed, damper), seed)
        fit = identify_structure([run], off(b))
        found.append(errors(fit, b))
        z.append(fit.z)
        assert fit.unidentified == ()
        assert np.all(fit.std_stiffnesses < 0.01 * fit.stiffnesses)
    found = np.concatenate(found)
    # Of 12 to 36 intervals of 95 %, fewer than three quarters would hold once in a thousand times.
    assert np.mean(np.abs(found) < 1.96) > 0.75
    assert np.max(np.abs(found)) < 5.0
    assert np.mean(z) == pytest.approx(1.0, abs=0.05)


def test_twenty_floors_whose_drifts_are_small_differences():
    b = building(20, False, 3, stiffness=2e5)
    fit = identify_structure([measured(shake(b, 3, samples=4000), 3)], off(b))
    error = (fit.stiffnesses - np.array(b.stiffnesses)) / fit.std_stiffnesses
    assert np.max(np.abs(error)) < 3.5
    # Below, where a storey carries much, a few thousandths; at the top the drift is mostly noise.
    assert fit.stiffnesses[:10] == pytest.approx(b.stiffnesses[:10], rel=0.02)
    assert fit.frequencies[0] == pytest.approx(frequencies(b)[0], rel=2e-3)
    # The highest modes hardly move: their damping is not told, and said so.
    assert "damping ratio of mode 20" in fit.unidentified


def test_frequencies_have_intervals_too():
    b = building(3, False, 1)
    fit = identify_structure([measured(shake(b, 1), 1)], off(b))
    error = (fit.frequencies - np.array(frequencies(b))) / fit.std_frequencies
    assert np.max(np.abs(error)) < 4.0


def test_without_noise_the_truth_comes_back_to_a_tenth_of_a_percent():
    b = building(2, True, 0)
    fit = identify_structure([measured(shake(b, 0, friction), 0, noise=1e-6)], off(b))
    assert fit.stiffnesses == pytest.approx(b.stiffnesses, rel=1e-3)
    assert fit.damping_ratios == pytest.approx(0.02, rel=0.05)


def commanded(clean):
    """Return clean channels with a command, which tells that there is a damper."""
    return {**clean, "voltage": np.full(len(clean["time"]), 3.0)}


def test_an_unknown_damper_leaves_what_is_below_it_unknown():
    b = building(2, True, 4)
    runs = [
        measured(commanded(shake(b, seed, friction, samples=8000)), seed, without=("force",))
        for seed in (4, 5)
    ]
    fit = identify_structure(runs, off(b))
    assert fit.unidentified[0] == "stiffness below base"
    assert fit.stiffnesses[0] == 1.3 * b.stiffnesses[0]
    assert fit.stiffnesses[1:] == pytest.approx(b.stiffnesses[1:], rel=2e-3)
    assert np.isnan(fit.z[0])
    assert fit.z[1:] == pytest.approx(1.0, abs=0.1)
    assert "damper's force was not measured" in fit.notes[0]


def test_a_damper_that_is_taken_for_none_shows_in_z():
    b = building(2, True, 4)
    run = measured(shake(b, 4, friction), 4, without=("force",))
    assert identify_structure([run], off(b)).z[0] > 3.0


def test_a_level_without_accelerometer_still_tells():
    b = building(2, False, 2)
    run = measured(shake(b, 2), 2, without=("floor2_acceleration_absolute",))
    fit = identify_structure([run], off(b))
    assert fit.stiffnesses == pytest.approx(b.stiffnesses, rel=0.03)


def test_failures_are_named():
    b = building(2, True, 0)
    clean = shake(b, 0, friction, samples=2000)
    with pytest.raises(RecordError, match=r"missing ground_acceleration\. .*base, floor1, floor2"):
        identify_structure([measured(clean, 0, without=("ground_acceleration",))], b)
    gone = ("floor1_displacement", "floor1_velocity")
    with pytest.raises(
        RecordError, match=r"missing floor1_displacement or floor1_velocity \(its acceleration"
    ):
        identify_structure([measured(clean, 0, without=gone)], b)
    with pytest.raises(RecordError, match="missing floor3_displacement or floor3_velocity\\."):
        identify_structure([measured(clean, 0)], building(3, True, 0))
    with pytest.raises(
        RecordError, match=r"floor2_.* measured, but '1 floors' has the levels base"
    ):
        identify_structure([measured(clean, 0)], building(1, True, 0))
    short = {channel: values[:150] for channel, values in clean.items()}
    with pytest.raises(RecordError, match="150 samples"):
        identify_structure([measured(short, 0)], b)
    one = shake(building(1, False, 0), 0, friction, samples=2000)
    with pytest.raises(RecordError, match="no storey above the damper"):
        identify_structure([measured(commanded(one), 0, without=("force",))], building(1, False, 0))


def test_a_wrong_sign_is_refused_by_name():
    b = building(1, False, 0)
    clean = shake(b, 0, samples=3000)
    clean["floor1_acceleration_absolute"] = -clean["floor1_acceleration_absolute"]
    with pytest.raises(RecordError, match=r"stiffness below floor1 comes out as -.*signs"):
        identify_structure([measured(clean, 0)], b)

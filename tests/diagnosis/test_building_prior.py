"""A building's numbers move within what is known of them where they make the damper's force."""

from __future__ import annotations

import numpy as np
import pytest
from shaken import building, measured, shake

from bristle.diagnosis.building_numbers import moved, moved_numbers, within_prior
from bristle.diagnosis.rule import BENCH
from bristle.identification.building_motion import responses
from bristle.identification.building_sites import problems_of
from bristle.identification.rig_fit import fit_damper
from bristle.model.model import Model


def dashpot(x, v):
    """Return a force [N] that a Bingham law without friction has exactly."""
    return 30.0 * v


@pytest.fixture(scope="module")
def shaken():
    b = building(2, True, 6)
    runs = []
    for i in range(3):
        clean = shake(b, 50 + i, dashpot)
        clean["voltage"] = np.full(len(clean["time"]), 2.0)
        runs.append(measured(clean, i, without=("force",)))
    return b, runs


def known(file, runs):
    found = responses(runs, file)
    problem, _ = problems_of(found[:2], found[2:], file, "bingham")["damper"]
    assert problem.reconstructed
    model = fit_damper(problem, Model("bingham")).model
    return within_prior(model, found[:2], file, "bingham")


def test_a_move_is_that_of_the_numbers():
    b = building(2, True, 6)
    other = moved(b, np.array([1.0, -1.0, 0.0, 0.0, 2.0, 0.0]))
    assert other.stiffnesses[0] == pytest.approx((1.0 + BENCH.stiffness_known) * b.stiffnesses[0])
    assert other.stiffnesses[1] == pytest.approx((1.0 - BENCH.stiffness_known) * b.stiffnesses[1])
    assert other.stiffnesses[2] == b.stiffnesses[2]
    assert [other.M[i][i] / b.M[i][i] for i in range(3)] == pytest.approx(
        [1, 1, 1 + 2 * BENCH.mass_known]
    )
    K, file = np.array(other.K), np.array(b.K)
    assert np.allclose(K, K.T)
    assert K.sum() == pytest.approx(other.stiffnesses[0])  # moved as one, the first spring alone
    assert K[2, 2] == pytest.approx(file[2, 2])
    assert moved(b, np.zeros(6)).K == b.K


@pytest.mark.parametrize("off", [0.0, 1.0, -1.0])
def test_stiffnesses_that_the_file_has_wrong_come_back(shaken, off):
    b, runs = shaken
    file = moved(b, np.array([off, -0.7 * off, 0.0, 0.0, 0.0, 0.0]))
    found = known(file, runs)
    for mine, true in zip(found.stiffnesses[:2], b.stiffnesses[:2], strict=True):
        assert mine == pytest.approx(true, rel=0.004)
    assert bool(moved_numbers(file, found)) == bool(off)


def test_what_is_farther_off_than_anybody_errs_stays(shaken):
    b, runs = shaken
    file = moved(b, np.array([-8.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    found = known(file, runs)
    assert found.stiffnesses[0] / file.stiffnesses[0] == pytest.approx(
        1.0 + BENCH.farthest * BENCH.stiffness_known
    )
    assert "isolation" in moved_numbers(file, found)[0]

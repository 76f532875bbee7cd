"""The search: it ends at the least squares, holds its bounds, and impacts do not lead it astray."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from bristle.identification.search import descend, jacobian

T = np.linspace(0.0, 1.0, 400)
WIDE = np.array([-50.0, -50.0, -50.0])


def decay(theta):
    """Return the residuals of a decaying exponential on an offset, linear in two of three."""
    truth = 2.0 * np.exp(-3.0 * T) + 0.5
    wobble = 0.05 * np.sin(40.0 * T)
    return theta[0] * np.exp(-theta[1] * T) + theta[2] - truth - wobble


def test_it_ends_at_the_least_squares():
    found = descend(decay, np.array([1.0, 1.0, 0.0]), WIDE, -WIDE, 40, tolerance=1e-10)
    exact = least_squares(decay, [1.0, 1.0, 0.0], xtol=1e-12, ftol=1e-12).x
    assert found.theta == pytest.approx(exact, rel=1e-5)


def test_updated_jacobians_save_evaluations():
    calls = 0

    def counted(theta):
        nonlocal calls
        calls += 1
        return decay(theta)

    found = descend(counted, np.array([1.0, 1.0, 0.0]), WIDE, -WIDE, 40)
    assert found.cost == pytest.approx(0.5 * 0.05**2 / 2.0, rel=0.05)
    # Each Jacobian costs three evaluations, each step one.
    assert calls < 3 * found.sweeps + 4 * found.sweeps + 10
    assert found.sweeps <= 5


def test_a_jacobian_that_promises_no_more_is_the_last_one():
    def line(theta):
        return theta[0] + theta[1] * T - 3.0 + np.sin(40.0 * T)

    found = descend(line, np.zeros(2), WIDE[:2], -WIDE[:2], 40)
    exact = least_squares(line, [0.0, 0.0]).x
    assert found.theta == pytest.approx(exact, rel=1e-3)
    assert found.sweeps == 2


def test_a_parameter_stays_inside_its_bounds():
    low, high = np.array([0.0, 0.0, 0.6]), np.array([10.0, 10.0, 1.0])
    found = descend(decay, np.array([1.0, 1.0, 0.8]), low, high, 40)
    assert found.theta[2] == 0.6
    assert np.all((low <= found.theta) & (found.theta <= high))


def test_without_parameters_there_is_nothing_to_move():
    found = descend(lambda _theta: np.ones(7), np.zeros(0), np.zeros(0), np.zeros(0))
    assert found.cost == 0.5
    assert found.theta.size == 0


def late_steps(theta):
    """Return residuals of a slope whose curve jumps at a moment, as a force does at an impact."""
    model = theta[0] * T + np.where(theta[1] < T, 5.0, 0.0)
    truth = 1.5 * T + np.where(T > 0.5, 5.0, 0.0)
    return model - truth


def test_a_jump_that_moves_by_a_sample_does_not_outweigh_the_curve():
    here = np.array([1.0, T[200] - 1e-9])
    r = late_steps(here)
    low, high = np.array([-10.0, 0.0]), np.array([10.0, 1.0])
    plain = jacobian(late_steps, here, r, low, high)
    cut = jacobian(late_steps, here, r, low, high, rough=True)
    assert np.abs(plain[:, 1]).max() > 1e4  # the spike of the one sample that the jump has left
    assert np.abs(cut[:, 1]).max() < 1e-6
    np.testing.assert_allclose(cut[:, 0], plain[:, 0], rtol=1e-6)

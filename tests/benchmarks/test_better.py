"""The closed loop that designs are searched with, and what its chosen design is worth."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import better
from benchmarks._motions import recorded, synthetic
from benchmarks._semi_active import CLIPPED, ESTIMATED, FEEDBACK, PASSIVE, lq_gains, peak, run
from benchmarks.better import minimise

pytestmark = pytest.mark.slow  # a benchmark's own loop is compiled for 5 s

NONE = better.NONE


@pytest.fixture(scope="module")
def el_centro() -> np.ndarray:
    """El Centro at nominal 0.6 g, to the end of the record."""
    return recorded("el_centro_1940_ns", 0.6, 31.18)


def at(voltage: float) -> np.ndarray:
    gains = NONE.copy()
    gains[13] = voltage
    return gains


def test_the_loop_has_the_published_peaks(el_centro: np.ndarray) -> None:
    """Peaks of the reference calculation: 0 V, 4 V, clipped-optimal (a switch: 3 %)."""
    assert peak(PASSIVE, el_centro, at(0.0)) == pytest.approx(11.112, rel=2e-3)
    assert peak(PASSIVE, el_centro, at(4.0)) == pytest.approx(6.103, rel=2e-3)
    assert peak(CLIPPED, el_centro, NONE) == pytest.approx(7.141, rel=0.03)
    rms = np.sqrt(np.mean(run(PASSIVE, el_centro, at(4.0))[:, 0] ** 2))
    assert rms == pytest.approx(1.250, rel=2e-3)


def test_a_quick_run_is_nearly_the_same(el_centro: np.ndarray) -> None:
    for gains in (better.CHOSEN, better.ORACLE):
        quick, slow = (peak(FEEDBACK, el_centro, gains, quick) for quick in (True, False))
        assert quick == pytest.approx(slow, rel=0.01)


def test_the_chosen_design_lowers_the_peak_on_motions_that_it_was_not_chosen_on(
    el_centro: np.ndarray,
) -> None:
    clipped = peak(CLIPPED, el_centro, NONE)
    assert peak(ESTIMATED, el_centro, better.CHOSEN) < 0.87 * clipped


def test_an_observer_is_nearly_as_good_as_the_state(el_centro: np.ndarray) -> None:
    exact, estimated = (peak(law, el_centro, better.CHOSEN) for law in (FEEDBACK, ESTIMATED))
    assert estimated == pytest.approx(exact, rel=0.03)


def test_voltages_stay_within_the_limits(el_centro: np.ndarray) -> None:
    V = run(ESTIMATED, el_centro, better.CHOSEN)[:, 1]
    assert V.min() >= 0.0
    assert V.max() <= 8.0


def test_linear_quadratic_gains_are_the_least_cost() -> None:
    """The cost x' P x of the gain is least: neighbours cost more, by Lyapunov's equation."""
    from scipy.linalg import solve_continuous_lyapunov

    from benchmarks._semi_active import _plant, floor_row

    A, B = _plant()[3:]
    row, gains = floor_row(), lq_gains(1e3, 0.1)

    def cost(g: np.ndarray) -> float:
        Q = np.outer(row, row) + np.diag([1e3, 0, 0, 0, 0, 0]) + 0.1 * np.outer(g, g)
        P = solve_continuous_lyapunov((A + B @ g[None]).T, -Q)
        return float(np.trace(P))

    least = cost(gains)
    for i in range(6):
        for factor in (0.97, 1.03):
            other = gains.copy()
            other[i] *= factor
            assert cost(other) > least


def test_synthetic_motions_have_their_peak_and_their_seed() -> None:
    for pulse in (False, True):
        a = synthetic(5, 0.5, pulse)
        assert np.abs(a).max() == pytest.approx(0.45 * 0.5 * 9.81, rel=0.02)
        assert np.array_equal(a, synthetic(5, 0.5, pulse))
        assert not np.array_equal(a, synthetic(6, 0.5, pulse))


def test_the_search_finds_a_narrow_valley() -> None:
    def rosenbrock(x: np.ndarray) -> float:
        return float(100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2)

    best, least = minimise(rosenbrock, np.array([-1.0, 1.0]), 0.5, 120, 1)
    assert best == pytest.approx([1.0, 1.0], abs=1e-3)
    assert least < 1e-6

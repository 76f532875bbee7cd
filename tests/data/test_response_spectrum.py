"""The response spectrum against closed forms of the oscillator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bristle.data.response_spectrum import response_spectrum, usual_periods
from bristle.errors import RecordError

STEP = 0.002


@pytest.mark.parametrize("damping", [0.02, 0.05, 0.2])
def test_a_sudden_acceleration_is_exceeded_by_its_overshoot(damping: float) -> None:
    """The step response of (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2), at its first peak."""
    motion = np.full(10_000, 3.0)
    root = np.sqrt(1.0 - damping**2)
    angle = np.pi - np.arctan2(2.0 * damping * root, 1.0 - 2.0 * damping**2)
    over = np.exp(-damping / root * angle)
    found = response_spectrum(motion, STEP, np.array([0.5, 1.0, 2.0]), damping)
    assert found == pytest.approx(np.full(3, 3.0 * (1.0 + over)), rel=1e-2)


@pytest.mark.parametrize("ratio", [0.2, 1.0, 1.4, 3.0])
def test_a_long_sine_gives_the_transmissibility(ratio: float) -> None:
    """sqrt((1 + (2 zeta r)^2) / ((1 - r^2)^2 + (2 zeta r)^2)), with r the ratio of frequencies."""
    zeta, period = 0.05, 0.8
    time = np.arange(0.0, 80.0, STEP)
    grown = np.sin(0.5 * np.pi * np.minimum(1.0, time / 40.0)) ** 2
    motion = 2.0 * grown * np.sin(2.0 * np.pi * ratio / period * time)
    found = response_spectrum(motion, STEP, np.array([period]), zeta)[0]
    own = (2.0 * zeta * ratio) ** 2
    right = 2.0 * np.sqrt((1.0 + own) / ((1.0 - ratio**2) ** 2 + own))
    assert found == pytest.approx(right, rel=2e-3)


def test_a_stiff_oscillator_moves_as_its_base() -> None:
    time = np.arange(0.0, 20.0, STEP)
    motion = np.sin(2.0 * np.pi * 0.1 * time) * np.minimum(1.0, time / 5.0)
    assert response_spectrum(motion, STEP, np.array([0.02]))[0] == pytest.approx(1.0, rel=1e-3)


def test_it_is_what_an_integration_of_the_oscillator_gives() -> None:
    generator = np.random.default_rng(3)
    time = np.arange(2500) * STEP
    motion = np.interp(time, np.arange(0.0, 5.1, 0.05), generator.standard_normal(102))
    motion[0] = 0.0
    turn, zeta = 2.0 * np.pi / 0.6, 0.05

    def rate(t: float, y: np.ndarray) -> list[float]:  # type: ignore[type-arg]
        x, v = y
        return [v, -np.interp(t, time, motion) - 2.0 * zeta * turn * v - turn**2 * x]

    solved = solve_ivp(rate, (0.0, time[-1]), [0.0, 0.0], max_step=STEP, t_eval=time)
    absolute = 2.0 * zeta * turn * solved.y[1] + turn**2 * solved.y[0]
    found = response_spectrum(motion, STEP, np.array([0.6]))[0]
    assert found == pytest.approx(np.max(np.abs(absolute)), rel=1e-3)


def test_usual_periods_begin_where_the_samples_show_a_peak() -> None:
    assert usual_periods(STEP)[[0, -1]] == pytest.approx([0.05, 5.0])
    assert usual_periods(0.02)[0] >= 0.2


@pytest.mark.parametrize(
    ("motion", "step", "period", "damping", "words"),
    [
        ([0.0, np.nan], 0.01, 1.0, 0.05, "finite"),
        ([], 0.01, 1.0, 0.05, "finite"),
        ([0.0, 1.0], 0.0, 1.0, 0.05, "above 0"),
        ([0.0, 1.0], 0.01, 1.0, 1.0, "damping of 1"),
        ([0.0, 1.0], 0.01, 0.05, 0.05, "0.1 s or more"),
    ],
)
def test_what_has_no_spectrum_is_refused(
    motion: list[float], step: float, period: float, damping: float, words: str
) -> None:
    with pytest.raises(RecordError, match=words):
        response_spectrum(np.array(motion), step, np.array([period]), damping)

"""A late force is that of an earlier moment: jumps in full, what is smooth to second order."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.identification.problem import Problem, Run, earlier, pure_delay
from bristle.model.model import Model

DT = 0.002
LAW = {"f_c": 1.3, "f_v": 0.8, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02, "exponent": 1.0}


def motion(t):
    w = 9.0
    V = 4.0 * (np.floor(t / 0.5 + 1e-9) % 2)
    return 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w * w * np.sin(w * t), V


def run(t):
    x, v, a, V = motion(t)
    return Run("one", DT, x, v, a, V, np.zeros(len(t)), 0.01, np.zeros((0, len(t), 4)))


@pytest.mark.parametrize("late", [0.0003, 0.002, 0.0071])
def test_the_force_of_an_earlier_moment(late):
    t = np.arange(2000) * DT
    problem = Problem([run(t)])
    own = {"delay.time": late, "delay.filtered": 0.0}
    shown = problem.predict(Model("bingham", ("delay",), LAW | own), problem.runs[0])
    before = run(t - late)  # the rig at that moment, exactly
    exact = problem.predict(Model("bingham", (), LAW), before)
    settled = slice(8, None)
    # The interpolation's own error, nothing at the jumps of a law with a sign and of the voltage.
    np.testing.assert_allclose(shown[settled], exact[settled], atol=2e-3 * np.abs(exact).max())


def test_without_a_delay_nothing_is_late():
    values = {"delay.time": 0.01, "delay.filtered": 1.0}
    assert pure_delay(("delay",), values) == (0.0, values)
    assert pure_delay(("gas_spring",), {}) == (0.0, {})


def test_a_filter_keeps_its_own_share_of_the_time():
    late, left = pure_delay(("delay",), {"delay.time": 0.01, "delay.filtered": 0.25})
    assert late == pytest.approx(0.0075)
    assert left == {"delay.time": 0.0025, "delay.filtered": 1.0}


def test_whole_samples_are_a_shift():
    signals = motion(np.arange(300) * DT)
    for signal, before in zip(signals, earlier(signals, 3 * DT, DT), strict=True):
        np.testing.assert_array_equal(before[3:], signal[:-3])
        np.testing.assert_array_equal(before[:3], np.full(3, signal[0]))

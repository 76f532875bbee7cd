"""Coordinates of a run, and their bins."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.comparison.predictions import (
    coordinates_of,
    cut,
    late_speed,
    recent_rate,
    since_reversal,
)


def test_time_since_reversal_counts_from_each_change_of_sign():
    v = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 2.0])
    assert since_reversal(v, 0.1) == pytest.approx([0.0, 0.1, 0.0, 0.1, 0.2, 0.0])


def test_a_step_of_the_voltage_shows_for_a_while_and_is_forgotten():
    V = np.concatenate([np.zeros(500), np.full(500, 4.0)])
    rate = recent_rate(V, 0.002)
    assert rate[:500] == pytest.approx(0.0, abs=1e-12)
    assert rate[500] == pytest.approx(4.0 / 0.05, rel=0.05)
    # A first-order lag has lost 63 % after its time constant, 25 samples here.
    assert rate[525] / rate[500] == pytest.approx(np.exp(-1.0), rel=0.01)
    assert abs(rate[-1]) < 1e-3


def test_bins_hold_about_the_same_number_of_samples_in_order():
    values = np.random.default_rng(0).standard_normal(4000)
    bins = cut(values, 16)
    counts = np.bincount(bins.label)
    assert len(counts) == bins.count
    assert counts.sum() == 4000
    assert counts.min() > 150
    assert counts.max() < 350
    assert (np.diff(bins.centre) > 0.0).all()
    for k in range(bins.count):
        own = values[bins.label == k]
        assert (own.min(), own.max()) == (bins.low[k], bins.high[k])


def test_levels_of_a_voltage_are_bins_of_their_own():
    V = np.repeat([0.0, 6.0, 2.0, 0.0, 4.0], 400)
    bins = cut(V, 16)
    assert bins.centre == pytest.approx([0.0, 2.0, 4.0, 6.0])
    # Equal values share a bin: else samples of one level would be told apart by time.
    for level in (0.0, 2.0, 4.0, 6.0):
        assert len(set(bins.label[level == V])) == 1


def test_a_mostly_constant_signal_keeps_its_tails_apart():
    rate = np.zeros(4000)
    rate[:120], rate[200:320] = -5.0, 7.0
    rate[:120] += np.linspace(0.0, 1.0, 120)
    bins = cut(rate, 16)
    zero = bins.label[3000]
    assert bins.centre[zero] == 0.0
    assert set(bins.label[:120]).isdisjoint({zero})
    assert set(bins.label[200:320]).isdisjoint({zero})


@pytest.mark.parametrize("values", [np.zeros(100), np.full(100, 3.0), np.zeros(0)])
def test_what_does_not_vary_has_no_bins(values):
    assert cut(values) is None


def test_only_what_was_measured_is_a_coordinate():
    x = np.linspace(0.0, 1.0, 50)
    assert set(coordinates_of(0.1, x, None, None, None, None)) == {"displacement", "time"}
    along = coordinates_of(0.1, x, np.gradient(x, 0.1), None, None, np.ones(50))
    assert {"velocity", "speed", "direction", "dissipated_energy"} <= set(along)
    assert along["dissipated_energy"][-1] == pytest.approx(50 * 0.1 * 1.0 / 4.9, rel=1e-9)


def test_late_speed_forgets_and_takes_the_sign_of_now():
    dt = 0.002
    v = np.concatenate([np.full(1000, 0.2), np.full(1000, -0.1)])
    late = late_speed(v, dt)
    np.testing.assert_allclose(late[:1000], 0.2)
    t = dt * np.arange(1, 1001)
    np.testing.assert_allclose(late[1000:], -(0.1 + 0.1 * np.exp(-t / 0.3)), rtol=1e-12)

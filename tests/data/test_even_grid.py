"""Times that are written with few digits lie on the even grid that they were taken on."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.data.sampling import evenly


def times(rate, digits, count, begin=0.0):
    return np.round(begin + np.arange(count) / rate, digits)


def evenly_of(time, values):
    return evenly(time, {"force": values}, np.arange(len(time)), "run.csv", "line")


@pytest.mark.parametrize("count", [80, 3000])
@pytest.mark.parametrize(
    ("rate", "digits"),
    [(204.8, 3), (256, 3), (409.6, 3), (512, 4), (1024, 4), (2048, 4), (300, 3), (1706.67, 4)],
)
def test_times_with_few_digits_have_the_rate_that_they_were_taken_at(rate, digits, count):
    true = 0.3 + np.arange(count) / rate
    even = evenly_of(times(rate, digits, count, 0.3), np.sin(2.0 * np.pi * 2.0 * true))
    (piece,) = even.pieces
    assert not even.sampling.resampled
    assert even.sampling.rate == pytest.approx(rate, rel=0.05 / count)
    assert piece[0] == pytest.approx(true, abs=0.2 * 10.0**-digits)
    assert len(piece[0]) == count


@pytest.mark.parametrize(("rate", "digits"), [(3000, 6), (600, 5), (7.5, 5)])
def test_times_of_so_many_significant_digits_have_fewer_decimals_later(rate, digits):
    true = np.arange(round(12.0 * rate)) / rate
    time = np.array([float(f"{t:.{digits}g}") for t in true])
    even = evenly_of(time, np.sin(2.0 * np.pi * 2.0 * true))
    assert not even.sampling.resampled
    assert even.pieces[0][0] == pytest.approx(true, abs=1e-4 / rate)


def test_samples_that_were_lost_do_not_change_the_grid_of_rounded_times():
    there = np.ones(3000, dtype=bool)
    there[[400, 401, 1500]] = False
    even = evenly_of(times(256, 3, 3000)[there], np.arange(3000.0)[there])
    (piece,) = even.pieces
    assert even.sampling.rate == pytest.approx(256.0, rel=1e-4)
    assert np.flatnonzero(~piece[2]).tolist() == [400, 401, 1500]


def test_jitter_beyond_the_digits_is_not_taken_for_rounding():
    g = np.random.default_rng(0)
    late = times(256, 5, 3000) + np.round(g.uniform(0.0, 1e-3, 3000), 5)
    assert evenly_of(late, np.arange(3000.0)).sampling.resampled

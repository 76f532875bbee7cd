"""The spectrum of a residual over runs of different rates has one axis of frequency."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bristle.comparison.predictions import RunPrediction
from bristle.comparison.spectrum import spectrum

NOISE = 0.1


def run(rate: float, planted: float, seed: int, seconds: float = 16.0) -> RunPrediction:
    """Return a run of a 2 Hz sine with noise, and an error at a frequency that is planted."""
    random = np.random.default_rng(seed)
    count = round(seconds * rate)
    t = np.arange(count) / rate
    predicted = np.sin(2.0 * np.pi * 2.0 * t)
    error = 0.5 * np.sin(2.0 * np.pi * planted * t) + NOISE * random.standard_normal(count)
    sigma, carried = np.full(count, NOISE), np.zeros((1, count))
    return RunPrediction(
        f"{rate:g}", 1.0 / rate, predicted + error, predicted, sigma, NOISE, carried
    )


RUNS = [run(500.0, 10.0, 1), run(100.0, 10.0, 2), run(256.0, 10.0, 3)]


@pytest.mark.parametrize("runs", list(itertools.permutations(RUNS)))
def test_an_error_is_at_its_frequency_whatever_the_rates(runs):
    found = spectrum(runs)
    peak = np.sort(found.frequency[np.argsort(found.residual)[-2:]])
    assert peak == pytest.approx(10.0, abs=0.11)
    assert found.frequency[np.argmax(found.measured)] == pytest.approx(2.0, abs=0.06)
    assert found.frequency[-1] == 50.0
    loud = [(band.low, band.high) for band in found.bands if band.z > 2.0]
    assert loud == [(8.0, 16.0)]
    assert all(0.5 < band.z < 1.5 for band in found.bands if band.low != 8.0)


def test_the_order_of_runs_does_not_count():
    first, second = spectrum(RUNS), spectrum(RUNS[::-1])
    assert first.residual == pytest.approx(second.residual)
    assert [band.z for band in first.bands] == pytest.approx([band.z for band in second.bands])


def test_power_beyond_the_lowest_rate_is_in_no_shared_band():
    found = spectrum([run(500.0, 120.0, 1), run(100.0, 10.0, 2)])
    assert max(found.bands, key=lambda band: band.z).low == 8.0
    assert found.bands[-1].high == 50.0
    assert found.bands[-1].z == pytest.approx(1.0, abs=0.2)


def test_runs_of_one_rate_keep_all_of_their_band():
    found = spectrum([run(500.0, 120.0, 1), run(500.0, 120.0, 2)])
    assert len(found.frequency) == 513
    assert found.bands[-1].high == 250.0
    assert found.frequency[np.argmax(found.residual)] == pytest.approx(120.0, abs=0.3)

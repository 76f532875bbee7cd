"""Intervals hold and z of the truth is 1, on data of the independent generator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truths import hidden_case, true_case

from bristle.identification.fit import fit, fit_from_starts, multistart_refit
from bristle.identification.problem import robust_z
from bristle.model.model import Model

RIGS = ("bench_10N", "bench_2kN")
NOISES = (0.01, 0.03)
CLOSED = {"backlash.gap": 7e-4, "backlash.k": 8e5, "backlash.c": 60.0, "backlash.mass": 0.004}


def errors(seed, law, rig, noise):
    """Return errors over standard deviations, widths of intervals over values, z of the truth."""
    train, held, truth = true_case(seed, law, rig, noise)
    found = fit_from_starts(train, Model(law))
    assert found.unidentified == ()
    names = list(found.std)
    value = np.array([truth.values[name] for name in names])
    std = np.array([found.std[name] for name in names])
    error = np.array([found.model.values[name] for name in names]) - value
    return error / std, 2.0 * 1.96 * std / value, robust_z(held, truth)


@pytest.mark.parametrize(
    ("law", "rig", "noise"),
    [("bingham", "bench_2kN", 0.01), ("lugre", "bench_10N", 0.03)],
)
def test_truth_within_its_intervals(law, rig, noise):
    error, width, z = errors(11, law, rig, noise)
    assert np.max(np.abs(error)) < 4.0
    assert np.median(width) < 0.05
    assert 0.9 < z < 1.1


@pytest.mark.slow  # many fits: intervals
def test_a_rough_loss_widens_its_intervals_by_the_spread_of_its_ends():
    """Impacts leave a loss of many dents, each far narrower than the errors are."""
    train, truth = hidden_case(21, "backlash", "rigid", 0.15, "bench_10N", "lugre")
    begun = replace(truth, effects=("backlash",), values={**truth.values, **CLOSED})
    once = fit(train, begun)
    found = multistart_refit(train, once.model)
    assert found.cost <= once.cost
    wider = [found.std[name] / once.std[name] for name in truth.values if name in found.std]
    assert min(wider) > 0.9
    assert np.median(wider) > 1.5
    errors = [
        (found.model.values[name] - value) / found.std[name]
        for name, value in truth.values.items()
        if name in found.std
    ]
    assert np.max(np.abs(errors)) < 6.0
    smooth = fit(train, truth, max_evaluations=6)
    assert multistart_refit(train, smooth.model).std == pytest.approx(smooth.std, rel=0.3)


@pytest.mark.slow  # many fits: 95 % of the intervals hold
def test_intervals_cover_and_z_of_the_truth_is_one():
    """Of 40 cases, both laws and rigs, 1 and 3 % noise: 90 to 99 % of the parameters covered."""
    cases = [
        (200 + k, ("bingham", "lugre")[k % 2], RIGS[k // 2 % 2], NOISES[k // 4 % 2])
        for k in range(40)
    ]
    found = [errors(*case) for case in cases]
    within = np.concatenate([np.abs(error) < 1.96 for error, _, _ in found])
    # The parameters of a case err together: 240 of them are worth about 80.
    assert 0.88 <= np.mean(within) <= 0.995
    assert np.median(np.concatenate([width for _, width, _ in found])) < 0.03
    z = np.array([one[2] for one in found])
    assert np.mean((z > 0.9) & (z < 1.1)) >= 0.9

"""What data cannot show: the smallest visible share goes with the noise; no change, no trace."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import measurements_of_frame
from bristle.diagnosis.effect_limits import detectable, untestable
from bristle.diagnosis.rule import BENCH
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import Model

STEP = 0.002
T = STEP * np.arange(3000)
VALUES = {"f_c": 1.3, "f_v": 0.83, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}
TITLES = {"displacement": "m", "velocity": "m/s", "voltage": "V", "force": "N"}
DRIVEN = ("coil_lag", "remanence", "saturation")


def problem_of(voltage, noise=0.01, values=VALUES):
    """Return two runs of a Bingham damper as they would be fitted, with white noise."""
    runs = []
    for seed in (1, 2):
        random = np.random.default_rng(seed)
        w = 2.0 * np.pi * random.uniform(0.5, 4.0, 8)
        angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
        size = 0.04 / w
        x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
        V = voltage(seed)
        F = DamperForces("bingham", []).force(x, v, a, V, STEP, values)
        columns = dict(zip(TITLES, (x, v, V, F), strict=True))
        std = {name: noise * float(np.sqrt(np.mean(y**2))) for name, y in columns.items()}
        noisy = {
            f"{name} [{unit}]": columns[name] + std[name] * random.standard_normal(len(T))
            for name, unit in TITLES.items()
        }
        specs = {n: ChannelSpec(f"{n} [{u}]", noise=std[n]) for n, u in TITLES.items()}
        frame = pd.DataFrame({"time [s]": T, **noisy})
        (run,) = measurements_of_frame(frame, "run", {"time": ChannelSpec("time [s]"), **specs})
        runs.append(prepare(run, seed=seed))
    return Problem(runs)


def steps(seed):
    """Return a voltage that jumps between levels."""
    levels = np.random.default_rng(40 + seed).choice([0.0, 2.0, 4.0, 6.0], 20)
    return np.repeat(levels, len(T) // 20)


def steady(_seed):
    """Return a voltage that stands still."""
    return np.full(len(T), 4.0)


def white(problem, sigma):
    """Return the expectation of a true model whose only noise is the force's, `sigma` [N]."""
    return [(0.0 * run.force, sigma + 0.0 * run.force, None) for run in problem.runs]


def test_half_the_noise_shows_half_the_share():
    problem = problem_of(steps)
    full, half = (detectable(problem, white(problem, sigma)) for sigma in (0.1, 0.05))
    assert half == pytest.approx(0.5 * full, rel=1e-12)


def test_the_share_is_what_raises_z_by_the_smallest_gain():
    problem = problem_of(steps)
    sigma = 0.1
    share = detectable(problem, white(problem, sigma))
    force = np.concatenate([run.force[run.skip :] for run in problem.runs])
    missing = share * np.sqrt(np.mean(force**2))  # N, RMS
    assert np.sqrt(1.0 + (missing / sigma) ** 2) == pytest.approx(1.0 + BENCH.gain, rel=1e-9)


def test_where_the_expected_noise_is_too_large_more_is_hidden():
    problem = problem_of(steps)
    expected = white(problem, 0.05)
    right = detectable(problem, expected)
    assert detectable(problem, expected, z=0.95) == right  # by chance
    gain = BENCH.gain
    share = np.sqrt(((1.0 + gain) ** 2 - 0.25) / ((1.0 + gain) ** 2 - 1.0))
    assert detectable(problem, expected, z=0.5) == pytest.approx(share * right)


def test_less_noise_on_all_channels_shows_less():
    shares = []
    for noise in (0.01, 0.03):
        problem = problem_of(steps, noise)
        shares.append(detectable(problem, problem.expectation(Model("bingham", (), VALUES))))
    assert 1.3 * shares[0] < shares[1] < 6.0 * shares[0]


@pytest.mark.parametrize("voltage", [steady, steps])
def test_effects_of_the_drive_need_a_drive_that_moves(voltage):
    problem = problem_of(voltage)
    model = Model("bingham", (), VALUES)
    expected = problem.expectation(model)
    out = untestable(model, problem, expected, detectable(problem, expected))
    assert [name in out for name in DRIVEN] == [voltage is steady] * len(DRIVEN)
    assert "gas_spring" not in out

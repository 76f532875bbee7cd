"""Parameters from noisy bench runs: the truth comes back, and z of the truth is 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_runs import DT, N, T, bench_run, motion, truth_of

from bristle.data.measurement import measurements_of_frame
from bristle.errors import RecordError
from bristle.identification.fit import fit, fit_from_starts
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, Run
from bristle.identification.smoothing import smooth, smooth_steps
from bristle.model.model import Model
from bristle.physics.laws import LAWS, laws_of


@pytest.mark.parametrize("law", [law.name for law in laws_of("damper")])
def test_the_truth_comes_back_within_its_intervals(law):
    truth = truth_of(law)
    found = fit_from_starts(
        Problem([bench_run(law, truth, seed) for seed in (1, 2, 3)]), Model(law)
    )
    errors = {n: (found.model.values[n] - truth[n]) / std for n, std in found.std.items()}
    assert set(truth) - set(errors) == set(LAWS[law].assumed) - {"exponent"}
    # Of seven parameters one may lie beyond three standard deviations once in fifty times.
    assert max(map(abs, errors.values())) < 4.0, errors
    assert all(std < max(0.1 * truth[name], 0.01) for name, std in found.std.items())
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(list(found.std.values()))
    assert np.linalg.eigvalsh(found.covariance)[0] >= 0.0
    assert found.unidentified == ()


def test_the_zero_of_the_displacement_may_be_many_strokes_away():
    truth = {"q": 2.4, "rho": 18e3, "sigma": 0.5, "c": 1.4, "k": 0.0, "k_3": 0.0, "f_0": 0.1}
    t, noise = 0.005 * np.arange(2500), 0.03
    x = -0.11 + 1.1e-4 * np.sin(2.2 * t)
    v, a, none = 2.42e-4 * np.cos(2.2 * t), -5.32e-4 * np.sin(2.2 * t), np.zeros(len(t))
    run = Run("run", 0.005, x, v, a, none, none, noise, np.zeros((12, len(t), 4)))
    force = Problem([run]).predict(Model("isolator", (), truth), run)
    force += noise * np.random.default_rng(1).standard_normal(len(t))
    problem = Problem([replace(run, force=force)])
    found = fit_from_starts(problem, Model("isolator"))
    left = force - problem.predict(found.model, run)
    assert np.std(left) == pytest.approx(noise, rel=0.05)


@pytest.mark.parametrize("law", [law.name for law in laws_of("damper")])
def test_residual_of_the_truth_is_its_expected_noise(law):
    truth = truth_of(law)
    problem = Problem([bench_run(law, truth, seed) for seed in (4, 5)])
    model = Model(law, (), truth)
    for run, (bias, sigma, _) in zip(problem.runs, problem.expectation(model), strict=True):
        z = ((run.force - problem.predict(model, run) - bias) / sigma)[run.skip :]
        assert np.median(np.abs(z)) / 0.6745 == pytest.approx(1.0, abs=0.1)


def test_smoother_is_as_certain_as_it_says():
    x, v, _ = motion(7)
    random = np.random.default_rng(7)
    noise = (0.01 * np.std(x), 0.01 * np.std(v))
    found = smooth(
        x + noise[0] * random.standard_normal(N),
        v + noise[1] * random.standard_normal(N),
        DT,
        noise,
    )
    assert np.std(found.x - x) < 1.2 * found.std[0] < 0.3 * noise[0]
    assert np.std(found.v - v) < 1.2 * found.std[1] < 0.9 * noise[1]
    assert found.mismatch == pytest.approx([1.0, 1.0], abs=0.1)


def test_voltage_keeps_its_steps():
    steps = np.repeat([0.0, 3.0, 1.0, 6.0], N // 4)
    noisy = steps + 0.05 * np.random.default_rng(1).standard_normal(N)
    smoothed, _ = smooth_steps(noisy, 0.05)
    assert np.max(np.abs(smoothed - steps)) < 0.02


def test_a_run_without_force_is_refused():
    import pandas as pd

    x, v, _ = motion(9)
    frame = pd.DataFrame({"time [s]": T, "displacement [m]": x, "velocity [m/s]": v})
    with pytest.raises(RecordError, match="force"):
        prepare(measurements_of_frame(frame)[0])


@pytest.mark.filterwarnings("error")
def test_a_fit_far_from_all_samples_tells_no_parameter():
    """Where no residual is near noise nothing says how sharp the loss is."""
    run = bench_run("bingham", truth_of("bingham"), 1)
    away = replace(run, force=run.force + 1e4 * run.noise)
    found = fit(Problem([away]), Model("bingham", (), truth_of("bingham")), max_evaluations=2)
    assert set(found.unidentified) == set(found.std)

"""What a model misses counts as variance beside the noise, where it does not explain the runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_runs import bench_run, truth_of
from scipy.optimize import least_squares

from bristle.identification.fit import Search, fit_from_starts
from bristle.identification.problem import (
    EXPLAINS,
    Problem,
    errors,
    excess_of,
    in_noises,
    residuals,
    robust_z,
)
from bristle.identification.rig import DAMPER, ROLES, Site
from bristle.identification.rig_fit import fit_site
from bristle.model.model import Model

LAW = "bingham"


def with_spring(run, k):
    """Return a run with a hardening spring besides, which no bare law has."""
    return replace(run, force=run.force + k * run.x**3)


@pytest.fixture(scope="module")
def runs():
    truth = truth_of(LAW)
    return [bench_run(LAW, truth, seed) for seed in (1, 2)], Model(LAW, (), truth)


def fitted(problem):
    site = Site(DAMPER, lambda role: problem if role == ROLES[0] else None)
    return fit_site(Model(LAW), site, {DAMPER: site}, 2, {})


def rms(problem, model):
    bare = [(np.zeros(len(r.x)), np.ones(len(r.x)), np.zeros((1, len(r.x)))) for r in problem.runs]
    return float(np.sqrt(np.mean(np.concatenate(errors(problem, model, bare)) ** 2)))


def test_a_fit_that_explains_the_runs_is_that_of_the_noise_to_the_last_bit(runs):
    problem = Problem(runs[0])
    found = fitted(problem)
    assert robust_z(problem, found.model) < EXPLAINS
    by_noise = fit_from_starts(problem, Model(LAW), starts=2)
    assert (found.model, found.std) == (by_noise.model, by_noise.std)


def test_a_fit_that_misses_something_is_nearly_least_squares(runs):
    """Huber's threshold of two noises and the noise of runs as weights would pull it away."""
    parts = [replace(run, force=run.force + 3e3 * run.v * np.abs(run.v)) for run in runs[0]]
    problem = Problem([parts[0], replace(parts[1], noise=0.1 * parts[1].noise)])
    found, by_noise = fitted(problem).model, fit_from_starts(problem, Model(LAW), starts=2).model
    assert robust_z(problem, found) > 3.0

    none = [(np.zeros(len(r.x)), np.ones(len(r.x)), np.zeros((1, len(r.x)))) for r in problem.runs]
    scaled = Search(problem, found, none, found.free(), logarithms=False)
    best = least_squares(
        lambda theta: np.concatenate(errors(problem, scaled.at(theta), none)), scaled.start,
        bounds=(scaled.low - 1e-12, scaled.high + 1e-12), x_scale="jac",
    )  # fmt: skip
    least = rms(problem, scaled.at(best.x))
    assert rms(problem, found) < 1.02 * least
    assert rms(problem, by_noise) > 1.1 * least


def test_the_excess_grows_from_nothing_with_what_is_missed(runs):
    truth, noise = runs[1], runs[0][0].noise
    parts = [
        Problem([with_spring(run, k) for run in runs[0]])
        for k in (0.0, 4e4, 6e4, 7e4, 8e4, 9e4, 1e5, 2e5, 1e6)
    ]
    z = [robust_z(one, truth) for one in parts]
    found = [excess_of(one, truth) for one in parts]
    assert z == sorted(z)
    assert found == sorted(found)
    assert [excess > 0.0 for excess in found] == [size > EXPLAINS for size in z]
    near = [e for e, size in zip(found, z, strict=True) if EXPLAINS < size < 1.25]
    assert near
    assert max(near) < 0.3 * noise**2


def test_z_is_error_over_noise_with_an_excess_and_without(runs):
    problem, truth = Problem([with_spring(run, 1e7) for run in runs[0]]), runs[1]
    more = problem.with_excess(excess_of(problem, truth))
    assert more.excess > 0.0
    assert robust_z(more, truth) == pytest.approx(robust_z(problem, truth), rel=1e-9)
    expected = more.expectation(truth)
    r = residuals(more, truth, expected)
    plain = residuals(problem, truth, problem.expectation(truth))
    assert in_noises(more, r, expected) == pytest.approx(plain, rel=1e-6, abs=1e-9)
    assert np.max(np.abs(r)) < np.max(np.abs(plain))
    assert more.of(more.runs[:1]).excess == more.excess
    assert more.with_excess(0.0).excess == 0.0


def test_a_few_wild_samples_do_not_make_the_excess(runs):
    def spiked(run):
        force = run.force.copy()
        force[100::200] += 1000.0 * run.noise
        return replace(run, force=force)

    truth = runs[1]
    plain = Problem([with_spring(run, 1e7) for run in runs[0]])
    wild = Problem([spiked(run) for run in plain.runs])
    assert excess_of(wild, truth) < 2.0 * excess_of(plain, truth)


def test_intervals_of_a_fit_with_an_excess_hold_the_scatter_of_fits(runs):
    """They come from the error itself: the drawn noise says nothing of what is missed."""
    truth, values = runs[1], []
    for seed in (3, 4, 5, 6):
        run = with_spring(bench_run(LAW, truth.values, seed), 4e6)
        values.append(fitted(Problem([run])).model.value("f_c"))
    found = fitted(Problem([with_spring(run, 4e6) for run in runs[0]]))
    scatter = float(np.std(values, ddof=1)) / np.sqrt(2.0)
    assert 0.25 < found.std["f_c"] / scatter < 4.0

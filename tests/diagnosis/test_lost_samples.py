"""Samples that were not measured have no say: neither in z, nor in the error in newtons."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.data.cut_off import beyond_range
from bristle.data.left_out import MISSING
from bristle.diagnosis.decision import missing
from bristle.diagnosis.effect_limits import detectable
from bristle.diagnosis.trials import judge
from bristle.identification.low_passed import error_rms
from bristle.identification.problem import Problem, Run, robust_z
from bristle.model.model import Model

DT = 0.002
T = np.arange(0.0, 24.0, DT)
TURN = 2.0 * np.pi * np.array([1.3, 3.1, 5.7])[:, None]
SIZE = np.array([8e-3, 3e-3, 1.5e-3])[:, None]
X = np.sum(SIZE * np.sin(TURN * T), axis=0)
V = np.sum(SIZE * TURN * np.cos(TURN * T), axis=0)
PLAIN = 5.0 * np.tanh(V / 3e-3) + 60.0 * V


class Given(Problem):
    """Runs whose force is given with and without an effect."""

    def __init__(self, runs: list[Run], bare: np.ndarray, whole: np.ndarray) -> None:
        super().__init__(runs)
        self.bare, self.whole = bare, whole

    def predict(self, model, run, draw=None):
        return self.whole if model.effects else self.bare


def run_of(force, noise, measured) -> Run:
    draws = np.zeros((0, len(T), 4))
    out = {} if measured is None else {MISSING: ~measured}
    return Run("r", DT, X, V, 0.0 * X, 0.0 * X, force, noise, draws, left_out=out)


@pytest.mark.parametrize("lost", [0.0, 0.1, 0.25])
def test_z_of_the_true_model_is_1_however_many_samples_are_lost(lost):
    rng = np.random.default_rng(4)
    force = PLAIN + rng.normal(0.0, 0.2, len(T))
    measured = rng.random(len(T)) >= lost
    force[~measured] = 400.0
    problem = Given([run_of(force, 0.2, measured)], PLAIN, PLAIN)
    assert robust_z(problem, Model("bingham")) == pytest.approx(1.0, abs=0.03)
    trial = judge(Model("bingham"), problem, problem)
    assert trial.train == pytest.approx(1.0, abs=0.03)
    assert trial.rms == pytest.approx(0.2, rel=0.03)
    assert error_rms(problem, Model("bingham"), 0.0) < 0.21


@pytest.mark.parametrize("more", [120.0, 240.0])
def test_an_effect_is_seen_beside_a_force_that_is_clipped(more):
    """The error at clipped samples is larger with the true effect, and says nothing."""
    whole = PLAIN + more * V * np.abs(V)
    noise = 0.02 * float(np.std(whole))
    force = whole + np.random.default_rng(3).normal(0.0, noise, len(T))
    end = float(np.quantile(np.abs(force), 0.86))
    force = np.clip(force, -end, end)
    kept = ~beyond_range(force, noise, end)
    parts = np.column_stack([np.tanh(V / 3e-3), V])
    bare = parts @ np.linalg.lstsq(parts[kept], force[kept], rcond=None)[0]
    problem = Given([run_of(force, noise, kept)], bare, whole)
    before, after = (
        judge(Model("bingham", effects), problem, problem)
        for effects in ((), ("quadratic_damping",))
    )
    assert after.z == pytest.approx(1.0, abs=0.03)
    assert after.rms < before.rms
    assert missing(before, after)


def test_the_smallest_share_that_is_seen_is_that_of_the_samples_there_are():
    noise, half = 0.2, np.arange(len(T)) % 2 == 0
    shares = []
    for measured in (None, half):
        problem = Given([run_of(PLAIN, noise, measured)], PLAIN, PLAIN)
        shares.append(detectable(problem, problem.expectation(Model("bingham"))))
    assert shares[1] == pytest.approx(shares[0], rel=0.01)

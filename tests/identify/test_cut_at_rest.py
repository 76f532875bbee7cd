"""A run that begins at rest under load: the bristles are bent already, and the model knows it."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.identify.model import BENT, Model, Problem, Run, rests

DT, NOISE = 0.002, 0.02
VALUES = {
    "sigma_a": 4000.0, "sigma_0": 1000.0, "sigma_1": 5.0, "sigma_2": 30.0, "sigma_b": 10.0,
    "v_n": 0.05, "a_0": 800.0,
}  # fmt: skip


def stop_and_go(begin):
    """Return a run cut out of a motion of strokes and rests, from sample `begin` on."""
    t = np.arange(6000) * DT
    turns = np.clip(np.mod(t, 4.0) / 1.0, 0.0, 1.0) - np.clip(np.mod(t, 4.0) - 2.0, 0.0, 1.0)
    x = 0.01 * (1.0 - np.cos(np.pi * turns))
    v = np.gradient(x, DT)
    a, V = np.gradient(v, DT), np.full(len(t), 2.0)
    whole = Run("whole", DT, x, v, a, V, np.zeros(len(t)), NOISE, np.zeros((1, len(t), 4)))
    force = Problem([whole]).predict(Model("lugre", (), dict(VALUES)), whole)
    shown = force + NOISE * np.random.default_rng(1).standard_normal(len(t))
    part = slice(begin, None)
    draws = np.zeros((1, len(t) - begin, 4))
    return Run("part", DT, x[part], v[part], a[part], V[part], shown[part], NOISE, draws)


def error(run, values=VALUES):
    problem = Problem([run])
    left = run.force - problem.predict(Model("lugre", (), dict(values)), run)
    return float(np.sqrt(np.mean(left[run.skip :] ** 2)))


@pytest.mark.parametrize("begin", [750, 1700])  # the rests after a stroke out and one back
def test_a_run_cut_out_at_rest_is_predicted(begin):
    run = stop_and_go(begin)
    assert rests(run)
    assert abs(run.force[0]) > 100.0 * NOISE
    assert error(run) == pytest.approx(NOISE, rel=0.1)
    # Taken as straight, the bristles' force is missing until the motion begins.
    assert error(run, {**VALUES, BENT: 1e-12}) > 20.0 * NOISE


def test_a_run_from_rest_without_load_begins_straight():
    t = np.arange(3000) * DT
    x = np.where(t > 1.0, 0.01 * np.sin(3.0 * (t - 1.0)), 0.0)
    v = np.gradient(x, DT)
    a, V, draws = np.gradient(v, DT), np.zeros(len(t)), np.zeros((1, len(t), 4))
    quiet = NOISE * np.random.default_rng(2).standard_normal(len(t))
    run = Run("quiet", DT, x, v, a, V, quiet, NOISE, draws)
    model = Model("lugre", (), dict(VALUES))
    told = Model("lugre", (), {**VALUES, BENT: 0.0})
    problem = Problem([run])
    assert rests(run)
    np.testing.assert_array_equal(problem.predict(model, run), problem.predict(told, run))


def test_the_deflection_is_no_larger_than_sliding_has_it():
    run = stop_and_go(750)
    offset = Run(
        "offset", DT, run.x, run.v, run.a, run.V, run.force + 1000.0, NOISE, run.draws
    )  # a load cell's zero
    predicted = Problem([offset]).predict(Model("lugre", (), dict(VALUES)), offset)
    slides = (VALUES["sigma_a"] + 2.0 * VALUES["sigma_0"]) / VALUES["a_0"]
    assert predicted[0] == pytest.approx(slides, rel=1e-6)


def test_bristles_that_never_slip_are_no_offset_of_each_run():
    run = stop_and_go(750)
    offset = Run("offset", DT, run.x, run.v, run.a, run.V, run.force + 1000.0, NOISE, run.draws)
    stiff = {**VALUES, "a_0": 1.0 / float(np.ptp(run.x))}
    problem = Problem([offset])
    assert problem.predict(Model("lugre", (), stiff), offset)[0] == pytest.approx(0.0, abs=1.0)

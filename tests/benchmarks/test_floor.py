"""What measured runs let a model reach, and the Bouc-Wen benchmark's own integrator."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import _floor, _free, _reach, boucwen
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

DT = 0.01


def run(seed: int, count: int = 600) -> Run:
    """Return a run of a damper with friction that lags behind the motion."""
    rng = np.random.default_rng(seed)
    t = np.arange(count) * DT
    w = 2.0 * np.pi * rng.uniform(0.7, 1.5)
    x, v, a = 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w * w * np.sin(w * t)
    force = 50.0 * np.tanh(v / 0.01) + 200.0 * v + rng.normal(0.0, 0.5, count)
    return Run(f"run {seed}", DT, x, v, a, np.zeros(count), force, 0.5, np.zeros((0, count, 4)))


def poisoned(one: Run) -> Run:
    """Return a run whose force is noise."""
    noise = np.random.default_rng(9).normal(0.0, 1e3, len(one.force))
    return replace(one, force=noise)


@pytest.fixture
def small(monkeypatch):
    """A learner of few trees and few settings: what is asked is which runs it sees."""
    pytest.importorskip("sklearn")
    monkeypatch.setattr(_floor, "SPANS", (0.1,))
    return replace(_floor.LEARNERS[0], grid={"max_leaf_nodes": (4, 8), "max_iter": (12,)})


def test_held_out_runs_choose_nothing(small):
    train, held = [run(k, 300) for k in range(4)], [run(7, 300)]
    told = _floor.without_physics(small, train, held)
    other = _floor.without_physics(small, train, [poisoned(one) for one in held])
    assert (told.chosen, told.folds) == (other.chosen, other.folds)
    assert told.share < 0.3 < other.share


def test_folds_are_whole_runs_or_stretches():
    runs = [run(k, 200) for k in range(4)]
    assert [set(part) for part in _floor.parts_of(runs)] == [{0}, {1}, {2}, {3}]
    (part,) = _floor.parts_of(runs[:1])
    assert np.array_equal(np.unique(part), np.arange(4))
    assert np.all(np.diff(part) >= 0)


def test_a_history_holds_no_later_sample():
    one = run(1)
    cut = replace(one, v=np.where(np.arange(600) > 300, 1e3, one.v))
    before, after = (_floor.histories(each, 0.4, True) for each in (one, cut))
    assert np.array_equal(before[:301], after[:301])
    assert before.shape[1] == len({round(40 / 2**k) for k in range(7)} - {0}) * 3 + 4


def test_least_squares_finds_a_law():
    runs = [run(k) for k in range(2)]
    begin = Model("bingham", (), {"f_c": 30.0, "c_0": 100.0}, ("f_v", "c_v"))
    share = _floor.least_squares(begin, Problem(runs), Problem([run(7)]))
    assert share < 0.25
    # Held-out runs judge it and move nothing.
    worse = _floor.least_squares(begin, Problem(runs), Problem([poisoned(run(7))]))
    assert worse == pytest.approx(1.0, abs=0.1)


def test_answers_of_another_version_are_none():
    made = {
        json.dumps(["mr_damper_utfpr", "steps", _reach.VERSION - 1]): {"free": {}},
        json.dumps(["mr_damper_utfpr", "neural network", _reach.VERSION]): {"share": 0.1},
    }
    assert _reach._by_folder(made, ["mr_damper_utfpr"]) == {
        "mr_damper_utfpr": {"neural network": {"share": 0.1}}
    }


def test_steps_see_training_runs_alone(monkeypatch):
    model = _free.Found(Model("dahl"), (), 1.0, (), False)
    calls = []

    def steps(train):
        calls.append(("steps", train))
        return model, model, replace(model, closed=True)

    def opened_once(found, train, held):
        calls.append(("opened", held))
        return 0.1

    monkeypatch.setattr(_reach, "steps", steps)
    monkeypatch.setattr(_reach, "opened_once", opened_once)
    made = _reach.found(_reach.STEPS, ["a", "b"], ["c"])
    assert calls == [("steps", ["a", "b"]), *(("opened", ["c"]) for _ in range(3))]
    assert set(made) == {"free", "learned", "closed"}
    assert made["closed"]["with"] == "dahl + a closure"
    assert made["learned"] == {"share": 0.1, "with": "dahl", "z": 1.0}


def test_the_published_system_is_integrated_right():
    from scipy.integrate import solve_ivp

    dt, n = 1.0 / 3e4, 1500
    push = lambda t: 80.0 * np.sin(260.0 * t) + 40.0 * np.cos(700.0 * t)  # noqa: E731
    u = push(0.5 * dt * np.arange(2 * n - 1))
    ours = boucwen.integrate(u, dt)
    exact = solve_ivp(
        lambda t, s: boucwen.rates(*s, push(t)), (0.0, dt * (n - 1)), np.zeros(3),
        rtol=1e-10, atol=1e-12, t_eval=dt * np.arange(n),
    ).y.T  # fmt: skip
    apart = np.abs(ours - exact).max(axis=0) / np.ptp(exact, axis=0)
    assert np.all(apart < 1e-5)


def test_a_step_at_constant_velocity_is_exact():
    inward, outward = 1900.0, -300.0
    for v in (0.3, -0.3):
        for b in (-2e-4, 0.0, 3e-4):
            got, dt = b, 1e-6
            for _ in range(2000):
                got += dt * (
                    v - 0.5 * (inward + outward) * abs(v) * got
                    - 0.5 * (outward - inward) * v * abs(got)
                )  # fmt: skip
            assert boucwen.bent(b, v, inward, outward, 2e-3) == pytest.approx(got, rel=1e-3)


def test_multisine_has_its_rms_and_band():
    u = boucwen.finer(boucwen.multisine(1), 4)
    assert np.sqrt(np.mean(u**2)) == pytest.approx(50.0)
    lines = np.fft.rfftfreq(len(u), 0.25 / boucwen.RATE)
    power = np.abs(np.fft.rfft(u))
    assert lines[power > 1e-6 * power.max()] == pytest.approx(
        np.arange(55, 1639) * boucwen.RATE / boucwen.SAMPLES
    )
    assert boucwen.coarser(u) == pytest.approx(boucwen.finer(boucwen.multisine(1), 1))

"""A trained policy: its derivative, its estimator, its motions, and what a short training gains."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.training import design as policy_design
from benchmarks.training.design import estimator
from benchmarks.training.train import main
from benchmarks.training.training import Loop, PolicyTask, Run, Training, same_motion, synthetic
from bristle.component.control_laws import hidden_units, policy_inputs, voltage_share, weight_count
from bristle.data.ground_motion import GroundMotion
from bristle.errors import DesignError
from bristle.physics.building import paper_building
from bristle.synthesis import DesignDamper
from bristle.synthesis.plant import structure

H = 0.002
MOTIONS = "[motions]\nsynthetic = 8\n"
SEEN = '[motions]\nrecords = ["el_centro_1940_ns"]\nreported = ["el_centro_1940_ns"]\n'
BRAKES = MOTIONS + '[damper]\nlaw = "lugre"\nparameters = { sigma_0 = 0.0, sigma_b = 0.0 }\n'


def test_the_voltage_is_the_same_where_all_signs_turn() -> None:
    random = np.random.default_rng(0)
    n, hidden = 4, 3
    weights = random.standard_normal(weight_count(n, hidden))
    assert hidden_units(n, len(weights)) == hidden
    scales = [0.9, 0.1, 8.0, 2.0, 0.05, 8.0]
    state, measured = random.standard_normal(n), random.standard_normal(4)
    shares = []
    for side in (1.0, -1.0):
        inputs, units = np.zeros(n + 3), np.zeros(hidden)
        policy_inputs(n, side * state, 1.5, side * measured, scales, inputs)
        shares.append(voltage_share(n + 3, hidden, inputs, weights, units))
    assert shares[0] == shares[1]
    assert 0.0 < shares[0] < 1.0


def test_the_estimator_follows_the_building_through_wrong_first_states() -> None:
    s = structure(paper_building())
    A, B = estimator(s, H)
    assert np.abs(np.linalg.eigvals(A)).max() < 1.0
    from scipy.linalg import expm

    both = np.zeros((7, 7))
    both[:6, :6], both[:6, 6] = s.A, s.B[:, 0]
    stepped = expm(both * H)
    x, e = 0.01 * np.ones(6), np.zeros(len(A))
    for k in range(1500):
        force = 3.0 * np.sin(12.0 * k * H)
        x = stepped[:6, :6] @ x + stepped[:6, 6] * force
        e = A @ e + B @ np.append(s.C @ x, force)
    assert e[:6] == pytest.approx(x, abs=1e-6)


def test_synthetic_motions_have_their_peak_and_their_seed() -> None:
    first, again = (synthetic(np.random.default_rng(3), H) for _ in range(2))
    assert np.array_equal(first, again)
    assert np.abs(first).max() == pytest.approx(1.0, rel=0.02)
    assert not np.array_equal(first, synthetic(np.random.default_rng(4), H))


def test_a_motion_is_known_by_its_shape() -> None:
    t = np.arange(500) * 0.01
    a = GroundMotion(t, np.sin(7.0 * t) * t, "a", "")
    assert same_motion(a, replace(a, acceleration=3.0 * a.acceleration, time=t + 1.0, name="b"))
    assert not same_motion(a, replace(a, acceleration=a.acceleration[::-1], name="c"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "hinf"', 'expected kind = "policy"'),
        ('kind = "policy"', "trained on motions"),
        ('kind = "policy"\n[motions]', "none to train on"),
        ('kind = "policy"\n[motions]\nsynthetic = 2.5', "whole number"),
        ('kind = "policy"\n[motions]\nsinthetic = 2', 'no key "sinthetic"'),
        ('kind = "policy"\n[motions]\nrecords = 3', "list of names"),
        (f'kind = "policy"\n{SEEN}', "el_centro_1940_ns is trained on and"),
        (f'kind = "policy"\n{MOTIONS}[damper]\nv_max = 0.0', "nothing to control"),
        (f'kind = "policy"\n{BRAKES}', "voltage has no effect on the force"),
        (f'kind = "policy"\nsample_period = 0.1\n{MOTIONS}', "too long for"),
    ],
)
def test_a_training_that_cannot_be_is_refused_before_it_begins(
    text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.toml").write_text("schema = 1\n" + text)
    assert main([str(tmp_path / "bad.toml"), "--out", str(tmp_path / "mine.json")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "mine.json").exists()


@pytest.mark.slow  # the loop is differentiated: against differences
@pytest.mark.parametrize("law", ["lugre", "bingham"])
def test_the_derivative_is_that_of_the_response(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[tuple[Loop, list[Run]]] = []

    def caught(loop: Loop, runs: list[Run], *_: object) -> None:
        found.append((loop, runs))
        raise DesignError("enough")

    monkeypatch.setattr(policy_design, "descend", caught)
    with pytest.raises(DesignError, match="enough"):
        policy_design.design_policy(
            PolicyTask(damper=DesignDamper(law), motions=Training(synthetic=8, hidden=3))
        )
    (loop, runs), random = found[0], np.random.default_rng(1)
    weights = loop.constant(0.25)
    if law == "lugre":
        weights += 0.02 * random.standard_normal(len(weights))
    for run in (runs[0], runs[7]):  # with noise and delay, and without
        by_y = random.standard_normal(len(run.motion.ground)) * np.hanning(len(run.motion.ground))
        loop.respond(run, weights)
        slope = loop.pull_back(run, weights, by_y, 0.0 * by_y)
        along = np.zeros(len(weights))
        along[-1] = 1.0  # a shift of all voltages; friction that turns is not smooth in the others
        if law == "lugre":
            along = random.standard_normal(len(weights))
        ends = [by_y @ loop.respond(run, weights + e * along)[0] for e in (1e-6, -1e-6)]
        assert slope @ along == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=2e-2)


@pytest.mark.slow  # a policy is trained: it serves
def test_a_short_training_beats_clipped_optimal_control_on_motions_held_out() -> None:
    task = PolicyTask(
        damper=DesignDamper("lugre"), motions=Training(synthetic=24, rounds=30, hidden=6)
    )
    result = policy_design.design_policy(task)
    facts = result.facts
    assert facts["peak_ratio"] < 0.9
    assert facts["peak_ratio_disturbed"] < 0.95
    assert facts["weights"] == len(result.controller.W) == weight_count(result.controller.n, 6)

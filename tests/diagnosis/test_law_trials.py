"""Laws fitted to the same runs: what is tried, and what a law that fails does to the others."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.checks.runs import tells_a_bend
from bristle.data.measurement import measurements_of_frame
from bristle.diagnosis import diagnose_rig, law_trials
from bristle.diagnosis.law_trials import (
    FORM_ALONE,
    LawTrial,
    better_law,
    not_finite,
    try_laws,
)
from bristle.diagnosis.trials import Trial
from bristle.diagnosis.words import left_out
from bristle.identification.error import ForceError
from bristle.identification.problem import Problem
from bristle.identification.rig import bench_rig
from bristle.model.model import Model
from bristle.study.inputs import measurements
from tests.made import bench_run

FEW = ("bingham_standard", "dahl")


@pytest.fixture(scope="module")
def runs():
    """Return the runs for training and the held-out one of a tanh-like damper at four levels."""
    found = measurements([bench_run(k, seconds=2.0) for k in (1, 2, 3)])
    return found[:2], found[2:]


@pytest.fixture(scope="module")
def problems(runs):
    return bench_rig(*runs).sites(Model("lugre"))["damper"].pair


@pytest.fixture
def few(monkeypatch):
    """Let there be two laws alone."""
    monkeypatch.setattr(law_trials, "law_names", lambda: FEW)


def test_each_law_is_tried_with_a_parabola_where_the_command_has_levels(runs, problems, few):
    assert tells_a_bend(runs[0])
    rows = try_laws(*problems, Model("lugre"), bends=True)
    assert {row.law for row in rows} == {*FEW, *(f"{name}[quadratic]" for name in FEW)}
    assert [row.trial.z for row in rows] == sorted(row.trial.z for row in rows)
    by_name = {row.law: row for row in rows}
    assert by_name["bingham_standard"].fitted == 4  # f_c, f_v, c_0, c_v
    assert by_name["bingham_standard[quadratic]"].fitted == 6
    (z,) = rows[0].z_runs  # one held-out run
    assert z == pytest.approx(rows[0].trial.z)
    straight = try_laws(*problems, Model("lugre"), bends=False)
    assert {row.law for row in straight} == set(FEW)


def test_laws_have_those_of_the_present_effects_that_can_join_them(problems, few):
    present = Model("lugre", ("gas_spring",), {"gas_spring.k": 80.0}, ("gas_spring.k", "sigma_1"))
    (first, *_) = try_laws(*problems, present, bends=False)
    assert first.trial.effects == ("gas_spring",)
    assert first.trial.model.fixed == ("gas_spring.k",)  # what was held of another law is not
    assert first.trial.model.value("gas_spring.k") == 80.0


def test_how_much_of_an_error_is_the_form_of_the_law_is_told():
    def row(law, z, rms):
        trial = Trial(Model("tanh"), z, z, rms, np.ones(1), np.ones(1))
        return LawTrial(law, trial, ForceError(1, 1, rms, 1.0, rms, 1.0), (z,))

    judged = row("lugre", 3.0, 1.0).trial
    # The z of dahl is lower still, but it serves the samples near rest at the cost of all others.
    laws = [row("dahl", 1.2, 1.5), row("tanh[quadratic]", 2.0, 0.7), row("lugre", 3.0, 1.0)]
    other = better_law(judged, laws)
    assert other is not None
    assert (other.law, other.z, other.share) == ("tanh[quadratic]", 2.0, pytest.approx(0.625))
    assert other.sentence() == (
        "Without a further effect, the law tanh with a quadratic command leaves 2.00 "
        "times the noise (z): its form alone explains 62 % of what is missing."
    )
    assert other.sentence(added=True) == (
        "With the same effects, the law tanh with a quadratic command leaves 2.00 times the "
        "noise (z): its form alone explains 62 % of what then remains above the noise."
    )
    assert other.as_dict()["command"] == "quadratic"
    assert better_law(judged, laws[2:]) is None


class Broken(Problem):
    """Runs on which Dahl's law has no number for a force."""

    def predict(self, model, run, draw=None):
        found = super().predict(model, run, draw)
        return np.full_like(found, np.nan) if model.law == "dahl" else found


def test_a_law_whose_force_is_not_a_number_is_left_out_and_told(problems, few):
    train, held_out = (Broken(one.runs) for one in problems)
    assert not_finite(train, Model("lugre")) == ["dahl"]
    (row,) = try_laws(train, held_out, Model("lugre"), bends=False)
    assert row.law == "bingham_standard"
    assert left_out(["dahl"]) == "dahl is left out: the force is not a number on these runs."


def test_two_levels_or_a_command_that_was_not_measured_tell_no_bend(runs):
    two = bench_run(4, seconds=2.0)
    two["U [V]"] = np.where(two["U [V]"] > 2.0, 4.0, 0.0)
    assert not tells_a_bend(measurements([two]))
    del two["U [V]"]
    assert not tells_a_bend(measurements([two]))


@pytest.mark.slow  # law free, pairs
def test_effects_that_leave_an_error_are_not_named_where_another_law_explains_the_runs_alone():
    runs = [_of_tanh(k) for k in range(3)]
    found = diagnose_rig(runs[:2], runs[2:], Model("bingham"))
    assert found.kind == "unknown"
    assert found.effects == ()
    (text,) = [one for one in found.reasons if FORM_ALONE in one]
    assert text.startswith("Without a further effect, the law tanh")


def _of_tanh(k):
    """Return a run of a damper that yields smoothly, with a spring: 8 s at 500 Hz, by current."""
    rng = np.random.default_rng(k)
    t = np.arange(0.0, 8.0, 2e-3)
    slow, size = 2.0 * np.pi * (1.0, 2.0, 1.5)[k], (0.012, 0.008, 0.010)[k]
    fast = 2.0 * np.pi * 2.7
    x = size * (np.sin(slow * t) + 0.3 * np.sin(fast * t + 0.4))
    v = size * (slow * np.cos(slow * t) + 0.3 * fast * np.cos(fast * t + 0.4))
    current = 0.5 + 0.5 * np.sin(2.0 * np.pi * 0.31 * t + k)
    force = (800.0 + 900.0 * current) * np.tanh(v / 0.01) + (2000.0 + 1500.0 * current) * v
    frame = pd.DataFrame({
        "time": t,
        "displacement": x + 2e-5 * rng.standard_normal(len(t)),
        "current": current + 1e-3 * rng.standard_normal(len(t)),
        "force": force + 20_000.0 * x + 8.0 * rng.standard_normal(len(t)),
    })  # fmt: skip
    units = {"time": "s", "displacement": "m", "current": "A", "force": "N"}
    specs = {name: ChannelSpec(name, unit) for name, unit in units.items()}
    return measurements_of_frame(frame, f"run{k}", specs)[0]

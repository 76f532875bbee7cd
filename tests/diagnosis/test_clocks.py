"""Loggers whose clocks differ: what is planted is told and set right, and nothing where none is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken import measured

from bristle.core.finding import Finding
from bristle.diagnosis.clocks import clock_faults, clocks_of
from bristle.diagnosis.prepared import corrected
from bristle.diagnosis.sensor_faults import as_json, instruments_of
from bristle.diagnosis.trials import judge
from bristle.identification.fit import fit
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

STEP = 0.002  # s
T = STEP * np.arange(5000)
VALUES = {"sigma_a": 700.0, "sigma_0": 450.0, "sigma_1": 5.0, "sigma_2": 100.0, "sigma_b": 18.0}
NOISE = 0.05  # N
RATE = 4e-4  # s/s: 4 ms in 10 s


def runs(rate=0.0, late=(0.0,) * 4, effect=lambda v, F: F):
    """Return four runs whose force was recorded at other times than the motion."""
    out = []
    for seed, begin in enumerate(late):
        random = np.random.default_rng(seed)
        w = 2.0 * np.pi * random.uniform(0.4, 4.0, 8)
        shift, size = random.uniform(0.0, 6.0, 8)[:, None], 0.05 / w

        def motion(t, w=w, shift=shift, size=size):
            angle = w[:, None] * t + shift
            return size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)

        V = np.full(len(T), 2.0 * seed)
        # A force that is read at t on its own clock is that of the moment (t - late)/(1 + rate).
        x, v, a = motion((T - begin) / (1.0 + rate))
        force = effect(v, DamperForces("lugre", []).force(x, v, a, V, STEP, VALUES))
        force = force + NOISE * random.standard_normal(len(T))
        x, v, a = motion(T)
        none = np.zeros((0, len(T), 4))
        out.append(Run(f"run{seed}", STEP, x, v, a, V, force, NOISE, none))
    return Problem(out[:3]), Problem(out[3:])


def opened(train, held_out):
    model = fit(train, Model("lugre", (), VALUES), with_std=False).model
    return judge(model, train, held_out), train, held_out


def test_a_clock_that_gains_is_told_with_its_rate_and_set_right():
    before, *pair = opened(*runs(RATE))
    found = clock_faults(before, *pair)
    (fault,) = found.faults
    assert (fault.channel, fault.kind, fault.run) == ("force", "clock", "")
    assert fault.value == pytest.approx(RATE, rel=0.03)
    assert abs(fault.value - RATE) < 4.0 * fault.std
    assert before.z > 1.3
    assert found.trial.z == pytest.approx(1.0, abs=0.05)
    assert "400 ppm" in fault.text
    assert "fast" in fault.text


@pytest.mark.parametrize("late", [0.008, -0.012])
def test_a_run_that_began_apart_is_told_with_its_name(late):
    before, *pair = opened(*runs(late=(0.0, late, 0.0, 0.0)))
    found = clock_faults(before, *pair)
    (fault,) = found.faults
    assert (fault.kind, fault.run) == ("delay", "run1")
    assert fault.value == pytest.approx(late, rel=0.05)
    assert ("later" if late > 0.0 else "earlier") in fault.text
    assert found.trial.train == pytest.approx(1.0, abs=0.05)


def test_no_fault_where_noise_is_all_or_something_else_is_missing():
    assert clock_faults(*opened(*runs())) is None
    spring = runs(effect=lambda v, F: F + 40.0 * v * np.abs(v) / 0.05)
    before, *pair = opened(*spring)
    assert before.z > 1.5
    assert clock_faults(before, *pair) is None


def test_too_short_a_run_says_nothing_of_clocks():
    train, _ = runs()
    short = [
        replace(run, **{n: getattr(run, n)[:400] for n in ("x", "v", "a", "V", "force")})
        for run in train.runs
    ]
    assert clocks_of(Model("lugre", (), VALUES), Problem(short)) is None


def test_a_fault_of_one_run_corrects_that_run_alone():
    ramp = 10.0 * T
    channels = {"time": T, "displacement": np.sin(T), "force": ramp}
    pair = [measured(channels, 0, noise=0.0, name=name) for name in ("one", "two")]
    late = Finding("delay", "warning", "", channel="force", value=0.1, std=0.0, run="two")
    one, two = corrected(pair, [late])
    assert one["force"] == pytest.approx(ramp)
    assert two["force"][:4000] == pytest.approx(ramp[:4000] + 1.0)
    (fast,) = corrected(
        pair[:1], [Finding("clock", "warning", "", channel="force", value=1e-3, std=0.0)]
    )
    assert fast["force"][:4000] == pytest.approx(1.001 * ramp[:4000])
    assert as_json(late)["run"] == "two"
    assert "run" not in as_json(
        Finding("clock", "warning", "", channel="force", value=1e-3, std=0.0)
    )


def test_a_run_that_began_apart_is_no_effect_of_the_model():
    late = Finding("delay", "warning", "", channel="force", value=0.008, std=1e-5)
    assert instruments_of([late]) == ("delay",)
    assert instruments_of([replace(late, run="run1")]) == ()

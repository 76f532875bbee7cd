"""A load cell off its zero and a late voltage are told from physics that looks alike."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.diagnosis.inconsistent_runs import inconsistent_runs
from bristle.diagnosis.model_faults import model_based_faults
from bristle.diagnosis.trials import judge
from bristle.identification.fit import fit_from_starts
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

DT, N, NOISE = 0.002, 3000, 0.03
T = DT * np.arange(N)
LAW = {"f_c": 1.3, "f_v": 0.8, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}
OFFSET, LATE = 0.4, 0.006


def made(seed, effects=(), values=None, spoil=lambda v: v):
    """Return a run of a Bingham damper whose motion is known; `spoil` acts on the voltage shown."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.4, 4.0, 10)
    phase, size = random.uniform(0.0, 6.28, 10), 0.02 / w
    angle = w[:, None] * T + phase[:, None]
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = 3.0 + 2.0 * np.sin(2.0 * np.pi * random.uniform(0.8, 1.6) * T + random.uniform(0.0, 6.28))
    force = DamperForces("bingham", list(effects)).force(x, v, a, V, DT, {**LAW, **(values or {})})
    force = force + NOISE * random.standard_normal(N)
    return Run(f"run_{seed}", DT, x, v, a, spoil(V), force, NOISE, np.zeros((2, N, 4)))


def problems(**choices):
    return Problem([made(s, **choices) for s in (1, 2, 3)]), Problem([made(4, **choices)])


def found(train, held_out):
    base = fit_from_starts(train, Model("bingham"), starts=2).model
    return model_based_faults(judge(base, train, held_out), train, held_out)


def preload(k):
    names = {"gas_spring.preload": OFFSET, "gas_spring.k": k}
    return {"effects": ("gas_spring",), "values": {**names, "gas_spring.k_2": 0.0}}


def test_a_force_off_its_zero():
    fault = found(*problems(**preload(0.0))).faults[0]
    assert (fault.channel, fault.kind) == ("force", "bias")
    assert fault.value == pytest.approx(OFFSET, abs=max(4.0 * fault.std, 0.01))


def test_a_preload_with_its_spring_is_physics():
    assert found(*problems(**preload(150.0))) is None


def test_a_damper_stronger_one_way_is_physics():
    values = {"asymmetry.ratio": 0.15}
    assert found(*problems(effects=("asymmetry",), values=values)) is None


def test_a_voltage_recorded_late():
    shift = round(LATE / DT)
    late = found(*problems(spoil=lambda V: np.concatenate([np.full(shift, V[0]), V[:-shift]])))
    assert (late.faults[0].channel, late.faults[0].kind) == ("voltage", "delay")
    assert late.faults[0].value == pytest.approx(LATE, abs=max(4.0 * late.faults[0].std, 1e-4))
    assert late.trial.z == pytest.approx(1.0, abs=0.1)


def test_a_coil_that_lags_is_physics():
    values = {"coil_lag.tau": 0.03, "coil_lag.fall": 1.0, "coil_lag.eddy": 0.0}
    assert found(*problems(effects=("coil_lag",), values=values)) is None


def test_a_voltage_recorded_early_is_physics():
    # The force then follows the record as it follows a slow coil.
    shift = round(LATE / DT)
    early = problems(spoil=lambda V: np.concatenate([V[shift:], np.full(shift, V[-1])]))
    assert found(*early) is None


def test_clean_runs_show_nothing():
    assert found(*problems()) is None


def test_a_run_of_another_damper_is_named():
    train, held_out = problems()
    strange = made(7, ("gas_spring",), {"gas_spring.k": 300.0, "gas_spring.preload": 0.0})
    mixed = Problem([*train.runs, strange])
    words = inconsistent_runs(Model("bingham", (), LAW), mixed, held_out)
    assert "run_7 (" in words
    assert "run_1 (" not in words
    assert inconsistent_runs(Model("bingham", (), LAW), train, held_out) == ""

"""A command limited in slew or range before the coil is told, and no effect that looks like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.core.finding import Finding
from bristle.data.corrections import Correction, limited, set_right, wrong_value
from bristle.diagnosis.model_faults import limited_drive
from bristle.diagnosis.prepared import corrected
from bristle.diagnosis.trials import judge
from bristle.identification.fit import fit
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

DT, N, NOISE = 0.002, 2500, 0.05
T = DT * np.arange(N)
LAW = {"f_c": 1.3, "f_v": 0.8, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}


def steps(random):
    """Return a command that is switched [V]."""
    return np.repeat(random.choice([0.0, 2.0, 4.0, 6.0, 8.0], 20), N // 20)


def sine(random):
    return 3.0 + 3.0 * np.sin(2.0 * np.pi * random.uniform(0.8, 1.6) * T + random.uniform(0.0, 6.0))


def held(random):
    return np.full(N, random.choice([2.0, 4.0, 6.0, 8.0]))


def made(seed, command=steps, limit=None, effects=(), values=None):
    """Return a run of a Bingham damper whose motion is known, its command limited on the way."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.4, 4.0, 10)
    phase, size = random.uniform(0.0, 6.28, 10), 0.02 / w
    angle = w[:, None] * T + phase[:, None]
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = command(random)
    felt = limited(V, DT, *limit) if limit else V
    force = DamperForces("bingham", list(effects)).force(
        x, v, a, felt, DT, {**LAW, **(values or {})}
    )
    force = force + NOISE * random.standard_normal(N)
    return Run(f"run_{seed}", DT, x, v, a, V, force, NOISE, np.zeros((2, N, 4)))


def found(drive="voltage", **how):
    runs = [replace(made(seed, **how), drive=drive) for seed in (1, 2, 3, 4)]
    train, held_out = Problem(runs[:3]), Problem(runs[3:])
    model = fit(train, Model("bingham", (), LAW), with_std=False).model
    before = judge(model, train, held_out)
    return before, limited_drive(before, train, held_out)


@pytest.mark.parametrize("command", [steps, sine])
@pytest.mark.parametrize("limit", [("slew", 12.0), ("range", 4.5)])
def test_a_limit_is_told_with_its_value_and_set_right(command, limit):
    before, told = found(command=command, limit=limit)
    assert (told.faults[0].channel, told.faults[0].kind) == ("voltage", limit[0])
    assert told.faults[0].value == pytest.approx(limit[1], rel=0.02)
    assert abs(told.faults[0].value - limit[1]) < 5.0 * told.faults[0].std
    assert before.z > 1.2
    assert told.trial.z == pytest.approx(1.0, abs=0.06)
    assert "4 of 4 runs" in told.faults[0].text
    assert f'fault = "{limit[0]}"' in told.faults[0].text
    apart = told.held_out.runs[0].V - limited(made(4, command=command).V, DT, *limit)
    assert float(np.max(np.abs(apart))) < 0.1


@pytest.mark.parametrize(
    "effect",
    [
        {"coil_lag.tau": 0.06, "coil_lag.fall": 1.0, "coil_lag.eddy": 0.0},
        {"saturation.V_s": 4.0, "saturation.shape": 2.0},
        {"gas_spring.k": 150.0, "gas_spring.k_2": 0.0, "gas_spring.preload": 0.0},
    ],
)
def test_effects_are_no_limit(effect):
    name = next(iter(effect)).partition(".")[0]
    before, told = found(effects=(name,), values=effect)
    assert before.z > 1.2
    assert told is None


def test_a_current_is_told_in_its_own_unit():
    _, told = found(drive="current", limit=("slew", 12.0))
    assert told.faults[0].channel == "current"
    assert told.faults[0].text.startswith("Current reaches the coil no faster than 12 A/s")


def test_clean_runs_and_commands_that_are_held_show_none():
    assert found()[1] is None
    before, told = found(command=held, limit=("range", 4.5))
    assert before.z > 1.2
    assert told is None


def test_a_limit_that_is_known_is_put_on_the_command():
    V = np.array([0.0, 0.0, 6.0, 6.0, 6.0, 6.0, 0.0, 0.0, 0.0, 0.0])
    assert limited(V, 0.1, "range", 4.0).max() == 4.0
    slow = limited(V, 0.1, "slew", 20.0)
    assert slow == pytest.approx([0, 0, 0, 2, 4, 6, 6, 4, 2, 0])  # it was held until the jump
    assert limited(V, 0.1, "slew", 1e3) is V
    both = [Correction("voltage", "slew", 20.0), Correction("voltage", "range", 4.0)]
    channels = set_right({"voltage": V, "force": V}, 0.1, both)
    assert channels["voltage"] == pytest.approx([0, 0, 0, 2, 4, 4, 4, 2, 0, 0])
    assert np.array_equal(channels["force"], V)
    assert "no faster than 20 V/s" in both[0].text
    assert "up to 4 V" in both[1].text
    assert wrong_value("slew", 0.0)
    assert not wrong_value("range", 3.0)


def test_a_told_limit_corrects_measurements():
    from shaken import measured

    channels = {"time": T, "displacement": np.sin(T), "voltage": 5.0 + np.sin(T)}
    (right,) = corrected(
        [measured(channels, 0, noise=0.0, name="one")],
        [Finding("range", "warning", "", channel="voltage", value=5.5, std=0.0)],
    )
    assert right["voltage"].max() == 5.5

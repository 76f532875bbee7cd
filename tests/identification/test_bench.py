"""A bench takes a voltage that jumps as one that was held, and a smooth one as linear."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from math import exp

import numpy as np
import pytest
from scipy.optimize import brentq

from bristle.core import jit
from bristle.identification.histories import DamperForces, before_jump, compiled_history
from bristle.physics.damper_source import LIBRARY
from bristle.physics.law import laws_of
from tests.physics.rigs import force_at

DT = 0.002
EFFECTS = ("coil_lag", "gas_spring", "remanence", "stribeck")
SPEED = 0.1
AT = 200


def pulled(law: str, effects: list[str], V: np.ndarray, **values: float) -> np.ndarray:
    """Return the force (n,) [N] at a steady `SPEED` under a voltage (n,) [V]."""
    n = len(V)
    x, v = SPEED * DT * np.arange(n), np.full(n, SPEED)
    return DamperForces(law, effects).force(x, v, np.zeros(n), V, DT, values)


def stepped(first: float, then: float, n: int = 400) -> np.ndarray:
    return np.where(np.arange(n) < AT, first, then)


def test_a_jump_stands_out_against_its_neighbours() -> None:
    V = np.array([0.0, 0.0, 5.0, 5.0, 5.0])
    assert [before_jump(V, k) for k in range(1, 5)] == [0.0, 0.0, 5.0, 5.0]
    sine = np.sin(np.linspace(0.0, 6.0, 50))
    assert [before_jump(sine, k) for k in range(1, 50)] == sine[1:].tolist()
    every = np.array([0.0, 2.0, 4.0, 2.0, 0.0, 2.0])  # a controller that moves at each sample
    assert [before_jump(every, k) for k in range(1, 6)] == every[1:].tolist()


@pytest.mark.parametrize(("first", "then"), [(0.0, 6.0), (6.0, 1.0)])
def test_coil_lag_answers_a_jump_from_its_sample_on(first: float, then: float) -> None:
    tau = 0.02
    force = pulled("bingham", ["coil_lag"], stepped(first, then), **{"coil_lag.tau": tau})
    for k in (AT - 1, AT, AT + 1, AT + 10, AT + 50):
        felt = then + (first - then) * exp(-max(k - AT, 0) * DT / tau)
        assert force[k] == pytest.approx(force_at("bingham", v=SPEED, V=felt), rel=1e-12)


def test_coil_lag_follows_a_ramp_by_its_time_constant() -> None:
    tau, slope = 0.02, 10.0
    V = slope * DT * np.arange(300)
    force = pulled("bingham", ["coil_lag"], V, **{"coil_lag.tau": tau})
    per_volt = force_at("bingham", v=SPEED, V=1.0) - force_at("bingham", v=SPEED, V=0.0)
    expected = force_at("bingham", v=SPEED, V=V[-1] - slope * tau)
    assert abs(force[-1] - expected) < 1e-3 * slope * tau * per_volt


@pytest.mark.parametrize("law", ["bingham", "lugre"])
def test_remanence_has_seen_the_first_voltage_and_each_jump(law: str) -> None:
    width = 0.5
    V = stepped(4.0, 7.0)
    values = {"remanence.width": width, "bristle_deflection_0": 1.0 / 500.0}
    force = pulled(law, ["remanence"], V, **values)
    for k, felt in ((0, 4.0 - width), (AT - 1, 4.0 - width), (AT, 7.0 - width)):
        assert force[k] == pytest.approx(force_at("bingham", v=SPEED, V=felt), rel=1e-9)


@pytest.mark.parametrize("law", ["bingham", "lugre"])
def test_a_mount_finds_its_new_balance_when_the_voltage_jumps(law: str) -> None:
    k, c = 2e4, 60.0
    values = {"mount_compliance.k": k, "mount_compliance.c": c}
    force = pulled(law, ["mount_compliance"], stepped(2.0, 7.0), **values)
    before, after = (force_at("bingham", v=SPEED, V=V) for V in (2.0, 7.0))
    assert force[AT - 1] == pytest.approx(before, rel=1e-6)

    # The spring is as long as before, so the dashpot carries what the fluid has more.
    def short(w: float) -> float:
        return before + c * (SPEED - w) - force_at("bingham", v=w, V=7.0)

    w = float(brentq(short, 1e-3, SPEED))
    assert force[AT] == pytest.approx(before + c * (SPEED - w), rel=5e-3)
    assert force[-1] == pytest.approx(after, rel=1e-6)


def test_threads_that_ask_at_once_get_one_function_and_leave_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    jit._compiled.clear()
    x = np.zeros(300)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: compiled_history(LIBRARY), range(32)))
        list(
            pool.map(lambda name: DamperForces("lugre", [name]).force(x, x, x, x, DT, {}), EFFECTS)
        )
    assert len({id(one) for one in found}) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("law", [law.name for law in laws_of() if law.exact()])
def test_a_law_alone_has_the_force_that_it_has_among_effects_that_are_off(law: str) -> None:
    t = DT * np.arange(1500)
    x, v, a = 0.01 * np.sin(9.0 * t), 0.09 * np.cos(9.0 * t), -0.81 * np.sin(9.0 * t)
    V = 2.0 + np.sin(3.0 * t) + np.where(t > 1.0, 1.5, 0.0)
    rig = DamperForces(law, [])
    values = {"bristle_deflection_0": 2e-4, "deflection_0": 2e-4}
    alone = rig.force(x, v, a, V, DT, values)
    rig._history = compiled_history(LIBRARY)
    assert np.array_equal(alone, rig.force(x, v, a, V, DT, values))
    rig._setup = rig._setup._replace(active=True)  # as if an effect were on
    assert rig.force(x, v, a, V, DT, values) == pytest.approx(alone, abs=1e-12 * np.ptp(alone))
    assert np.ptp(alone) > 1.0

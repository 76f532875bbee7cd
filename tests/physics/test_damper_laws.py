"""Dahl, Bouc-Wen (simple and modified) and hyperbolic tangent: limits, formulae, steps, energy."""

from __future__ import annotations

from math import exp, tanh

import numpy as np
import pytest
from rigs import LAWS as NAMES
from rigs import Bench, force_at, loop_energy, sine

from bristle.physics import damper
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from bristle.physics.laws.bouc_wen import yielded
from bristle.physics.laws.modified_bouc_wen import excess, inner_velocity, mean_share
from bristle.user_code.conformance import examine_law
from bristle.user_code.load import defined

NEW = ("bouc_wen", "dahl", "modified_bouc_wen", "tanh")
DT = 5e-4


def voltage(t: float) -> float:
    return 4.0 + 3.0 * np.sin(9.0 * t)


@pytest.mark.parametrize("name", NAMES)
def test_a_law_is_all_that_is_asked_of_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BRISTLE_JIT", "off")  # compiled they are in test_compiled_laws
    checks = examine_law(LAWS[name])
    assert [check for check in checks if not check.holds] == []


def test_dahl_is_lugre_without_the_damping_of_its_bristles() -> None:
    rho, values = 400.0, {"f_c": 1.1, "f_v": 0.7, "c_0": 30.0, "c_v": 4.0}
    same = {"sigma_a": 1.1 * rho, "sigma_0": 0.7 * rho, "sigma_1": 0.0, "a_0": rho}
    same |= {"sigma_2": 30.0, "sigma_b": 4.0, "exponent": 0.0}
    t = DT * np.arange(2000)
    one = Bench("dahl", {**values, "rho": rho}).play(sine(0.006, 3.0), voltage, t)
    other = Bench("lugre", same).play(sine(0.006, 3.0), voltage, t)
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("sigma", [0.5, 0.8, 1.0, 1.7])
@pytest.mark.parametrize("v", [0.1, -0.1])
@pytest.mark.parametrize("begin", [-1.9e-3, -4e-4, 0.0, 1.2e-3])
def test_a_step_of_bouc_wen_is_its_equation(sigma: float, v: float, begin: float) -> None:
    slip, z, dt = 500.0, begin, 0.03
    steps = 20000
    for _ in range(steps):  # the middle of each step: the error is about 1e-9
        half = z + 0.5 * dt / steps * _rate(z, v, slip, sigma)
        z += dt / steps * _rate(half, v, slip, sigma)
    assert yielded(begin, v, slip, sigma, dt) == pytest.approx(z, rel=1e-6, abs=1e-10)
    once = yielded(begin, v, slip, sigma, 0.4 * dt)
    assert yielded(once, v, slip, sigma, 0.6 * dt) == pytest.approx(z, rel=1e-6, abs=1e-10)


def _rate(z: float, v: float, slip: float, sigma: float) -> float:
    y = slip * z
    return v - (sigma * abs(v) * abs(y) + (1.0 - sigma) * v * y) * y


def test_bouc_wen_slides_at_its_yield_force_and_never_beyond() -> None:
    law = LAWS["bouc_wen"]
    assert law.sliding_force({}, 0.1, 4.0) == pytest.approx((1.3 + 0.83 * 4.0, 18.0 * 0.1))
    for dt in (1e-4, 1e-2, 1.0, 1e6):
        for z in (-2e-3, -1e-4, 2e-3):
            assert abs(yielded(z, 0.3, 500.0, 0.6, dt)) <= 2e-3 * (1.0 + 1e-12)


def test_bouc_wen_of_1997_is_said_by_its_own_numbers() -> None:
    """alpha z + c_0 v + k_0 (x - x_0) with A = 301, beta = gamma = 363 per cm^2, n = 2, in cm."""
    A, beta, gamma, alpha = 301.0, 363.0, 363.0, 140.0
    last = (A / (beta + gamma)) ** 0.5  # cm
    slip, sigma = A / last, gamma / (beta + gamma)
    z, v, dt = 0.0, 2.0, 1e-6
    for _ in range(4000):
        z += dt * (A * v - gamma * abs(v) * z * abs(z) - beta * v * z * z)
    ours = yielded(0.0, v, slip, sigma, 4000 * dt)  # in cm, A = 1
    assert alpha * z == pytest.approx(alpha * last * slip * ours, rel=1e-3)


@pytest.mark.parametrize(("x", "v", "V"), [(0.004, 0.03, 4.0), (-0.002, 0.05, 0.0)])
def test_tanh_is_as_published_where_the_sign_is_not_smoothed(x: float, v: float, V: float) -> None:
    beta, delta, k, c, offset = 80.0, 0.7, 55.0, 12.0, 0.4
    values = {"v_s": 1.0 / beta, "delta": delta, "k": k, "f_0": offset, "x_s": 1e-7}
    z = tanh(beta * v + delta * np.sign(x))
    expected = c * v + k * x + (1.3 + 0.83 * V) * z + offset
    found = force_at("tanh", x=x, v=v, V=V, values={**values, "c_0": c, "c_v": 0.0})
    assert found == pytest.approx(expected, rel=1e-12)


def test_the_modified_law_without_dashpot_and_lag_is_the_simple_one() -> None:
    values = {"f_c": 1.1, "f_v": 0.6, "c_0": 12.0, "c_v": 1.0, "rho": 600.0, "sigma": 0.7}
    t = DT * np.arange(2000)
    simple = Bench("bouc_wen", {**values, "k": 90.0}).play(sine(0.006, 3.0), 4.0, t)
    stiff = {"c_1": 1e8, "eta": 1e4, "k_0": 60.0, "k_1": 30.0, "command_0": 4.0}
    modified = Bench("modified_bouc_wen", {**values, **stiff}).play(sine(0.006, 3.0), 4.0, t)
    assert np.abs(modified - simple).max() < 2e-3 * np.abs(simple).max()


def test_the_modified_law_balances_the_yield_force_that_an_effect_leaves() -> None:
    twice = {"stribeck.rise": 1.0, "stribeck.v_s": 1e6, "stribeck.way": 0.0}  # at every speed
    t = DT * np.arange(1500)
    changed = Bench("modified_bouc_wen", twice, ["stribeck"]).play(sine(0.006, 3.0), 4.0, t)
    doubled = Bench("modified_bouc_wen", {"f_c": 2.6, "f_v": 1.66}).play(sine(0.006, 3.0), 4.0, t)
    np.testing.assert_allclose(changed, doubled, rtol=1e-9, atol=1e-9)


BENDING = '''"""A travel before sliding that grows with the command, at the same yield force."""

from bristle.physics.effect import Effect


class Bending(Effect):
    """The travel before sliding is 1 + V/2 times as long: rho/(1 + V/2)."""

    name = "bending"
    needs = ("V",)
    passive = True
    source = "a test"
    expect = "an error after each reversal that grows with the command"

    @staticmethod
    def reach(q, z, p):
        return 1.0 + 0.5 * q.V

    @staticmethod
    def yield_factor(q, z, p):
        return 1.0 / (1.0 + 0.5 * q.V)
'''


@pytest.mark.parametrize("name", ["bouc_wen", "modified_bouc_wen"])
def test_an_effect_may_stretch_the_travel_before_sliding_by_the_command(name: str) -> None:
    t = DT * np.arange(1500)
    with defined({"bending": BENDING}):
        bent = Bench(name, {}, ["bending"]).play(sine(0.006, 3.0), 4.0, t)
    longer = Bench(name, {"rho": 500.0 / 3.0}).play(sine(0.006, 3.0), 4.0, t)
    np.testing.assert_allclose(bent, longer, rtol=1e-9, atol=1e-9)


def test_the_two_sides_of_the_modified_law_balance() -> None:
    """c_1 y' + k_1 x is what the inner element and the accumulator give."""
    model = damper.DamperModel("modified_bouc_wen", {"command_0": 3.0})
    law, V = LAWS["modified_bouc_wen"], 3.0
    for k in range(1, 400):
        x, v = 0.006 * np.sin(0.04 * k), 0.12 * np.cos(0.04 * k)
        force = model.step(float(x), float(v), 0.0, V, 0.002, 0.0, 0.0, False)
        z, p = law.State(*model.z[:3]), law.at({}, V)
        q = damper.Inputs(float(x), float(v), 0.0, V, 0.002, 0.0, 0.0, False)
        slow = float(v) - law.rate(q, z, p)[1]
        assert force == pytest.approx(p.series_damping * slow + 30.0 * x, rel=1e-9, abs=1e-12)
        share = mean_share(p.k_0 * q.dt / (p.viscosity * p.viscous_factor + p.series_damping))
        assert abs(excess(inner_velocity(q, z, p), share, q, z, p)) < 1e-6


def test_the_command_of_the_modified_law_lags() -> None:
    model = damper.DamperModel("modified_bouc_wen", {"eta": 50.0})
    for _ in range(20):
        model.step(0.0, 0.0, 0.0, 6.0, 1e-3, 0.0, 0.0, False)
    assert model.z[2] == pytest.approx(6.0 * (1.0 - exp(-1.0)), rel=1e-9)


@pytest.mark.parametrize("rho", [500.0, 4.67e4, 1e7])
@pytest.mark.parametrize("c_1", [1e-3, 150.0, 1e8])
def test_the_modified_law_is_stable_however_stiff(rho: float, c_1: float) -> None:
    values = {"rho": rho, "c_1": c_1, "command_0": 8.0}
    dt = 2e-3
    times = dt * np.arange(601)
    motion = sine(0.015, 5.0)
    force = Bench("modified_bouc_wen", values).play(motion, 8.0, times)
    v = np.array([motion(t)[1] for t in times])
    assert np.isfinite(force).all()
    assert np.abs(force).max() < 100.0
    assert loop_energy(force[-101:], v[-101:], dt) > 0.0


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.site == "damper"],
                         ids=lambda e: e.name)  # fmt: skip
def test_what_a_law_contains_is_not_offered_twice(law: str, effect: type) -> None:
    kind = LAWS[law]
    lacks = {
        "coil_lag": "command", "remanence": "command", "saturation": "command",
        "presliding": "sign", "stribeck": "yield", "temperature": "yield", "flattening": "viscous",
        "measured_temperature": "yield",
    }.get(effect.name, "")  # fmt: skip
    contained = (effect.kind or effect.name) in kind.contains
    assert effect.joins(kind) == (not contained and (not lacks or kind.has(lacks)))


def test_what_the_new_laws_contain() -> None:
    assert {name: LAWS[name].contains for name in NEW} == {
        "bouc_wen": ("spring",), "dahl": (), "tanh": ("spring",),
        "modified_bouc_wen": ("spring",),
    }  # fmt: skip

"""Laws of devices that nothing commands: their limits, their curves, their energy."""

from __future__ import annotations

from itertools import pairwise
from math import exp, pi, tanh

import numpy as np
import pytest
from rigs import Bench, loop_energy, sine

from bristle.physics.laws import LAWS
from bristle.physics.tuples import Inputs

DT = 5e-4
NAMES = ("fluid_viscous", "friction_damper", "isolator", "shock_absorber")


def inputs(v: float, dt: float) -> Inputs:
    return Inputs(0.0, v, 0.0, 0.0, dt, 0.0, 0.0, False)


def last_cycle(
    law: str, values: dict[str, float], amplitude: float, frequency: float, steps: int = 2000
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return displacement, velocity and force of the third cycle, and the step [s]."""
    dt = 1.0 / (frequency * steps)
    times = dt * np.arange(3 * steps + 1)
    motion = sine(amplitude, frequency)
    force = Bench(law, values).play(motion, 0.0, times)
    x, v = np.array([motion(t) for t in times]).T
    last = slice(2 * steps, None)
    return x[last], v[last], force[last], dt


@pytest.mark.parametrize("name", NAMES)
def test_nothing_commands_it(name: str) -> None:
    law = LAWS[name]
    assert not law.has("command")
    assert law.driven() == ()
    assert not law.affine()
    t = DT * np.arange(400)
    none, some = (Bench(name).play(sine(0.006, 3.0), V, t) for V in (0.0, 6.0))
    np.testing.assert_array_equal(none, some)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("amplitude", [1e-4, 3e-3, 0.03])
def test_closed_cycles_never_create_energy(name: str, amplitude: float) -> None:
    for frequency in (0.2, 8.0):
        _, v, force, dt = last_cycle(name, {}, amplitude, frequency, 400)
        assert loop_energy(force, v, dt) > -1e-9 * amplitude * np.abs(force).max()


# -- the fluid viscous damper


def test_a_rigid_one_with_exponent_1_is_a_dashpot() -> None:
    values = {"c": 8.0, "alpha": 1.0, "give": 0.0}
    _, v, force, _ = last_cycle("fluid_viscous", values, 0.01, 2.0)
    assert force == pytest.approx(8.0 * v / 0.1, abs=1e-3 * 8.0)


def test_exponent_1_behind_a_spring_is_maxwells_element() -> None:
    """Work per cycle pi w tau k X^2/(1 + (w tau)^2) (Makris & Constantinou 1991)."""
    c, k, amplitude, w = 80.0, 8.0 * 400.0, 0.01, 2.0 * pi * 5.0
    tau = c / k
    values = {"c": 8.0, "alpha": 1.0, "give": 1.0 / 400.0}
    _, v, force, dt = last_cycle("fluid_viscous", values, amplitude, 5.0)
    expected = pi * w * tau * k * amplitude**2 / (1.0 + (w * tau) ** 2)
    assert loop_energy(force, v, dt) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("alpha", [0.3, 0.6, 1.0, 2.0])
def test_steady_motion_gives_the_power_of_the_speed(alpha: float) -> None:
    law = LAWS["fluid_viscous"]
    for v in (0.02, 0.1, 0.7):
        _, force = law.sliding_force({"c": 5.0, "alpha": alpha}, v, 0.0)
        assert force == pytest.approx(5.0 * (v / 0.1) ** alpha, rel=1e-12)


@pytest.mark.parametrize("alpha", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("rho", [10.0, 1e3])
def test_held_still_its_spring_relaxes_as_the_power_says(alpha: float, rho: float) -> None:
    """y^(1 - n) falls, or grows, by (1 - n) rho V_r t, with n = 1/alpha."""
    law, n, seconds, steps = LAWS["fluid_viscous"], 1.0 / alpha, 2.0 / rho, 2000
    z, p = law.State(0.5, 0.0), law.at({"c": 8.0, "alpha": alpha, "give": 1.0 / rho})
    for _ in range(steps):
        z = law.State(*law.hook("advance")(inputs(0.0, seconds / steps), z, p))
    gone = rho * 0.1 * seconds
    exact = 0.5 * exp(-gone) if n == 1.0 else (0.5 ** (1 - n) - (1 - n) * gone) ** (1 / (1 - n))
    assert z.carried == pytest.approx(exact, rel=1e-5)


# -- the shock absorber


VALVES = {"c_r1": 60.0, "c_r2": 20.0, "v_r": 0.05, "c_c1": 20.0, "c_c2": 30.0, "v_c": 0.08}
BARE = {**VALVES, "f_s": 0.0, "f_0": 0.0, "k_g": 0.0, "k_g2": 0.0}


def test_each_direction_has_its_own_curve() -> None:
    law = LAWS["shock_absorber"]
    for v, (first, fast, knee) in {0.2: (60.0, 20.0, 0.05), -0.2: (20.0, 30.0, 0.08)}.items():
        _, force = law.sliding_force(BARE, v, 0.0)
        assert force == pytest.approx(fast * v + (first - fast) * knee * tanh(v / knee), rel=1e-9)


@pytest.mark.parametrize("first", [0.0, 1.0, 300.0])
@pytest.mark.parametrize("fast", [0.0, 1.0, 300.0])
def test_the_curve_never_falls(first: float, fast: float) -> None:
    values = {**BARE, "c_r1": first, "c_r2": fast, "c_c1": fast, "c_c2": first}
    speeds = np.linspace(-0.5, 0.5, 201).tolist()
    force = [LAWS["shock_absorber"].sliding_force(values, v, 0.0)[1] for v in speeds]
    assert all(b >= a for a, b in pairwise(force))
    assert all(f * v >= 0.0 for f, v in zip(force, speeds, strict=True))


def test_stiff_and_without_gas_and_seals_the_force_is_the_curve() -> None:
    _, v, force, _ = last_cycle("shock_absorber", {**BARE, "give": 0.0}, 0.01, 2.0)
    expected = [LAWS["shock_absorber"].sliding_force(BARE, one, 0.0)[1] for one in v.tolist()]
    assert force == pytest.approx(np.array(expected), abs=2e-3)


def test_a_valve_without_knee_behind_a_spring_is_maxwells_element() -> None:
    even = {**BARE, "c_r1": 40.0, "c_r2": 40.0, "c_c1": 40.0, "c_c2": 40.0, "give": 1e-3}
    fluid = {"c": 4.0, "alpha": 1.0, "give": 1.0 / 250.0}
    one = last_cycle("shock_absorber", even, 0.01, 3.0)[2]
    other = last_cycle("fluid_viscous", fluid, 0.01, 3.0)[2]
    assert one == pytest.approx(other, abs=1e-3 * np.abs(other).max())


def test_slow_motion_rubs_at_the_seals_and_bends_the_gas() -> None:
    values = {**BARE, "f_s": 0.8, "rho": 1e6, "f_0": -2.0, "k_g": 40.0, "k_g2": 300.0}
    x, v, force, dt = last_cycle("shock_absorber", values, 0.01, 1e-3)
    assert loop_energy(force, v, dt) == pytest.approx(4.0 * 0.8 * 0.01, rel=0.01)
    moving = np.abs(v) > 0.5 * np.abs(v).max()
    rest = force - 0.8 * np.sign(v)
    gas = -2.0 + 40.0 * x + 300.0 * x**2
    assert rest[moving] == pytest.approx(gas[moving], abs=5e-3)


# -- the friction damper


def test_a_slow_loop_of_friction_with_play_has_its_area() -> None:
    """Coulomb friction works over the stroke less the play, at each reversal all of it."""
    values = {"f_c": 5.0, "c": 0.0, "k": 0.0, "rho": 1e6, "play": 1e-3}
    _, v, force, dt = last_cycle("friction_damper", values, 0.01, 0.1)
    assert loop_energy(force, v, dt) == pytest.approx(4.0 * 5.0 * (0.01 - 1e-3), rel=2e-3)


def test_within_the_play_nothing_is_carried() -> None:
    values = {"c": 0.0, "k": 0.0, "play": 2e-3}
    force = Bench("friction_damper", values).play(sine(1.9e-3, 3.0), 0.0, DT * np.arange(2000))
    assert np.abs(force).max() == 0.0


def test_without_play_it_is_dahls_law() -> None:
    t = DT * np.arange(2000)
    tight = {"f_c": 5.0, "c": 6.0, "k": 0.0, "rho": 900.0, "play": 0.0}
    dahl = {"f_c": 5.0, "c_0": 6.0, "c_v": 0.0, "f_v": 0.0, "rho": 900.0}
    one = Bench("friction_damper", tight).play(sine(0.006, 3.0), 0.0, t)
    other = Bench("dahl", dahl).play(sine(0.006, 3.0), 0.0, t)
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("gamma", [0.0, 0.3, 0.99])
def test_the_exponent_says_how_round_the_onset_of_slip_is(gamma: float) -> None:
    """What is left to slip, w = 1 - rho b, falls as w^(1 - gamma) = 1 - (1 - gamma) rho s."""
    values = {"f_c": 5.0, "c": 0.0, "k": 0.0, "rho": 400.0, "play": 0.0, "gamma": gamma}
    t = DT * np.arange(1, 400)
    force = Bench("friction_damper", values).play(lambda now: (0.05 * now, 0.05), 0.0, t)
    left = np.maximum(1.0 - (1.0 - gamma) * 400.0 * 0.05 * (t - t[0]), 0.0) ** (1.0 / (1.0 - gamma))
    assert force == pytest.approx(5.0 * (1.0 - left), abs=1e-9)
    for amplitude in (1e-3, 0.03):
        _, v, force, dt = last_cycle("friction_damper", values, amplitude, 2.0, 400)
        assert loop_energy(force, v, dt) > 0.0


@pytest.mark.parametrize("gamma", [0.0, 0.4, 1.0])
def test_a_long_step_with_a_reversal_of_the_plates_is_many_short_ones(gamma: float) -> None:
    values = {"play": 1e-3, "rho": 500.0, "gamma": gamma}
    for begin in (-3e-3, -2e-4, 2.5e-3):
        law = LAWS["friction_damper"]
        ends = []
        for count in (1, 1000):
            z, p = law.State(begin), law.at(values)
            for _ in range(count):
                z = law.State(*law.hook("advance")(inputs(0.05, 0.1 / count), z, p))
            ends.append(z.offset)
        assert ends[0] == pytest.approx(ends[1], rel=1e-9)


# -- the isolator


def test_at_rest_it_has_the_stiffness_of_rubber_and_core() -> None:
    values = {"q": 4.0, "rho": 800.0, "k": 300.0}
    _, travel = LAWS["isolator"].slopes_at_rest(values, 0.0)
    assert travel == pytest.approx(300.0 + 4.0 * 800.0, rel=1e-6)


def test_a_large_slow_cycle_has_the_area_of_the_bilinear_loop() -> None:
    """4 Q (X - x_y) of Naeim & Kelly (1999), Design of Seismic Isolated Structures, ch. 4."""
    values = {"q": 4.0, "rho": 2e4, "k": 300.0, "k_3": 0.0, "c": 0.0, "sigma": 1.0}
    _, v, force, dt = last_cycle("isolator", values, 0.02, 0.01)
    assert loop_energy(force, v, dt) == pytest.approx(4.0 * 4.0 * 0.02, rel=0.01)


def test_hardening_and_rubber_add_up() -> None:
    bare = {"q": 0.0, "c": 0.0, "k": 300.0, "k_3": 1e6, "f_0": 1.0}
    x, _, force, _ = last_cycle("isolator", bare, 0.02, 1.0, 200)
    assert force == pytest.approx(1.0 + 300.0 * x + 1e6 * x**3, rel=1e-12)


def test_without_hardening_it_is_bouc_wens_law() -> None:
    t = DT * np.arange(1500)
    same = {"rho": 600.0, "sigma": 0.7, "k": 90.0}
    rubber = {**same, "q": 4.0, "c": 12.0, "k_3": 0.0}
    simple = {**same, "f_c": 4.0, "f_v": 0.0, "c_0": 12.0, "c_v": 0.0}
    one = Bench("isolator", rubber).play(sine(0.006, 3.0), 0.0, t)
    other = Bench("bouc_wen", simple).play(sine(0.006, 3.0), 0.0, t)
    np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


# -- stiff ones, at any step


@pytest.mark.parametrize("dt", [1e-5, 2e-3, 0.05])
@pytest.mark.parametrize(
    ("law", "values"),
    [
        *(("fluid_viscous", {"alpha": a, "give": g}) for a in (0.1, 2.0) for g in (0.0, 1e-9, 1.0)),
        *(("shock_absorber", {"give": g, "c_r1": c}) for g in (0.0, 1e-9, 1.0) for c in (0.0, 1e7)),
    ],
)
def test_it_is_stable_however_stiff(law: str, values: dict[str, float], dt: float) -> None:
    force = Bench(law, values).play(sine(0.01, 2.0), 0.0, dt * np.arange(600))
    assert np.isfinite(force).all()
    limit = 2e6 if "c_r1" in values else 100.0
    assert np.abs(force).max() < limit


def test_a_spring_that_relaxes_is_exact_in_any_step() -> None:
    values = {**BARE, "c_r1": 40.0, "c_r2": 40.0, "c_c1": 40.0, "c_c2": 40.0, "give": 1e-3}
    law, p = LAWS["shock_absorber"], LAWS["shock_absorber"].at(values)
    z = law.State(0.1, 0.0, 0.0)
    for dt in (1e-3, 0.02, 0.5):
        flow = law.hook("advance")(inputs(0.0, dt), z, p)[0]
        assert flow == pytest.approx(0.1 * exp(-dt * 1000.0 / 40.0), rel=1e-6)

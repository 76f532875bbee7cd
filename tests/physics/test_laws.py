"""The damper laws: listed forces and loops, limits, passivity, the bristle's motion."""

from __future__ import annotations

from functools import cache
from math import exp, inf, pi
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from published import MODEL
from rigs import LAWS, Bench, force_at, loop_energy, sine
from scipy.integrate import solve_ivp

from bristle.physics.damper import DamperModel
from bristle.physics.falling import falling
from bristle.physics.laws.bingham import Bingham
from bristle.physics.laws.lugre import LuGre
from bristle.physics.tuples import Inputs

BINGHAM = SimpleNamespace(**{k: v.value for k, v in Bingham.parameters.items()})
LUGRE = SimpleNamespace(**{k: v.value for k, v in LuGre.parameters.items()})
A_0 = LUGRE.a_0


def moving(v: float, dt: float = 0.0) -> Inputs:
    """Return what a law's hooks take as q."""
    return Inputs(0.0, v, 0.0, 0.0, dt, 0.0, 0.0, False)


def bristle_rate(z: float, v: float) -> float:
    return float(LuGre.rate(moving(v), LuGre.State(z), LuGre.at({}))[0])


def advanced(z: float, v: float, dt: float) -> float:
    """Return the bristle deflection [m] after dt [s] at a velocity v [m/s]."""
    return float(LuGre.advance(moving(v, dt), LuGre.State(z), LuGre.at({}))[0])


@pytest.mark.parametrize(("law", "values"), [("bingham", BINGHAM), ("lugre", LUGRE)])
def test_default_parameters_are_those_listed(law: str, values: SimpleNamespace) -> None:
    listed = {k: v for k, v in MODEL[law].items() if k not in ("label", "source")}
    assert vars(values) == {**listed, "exponent": 1.0}


# -- forces


@pytest.mark.parametrize("row", MODEL["forces"]["rows"], ids=str)
def test_listed_forces(row: list[float]) -> None:
    v, V, z, bingham, lugre, rate = row
    assert force_at("bingham", v=v, V=V) == pytest.approx(bingham, abs=5e-10)
    assert force_at("lugre", v=v, V=V, z=z) == pytest.approx(lugre, abs=5e-10)
    assert bristle_rate(z, v) == pytest.approx(rate, abs=1e-15)


def test_the_bump_stands_out_more_at_low_voltage() -> None:
    listed = MODEL["bump"]
    for V, ratio in zip(listed["voltages"], listed["ratios"], strict=True):
        speeds = np.linspace(0.0, 0.2, 20001)
        p = Bingham.at({}, V)
        viscous = [Bingham.viscous(moving(v), (), p) for v in speeds]
        assert speeds[int(np.argmax(viscous))] == pytest.approx(BINGHAM.v_n, abs=1e-5)
        assert max(viscous) / Bingham.limit(moving(0.1), (), p) == pytest.approx(ratio, abs=0.005)


@given(v=st.floats(-1.0, 1.0), V=st.floats(0.0, 8.0))
def test_laws_are_odd_in_velocity(v: float, V: float) -> None:
    assert force_at("bingham", v=-v, V=V) == -force_at("bingham", v=v, V=V)
    z = 0.8 / A_0
    assert force_at("lugre", v=-v, V=V, z=-z) == -force_at("lugre", v=v, V=V, z=z)


@given(v=st.floats(1e-6, 2.0), sign=st.sampled_from([-1.0, 1.0]), V=st.floats(0.0, 8.0))
def test_steady_sliding_of_lugre_is_bingham(v: float, sign: float, V: float) -> None:
    lugre = force_at("lugre", v=sign * v, V=V, z=sign / A_0)
    assert lugre == pytest.approx(force_at("bingham", v=sign * v, V=V), rel=1e-12)
    assert bristle_rate(sign / A_0, sign * v) == pytest.approx(0.0, abs=1e-15)


@given(v=st.floats(-1.0, 1.0), V=st.floats(0.0, 8.0))
def test_the_standard_law_has_no_fall(v: float, V: float) -> None:
    standard = {"exponent": 0.0}
    assert falling(v, 0.02, 0.0) == 1.0
    sliding = (1.3 + 0.83 * V) * np.sign(v) + (100.0 + 20.0 * V) * v
    assert force_at("bingham", v=v, V=V, values=standard) == pytest.approx(sliding, rel=1e-12)
    steady = force_at("lugre", v=v, V=V, z=float(np.sign(v)) / A_0, values=standard)
    assert steady == pytest.approx(sliding, rel=1e-12, abs=1e-12)


@given(v=st.floats(-0.5, 0.5), exponent=st.floats(0.25, 4.0))
def test_the_exponent_shapes_the_fall(v: float, exponent: float) -> None:
    assert falling(v, 0.02, exponent) == pytest.approx(exp(-((abs(v) / 0.02) ** exponent)))
    assert falling(0.02, 0.02, exponent) == pytest.approx(exp(-1.0), rel=1e-14)
    assert falling(0.0, 0.02, exponent) == 1.0


def test_a_gaussian_fall_in_both_laws() -> None:
    v, V = 0.03, 4.0
    viscous = (100.0 + 20.0 * V) * v * exp(-((v / 0.02) ** 2))
    expected = 1.3 + 0.83 * V + viscous
    assert force_at("bingham", v=v, V=V, values={"exponent": 2.0}) == pytest.approx(expected)
    sliding = force_at("lugre", v=v, V=V, z=1.0 / A_0, values={"exponent": 2.0})
    assert sliding == pytest.approx(expected, rel=1e-12)


# -- the bristle


def test_force_at_constant_velocity() -> None:
    listed = MODEL["constant_velocity"]
    for t, expected in zip(listed["times"], listed["forces"], strict=True):
        model = DamperModel("lugre")
        held = (0.0, listed["v"], 0.0, listed["V"])
        steps = 3  # exact whatever their number
        for _ in range(steps if t else 0):
            force = model.step(*held, t / steps, 0.0, 0.0, False)
        if not t:
            force = model.force(*held, inf, 0.0, 0.0, False)
        assert force == pytest.approx(expected, abs=5e-10)


@given(
    z=st.floats(-0.002, 0.002),
    v=st.one_of(st.floats(-2.0, 2.0), st.floats(-1e-9, 1e-9)),
    dt=st.floats(1e-6, 0.5),
    share=st.floats(0.0, 1.0),
)
def test_the_bristles_step_is_exact(z: float, v: float, dt: float, share: float) -> None:
    whole = advanced(z, v, dt)
    parted = advanced(advanced(z, v, share * dt), v, (1.0 - share) * dt)
    assert whole == pytest.approx(parted, abs=1e-17 + 1e-12 * abs(whole) + 2e-12 * abs(v * dt))


@pytest.mark.parametrize(("z", "v"), [(0.0, 0.05), (0.002, -0.3), (-0.001, 1e-4), (0.0015, 0.0)])
def test_the_bristles_step_against_a_tight_integration(z: float, v: float) -> None:
    exact = solve_ivp(
        lambda _t, y: [bristle_rate(y[0], v)],
        (0.0, 0.1),
        [z],
        "DOP853",
        rtol=1e-12,
        atol=1e-16,
    ).y[0, -1]
    assert advanced(z, v, 0.1) == pytest.approx(exact, rel=1e-9, abs=1e-15)


@given(
    z=st.floats(-1.0, 1.0),
    motion=st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(1e-5, 0.02)), max_size=40),
)
def test_the_bristle_never_bends_beyond_sliding(
    z: float, motion: list[tuple[float, float]]
) -> None:
    z /= A_0
    for v, dt in motion:
        z = advanced(z, v, dt)
        assert abs(z) <= (1.0 + 1e-12) / A_0


@given(
    motion=st.lists(
        st.tuples(st.floats(-1.0, 1.0), st.floats(-4.0, 12.0), st.floats(1e-4, 0.01)), max_size=25
    )
)
def test_the_bristle_stays_bounded_on_the_bench(motion: list[tuple[float, float, float]]) -> None:
    bench = Bench("lugre")
    for v, V, dt in motion:
        bench.move(0.0, v, V, dt)
        assert abs(bench.state("bristle")) <= (1.0 + 1e-12) / A_0


@given(z=st.floats(-0.002, 0.002), v=st.floats(-2.0, 2.0), V=st.floats(0.0, 8.0))
def test_lugre_is_passive_at_constant_voltage(z: float, v: float, V: float) -> None:
    stiffness = LUGRE.sigma_a + LUGRE.sigma_0 * V
    stored = stiffness * z * bristle_rate(z, v)  # d/dt of stiffness z^2/2
    lost = force_at("lugre", v=v, V=V, z=z) * v - stored
    viscous = (LUGRE.sigma_2 + LUGRE.sigma_b * V) * v**2 * exp(-abs(v) / LUGRE.v_n)
    parts = (
        stiffness * A_0 * abs(v) * z**2
        + LUGRE.sigma_1 * v**2 * (1.0 - A_0 * z * np.sign(v))
        + viscous
    )
    assert lost == pytest.approx(parts, rel=1e-9, abs=1e-12)
    assert parts >= 0.0
    assert lost >= -1e-12


@given(
    law=st.sampled_from(LAWS),
    V=st.floats(0.0, 8.0),
    velocities=st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=8),
)
def test_no_path_yields_more_than_was_stored(law: str, V: float, velocities: list[float]) -> None:
    bench, work, x, dt = Bench(law), 0.0, 0.0, 2e-4
    force, v_before = 0.0, 0.0
    for v in velocities:
        for _ in range(20):
            x += v * dt
            now = bench.move(x, v, V, dt)
            work += 0.5 * dt * (force * v_before + now * v) if v == v_before else dt * now * v
            force, v_before = now, v
    stiffness = LUGRE.sigma_a + LUGRE.sigma_0 * V
    stored = 0.5 * stiffness * bench.state("bristle") ** 2 if law == "lugre" else 0.0
    assert work >= stored - 1e-9 - 0.05 * abs(work)


def test_switching_the_voltage_stores_at_most_the_listed_energy() -> None:
    most = 0.5 * LUGRE.sigma_0 * MODEL["text"]["v_max"] / A_0**2
    assert most == pytest.approx(MODEL["rest"]["switching_energy"], rel=1e-3)


def test_at_rest_bristles_hold_the_base_off_its_middle() -> None:
    listed = MODEL["rest"]
    k_b = MODEL["text"]["isolation_stiffness"]
    for V, offset in zip(listed["voltages"], listed["offsets"], strict=True):
        held = force_at("lugre", V=V, z=1.0 / A_0)
        assert held / k_b == pytest.approx(offset, abs=5e-6)
        model = DamperModel("lugre", {"bristle_deflection_0": 1.0 / A_0})
        rest = (0.0, 0.0, 0.0, V, 0.01, 0.0, 0.0, False)
        assert [model.step(*rest) for _ in range(100)] == [held] * 100


# -- the sine loop


@cache
def bristles_of_the_sine() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times [s] of a settled cycle, the bristles' deflection [m] and the velocity [m/s]."""
    period = 0.5

    def velocity(t: np.ndarray) -> np.ndarray:
        return 0.1 * np.cos(4.0 * pi * t)

    times = 4.0 * period + period * np.arange(4001) / 4000
    solution = solve_ivp(
        lambda t, z: [bristle_rate(z[0], float(velocity(t)))],
        (0.0, times[-1]), [0.0], "LSODA", times, rtol=1e-11, atol=1e-15, max_step=period / 50,
    )  # fmt: skip
    return times, solution.y[0], velocity(times)


def forces_of(law: str, z: np.ndarray, v: np.ndarray, V: float) -> np.ndarray:
    """Return a law's forces [N] at bristle deflections and velocities, one model for all."""
    model, forces = Bench(law).model, []
    for deflection, velocity in zip(z.tolist(), v.tolist(), strict=True):
        model.z[0] = deflection
        forces.append(model.force(0.0, velocity, 0.0, V, inf, 0.0, 0.0, False))
    return np.array(forces)


@pytest.mark.parametrize("row", MODEL["sine_loop"]["rows"], ids=lambda row: f"{row[0]:g} V")
def test_sine_loop_of_the_laws(row: list[float]) -> None:
    V, lugre_max, at_v_max, lugre_energy, at_rest, bingham_max, bingham_energy = row
    times, z, v = bristles_of_the_sine()
    lugre, bingham = forces_of("lugre", z, v, V), forces_of("bingham", z, v, V)
    dt = times[1] - times[0]
    assert z[-1] == pytest.approx(MODEL["sine_loop"]["z_at_v_max"], abs=5e-10)
    assert lugre.max() == pytest.approx(lugre_max, abs=2e-6)
    assert lugre[-1] == pytest.approx(at_v_max, abs=1e-6)
    assert loop_energy(lugre, v, dt) == pytest.approx(lugre_energy, abs=1e-7)
    assert v[1000] == pytest.approx(0.0, abs=1e-15)
    assert lugre[1000] == pytest.approx(at_rest, abs=1e-6)
    assert bingham.max() == pytest.approx(bingham_max, abs=2e-6)
    assert loop_energy(bingham, v, dt) == pytest.approx(bingham_energy, abs=2e-7)


@pytest.mark.parametrize(("steps", "within"), [(250, 2e-3), (2500, 2e-5)])
def test_sine_loop_of_the_stepped_damper(steps: int, within: float) -> None:
    V, lugre_max, at_v_max, lugre_energy = MODEL["sine_loop"]["rows"][2][:4]
    times = 0.5 * np.arange(5 * steps + 1) / steps
    motion = sine(0.1 / (4.0 * pi), 2.0)
    forces = Bench("lugre").play(motion, V, times)[4 * steps :]
    v = np.array([motion(t)[1] for t in times[4 * steps :]])
    assert forces.max() == pytest.approx(lugre_max, rel=within)
    assert forces[-1] == pytest.approx(at_v_max, rel=within)
    assert loop_energy(forces, v, 0.5 / steps) == pytest.approx(lugre_energy, rel=within)


# -- holding


@pytest.mark.parametrize("halt", [0.0, 3.0, -7.9])
def test_a_stuck_bingham_damper_gives_the_force_that_halts(halt: float) -> None:
    model = DamperModel("bingham")
    assert model.force(0.0, 0.0, 0.0, 8.0, 0.002, 0.0, halt, True) == pytest.approx(halt)
    moving = model.force(0.0, 1e-4, 0.0, 8.0, 0.002, 0.0, halt, True)
    assert moving == pytest.approx(halt, rel=1e-12)  # its viscous part included


@pytest.mark.parametrize(("halt", "sign"), [(50.0, 1.0), (-50.0, -1.0)])
def test_a_bingham_damper_holds_no_more_than_it_yields(halt: float, sign: float) -> None:
    model = DamperModel("bingham")
    held = model.force(0.0, 0.0, 0.0, 8.0, 0.002, 0.0, halt, True)
    assert held == pytest.approx(sign * (1.3 + 0.83 * 8.0), rel=1e-14)
    v = sign * 0.01
    sliding = model.force(0.0, v, 0.0, 8.0, 0.002, 0.0, halt, True)
    assert sliding == pytest.approx(force_at("bingham", v=v, V=8.0), rel=1e-14)


def test_a_lugre_damper_needs_no_holding() -> None:
    model = DamperModel("lugre", {"bristle_deflection_0": 0.001})
    found = [model.force(0.0, 0.0, 0.0, 4.0, 0.002, 0.0, halt, True) for halt in (-9.0, 0.0, 9.0)]
    assert found == [pytest.approx(2.31, rel=1e-12)] * 3

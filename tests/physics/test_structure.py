"""The structure's step: exact, whatever the step size; energy; effects of its site."""

from __future__ import annotations

from itertools import pairwise
from math import log, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from published import MODEL
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm

from bristle.component.structure import StructureModel
from bristle.physics import structure
from bristle.physics.building import Building, from_data, modes, paper_building
from bristle.physics.structure import matrices, step_matrices

STEPS = [1e-5, 5e-4, 2e-3, 1e-2, 0.1]


def tower(floors: int, *, base: str = "isolated", ratio: float = 0.02) -> Building:
    levels = floors + (base == "isolated")
    return from_data(
        {
            "schema": 1,
            "masses": [1.0 + 0.1 * i for i in range(levels)],
            "stiffnesses": [1e3 - 20.0 * i for i in range(levels)],
            "base": base,
            "damping_ratio": ratio,
        }
    )


BUILDINGS = {
    "paper": paper_building(),
    "one fixed floor": tower(1, base="fixed"),
    "fixed": tower(5, base="fixed"),
    "twenty floors": tower(20),
}


def arrays(building: Building) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array(building.M), np.array(building.C), np.array(building.K)


def energy(building: Building, x: list[float]) -> float:
    """Return kinetic and elastic energy [J]."""
    M, _, K = arrays(building)
    q, v = np.array(x[: building.size]), np.array(x[building.size :])
    return float(0.5 * v @ M @ v + 0.5 * q @ K @ q)


def set_state(model: StructureModel, x: Any) -> None:
    model.x = [float(value) for value in x]
    model.settle()


def effect_loads(model: StructureModel) -> np.ndarray:
    """Return what the effects add to K q on the levels (n,) [N]; for a building at rest."""
    building = paper_building()
    q, a = np.array(model.x[: building.size]), np.array(model.absolute_accelerations(0.0))
    return -np.array(building.M) @ a - np.array(building.K) @ q


# -- the matrices of a step


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("building", BUILDINGS.values(), ids=BUILDINGS)
def test_step_matrices_against_scipy(building: Building, h: float) -> None:
    n = building.size
    M, C, K = arrays(building)
    M_inverse = np.linalg.inv(M)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-M_inverse @ K, -M_inverse @ C]])
    b = np.zeros((2 * n, n + 1))
    b[n:, :n], b[n:, n] = -M_inverse, -1.0
    # x' = A x + B (u_0 + s (u_1 - u_0)) with s' = 1/h, as one linear system.
    zeros, unit = np.zeros((n + 1, n + 1)), np.eye(n + 1)
    whole = expm(
        h
        * np.block(
            [
                [a, b, np.zeros((2 * n, n + 1))],
                [np.zeros((n + 1, 2 * n)), zeros, unit / h],
                [np.zeros((n + 1, 2 * n)), zeros, zeros],
            ]
        )
    )
    step = step_matrices(matrices(building), h)
    for found, expected in (
        (step.phi, whole[: 2 * n, : 2 * n]),
        (step.held, whole[: 2 * n, 2 * n : 3 * n + 1]),
        (step.ramp, whole[: 2 * n, 3 * n + 1 :]),
    ):
        error = np.abs(np.reshape(found, expected.shape) - expected).max()
        assert error <= 2e-13 * max(1.0, np.abs(expected).max()) * n


@given(
    h=st.sampled_from(STEPS),
    x=st.lists(st.floats(-0.05, 0.05), min_size=6, max_size=6),
    ground=st.tuples(st.floats(-20, 20), st.floats(-20, 20)),
    force=st.floats(-10, 10),
)
def test_two_half_steps_equal_one(
    h: float, x: list[float], ground: tuple[float, float], force: float
) -> None:
    one, two = StructureModel(paper_building()), StructureModel(paper_building())
    set_state(one, x)
    set_state(two, x)
    middle = 0.5 * (ground[0] + ground[1])
    one.step(h, ground[0], ground[1], force)
    two.step(0.5 * h, ground[0], middle, force)
    two.step(0.5 * h, middle, ground[1], force)
    scale = max(map(abs, [*x, *one.x, 1e-6]))
    assert one.x == pytest.approx(two.x, abs=1e-12 * scale)


def test_steps_of_any_size_meet_at_the_same_time() -> None:
    found = []
    for count in (1, 7, 50):
        model = StructureModel(paper_building())
        set_state(model, [0.001, -0.002, 0.003, 0.1, 0.2, -0.1])
        for k in range(count):
            model.step(0.1 / count, 3.0 * k / count, 3.0 * (k + 1) / count, 2.0)
        found.append(model.x)
    assert found[1] == pytest.approx(found[0], abs=1e-13)
    assert found[2] == pytest.approx(found[0], abs=1e-13)


def test_half_sine_pulse_without_damper_against_the_table() -> None:
    table = MODEL["half_sine"]
    listed = table["rows"][0]
    model = StructureModel(paper_building())
    amplitude, duration, h = table["amplitude"], table["duration"], 1e-4
    peaks = [(0.0, 0.0)] * 5
    for k in range(round(table["stop"] / h)):
        now, then = k * h, (k + 1) * h
        begin, end = (
            amplitude * sin(pi * t / duration) if t < duration else 0.0 for t in (now, then)
        )
        model.step(h, begin, end, 0.0)
        absolute = model.absolute_accelerations(0.0)
        x = model.x
        watched = (x[0], x[2] - x[1], absolute[0], absolute[2], x[3])
        peaks = [max(peak, (abs(value), then)) for peak, value in zip(peaks, watched, strict=True)]
    drift, storey, base, y, v = peaks
    assert drift == (pytest.approx(listed[1], rel=1e-6), pytest.approx(listed[2], abs=1e-4))
    assert storey[0] == pytest.approx(listed[3], rel=1e-6)
    assert base[0] == pytest.approx(listed[4], rel=1e-6)
    assert y == (pytest.approx(listed[5], rel=1e-6), pytest.approx(listed[6], abs=1e-4))
    assert v[0] == pytest.approx(listed[7], rel=1e-6)
    assert model.x[0] == pytest.approx(listed[9], rel=5e-4)


# -- energy


@pytest.mark.parametrize("building", BUILDINGS.values(), ids=BUILDINGS)
def test_without_damping_and_load_energy_stays(building: Building) -> None:
    undamped = building._replace(C=tuple(tuple(0.0 for _ in row) for row in building.C))
    model = StructureModel(undamped)
    generator = np.random.default_rng(1)
    set_state(model, 0.01 * generator.standard_normal(2 * building.size))
    begin = energy(undamped, model.x)
    for _ in range(2000):
        model.step(2e-3, 0.0, 0.0, 0.0)
    assert energy(undamped, model.x) == pytest.approx(begin, rel=1e-10)


def test_work_done_is_energy_gained_and_lost() -> None:
    # On smooth input the trapezoidal sum of the powers is off by h^2 alone.
    building = paper_building()
    M, C, _ = arrays(building)
    balance = []
    for h in (2e-3, 1e-3):
        model = StructureModel(building)
        powers = [0.0]
        for k in range(round(3.0 / h)):
            ground = [2.0 * sin(7.0 * k * h), 2.0 * sin(7.0 * (k + 1) * h)]
            model.step(h, *ground, 1.5)
            v = np.array(model.x[3:])
            powers.append(float(-v @ M @ np.full(3, ground[1]) - 1.5 * v[0] - v @ C @ v))
        gained = h * (sum(powers) - 0.5 * powers[-1])
        balance.append(abs(gained - energy(building, model.x)) / energy(building, model.x))
    assert balance[0] < 1e-4
    assert balance[1] < 0.3 * balance[0]


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_free_decay_of_a_mode_has_its_damping_ratio(mode: int) -> None:
    building = paper_building()
    omega, shape = modes(building.M, building.K)[mode - 1]
    ratio = MODEL["damping"]["ratios"][mode - 1]
    model = StructureModel(building)
    set_state(model, [*shape, 0.0, 0.0, 0.0])
    # One damped period: the amplitude has fallen by exp(-2 pi zeta/sqrt(1 - zeta^2)).
    model.step(2.0 * pi / (omega * (1.0 - ratio**2) ** 0.5), 0.0, 0.0, 0.0)
    decrement = -log(model.x[0] / shape[0])
    assert decrement / (4.0 * pi**2 + decrement**2) ** 0.5 == pytest.approx(ratio, rel=1e-4)


# -- accelerations and the holding force


@pytest.mark.parametrize("building", BUILDINGS.values(), ids=BUILDINGS)
def test_absolute_accelerations_are_those_of_the_equation_of_motion(building: Building) -> None:
    M, C, K = arrays(building)
    n = building.size
    model = StructureModel(building)
    set_state(model, np.random.default_rng(3).standard_normal(2 * n))
    q, v = np.array(model.x[:n]), np.array(model.x[n:])
    load = K @ q + C @ v
    load[0] += 4.0
    expected = -np.linalg.solve(M, load)
    np.testing.assert_allclose(model.absolute_accelerations(4.0), expected, rtol=1e-11)


@pytest.mark.parametrize("building", BUILDINGS.values(), ids=BUILDINGS)
def test_under_the_holding_force_the_first_level_moves_with_the_ground(
    building: Building,
) -> None:
    model = StructureModel(building)
    set_state(model, np.random.default_rng(4).standard_normal(2 * building.size))
    held = model.holding_force(a_g := 3.0, others := -2.0)
    assert model.absolute_accelerations(held + others)[0] == pytest.approx(a_g, rel=1e-10)


def test_the_holding_force_of_a_stuck_base_is_its_equilibrium() -> None:
    # f = k (x_1 - x_b) + c x_1' - k_b x_b - m_b a_g, everything relative to the ground.
    building = paper_building()
    model = StructureModel(building)
    x_b, x_1, x_2, v_1, v_2, a_g = 0.002, 0.005, -0.001, 0.03, 0.1, 1.7
    set_state(model, [x_b, x_1, x_2, 0.0, v_1, v_2])
    k_b, k = building.stiffnesses[:2]
    expected = k * (x_1 - x_b) - building.C[0][1] * v_1 - k_b * x_b - building.M[0][0] * a_g
    assert model.holding_force(a_g, 0.0) == pytest.approx(expected, rel=1e-12)


def test_a_fixed_base_takes_the_damper_on_its_first_floor() -> None:
    model = StructureModel(BUILDINGS["fixed"])
    model.step(1e-4, 0.0, 0.0, 10.0)
    n = model.m.n
    mass = BUILDINGS["fixed"].M[0][0]
    assert model.x[n] == pytest.approx(-10.0 / mass * 1e-4, rel=1e-3)
    assert abs(model.x[n + 1]) < 1e-4 * abs(model.x[n])


def test_attached_mass_slows_the_first_level() -> None:
    building = paper_building()
    for mass in (0.0, 0.7):
        model = StructureModel(building.with_attached_mass(mass))
        found = model.absolute_accelerations(5.0)[0]
        assert found == pytest.approx(-5.0 / (building.M[0][0] + mass), rel=1e-12)


# -- softening of the storeys

SOFTENING = {"storey_softening.d_half": 0.004}


def softening_force(model: StructureModel, drift: float) -> float:
    """Return the force of the second storey [N] at a drift [m]."""
    set_state(model, [0.0, drift, drift, 0.0, 0.0, 0.0])
    return float(-paper_building().K[0][1] * drift - effect_loads(model)[0])


@pytest.mark.parametrize("shape", [1.0, 2.0, 3.5])
def test_a_softening_storey_pulls_with_its_secant_stiffness(shape: float) -> None:
    values = {**SOFTENING, "storey_softening.shape": shape}
    model = StructureModel(paper_building(), values, ["storey_softening"])
    k = paper_building().stiffnesses[1]
    assert softening_force(model, 1e-9) == pytest.approx(k * 1e-9, rel=1e-4)
    assert softening_force(model, 0.004) == pytest.approx(0.5 * k * 0.004, rel=1e-12)
    assert softening_force(model, -0.004) == pytest.approx(-0.5 * k * 0.004, rel=1e-12)
    at = 0.003
    assert softening_force(model, at) == pytest.approx(k * at / (1 + 0.75**shape), rel=1e-12)


@pytest.mark.parametrize(("which", "softens"), [(0.0, (1, 2)), (1.0, (1,)), (2.0, (2,))])
def test_one_storey_or_all_soften_and_never_the_isolation(
    which: float, softens: tuple[int, ...]
) -> None:
    model = StructureModel(
        paper_building(), {**SOFTENING, "storey_softening.which": which}, ["storey_softening"]
    )
    for storey in (0, 1, 2):
        q = [0.004 if level >= storey else 0.0 for level in range(3)]
        set_state(model, [*q, 0.0, 0.0, 0.0])
        expected = [0.0, 0.0, 0.0]
        if storey in softens:
            lost = 0.5 * 0.004 * paper_building().stiffnesses[storey]
            expected[storey - 1], expected[storey] = lost, -lost
        assert effect_loads(model) == pytest.approx(expected, abs=1e-11)


def softening_energy(building: Building, x: list[float], d_half: float) -> float:
    """Return kinetic and elastic energy with shape 2: k d_half^2/2 log(1 + (d/d_half)^2) each."""
    M, _, _ = arrays(building)
    v = np.array(x[building.size :])
    total = 0.5 * v @ M @ v + 0.5 * building.stiffnesses[0] * x[0] ** 2
    for (below, above), k in zip(
        pairwise(x[: building.size]), building.stiffnesses[1:], strict=True
    ):
        total += 0.5 * k * d_half**2 * log(1.0 + ((above - below) / d_half) ** 2)
    return float(total)


def test_softening_conserves_energy() -> None:
    building = paper_building()
    undamped = building._replace(C=tuple(tuple(0.0 for _ in row) for row in building.C))
    worst = []
    for h in (2e-3, 1e-3):
        model = StructureModel(undamped, SOFTENING, ["storey_softening"])
        set_state(model, [0.003, 0.007, 0.012, 0.0, 0.05, 0.0])
        begin = softening_energy(undamped, model.x, 0.004)
        off = 0.0
        for _ in range(round(10.0 / h)):
            model.step(h, 0.0, 0.0, 0.0)
            off = max(off, abs(softening_energy(undamped, model.x, 0.004) / begin - 1.0))
        worst.append(off)
    assert max(worst) < 1e-4


def test_softening_against_a_tight_integration() -> None:
    building = paper_building()
    M, C, K = arrays(building)
    d_half = SOFTENING["storey_softening.d_half"]

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        q, v = x[:3], x[3:]
        load = K @ q + C @ v + M @ np.full(3, 3.0 * sin(13.0 * t))
        for i in (1, 2):
            d = q[i] - q[i - 1]
            lost = building.stiffnesses[i] * d * (1.0 - 1.0 / (1.0 + (d / d_half) ** 2))
            load[i] -= lost
            load[i - 1] += lost
        return np.concatenate([v, -np.linalg.solve(M, load)])

    times = np.arange(1001) * 2e-3
    exact = solve_ivp(rate, (0.0, 2.0), np.zeros(6), "DOP853", times, rtol=1e-10, atol=1e-12).y
    model = StructureModel(building, SOFTENING, ["storey_softening"])
    found = [list(model.x)]
    for k in range(1000):
        model.step(2e-3, 3.0 * sin(13.0 * times[k]), 3.0 * sin(13.0 * times[k + 1]), 0.0)
        found.append(list(model.x))
    drift = exact[1] - exact[0]
    assert np.abs(drift).max() > 2.0 * d_half  # the effect is well exercised
    error = np.abs(np.array(found).T - exact).max(axis=1) / np.abs(exact).max(axis=1)
    assert error.max() < 2e-3


YIELDING = {
    "storey_softening.d_half": 10.0,
    "storey_softening.yields": 0.6,
    "storey_softening.d_y": 0.002,
    "storey_softening.sharpness": 1.5,
}


def shaken(model: StructureModel, seconds: float) -> list[list[float]]:
    """Return the states of a building from rest, every 2 ms, under 3 m/s2 at 13 rad/s."""
    found = [list(model.x)]
    for k in range(round(seconds / 2e-3)):
        model.step(2e-3, 3.0 * sin(0.026 * k), 3.0 * sin(0.026 * (k + 1)), 0.0)
        found.append(list(model.x))
    return found


@pytest.mark.parametrize("base", ["isolated", "fixed"])
def test_yielding_storeys_against_a_tight_integration(base: str) -> None:
    building = paper_building()
    if base == "fixed":
        building = tower(2, base="fixed")
    M, C, K = arrays(building)
    n, first = building.size, 1 if base == "isolated" else 0
    stiffnesses = building.stiffnesses

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        q, v, e = x[:n], x[n : 2 * n], x[2 * n :]
        load = K @ q + C @ v + M @ np.full(n, 3.0 * sin(13.0 * t))
        flow = np.zeros(n)
        for i in range(first, n):
            d, speed = (q[i] - q[i - 1], v[i] - v[i - 1]) if i else (q[0], v[0])
            flow[i] = speed
            if e[i] * speed > 0.0:
                flow[i] *= 1.0 - (abs(e[i]) / 0.002) ** 1.5
            lost = 0.6 * stiffnesses[i] * (d - e[i])
            load[i] -= lost
            if i:
                load[i - 1] += lost
        return np.concatenate([v, -np.linalg.solve(M, load), flow])

    times = np.arange(1001) * 2e-3
    exact = solve_ivp(rate, (0.0, 2.0), np.zeros(3 * n), "DOP853", times, rtol=1e-9, atol=1e-12).y
    found = shaken(StructureModel(building, YIELDING, ["storey_softening"]), 2.0)
    assert np.abs(exact[2 * n + first]).max() > 0.9 * 0.002  # the effect is well exercised
    assert np.abs(exact[1] - exact[0]).max() > 2.0 * 0.002
    error = np.abs(np.array(found).T - exact[: 2 * n]).max(axis=1)
    assert np.all(error / np.abs(exact[: 2 * n]).max(axis=1) < 3e-3)


def test_yielding_loses_energy_in_every_closed_cycle() -> None:
    k = paper_building().stiffnesses[1]
    model = StructureModel(paper_building(), YIELDING, ["storey_softening"])
    angles = np.linspace(0.0, 2.0 * np.pi, 2001)
    lost = []
    for size in (0.0005, 0.002, 0.008):
        steady = []
        for _ in range(3):
            forces = []
            for k0, k1 in pairwise(angles):
                drift, way = size * sin(0.5 * (k0 + k1)), size * (sin(k1) - sin(k0))
                level, z = [0.0, drift, drift, 0.0, way / 1e-3, way / 1e-3], list(model.z)
                structure.advance_effects(
                    3, True, model.m.stiffnesses, level, 1e-3, 0.0, 0.0, 0.0, z, model.p, model.on,
                    model.z,
                )  # fmt: skip
                set_state(model, [0.0, drift, drift, 0.0, 0.0, 0.0])
                forces.append((k * drift - effect_loads(model)[0]) * way)
            steady.append(sum(forces))
        lost.append(steady[-1])
    assert 0.0 < lost[0] < lost[1] < lost[2]
    # Fully plastic both ways, the loop is a parallelogram but for its rounded corners.
    assert lost[2] == pytest.approx(4.0 * 0.6 * k * 0.002 * (0.008 - 0.002), rel=0.1)


def test_a_switched_off_effect_changes_nothing() -> None:
    found = []
    for values in ({}, SOFTENING):
        model = StructureModel(paper_building(), values, [])
        for k in range(50):
            model.step(2e-3, sin(0.1 * k), sin(0.1 * k + 0.1), 1.0)
        found.append(model.x)
    assert found[0] == found[1]


def test_step_keeps_the_state_at_its_begin() -> None:
    m = matrices(paper_building())
    s = step_matrices(m, 2e-3)
    x0, x1 = [0.01, 0.0, -0.01, 0.1, 0.2, 0.3], [0.0] * 6
    before = list(x0)
    setup = structure.Setup(
        m.n, m.isolated, m.stiffnesses, s.phi, s.held, s.ramp, s.h, [], [], active=False
    )
    loads = structure.Loads(1.0, 2.0, [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], 0.0)
    structure.step(setup, loads, x0, [], x1, [], [0.0] * structure.work_size(m.n))
    assert x0 == before
    assert x1 != before


def test_generalised_eigenvalues_are_those_of_the_step() -> None:
    building = paper_building()
    M, _, K = arrays(building)
    undamped = building._replace(C=tuple(tuple(0.0 for _ in row) for row in building.C))
    h = 2e-3
    phi = np.reshape(step_matrices(matrices(undamped), h).phi, (6, 6))
    found = sorted(np.abs(np.angle(np.linalg.eigvals(phi))) / h)[::2]
    assert found == pytest.approx(np.sqrt(eigh(K, M, eigvals_only=True)), rel=1e-9)

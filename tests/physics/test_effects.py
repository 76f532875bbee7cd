"""What each effect does, and effects that are refused when they are defined."""

from __future__ import annotations

from functools import cache
from math import exp, inf, pi, sin
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rigs import LAWS, NO_LAW, Bench, force_at, sine
from scipy.integrate import solve_ivp

from bristle.component.structure import StructureModel
from bristle.errors import PhysicsError
from bristle.physics.building import paper_building
from bristle.physics.damper import DamperModel, setup_of
from bristle.physics.effect import EFFECTS, Effect, Q, effects_of
from bristle.physics.law import LAWS as ALL_LAWS
from bristle.physics.parameter import Parameter
from bristle.user_code.conformance import shown

all_laws = pytest.mark.parametrize("law", LAWS)
both_laws = pytest.mark.parametrize("law", ["bingham", "lugre"])  # whose forces are known by hand


def on(name: str, **values: float) -> dict[str, float]:
    return {f"{name}.{key}": value for key, value in values.items()}


# -- gas spring


@all_laws
def test_gas_spring_adds_its_series_in_displacement(law: str) -> None:
    values = on("gas_spring", k=80.0, preload=0.5, k_2=300.0, k_3=-4e4)
    for x in (-0.02, 0.0, 0.003, 0.015):
        motion = {"x": x, "v": 0.05, "V": 4.0}
        added = force_at(law, **motion, values=values, effects=["gas_spring"]) - force_at(
            law, **motion
        )
        assert added == pytest.approx(0.5 + 80.0 * x + 300.0 * x**2 - 4e4 * x**3, abs=1e-12)


@all_laws
def test_gas_spring_is_in_phase_with_displacement(law: str) -> None:
    times = np.arange(1000) * 0.002  # four cycles
    motion = sine(0.01, 2.0)
    with_it = Bench(law, {}, ["gas_spring"]).play(motion, 4.0, times)
    added = with_it - Bench(law).play(motion, 4.0, times)
    x, v = np.array([motion(t) for t in times]).T
    assert added @ x / (x @ x) == pytest.approx(80.0, rel=1e-12)
    assert abs(added @ v) / (v @ v) < 1e-12


# -- Stribeck


@both_laws
def test_stribeck_limits(law: str) -> None:
    values = on("stribeck", rise=0.4, v_s=0.01)
    yield_force = 1.3 + 0.83 * 4.0
    z = 0.002  # sliding: sigma z is the yield force
    creeping = force_at(law, v=1e-9, V=4.0, z=z, values=values, effects=["stribeck"])
    assert creeping == pytest.approx(1.4 * yield_force, rel=1e-6)
    fast = {"v": 0.5, "V": 4.0, "z": z}
    assert force_at(law, **fast, values=values, effects=["stribeck"]) == force_at(law, **fast)


@pytest.mark.parametrize("shape", [0.5, 1.0, 2.0])
def test_stribeck_drops_by_its_shape(shape: float) -> None:
    values = {**on("stribeck", rise=0.4, v_s=0.01, shape=shape), "c_0": 0.0, "c_v": 0.0}
    for v in (0.004, 0.01, 0.03):
        found = force_at("bingham", v=-v, V=4.0, values=values, effects=["stribeck"])
        factor = 1.0 + 0.4 * exp(-((v / 0.01) ** shape))
        assert found == pytest.approx(-(1.3 + 0.83 * 4.0) * factor, rel=1e-12)


# -- coil lag


@all_laws
@pytest.mark.parametrize("dt", [0.0005, 0.002, 0.01])
def test_coil_lag_answers_a_step_with_its_time_constant(law: str, dt: float) -> None:
    tau = 0.03
    bench = Bench(law, {**on("coil_lag", tau=tau, voltage_0=1.0)}, ["coil_lag"])
    bench.last = (0.0, 0.0, 5.0)
    for k in range(1, 21):
        bench.move(0.0, 0.0, 5.0, dt)
        expected = 5.0 - 4.0 * exp(-k * dt / tau)
        assert bench.state("coil_lag.voltage") == pytest.approx(expected, rel=1e-12)


def test_coil_lag_delays_the_force_and_nothing_else() -> None:
    model = DamperModel("bingham", on("coil_lag", tau=0.02), ["coil_lag"])
    held = (0.0, 0.1, 0.0, 8.0)
    forces = [model.step(*held, 0.002, 0.0, 0.0, False) for _ in range(200)]
    for k, force in enumerate(forces, 1):
        felt = 8.0 * (1.0 - exp(-k * 0.002 / 0.02))
        assert force == pytest.approx(force_at("bingham", v=0.1, V=felt), rel=1e-12)
    assert forces[-1] == pytest.approx(force_at("bingham", v=0.1, V=8.0), rel=1e-6)


# -- remanence


def remanent_loop(
    width: float, dt: float = 0.002, turn: float = 1.0, hold: float = 0.0
) -> dict[str, list[tuple[float, float]]]:
    """Return (V, force) while the voltage rises from 0 to 8 V and while it falls, at 0.1 m/s."""
    bench = Bench("bingham", on("remanence", width=width, turn=turn, hold=hold), ["remanence"])
    bench.last = (0.0, 0.1, 0.0)
    branches: dict[str, list[tuple[float, float]]] = {"up": [], "down": []}
    for branch, voltages in (
        ("up", np.linspace(0.0, 8.0, 81)),
        ("down", np.linspace(8.0, 0.0, 81)),
    ):
        for V in voltages.tolist():
            branches[branch].append((V, bench.move(0.0, 0.1, V, dt)))
    return branches


@pytest.mark.parametrize("width", [0.3, 1.0])
def test_remanence_gives_two_forces_at_one_voltage(width: float) -> None:
    loop = remanent_loop(width)
    up, down = dict(loop["up"]), dict(reversed(loop["down"]))
    per_volt = force_at("bingham", v=0.1, V=1.0) - force_at("bingham", v=0.1, V=0.0)
    for V in (2.0, 4.0, 6.0):
        rising = next(force for at, force in up.items() if abs(at - V) < 1e-9)
        falling = next(force for at, force in down.items() if abs(at - V) < 1e-9)
        assert rising == pytest.approx(force_at("bingham", v=0.1, V=V - width), rel=1e-9)
        assert falling - rising == pytest.approx(2.0 * width * per_volt, rel=1e-9)
    assert loop["down"][-1][1] == pytest.approx(force_at("bingham", v=0.1, V=width), rel=1e-9)


def test_remanence_does_not_depend_on_how_fast_the_voltage_moves() -> None:
    assert remanent_loop(0.5, dt=1e-4) == remanent_loop(0.5, dt=0.1)


def test_remanence_follows_a_voltage_before_time_goes_on() -> None:
    model = DamperModel("bingham", on("remanence", width=0.5), ["remanence"])
    force = model.force(0.0, 0.1, 0.0, 6.0, inf, 0.0, 0.0, False)
    assert force == pytest.approx(force_at("bingham", v=0.1, V=5.5), rel=1e-12)


def test_remanence_turns_as_a_play_or_jumps_as_a_relay() -> None:
    relay, play = remanent_loop(0.5, turn=0.02), remanent_loop(0.5)

    def felt(V: float) -> float:
        return force_at("bingham", v=0.1, V=V)

    assert relay["down"][0][1] == pytest.approx(felt(7.5), rel=1e-9), "both have risen to 8 V"
    # A tenth of a volt later the relay is on the other branch, the play has not moved.
    assert relay["down"][1] == (pytest.approx(7.9), pytest.approx(felt(8.4), rel=1e-9))
    assert play["down"][1] == (pytest.approx(7.9), pytest.approx(felt(7.5), rel=1e-9))
    half = remanent_loop(0.5, turn=0.5)["down"]
    assert half[3][1] == pytest.approx(felt(7.7 + 0.5 - (0.5 - 0.3) / 0.5), rel=1e-9)
    assert half[8][1] == pytest.approx(felt(7.2 + 0.5), rel=1e-9)
    # Three times as wide: 3 V back, from branch to branch, where the play takes 1 V.
    wide = remanent_loop(0.5, turn=3.0)["down"]
    assert wide[15][1] == pytest.approx(felt(6.5), rel=1e-9)
    assert wide[30][1] == pytest.approx(felt(5.0 + 0.5), rel=1e-9)
    assert wide[40][1] == pytest.approx(felt(4.0 + 0.5), rel=1e-9)
    # The same way back, four fifths of it on the branch that it comes from.
    kept = remanent_loop(0.5, turn=3.0, hold=0.8)["down"]
    assert kept[24][1] == pytest.approx(felt(5.6 - 0.5), rel=1e-9)
    assert kept[27][1] == pytest.approx(felt(5.3), rel=1e-9)
    assert kept[40][1] == pytest.approx(felt(4.0 + 0.5), rel=1e-9)


def test_remanence_without_width_is_none() -> None:
    for branch in remanent_loop(0.0).values():
        for V, force in branch:
            assert force == pytest.approx(force_at("bingham", v=0.1, V=V), rel=1e-12)


@pytest.mark.parametrize("effect", ["stribeck", "temperature"])
def test_the_yield_force_is_scaled_and_the_bristles_damping_is_not(effect: str) -> None:
    # In steady sliding the bristles do not move: their damping is no part of the yield force.
    start = {"temperature.heat_0": 2.0, "stribeck.rise": 0.5}
    at = {"z": 4e-4, "v": 0.004, "V": 3.0, "effects": [effect]}
    damped = force_at("lugre", values={**start, "sigma_1": 5.0}, **at)
    undamped = force_at("lugre", values={**start, "sigma_1": 0.0}, **at)
    assert damped - undamped == pytest.approx(5.0 * 0.004 * (1.0 - 500.0 * 4e-4), rel=1e-9)
    assert undamped != pytest.approx(
        force_at("lugre", values={"sigma_1": 0.0}, z=4e-4, v=0.004, V=3.0)
    )


# -- mount compliance


def test_a_slow_pull_meets_two_springs_in_series() -> None:
    k_mount, V = 3000.0, 4.0
    bristles = 650.0 + 415.0 * V
    bench = Bench("lugre", on("mount_compliance", k=k_mount), ["mount_compliance"])
    x_end, duration, dt = 1e-6, 10.0, 0.01
    for k in range(1, round(duration / dt) + 1):
        share = k * dt / duration
        # Smoothly up: the dampers in mount and fluid must not be felt.
        x = x_end * share**2 * (3.0 - 2.0 * share)
        v = x_end * 6.0 * share * (1.0 - share) / duration
        force = bench.move(x, v, V, dt)
    assert force / x_end == pytest.approx(k_mount * bristles / (k_mount + bristles), rel=1e-3)


@both_laws
def test_in_steady_sliding_the_mount_passes_the_fluids_force(law: str) -> None:
    bench = Bench(law, {}, ["mount_compliance"])
    v, dt, x = 0.05, 0.002, 0.0
    for k in range(500):
        speed = v * min(1.0, k / 50)
        x += speed * dt
        force = bench.move(x, speed, 4.0, dt)
    sliding = force_at("bingham", v=v, V=4.0)
    assert force == pytest.approx(sliding, rel=1e-6)
    assert bench.state("mount_compliance.compression") == pytest.approx(sliding / 2e4, rel=1e-6)
    assert bench.state("mount_compliance.joint_velocity") == pytest.approx(v, rel=1e-6)


def from_rest(t: float) -> tuple[float, float]:
    """Return x and v of a cosine that begins at rest: 3 Hz, 20 mm from end to end."""
    omega = 6.0 * pi
    return 0.01 * (1.0 - np.cos(omega * t)), 0.01 * omega * sin(omega * t)


def mounted(law: str, times: np.ndarray, *, k: float, c: float, mass: float) -> np.ndarray:
    """Return the force at 8 V by a tight integration, sgn(v) as a steep tanh."""
    values = {"bingham": (1.3 + 0.83 * 8.0, 0.0), "lugre": (0.0, 650.0 + 415.0 * 8.0)}
    limit, stiffness = values[law]

    def rate(t: float, y: np.ndarray) -> list[float]:
        s, w, z = y
        v = from_rest(t)[1]
        bend = w - 500.0 * abs(w) * z
        fluid = limit * np.tanh(w / 2e-5) + stiffness * z + 260.0 * w * exp(-abs(w) / 0.02)
        fluid += 5.0 * bend if law == "lugre" else 0.0
        return [v - w, (k * s + c * (v - w) - fluid) / mass, bend]

    end = float(times[-1])
    y = solve_ivp(rate, (0.0, end), [0.0] * 3, "LSODA", times, rtol=1e-8, atol=1e-11).y
    v = np.array([from_rest(t)[1] for t in times])
    return k * y[0] + c * (v - y[1])


JOINT = EFFECTS["mount_compliance"].parameters["mass"].value


def chatter(force: np.ndarray) -> float:
    """Return the way that a force goes up and down [N]."""
    return float(np.abs(np.diff(force)).sum())


@both_laws
@pytest.mark.parametrize("dt", [0.002, 0.01])
@pytest.mark.parametrize(("k", "c"), [(2e3, 60.0), (2e4, 60.0), (2e4, 200.0), (2e5, 60.0)])
def test_the_mount_does_not_chatter(law: str, dt: float, k: float, c: float) -> None:
    times = dt * np.arange(round(1.0 / dt))
    bench = Bench(law, on("mount_compliance", k=k, c=c), ["mount_compliance"])
    found = bench.play(from_rest, 8.0, times)
    exact = mounted(law, times, k=k, c=c, mass=JOINT)
    assert chatter(found) <= 1.005 * chatter(exact)
    error = float(np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)))
    assert error < 0.0025


@both_laws
@pytest.mark.parametrize(
    "values",
    [
        {"k": 1e6}, {"k": 1e9}, {"mass": 1e-5}, {"c": 10.0},
        pytest.param({"c": 0.0}, marks=pytest.mark.slow),  # 3 s for the tight integration
    ],
    ids=str,
)  # fmt: skip
@pytest.mark.parametrize("dt", [pytest.param(0.0005, marks=pytest.mark.slow), 0.002, 0.01])
def test_no_mount_throws_the_joint_about(law: str, values: dict[str, float], dt: float) -> None:
    # Without enough damping the joint jumps where the viscous part falls: that is physical, and
    # then it swings beyond the fluid's largest force, in a tight integration by a tenth.
    bench = Bench(law, on("mount_compliance", **values), ["mount_compliance"])
    times = dt * np.arange(round(0.7 / dt))
    force = bench.play(from_rest, 8.0, times)
    largest = force_at("bingham", v=0.02, V=8.0)
    if "c" in values:
        largest = max(largest, largest_mounted(law, values["c"]))
    assert np.abs(force).max() < 1.01 * largest


@cache
def largest_mounted(law: str, c: float) -> float:
    """Return the largest force of a mounted damper in a tight integration [N]."""
    return float(np.abs(mounted(law, 5e-4 * np.arange(1400), k=2e4, c=c, mass=JOINT)).max())


@all_laws
@pytest.mark.parametrize("start", [0.0, 0.1], ids=["at rest", "in motion"])
def test_a_stiff_mount_is_none(law: str, start: float) -> None:
    times = 0.002 * np.arange(350)
    stiff = Bench(law, on("mount_compliance", k=1e9), ["mount_compliance"])
    forces = [one.play(lambda t: from_rest(t + start), 8.0, times) for one in (stiff, Bench(law))]
    error = np.diff(forces, axis=0)[0, 1:]  # the joint stands at the start
    assert np.sqrt(np.mean(error**2)) < (0.05 if start else 0.02)


def test_two_series_elements_are_refused() -> None:
    class Twin(EFFECTS["mount_compliance"]):  # type: ignore[misc, name-defined]
        """Twin: another mount."""

        name = "twin"

    try:
        with pytest.raises(PhysicsError, match="mount_compliance and twin are series elements"):
            DamperModel("lugre", {}, ["twin", "mount_compliance"])
        DamperModel("lugre", {}, ["twin"])
    finally:
        EFFECTS.pop("twin", None)


# -- Stribeck in the bristles


def test_stribeck_in_the_bristles_is_the_same_in_steady_sliding() -> None:
    for way in (0.0, 0.4, 1.0):
        bench = Bench("lugre", on("stribeck", rise=0.5, v_s=0.02, way=way), ["stribeck"])
        v, dt, x = 0.012, 0.002, 0.0
        bench.last = (0.0, v, 4.0)
        for _ in range(4000):  # some twenty times the travel in which the bristles slip
            x += v * dt
            force = bench.move(x, v, 4.0, dt)
        excess = 0.5 * exp(-((v / 0.02) ** 2))
        sliding = (1.3 + 0.83 * 4.0) * (1.0 + excess) + 180.0 * v * exp(-v / 0.02)
        assert force == pytest.approx(sliding, rel=1e-9)


def test_stribeck_in_the_bristles_builds_up_over_their_travel() -> None:
    stiff = {"sigma_1": 0.0}  # the bristles' damping is no part of the yield force
    rises = [{**stiff, **on("stribeck", rise=0.5, v_s=0.02, way=way)} for way in (0.0, 1.0)]
    at_once, over_travel = (Bench("lugre", values, ["stribeck"]) for values in rises)
    plain = Bench("lugre", stiff)
    forces = []
    for bench in (at_once, over_travel, plain):
        bench.last = (0.0, 1e-4, 4.0)
        forces.append(bench.move(1e-6, 1e-4, 4.0, 0.01))
    bristles = [force - 180.0 * 1e-4 * exp(-1e-4 / 0.02) for force in forces]
    assert bristles[0] == pytest.approx(1.5 * bristles[2], rel=0.01)  # stiffer from the start
    assert bristles[1] == pytest.approx(bristles[2], rel=0.01)  # as stiff, with a later slip


# -- flattening


@pytest.mark.parametrize(
    ("shape", "bend", "factor"),
    [
        (0.0, 1.0, lambda u: exp(-u)),
        (1.0, 1.0, lambda u: 1.0 / (1.0 + u)),
        (2.0 / 0.7, 2.0, lambda u: (1.0 + u * u / 0.35) ** -0.35),  # Carreau, n = 0.7
    ],
)
@all_laws
def test_flattening_has_the_forms_of_the_literature(
    law: str, shape: float, bend: float, factor: Any
) -> None:
    values = on("flattening", v_f=0.1, shape=shape, bend=bend)
    for v in (-0.3, -0.02, 0.0, 0.05, 0.2):
        motion = {"v": v, "V": 4.0, "z": 0.001}
        found = force_at(law, **motion, values=values, effects=["flattening"])
        assert found == pytest.approx(force_at(law, **motion) * factor(abs(v) / 0.1), rel=1e-12)


# -- quadratic damping


@pytest.mark.parametrize("shape", [1.75, 2.0, 3.0])
def test_quadratic_damping_is_a_power_of_the_speed(shape: float) -> None:
    values = on("quadratic_damping", c_2=250.0, shape=shape)
    for v in (-0.3, -0.1, 0.0, 0.05):
        motion = {"v": v, "V": 2.0}
        added = force_at("bingham", **motion, values=values, effects=["quadratic_damping"])
        added -= force_at("bingham", **motion)
        assert added == pytest.approx(np.sign(v) * 2.5 * (abs(v) / 0.1) ** shape, abs=1e-12)


# -- asymmetry


@pytest.mark.parametrize(
    ("side", "out", "slow", "back"), [(0, 1.4, 1.0, 0.6), (1, 1.4, 0.6, 0.6), (-1, 1.4, 1.4, 0.6)]
)
def test_asymmetry_sets_in_for_both_directions_or_for_one(
    side: int, out: float, slow: float, back: float
) -> None:
    values = on("asymmetry", ratio=0.4, v_s=1e-4, side=float(side))
    for v, factor in ((10.0, out), (1e-14, slow), (-1e-14, slow), (-10.0, back)):
        found = force_at("bingham", v=v, V=4.0, values=values, effects=["asymmetry"])
        assert found == pytest.approx(factor * force_at("bingham", v=v, V=4.0), rel=1e-9)


# -- saturation


def test_saturation_is_froehlichs_curve_and_has_a_ceiling() -> None:
    froehlich = on("saturation", V_s=4.0, shape=1.0)
    for V in (0.0, 2.0, 8.0):
        found = force_at("bingham", v=0.1, V=V, values=froehlich, effects=["saturation"])
        assert found == pytest.approx(force_at("bingham", v=0.1, V=V / (1.0 + V / 4.0)), rel=1e-12)
    for shape in (1.0, 2.0, 6.0):
        values = on("saturation", V_s=4.0, shape=shape)
        most = force_at("bingham", v=0.1, V=1e6, values=values, effects=["saturation"])
        assert most == pytest.approx(force_at("bingham", v=0.1, V=4.0), rel=1e-4)


def test_saturation_comes_within_1_percent_of_tanh() -> None:
    saturation = EFFECTS["saturation"]
    p = saturation.Values(V_s=1.022, shape=2.5)
    for V in np.linspace(0.0, 4.0, 81):
        found = saturation.voltage(Q(*(V for _ in Q._fields)), (), p)
        assert found == pytest.approx(np.tanh(V), abs=0.0101)


# -- presliding


def test_presliding_is_dahls_curve() -> None:
    values = {**on("presliding", x_s=5e-4, shape=1.0), "c_0": 0.0, "c_v": 0.0}
    bench = Bench("bingham", values, ["presliding"])
    limit, x, v, dt = 1.3 + 0.83 * 4.0, 0.0, 0.01, 0.002
    bench.last = (0.0, v, 4.0)
    for _ in range(100):
        x += v * dt
        assert bench.move(x, v, 4.0, dt) == pytest.approx(limit * (1 - exp(-x / 5e-4)), rel=1e-9)
    turned, before = 0.0, bench.state("presliding.direction")
    bench.last = (x, -v, 4.0)
    for _ in range(100):
        turned += v * dt
        force = bench.move(x - turned, -v, 4.0, dt)
        assert force == pytest.approx(
            limit * ((1.0 + before) * exp(-turned / 5e-4) - 1.0), abs=1e-9
        )


def test_presliding_of_shape_0_is_an_elastic_plastic_spring() -> None:
    values = {**on("presliding", x_s=1e-3, shape=0.0), "c_0": 0.0, "c_v": 0.0}
    bench = Bench("bingham", values, ["presliding"])
    bench.last = (0.0, 0.01, 0.0)
    for k in range(1, 101):
        force = bench.move(k * 2e-5, 0.01, 0.0, 0.002)
        assert force == pytest.approx(1.3 * min(k * 2e-5 / 1e-3, 1.0), rel=1e-9)


# -- fluid inertia


@all_laws
def test_fluid_inertia_is_a_mass(law: str) -> None:
    model = DamperModel(law, on("fluid_inertia", m_f=0.4), ["fluid_inertia"])
    bare = DamperModel(law)
    held = (0.001, 0.05), (2.0, 0.002, 0.0, 0.0, False)
    force = model.force(*held[0], 3.0, *held[1]) - bare.force(*held[0], 3.0, *held[1])
    assert force == pytest.approx(1.2, rel=1e-12)


@pytest.mark.parametrize("frequency", [1.0, 3.0, 6.0])
def test_the_fluids_memory_is_half_way_between_mass_and_damping(frequency: float) -> None:
    # A kernel 1/sqrt(pi t) turns a into a / sqrt(i omega): sqrt(i omega) v, 45 degrees ahead of v.
    omega = 2.0 * pi * frequency
    values = {**on("fluid_inertia", m_f=0.0, m_h=1.0), **NO_LAW["bingham"]}
    model, dt, rows = DamperModel("bingham", values, ["fluid_inertia"]), 5e-4, []
    for k in range(1, round(8.0 / frequency / dt)):
        t = k * dt
        v, a = sin(omega * t), omega * np.cos(omega * t)
        rows.append((t, model.step(0.0, v, a, 0.0, dt, 0.0, 0.0, False)))
    t, force = np.array(rows[-round(4.0 / frequency / dt) :]).T
    pair = np.column_stack([np.sin(omega * t), np.cos(omega * t)])
    (in_phase, ahead), *_ = np.linalg.lstsq(pair, force, rcond=None)
    size = (20.0 * omega) ** 0.5
    assert np.hypot(in_phase, ahead) == pytest.approx(size, rel=0.04)
    assert np.degrees(np.arctan2(ahead, in_phase)) == pytest.approx(45.0, abs=2.5)


# -- temperature


def test_heat_thins_the_fluid_and_leaves_with_its_time_constant() -> None:
    bench = Bench("bingham", on("temperature", E_0=5.0, tau=2.0, part=0.5), ["temperature"])
    bench.last = (0.0, 0.1, 4.0)
    bench.model.z[bench.slot("temperature.heat")] = 5.0
    still = Bench("bingham", on("temperature", E_0=5.0, tau=2.0, part=0.5), ["temperature"])
    at_e = bench.model.force(0.0, 0.1, 0.0, 4.0, 0.002, 0.0, 0.0, False)
    yielding, viscous = 1.3 + 0.83 * 4.0, 180.0 * 0.1 * exp(-5.0)
    assert at_e == pytest.approx(yielding * exp(-0.5) + viscous * exp(-1.0), rel=1e-12)
    still.model.z[still.slot("temperature.heat")] = 5.0
    still.last = (0.0, 0.0, 0.0)
    for _ in range(1000):
        still.move(0.0, 0.0, 0.0, 0.002)
    assert still.state("temperature.heat") == pytest.approx(5.0 * exp(-1.0), rel=1e-9)


@pytest.mark.parametrize(("curve", "left"), [(-1.0, 0.6), (0.0, exp(-0.4)), (1.0, 1.0 / 1.4)])
def test_heat_thins_linearly_exponentially_or_less_and_less(curve: float, left: float) -> None:
    values = on("temperature", E_0=10.0, curve=curve, heat_0=4.0)
    found = force_at("bingham", v=0.1, V=4.0, values=values, effects=["temperature"])
    assert found == pytest.approx(left * force_at("bingham", v=0.1, V=4.0), rel=1e-9)


# -- backlash


def test_backlash_carries_nothing_over_the_width_of_its_gap() -> None:
    gap, dt = 1e-3, 5e-4
    bench = Bench("bingham", on("backlash", gap=gap), ["backlash"])
    times = dt * np.arange(round(2.0 / dt))
    forces = bench.play(sine(0.01, 1.0), 4.0, times)
    x = 0.01 * np.sin(2.0 * pi * times)
    after = (times > 0.25) & (times < 0.75)
    free = after & (np.abs(forces) < 1e-9)
    assert np.ptp(x[free]) == pytest.approx(2.0 * gap, rel=0.1)
    slides = (times > 0.6) & (times < 0.7)
    assert np.abs(forces[slides]).min() > 4.0


def test_a_joint_with_damping_closes_without_a_jump_of_the_force() -> None:
    values, gap, speed = {"gap": 1e-3, "k": 1e5, "c": 1e4, "mass": 0.004}, 1e-3, 0.1
    own = EFFECTS["backlash"]
    p = SimpleNamespace(**values)
    q = SimpleNamespace(rod_x=0.0, rod_v=speed, force=0.0)
    beyond = 1e-6 * np.arange(101)
    force = [
        own.reaction(q, SimpleNamespace(compression=gap + d, joint_velocity=0.0), p) for d in beyond
    ]
    assert force[0] == 0.0
    # The damping rises over 20 um, here in steps of 1 um.
    assert max(np.abs(np.diff(force))) < 0.06 * values["c"] * speed
    assert force[50] == pytest.approx(values["k"] * beyond[50] + values["c"] * speed, rel=1e-9)


# -- coil lag with two times and eddy currents


def test_coil_lag_rises_and_falls_with_times_of_its_own() -> None:
    for target, start, tau in ((8.0, 0.0, 0.02 / 2.0), (0.0, 8.0, 0.02 * 2.0)):
        bench = Bench("bingham", on("coil_lag", tau=0.02, fall=4.0, voltage_0=start), ["coil_lag"])
        bench.last = (0.0, 0.0, target)
        bench.move(0.0, 0.0, target, 0.01)
        left = (bench.state("coil_lag.voltage") - target) / (start - target)
        assert left == pytest.approx(exp(-0.01 / tau), rel=1e-9)


def test_eddy_currents_are_a_second_lag() -> None:
    values = on("coil_lag", tau=0.03, eddy=0.5)
    bench = Bench("bingham", values, ["coil_lag"])
    bench.last = (0.0, 0.0, 5.0)
    for k in range(1, 40):
        bench.move(0.0, 0.0, 5.0, 0.002)
        t = 0.002 * k
        exact = 5.0 * (1.0 - 2.0 * exp(-t / 0.03) + exp(-t / 0.015))
        assert bench.state("coil_lag.field") == pytest.approx(exact, rel=1e-9)


# -- mount that hardens


def test_a_hard_bush_carries_its_force_over_less_travel() -> None:
    values = on("mount_compliance", k=5e3, hard=2.0)
    bench = Bench("bingham", values, ["mount_compliance"])
    v, dt, x = 0.05, 0.002, 0.0
    for k in range(500):
        speed = v * min(1.0, k / 50)
        x += speed * dt
        force = bench.move(x, speed, 4.0, dt)
    s = bench.state("mount_compliance.compression")
    assert force == pytest.approx(force_at("bingham", v=v, V=4.0), rel=1e-6)
    assert force == pytest.approx(5e3 * s * (1.0 + 2.0 * (s / 1e-3) ** 2), rel=1e-6)


# -- the structure's


def ringing(
    values: dict[str, float], effects: list[str], seconds: float = 1.5
) -> tuple[np.ndarray, np.ndarray, StructureModel]:
    """Return times and states (n, 6) of the paper's building under a sine of the ground."""
    model = StructureModel(paper_building(), values, effects)
    times = 0.002 * np.arange(round(seconds / 0.002) + 1)
    states = [list(model.x)]
    for t in times[:-1]:
        model.step(0.002, *(4.0 * sin(13.0 * s) for s in (t, t + 0.002)), 0.0)
        states.append(list(model.x))
    return times, np.array(states), model


def exact(times: np.ndarray, force: Any) -> np.ndarray:
    """Return the same by a tight integration with `force`(x, v) on the base."""
    M, C, K = (np.array(matrix) for matrix in paper_building()[1:4])

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        load = C @ y[3:] + K @ y[:3] + np.array([force(y[0], y[3]), 0.0, 0.0])
        return np.concatenate([y[3:], -np.linalg.solve(M, load) - 4.0 * sin(13.0 * t)])

    span = (0.0, float(times[-1]))
    options = {"rtol": 1e-9, "atol": 1e-12, "max_step": 5e-4}
    return solve_ivp(rate, span, np.zeros(6), "RK45", times, **options).y.T


def test_a_duffing_spring_is_integrated_closely() -> None:
    values = on("duffing", k_3=2e6, shape=5.0)
    times, found, _ = ringing(values, ["duffing"])
    wanted = exact(times, lambda x, v: 2e6 * 1e-4 * (abs(x) / 0.01) ** 4 * x)
    assert np.abs(found - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_a_softening_spring_never_pushes_outwards() -> None:
    duffing, k = EFFECTS["duffing"], 1057.0
    p = duffing.Values(k_3=-1e8, shape=3.0)
    q = Q(*(0.0 for _ in Q._fields))._replace(stiffness=k)
    forces = [k * x + duffing.force(q._replace(x=x), (), p) for x in np.linspace(0.0, 0.05, 51)]
    assert min(forces) >= 0.0
    small = duffing.force(q._replace(x=1e-4), (), p)
    assert small == pytest.approx(-1e8 * 1e-12, rel=1e-2)


def test_an_end_stop_is_integrated_closely_and_loses_energy() -> None:
    values = on("end_stop", clearance=0.004, k=3e4, c=20.0)

    def stop(x: float, v: float) -> float:
        side = np.sign(x)
        return side * max(3e4 * (abs(x) - 0.004) + 20.0 * side * v, 0.0) if abs(x) > 0.004 else 0.0

    times, found, _ = ringing(values, ["end_stop"])
    wanted = exact(times, stop)
    assert np.abs(found - wanted).max() < 0.01 * np.abs(wanted).max()


@pytest.mark.parametrize("k", [1e5, 1e7, 1e9])
def test_a_stiff_stop_holds(k: float) -> None:
    _, found, _ = ringing(on("end_stop", clearance=0.003, k=k), ["end_stop"])
    assert np.abs(found[:, 0]).max() < 0.003 + 3.0 * (0.5 * 4.4 / k) ** 0.5 + 1e-3


def test_base_friction_sticks_and_says_so_in_the_accelerations() -> None:
    model = StructureModel(paper_building(), on("base_friction", limit=3.0), ["base_friction"])
    for k in range(500):  # 0.3 m/s2 on 4.4 kg: less than the limit, once the storeys are quiet
        a_g = 0.3 * sin(13.0 * 0.002 * k)
        model.step(0.002, a_g, a_g, 0.0)
        assert abs(model.x[0]) < 2e-8
        assert model.absolute_accelerations(0.0, a_g)[0] == pytest.approx(a_g, abs=1e-9)


def test_base_friction_slides_with_its_force() -> None:
    _, found, model = ringing(on("base_friction", limit=0.8), ["base_friction"])
    assert np.abs(found[:, 0]).max() > 1e-3
    x, v = np.array(model.x[:3]), np.array(model.x[3:])
    assert abs(v[0]) > 0.01
    M, C, K = (np.array(matrix) for matrix in paper_building()[1:4])
    added = -M @ model.absolute_accelerations(0.0, 0.0) - K @ x - C @ v
    assert added[0] == pytest.approx(0.8 * np.sign(v[0]), rel=1e-9)


def test_base_friction_with_an_elastic_travel_follows_it() -> None:
    values = on("base_friction", limit=2.0, x_s=1e-3)
    times, found, _ = ringing(values, ["base_friction"], seconds=1.0)
    stiffer = 2.0 / 1e-3  # about rest
    first = found[1:4, 0] / ringing({}, [], seconds=1.0)[1][1:4, 0]
    assert (first < 1.0).all()
    assert (first > 1.0 - stiffer * times[1:4] ** 2).all()


# -- instruments


def test_a_delay_shows_the_force_late() -> None:
    t = 0.002 * np.arange(1000)
    force = 5.0 * np.sin(2.0 * pi * 2.0 * t)
    for time in (0.0, 0.003, 0.0171, 0.1):
        late = shown(EFFECTS["delay"], {"time": time, "filtered": 0.0}, force, 0.002)
        expected = np.interp(t - time, t, force)
        np.testing.assert_allclose(late, expected, atol=1e-9)


def test_a_filter_delays_by_the_same_time_in_the_mean() -> None:
    t = 0.002 * np.arange(1000)
    ramp = 3.0 * t
    for part in (0.3, 1.0):
        late = shown(EFFECTS["delay"], {"time": 0.03, "filtered": part}, ramp, 0.002)
        # A filter of held samples is late by up to half a sample more.
        assert (ramp[500] - late[500]) / 3.0 == pytest.approx(0.03, abs=0.001)


@pytest.mark.parametrize(
    ("values", "response"),
    [
        ({"tau": 0.02, "gain": 1.1, "shape": 0.0, "corner": 0.0}, lambda s: 1.1 / (1.0 + 0.02 * s)),
        (
            {"tau": 0.03, "shape": 0.8, "corner": 0.0},
            lambda s: 1.0 / (1.0 + 0.03 * s + 0.8 * (0.03 * s) ** 2),
        ),
        ({"tau": 0.0, "corner": 15.0}, lambda s: s / (s + 15.0)),
    ],
)
@pytest.mark.parametrize("frequency", [1.0, 4.0])
def test_a_velocity_sensor_has_its_response(
    values: dict[str, float], response: Any, frequency: float
) -> None:
    dt, omega = 5e-4, 2.0 * pi * frequency
    t = dt * np.arange(round(6.0 / dt))
    seen = shown(EFFECTS["velocity_sensor"], values, np.sin(omega * t), dt)
    last = t > 3.0
    pair = np.column_stack([np.sin(omega * t[last]), np.cos(omega * t[last])])
    (real, imaginary), *_ = np.linalg.lstsq(pair, seen[last], rcond=None)
    assert complex(real, imaginary) == pytest.approx(response(1j * omega), abs=0.02)


# -- several together


def test_effects_join_in_any_number() -> None:
    names = [effect.name for effect in effects_of("damper", "lugre") if effect.name != "backlash"]
    bench = Bench("lugre", {}, names)
    force = bench.play(sine(0.01, 2.0), lambda t: 4.0 + 3.0 * sin(9.0 * t), 0.002 * np.arange(500))
    assert np.isfinite(force).all()
    assert 5.0 < np.abs(force).max() < 20.0


def test_remanence_acts_on_the_voltage_that_the_coil_passes_on() -> None:
    values = {**on("coil_lag", tau=0.05), **on("remanence", width=0.5)}
    bench = Bench("bingham", values, ["coil_lag", "remanence"])
    bench.last = (0.0, 0.1, 8.0)
    for _ in range(1000):
        force = bench.move(0.0, 0.1, 8.0, 0.002)
    assert bench.state("coil_lag.voltage") == pytest.approx(8.0, rel=1e-9)
    assert bench.state("remanence.voltage") == pytest.approx(7.5, rel=1e-9)
    assert force == pytest.approx(force_at("bingham", v=0.1, V=7.5), rel=1e-9)


def test_which_states_move_how() -> None:
    assert DamperModel("lugre", {}, ["gas_spring", "coil_lag"]).moving == []
    assert DamperModel("lugre", {}, ["mount_compliance"]).moving == []  # it has its own solver
    assert not setup_of("lugre", {}, ["gas_spring", "mount_compliance"]).advances
    assert setup_of("lugre", {}, ["coil_lag"]).advances


# -- definitions that are refused


def define(**data: Any) -> type[Effect]:
    """Define an effect that would do, but for what `data` changes; None takes an item away."""

    def force(q: Any, z: Any, p: Any) -> float:
        return float(p.k * q.x)

    good = {
        "__doc__": "Trial: adds a spring.",
        "name": "trial",
        "site": "damper",
        "needs": ("x",),
        "parameters": {"k": Parameter(1.0, "N/m", (0.0, 2.0), "stiffness")},
        "force": staticmethod(force),
    }
    body = {key: value for key, value in {**good, **data}.items() if value is not None}
    return type("Trial", (Effect,), body)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"site": "roof"}, r"site 'roof' is none of \('damper', 'structure', 'sensor'\)"),
        ({"name": "two words"}, "a name is one word"),
        ({"channels": {"k": "pressure"}}, r"channels names \['k'\]; parameters that assumed names"),
        (
            {"channels": {"q": "pressure"}, "assumed": ("q",)},
            r"channels names \['q'\]; parameters that assumed names",
        ),
        (
            {"channels": {"k": "two words"}, "assumed": ("k",)},
            r"channels names \['two words'\]; letters, digits and _",
        ),
        (
            {"channels": {"k": "pressure"}, "assumed": ("k",), "site": "structure"},
            "channels are what an effect of the damper alone may follow",
        ),
        ({"needs": ("x", "colour")}, r"needs \['colour'\]; q offers \['x', 'v'"),
        ({"force": None}, r"defines no hook; there are \['parallel', 'voltage'"),
        ({"__doc__": ""}, "a first docstring line"),
        ({"states": {"z": "m"}}, "has states and neither `rate` nor `advance`"),
        (
            {
                "states": {"z": "m"},
                "rate": staticmethod(lambda q, z, p: (0.0,)),
                "advance": staticmethod(lambda q, z, p: (0.0,)),
            },
            "by `rate` or by `advance`, not both",
        ),
        (
            {
                "states": {"s": "m", "w": "m/s"},
                "rate": staticmethod(lambda q, z, p: (0.0, 0.0)),
                "joint": ("s", "v"),
            },
            r"joint = \('s', 'v'\); the names of two states are right",
        ),
        (
            {"parameters": {"k": Parameter(3.0, "N/m", (0.0, 2.0), "stiffness")}},
            r"k = 3.0 lies outside \(0.0, 2.0\)",
        ),
        (
            {"parameters": {"k": Parameter(float("nan"), "N/m", (0.0, 2.0), "stiffness")}},
            "k = nan lies outside",
        ),
    ],
)
def test_an_effect_that_could_not_work_is_refused(data: dict[str, Any], says: str) -> None:
    with pytest.raises(PhysicsError, match=says) as caught:
        define(**data)
    assert "Trial" in str(caught.value)
    assert "trial" not in EFFECTS


def test_a_base_class_without_a_name_is_not_registered() -> None:
    before = set(EFFECTS)
    define(name="")
    assert set(EFFECTS) == before


def test_a_defined_effect_is_registered_and_found_by_site_and_law() -> None:
    try:
        trial = define(acts_on=("sign",))
        assert EFFECTS["trial"] is trial
        assert trial in effects_of("damper", "bingham")
        assert trial not in effects_of("damper", "lugre")
        assert trial not in effects_of("structure")
        assert trial.first_line() == "Trial: adds a spring."
        assert list(trial.hooks()) == ["force"]
    finally:
        EFFECTS.pop("trial", None)


def test_a_late_effect_works() -> None:
    try:
        define()
        force = DamperModel("bingham", {"trial.k": 2.0}, ["trial"]).force(
            0.5, 0.0, 0.0, 0.0, 0.002, 0.0, 0.0, False
        )
        assert force == 1.0
    finally:
        EFFECTS.pop("trial", None)


@pytest.mark.parametrize("rate", [1.0, 50.0, 1e6])
@all_laws
def test_states_that_move_by_rate_do_so_at_any_stiffness(law: str, rate: float) -> None:
    # A state that follows the velocity late: u' = (v - u) rate, and a force that shows it.
    try:
        define(
            needs=("v",),
            states={"u": "m/s"},
            parameters={"rate": Parameter(1.0, "1/s", (0.0, 1e9), "how fast it follows")},
            force=staticmethod(lambda q, z, p: 10.0 * z.u),
            rate=staticmethod(lambda q, z, p: ((q.v - z.u) * p.rate,)),
        )
        times = 0.002 * np.arange(501)
        motion = sine(0.01, 2.0)
        bench = Bench(law, {"trial.rate": rate}, ["trial"])
        added = bench.play(motion, 4.0, times) - Bench(law).play(motion, 4.0, times)
        omega, amplitude = 4.0 * pi, 0.01 * 4.0 * pi
        # u for v = amplitude cos(omega t), u(0) = 0, in closed form.
        share = rate / (rate**2 + omega**2) * amplitude
        exact = share * (rate * np.cos(omega * times) + omega * np.sin(omega * times))
        exact -= share * rate * np.exp(-rate * times)
        # A law's states are advanced with the effect's then, in shorter steps than alone: 0.004 N.
        # One with a series element then takes a jump from rest to speed less exactly, by 1 %.
        within = 0.005 if ALL_LAWS[law].states else 2e-4
        within = 0.07 if "series element" in ALL_LAWS[law].contains else within
        assert np.abs(added[1:] - 10.0 * exact[1:]).max() < within
    finally:
        EFFECTS.pop("trial", None)


def test_no_law_leaves_nothing() -> None:
    for law, values in NO_LAW.items():
        assert force_at(law, v=0.1, V=8.0, z=0.001, values=values) == 0.0

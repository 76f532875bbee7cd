"""Effects where the physics is: one class at several sites, and its name at each."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import HOUSE, LAWS, NO_LAW, Bench, force_at, loop_energy, sine

import bristle
from bristle.errors import PhysicsError
from bristle.physics import damper, structure
from bristle.physics.damper import DamperModel
from bristle.physics.effect import EFFECTS, Effect, effects_of, exclude, laws_joined, plain_name
from bristle.physics.effects.duffing import Duffing
from bristle.physics.effects.end_stop import EndStop
from bristle.physics.laws import LAWS as CLASSES
from bristle.physics.parameter import Parameter

SHARED = [effect for effect in EFFECTS.values() if len(effect.sites) > 1]
SHORT = {"end_stop.clearance": 0.006, "end_stop.k": 2e4, "end_stop.c": 20.0}
MOTION, TIMES = sine(0.01, 2.0), 0.002 * np.arange(400)
each_law = pytest.mark.parametrize("law", LAWS)


# -- names


def test_stop_spring_and_friction_are_of_both_sites() -> None:
    assert {effect.name for effect in SHARED} == {"base_friction", "duffing", "end_stop"}
    for site in ("damper", "structure"):
        assert set(SHARED) <= set(effects_of(site))
    for effect in SHARED:
        alone = set(LAWS) - set(laws_joined(effect))
        assert all(effect.name in CLASSES[law].contains for law in alone)


def test_a_name_means_the_first_site_and_says_any_other() -> None:
    there = EFFECTS["end_stop@damper"]
    assert (there.site, there.sites, there.name) == ("damper", ("damper",), "end_stop")
    assert there is EFFECTS.get("end_stop@damper") is EndStop.at("damper")
    assert (EndStop.site, EndStop.key("structure"), EndStop.key("damper")) == (
        "structure", "end_stop", "end_stop@damper",
    )  # fmt: skip
    assert "end_stop@damper" in EFFECTS
    assert not any("@" in name for name in EFFECTS)
    for wrong in ("end_stop@structure", "end_stop@sensor", "gas_spring@damper", "none@damper"):
        assert wrong not in EFFECTS
        assert EFFECTS.get(wrong) is None
        with pytest.raises(KeyError):
            EFFECTS[wrong]
    assert plain_name("end_stop@damper.k") == "end_stop.k"
    assert plain_name("f_c") == "f_c"
    with pytest.raises(PhysicsError, match="end_stop: of structure and damper, not of sensor"):
        EndStop.at("sensor")


def test_what_excludes_another_does_so_at_one_site() -> None:
    assert exclude("backlash", "mount_compliance")
    assert not exclude("backlash", "end_stop@damper")


class _Hook:
    """A second path: one that a test needs. Leaves out all else."""

    parameters = {"k": Parameter(1.0, "N/m", (0.0, 2.0), "stiffness")}  # noqa: RUF012

    @staticmethod
    def force(q, z, p):  # type: ignore[no-untyped-def]
        return p.k * q.x


def made(**data: object) -> type[Effect]:
    base = {"__doc__": _Hook.__doc__, "parameters": _Hook.parameters, "needs": ("x",)}
    hooks = {"force": staticmethod(_Hook.force)}
    own = {"name": "second_path", **base, **hooks, **data}
    try:
        return type(Effect)("SecondPath", (Effect,), own)
    finally:
        EFFECTS.pop("second_path", None)


def test_a_class_that_gives_its_site_alone_is_still_read() -> None:
    assert made(site="structure").sites == ("structure",)
    assert made().sites == ("damper",)
    assert made(sites=("damper", "structure")).site == "damper"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({"sites": ("damper", "roof")}, "site 'roof' is none of"),
        ({"sites": "damper"}, "sites = 'damper'; a tuple of"),
        ({"sites": ()}, r"sites = \(\); a tuple of"),
        ({"sites": ("damper", "damper")}, "each once"),
        ({"sites": ("structure", "damper"), "site": "damper"}, "sites alone is right"),
        ({"sites": ("damper", "structure"), "needs": ("x", "V")}, r"needs \['V'\]"),
        (
            {"sites": ("damper", "structure"), "spring": staticmethod(_Hook.force)},
            r"defines \['spring'\]",
        ),
    ],
)
def test_sites_that_cannot_work_are_refused(data: dict[str, object], said: str) -> None:
    with pytest.raises(PhysicsError, match=said):
        made(**data)


# -- limits


@each_law
@pytest.mark.parametrize(
    "values",
    [
        {"end_stop.clearance": 0.0101},  # never met
        {"end_stop.clearance": 1.0, "end_stop.k": 1e9},
        {"end_stop.clearance": 0.001, "end_stop.k": 0.0, "end_stop.c": 0.0},
        {"duffing.k_3": 0.0},
        {"base_friction.limit": 0.0},
    ],
    ids=lambda values: " ".join(values),
)
def test_without_size_there_is_no_trace(law: str, values: dict[str, float]) -> None:
    effect = next(iter(values)).partition(".")[0]
    plain = Bench(law).play(MOTION, 4.0, TIMES)
    np.testing.assert_array_equal(Bench(law, values, [effect]).play(MOTION, 4.0, TIMES), plain)


@each_law
def test_a_stop_adds_its_own_formula_to_the_law(law: str) -> None:
    plain = Bench(law).play(MOTION, 4.0, TIMES)
    seen = Bench(law, SHORT, ["end_stop"]).play(MOTION, 4.0, TIMES) - plain
    x, v = np.array([MOTION(t) for t in TIMES]).T
    depth = np.maximum(np.abs(x) - 0.006, 0.0)
    push = np.where(depth > 0.0, np.maximum(2e4 * depth + 20.0 * np.sign(x) * v, 0.0), 0.0)
    np.testing.assert_allclose(seen, np.sign(x) * push, atol=1e-9)
    assert (seen * x >= 0.0).all(), "it pushes back and never pulls"


@each_law
def test_a_hardening_spring_is_duffings_cubic(law: str) -> None:
    plain = Bench(law).play(MOTION, 4.0, TIMES)
    seen = Bench(law, {"duffing.k_3": 3e6}, ["duffing"]).play(MOTION, 4.0, TIMES) - plain
    x = np.array([MOTION(t)[0] for t in TIMES])
    np.testing.assert_allclose(seen, 3e6 * x**3, rtol=1e-9, atol=1e-9)


@each_law
def test_friction_of_seals_loses_four_times_its_limit_by_the_stroke(law: str) -> None:
    values = {**NO_LAW[law], "base_friction.limit": 0.7}
    times = np.linspace(0.0, 1.5, 6001)
    force = Bench(law, values, ["base_friction"]).play(MOTION, 4.0, times)
    v = np.array([MOTION(t)[1] for t in times])
    assert set(np.round(np.abs(force[np.abs(v) > 1e-9]), 12)) == {0.7}
    last = slice(4000, None)
    lost = loop_energy(force[last], v[last], times[1])
    assert lost == pytest.approx(4.0 * 0.7 * 0.01, rel=1e-3)


@each_law
def test_a_stuck_damper_carries_what_holds_it_and_no_more(law: str) -> None:
    """Friction takes what the law leaves of the holding force, up to its limit."""
    model = DamperModel(law, {"base_friction.limit": 0.7}, ["base_friction"])
    most = (1.3 if law == "bingham" else 0.0) + 0.7
    for holding in (0.3, -0.6, 1.7, -9.0):
        force = model.force(0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, holding, True)
        assert force == pytest.approx(max(min(holding, most), -most), abs=1e-12)


def test_friction_beside_bent_bristles_carries_the_rest() -> None:
    bent = {"bristle_deflection_0": 1e-3, "base_friction.limit": 0.7}
    model = DamperModel("lugre", bent, ["base_friction"])
    bristles = DamperModel("lugre", bent).force(0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, True)
    assert bristles == pytest.approx(0.65)
    assert model.force(0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.9, True) == pytest.approx(0.9)
    assert model.force(0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 3.0, True) == pytest.approx(1.35)


@each_law
@pytest.mark.parametrize("effect", [e.name for e in SHARED])
def test_behind_a_stiff_mount_it_is_as_without_one(law: str, effect: str) -> None:
    values = {**SHORT, "mount_compliance.k": 1e6, "mount_compliance.c": 300.0}
    times = 0.0005 * np.arange(1600)
    direct = Bench(law, values, [effect]).play(MOTION, 4.0, times)
    mounted = Bench(law, values, [effect, "mount_compliance"]).play(MOTION, 4.0, times)
    alone = Bench(law, values, ["mount_compliance"]).play(MOTION, 4.0, times)
    added = direct - Bench(law).play(MOTION, 4.0, times)
    slides = np.abs([MOTION(t)[1] for t in times]) > 0.03  # where it turns the mount unbends
    left = (mounted - alone - added)[slides]
    assert np.sqrt(np.mean(left**2) / np.mean(added[slides] ** 2)) < 0.05


SLOTS = structure.SETS.library.slots


def test_both_sites_evaluate_one_and_the_same_force() -> None:
    state = [0.008, 0.0, 0.0, 0.02, 0.0, 0.0]
    for effect, values in ((EndStop, SHORT), (Duffing, {"duffing.k_3": 2e6})):
        on = [one is effect for one in SLOTS.effects]
        forces = [0.0] * 3
        p, z = structure.pack(values, SLOTS), structure.start_states(3, values, SLOTS)
        arguments = 3, True, [1057.0, 1.0, 1.0], state
        structure.resting_forces(*arguments, z, p, on, forces)
        layer = forces[0] + structure.resting_contact(*arguments, 0.0, z, p, on)
        for law in LAWS:
            inside = force_at(law, x=0.008, v=0.02, values=values, effects=[effect.name])
            assert inside - force_at(law, x=0.008, v=0.02) == pytest.approx(layer, rel=1e-12)


# -- in a building


SINE = 'kind = "sine", amplitude = 3.0, frequency = 1.5'
HELD = '"damper.holding_force" = "structure.holding_force"\n'
STOP = '"end_stop.on" = true, "end_stop.clearance" = 0.004, "end_stop.k" = 4e3, "end_stop.c" = 20.0'
RUBS = '"base_friction.on" = true, "base_friction.limit" = 0.8'
PEAK = "structure.base_displacement"


def simulated(tmp_path, name, engine="compiled", step=0.0005, **text):
    file = tmp_path / f"{name}.toml"
    inside = text.pop("inside", "")
    given = "voltage = 1.0, moving_mass = 1.96935633694460" + (inside and f", {inside}")
    texts = {"structure": "", "damper": "LuGreDamper", "step": step, **text}
    house = HOUSE.format(stop=3.0, ground=SINE, parameters=given, **texts)
    file.write_text(house + HELD, encoding="utf-8")
    return bristle.run(file, engine=engine)


@pytest.mark.parametrize(("effect", "least"), [(STOP, 0.05), (RUBS, 0.05)], ids=["stop", "rubs"])
@pytest.mark.parametrize(
    # A second: the other kind of law.
    "damper",
    [pytest.param("LuGreDamper", marks=pytest.mark.slow), "BinghamDamper"],
)
def test_in_the_layer_and_in_the_damper_a_building_moves_alike(
    tmp_path, damper: str, effect: str, least: float
) -> None:
    plain = simulated(tmp_path, "plain", damper=damper)[PEAK]
    layer = simulated(tmp_path, "layer", damper=damper, structure=effect)[PEAK]
    inside = simulated(tmp_path, "inside", damper=damper, inside=effect)[PEAK]
    size = float(np.sqrt(np.mean(layer**2)))
    assert float(np.sqrt(np.mean((inside - layer) ** 2))) < 0.01 * size
    assert float(np.sqrt(np.mean((plain - layer) ** 2))) > least * size


@pytest.mark.parametrize(
    # A second: the other kind of law.
    "damper",
    ["LuGreDamper", pytest.param("BinghamDamper", marks=pytest.mark.slow)],
)
def test_fmu_and_coupled_engine_agree(tmp_path, damper: str) -> None:
    inside = f'{STOP}, {RUBS}, "duffing.on" = true'
    found = [
        simulated(tmp_path, engine, engine, 2e-4, damper=damper, inside=inside)
        for engine in ("fmu", "compiled")
    ]
    for column in (PEAK, "damper.force"):
        one, other = (frame[column].to_numpy() for frame in found)
        assert np.sqrt(np.mean((one - other) ** 2)) < 0.02 * np.sqrt(np.mean(other**2)), column


def test_compiled_and_plain_python_agree() -> None:
    from bristle.identification.histories import DamperForces as Fast

    t = 0.002 * np.arange(300)
    x, v, a = 0.009 * np.sin(9.0 * t), 0.081 * np.cos(9.0 * t), -0.729 * np.sin(9.0 * t)
    values = {**SHORT, "base_friction.x_s": 5e-4}
    for law in LAWS:
        names = [effect.name for effect in SHARED if effect.joins(CLASSES[law])]
        fast = Fast(law, names).force(x, v, a, np.full(300, 2.0), 0.002, values)
        first = {"x": x[0], "v": v[0], "V": 2.0}
        begin = {f"{state}_0": first[signal] for state, signal in CLASSES[law].starts.items()}
        slow = Bench(law, {**values, **begin}, names)
        slow.last = x[0], v[0], 2.0
        assert fast[0] == pytest.approx(slow.model.force(x[0], v[0], a[0], 2.0, 1.0, 0, 0, False))
        for k in range(1, 300):
            force = slow.move(x[k], v[k], 2.0, 0.002)
            assert fast[k] == pytest.approx(force, rel=1e-9, abs=1e-9), (law, k)


def test_a_late_effect_of_several_sites_is_generated_for_each() -> None:
    class SecondPath(Effect):
        """Second path: a spring beside the damper or the layer. Leaves out its damping."""

        name = "second_path"
        sites = ("damper", "structure")
        needs = ("x",)
        source = "a test (2026)"
        expect = "a force in phase with displacement at any voltage"
        parameters = {"k": Parameter(50.0, "N/m", (0.0, 1e6), "stiffness")}  # noqa: RUF012

        @staticmethod
        def force(q, z, p):  # type: ignore[no-untyped-def]
            return p.k * q.x

    try:
        inside = force_at("bingham", x=0.01, effects=["second_path"])
        assert inside == pytest.approx(0.5)
        assert "second_path.k" in structure.functions_of(["second_path"]).slots.parameters
        assert EFFECTS["second_path@structure"].site == "structure"
        assert SecondPath.key("structure") == "second_path@structure"
    finally:
        del EFFECTS["second_path"]
    assert "second_path.k" not in damper.LIBRARY.slots.parameters
    assert "second_path.k" not in SLOTS.parameters

"""What holds for every registered effect, none excluded."""

from __future__ import annotations

import ast
import inspect
import textwrap
from functools import cache
from math import isfinite, sin
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from rigs import HOUSE, LAWS, NO_LAW, Bench, loop_energy, sine

from bristle import units
from bristle.component.structure import StructureModel
from bristle.engine.run import run
from bristle.errors import ScenarioError
from bristle.fmu.catalogue import component_of_law
from bristle.physics.building import paper_building
from bristle.physics.effect import EFFECTS, HOOKS, SITES, Effect, Q, effects_of, laws_joined
from bristle.system.scenario import load_scenario
from bristle.user_code.conformance import examine

LIBRARY = {
    "damper": (
        "stribeck", "flattening", "presliding", "gas_spring", "coil_lag", "remanence",
        "saturation", "temperature", "backlash", "mount_compliance", "quadratic_damping",
        "fluid_inertia", "asymmetry", "base_friction", "duffing", "end_stop",
        "measured_temperature",
    ),
    "structure": ("base_friction", "duffing", "storey_softening", "end_stop"),
    "sensor": ("delay", "velocity_sensor"),
}  # fmt: skip
ALL = [EFFECTS[name] for name in sorted(EFFECTS)]
USUAL = {"lugre", "isolator"}


def _usual(effect: type[Effect]) -> set[str]:
    joined = laws_joined(effect)
    return {"bingham", "lugre"} & {*joined} or {joined[0]}


def _first(effect: type[Effect]) -> set[str]:
    """Return one law: alone, an effect acts with the parameters of the law at zero."""
    return {min(_usual(effect))}


def _played(effect: type[Effect]) -> int:
    return len(laws_joined(effect)) * len(effect.parameters)


each_effect = pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
each_damper_effect = pytest.mark.parametrize(
    ("effect", "law"),
    [(e, law) for e in ALL if "damper" in e.sites for law in laws_joined(e)],
    ids=lambda value: getattr(value, "name", value),
)
each_structure_effect = pytest.mark.parametrize(
    "effect", [e for e in ALL if "structure" in e.sites], ids=lambda e: e.name
)


def parameter_sets(effect: type[Effect], count: int) -> list[dict[str, float]]:
    """Return the defaults and sets drawn from the bounds, by decades where they span many."""
    random = np.random.default_rng(crc32(effect.name.encode()))
    sets: list[dict[str, float]] = [{}]
    for _ in range(count):
        drawn = {}
        for name, parameter in effect.parameters.items():
            low, high = parameter.bounds
            share = random.random()
            if low > 0.0 and high > 100.0 * low:
                value = low * (high / low) ** share
            else:
                value = low + (high - low) * share
            drawn[f"{effect.name}.{name}"] = float(value)
        sets.append(drawn)
    return sets


def names_read(effect: type[Effect]) -> tuple[set[str], set[str], set[str]]:
    """Return which fields of q, z and p the hooks read, from their source."""
    read: tuple[set[str], set[str], set[str]] = (set(), set(), set())
    for function in effect.hooks().values():
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        arguments = [argument.arg for argument in tree.body[0].args.args]
        assert len(arguments) == 3, f"{effect.name}: a hook takes q, z, p"
        for node in ast.walk(tree):
            named = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
            if named and node.value.id in arguments:
                read[arguments.index(node.value.id)].add(node.attr)
            slot = isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
            if slot and node.value.id == arguments[1]:  # a ring: all of its slots
                read[1].update(effect.states)
    return read


@pytest.mark.parametrize(
    "effect",
    [
        # Every bound with every law is played: more than three seconds where there are many.
        pytest.param(e, marks=pytest.mark.slow if _played(e) > 16 else ())
        for e in ALL
    ],
    ids=lambda e: e.name,
)
def test_it_is_all_that_is_asked_of_a_users_own(effect: type[Effect]) -> None:
    assert [check for check in examine(effect) if not check.holds] == []


# -- class data


def test_the_library_has_not_lost_an_effect() -> None:
    for site, names in LIBRARY.items():
        assert set(names) <= {effect.name for effect in effects_of(site)}


@each_effect
def test_its_class_data_are_whole(effect: type[Effect]) -> None:
    assert effect.__module__.rsplit(".", 1)[-1] == effect.name
    assert EFFECTS[effect.name] is effect
    assert set(effect.sites) <= set(SITES)
    assert effect.site == effect.sites[0]
    assert set(laws_joined(effect)) <= set(LAWS)
    assert bool(laws_joined(effect)) == ("damper" in effect.sites)
    assert effect.name not in effect.excludes
    spelled = [parameter.unit for parameter in effect.parameters.values()]
    spelled += effect.states.values()
    assert [units.canonical(unit) for unit in spelled] == spelled
    assert effect.parameters
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        assert isfinite(low), name
        assert isfinite(high), name
        assert low < high, name
        assert low <= parameter.value <= high, name
        assert parameter.text == parameter.text.strip(), name
        assert parameter.text, name
    assert len(effect.first_line()) <= 100
    assert not effect.expect.endswith(".")


@each_effect
def test_its_hooks_are_pure_functions_in_order_that_read_what_it_says(effect: type[Effect]) -> None:
    q, z, p = names_read(effect)
    assert q == set(effect.needs)
    assert z == set(effect.states)
    assert p == set(effect.parameters)
    hooks = effect.hooks()
    assert list(hooks) == [hook for hook in HOOKS if hook in hooks]
    for hook, function in hooks.items():
        assert isinstance(inspect.getattr_static(effect, hook), staticmethod), hook
        assert function.__closure__ is None, hook


@each_effect
def test_hooks_return_as_many_values_as_they_must(effect: type[Effect]) -> None:
    q = Q(*(0.01 * (i + 1) for i in range(len(Q._fields))))
    z = effect.State(*(0.001 for _ in effect.states))
    p = effect.values_of({})
    counts = {"rate": len(effect.states), "advance": len(effect.states), "motion": 2}
    for hook, function in effect.hooks().items():
        returned = function(q, z, p)
        assert function(q, z, p) == returned, hook
        if hook in counts:
            assert isinstance(returned, tuple), hook
            assert len(returned) == counts[hook], hook
        else:
            returned = (returned,)
        assert all(isinstance(value, float) and isfinite(value) for value in returned), hook


# -- at rest


@each_damper_effect
def test_at_rest_it_stays_at_rest(effect: type[Effect], law: str) -> None:
    bench = Bench(law, effects=[effect.name])
    still = np.arange(50) * 0.002
    force = bench.play(lambda _t: (0.0, 0.0), 0.0, still)
    assert np.abs(force).max() <= 1e-12


# -- energy


@pytest.mark.parametrize(
    ("effect", "law", "alone"),
    [
        # A quarter of a second each, hundreds of pairs: by default each effect with its usual laws.
        pytest.param(
            effect, law, alone, id=f"{effect.name}-{law}-{'alone' if alone else 'with the law'}",
            marks=() if law in (_first(effect) if alone else _usual(effect)) else pytest.mark.slow,
        )
        for effect in ALL
        if "damper" in effect.sites and effect.passive
        for law in laws_joined(effect)
        for alone in (False, True)
    ],
)  # fmt: skip
def test_closed_cycles_never_yield_energy(effect: type[Effect], law: str, alone: bool) -> None:
    base = NO_LAW[law] if alone else {}
    steps = 200
    for amplitude, frequency, V in ((0.001, 8.0, 6.0), (0.015, 8.0, 0.0), (0.015, 0.5, 6.0)):
        dt = 1.0 / (frequency * steps)
        times = dt * np.arange(3 * steps + 1)
        motion = sine(amplitude, frequency, middle=0.003)
        v = np.array([motion(t)[1] for t in times])
        for values in parameter_sets(effect, 1):
            bench = Bench(law, {**base, **values}, [effect.name])
            force = bench.play(motion, V, times)
            last = slice(2 * steps, None)
            work = loop_energy(force[last], v[last], dt)
            scale = amplitude * max(1e-9, float(np.abs(force).max()))
            assert work >= -1e-6 * scale, (amplitude, frequency, V, values)


@each_structure_effect
def test_closed_drifts_never_yield_energy(effect: type[Effect]) -> None:
    if not effect.passive:
        pytest.skip("it may feed energy")
    building, steps = paper_building(), 400
    M, C, K = (np.array(matrix) for matrix in (building.M, building.C, building.K))
    for values in parameter_sets(effect, 5):
        model = StructureModel(building, values, [effect.name])
        work = scale = 0.0
        for k in range(steps):
            angles = 2.0 * np.pi * k / steps + np.arange(3)
            q, v = 0.004 * np.sin(angles), 0.004 * np.cos(angles)
            model.x = [*q.tolist(), *v.tolist()]
            model.settle()
            added = -M @ model.absolute_accelerations(0.0) - K @ q - C @ v
            work += added @ v
            scale += np.abs(added) @ np.abs(v)
        assert work >= -1e-9 * max(scale, 1e-4)


PLAYED = 0.002 * np.arange(300)
"""Times [s] at which a law is played with an effect and without it."""


@cache
def plain(law: str, amplitude: float, moved: bool = False) -> np.ndarray:
    """Return the forces of a law alone, at 4 V or under a voltage that moves."""
    return Bench(law).play(sine(amplitude, 2.0), voltage if moved else 4.0, PLAYED)


def voltage(t: float) -> float:
    return 4.0 + 3.0 * sin(9.0 * t)


@each_damper_effect
def test_switched_off_it_leaves_no_trace(effect: type[Effect], law: str) -> None:
    for values in parameter_sets(effect, 3):
        found = Bench(law, values).play(sine(0.01, 2.0), 4.0, PLAYED[:100])
        np.testing.assert_array_equal(found, plain(law, 0.01)[:100])


@each_damper_effect
def test_switched_on_it_matters(effect: type[Effect], law: str) -> None:
    changes = []
    for amplitude in (0.01, 0.03):  # a stop may not be met by the smaller one
        alone = plain(law, amplitude, moved=True)
        seen = Bench(law, {}, [effect.name]).play(sine(amplitude, 2.0), voltage, PLAYED)
        changes.append(np.sqrt(np.mean((seen - alone) ** 2)) / np.sqrt(np.mean(alone**2)))
    assert max(changes) > 0.01


# -- in a scenario

PULSE = 'kind = "half_sine", amplitude = 2.0, duration = 0.2'


def spelled(effects: list[type[Effect]]) -> str:
    given = {f"{effect.name}.on": "true" for effect in effects}
    for effect in effects:
        for name, parameter in effect.parameters.items():
            given[f"{effect.name}.{name}"] = repr(parameter.value)
    return ", ".join(f'"{name}" = {value}' for name, value in given.items())


@pytest.mark.parametrize(
    ("damper", "law"),
    [
        # Up to a second each: the laws differ in nothing that a scenario says of effects.
        pytest.param(component_of_law(law), law, marks=() if law in USUAL else pytest.mark.slow)
        for law in LAWS
    ],
)
def test_a_scenario_can_switch_every_effect_on(damper: str, law: str, tmp_path: Path) -> None:
    joined = [effect for effect in effects_of("damper", law) if effect.name != "backlash"]
    file = tmp_path / "all.toml"
    text = {
        "stop": 0.1, "step": 0.002, "ground": PULSE, "damper": damper,
        "structure": spelled(list(effects_of("structure"))),
        "parameters": f"voltage = 4.0, {spelled(joined)}",
    }  # fmt: skip
    file.write_text(HOUSE.format(**text), encoding="utf-8")
    loaded = {component.name: component for component in load_scenario(file).components.values()}
    for effect in joined:
        assert loaded["damper"].values[f"{effect.name}.on"] is True
        for name in effect.parameters:
            assert f"{effect.name}.{name}" in loaded["damper"].values
    frames = [run(file), run(file, {f"damper.{effect.name}.on": False for effect in joined})]
    assert (frames[0]["damper.force"] != frames[1]["damper.force"]).any()
    with pytest.raises(ScenarioError, match=f"{joined[0].name}"):
        load_scenario(file, {f"damper.{joined[0].name}.colour": 1.0})

"""A third law, defined here alone: everything that asks for laws finds it, with no other edit."""

from __future__ import annotations

from collections.abc import Iterator
from math import tanh
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import Bench, force_at

from bristle.errors import PhysicsError
from bristle.fmu import catalogue
from bristle.fmu.controller import invertible
from bristle.identification.fit import fit_from_starts
from bristle.identification.histories import DamperForces as CompiledBench
from bristle.identification.problem import Problem, Run
from bristle.identification.starts import start_models
from bristle.model.model import Model, new_model
from bristle.model.model_file import model_text, read_model
from bristle.physics import damper
from bristle.physics.command import Linear
from bristle.physics.effect import EFFECTS, Effect, effects_of, laws_joined
from bristle.physics.law import Law, Shape, forget_law
from bristle.physics.laws import LAWS, law_code, law_names, laws_of
from bristle.physics.parameter import Parameter

DT = 2e-3


def hyperbolic(**class_data: Any) -> type[Law]:
    """Define a law whose yield force builds up with speed; class data may be changed."""

    class Hyperbolic(Law):
        """Hyperbolic damper: f = (f_c + f_v V) tanh(v/v_s) + c v + k x."""

        name = "hyperbolic"
        parts = ("yield", "viscous", "spring")
        contains = ("spring",)
        source = "Kwok, Ha, Nguyen, Li & Samali (2006), Sens. Actuators A 132(2), 441-451"
        parameters = {
            "f_c": Parameter(2.0, "N", (0.0, 1e5), "yield force without voltage"),
            "f_v": Parameter(1.0, "N/V", (0.0, 1e5), "yield force per volt"),
            "c": Parameter(40.0, "N.s/m", (0.0, 1e7), "viscous coefficient"),
            "k": Parameter(60.0, "N/m", (0.0, 1e7), "stiffness of the accumulator"),
            "v_s": Parameter(0.02, "m/s", (1e-4, 1e2), "speed over which it builds up"),
        }
        command = {"yield_force": Linear("f_c", "f_v")}
        shapes = {"v_s": Shape(0.02, 5.0, 13, ("f_c", "f_v"))}

        @staticmethod
        def yielding(q, z, p):
            return p.yield_force * tanh(q.v / p.v_s)

        @staticmethod
        def viscous(q, z, p):
            return p.c * q.v

        @staticmethod
        def elastic(q, z, p):
            return p.k * q.x

    return type("Hyperbolic", (Hyperbolic,), class_data) if class_data else Hyperbolic


def lagging() -> type[Law]:
    """Define a law whose yield force lags behind, and moves by its rate alone."""

    class Lagging(Law):
        """Lagging damper: f = (f_c + f_v V) s, t_0 s' = tanh(v/v_s) - s."""

        name = "lagging"
        parts = ("yield",)
        source = "made for this test, 2026"
        states = {"share": "1"}
        parameters = {
            "f_c": Parameter(2.0, "N", (0.0, 1e5), "yield force without voltage"),
            "f_v": Parameter(1.0, "N/V", (0.0, 1e5), "yield force per volt"),
            "v_s": Parameter(0.02, "m/s", (1e-4, 1e2), "speed over which it builds up"),
            "t_0": Parameter(0.01, "s", (1e-4, 1.0), "time of the lag"),
        }
        command = {"yield_force": Linear("f_c", "f_v")}
        shapes = {
            "v_s": Shape(0.02, 5.0, 5, ("f_c", "f_v")),
            "t_0": Shape(0.05, 2.0, 5, ("f_c", "f_v")),
        }

        @staticmethod
        def yielding(q, z, p):
            return p.yield_force * z.share

        @staticmethod
        def rate(q, z, p):
            return ((tanh(q.v / p.v_s) - z.share) / p.t_0,)

    return Lagging


@pytest.fixture
def law() -> Iterator[type[Law]]:
    found = hyperbolic()
    yield found
    forget_law(found)


@pytest.fixture
def slow_law() -> Iterator[type[Law]]:
    found = lagging()
    yield found
    forget_law(found)


def motion(count: int = 1500) -> tuple[np.ndarray, ...]:
    t = np.arange(count) * DT
    x = 0.006 * np.sin(9.0 * t) + 0.002 * np.sin(31.0 * t)
    v = 0.054 * np.cos(9.0 * t) + 0.062 * np.cos(31.0 * t)
    a = -0.486 * np.sin(9.0 * t) - 1.922 * np.sin(31.0 * t)
    return x, v, a, 4.0 + 3.0 * np.sin(2.0 * t)


def problem(law: str, values: dict[str, float], effects: list[str]) -> Problem:
    x, v, a, V = motion()
    force = CompiledBench(law, effects).force(x, v, a, V, DT, values)
    rng = np.random.default_rng(5)
    noisy = force + 0.02 * rng.standard_normal(len(x))
    draws = np.zeros((4, len(x), 4))
    return Problem([Run("made", DT, x, v, a, V, noisy, 0.02, draws)])


def test_it_is_known_to_all_that_lists_laws(law: type[Law]) -> None:
    assert LAWS["hyperbolic"] is law
    assert "hyperbolic" in law_names()
    assert law_names()[-2:] == ("bingham_standard", "lugre_standard")
    assert law_code("hyperbolic") == len(laws_of("damper")) - 1
    assert law.seen() == ("yield_force", "c", "k", "v_s")
    assert law.linear() == ("f_c", "f_v", "c", "k")
    assert law.driven() == ("f_v",)
    assert law.yield_parameters() == ("f_c", "f_v")


def test_its_force_is_its_formula(law: type[Law]) -> None:
    expected = (2.0 + 4.0) * tanh(0.03 / 0.02) + 40.0 * 0.03 + 60.0 * 0.004
    assert force_at("hyperbolic", x=0.004, v=0.03, V=4.0) == pytest.approx(expected, rel=1e-15)
    assert law.sliding_force({}, 0.03, 4.0) == pytest.approx((6.0 * tanh(1.5), 1.2))
    assert law.slopes_at_rest({}, 4.0) == pytest.approx((6.0 / 0.02 + 40.0, 60.0), rel=1e-9)


def test_effects_join_it_by_its_parts(law: type[Law]) -> None:
    joined = {effect.name for effect in effects_of("damper", "hyperbolic")}
    assert {"stribeck", "temperature", "coil_lag", "flattening", "mount_compliance"} <= joined
    assert "presliding" not in joined, "it turns a force that jumps with direction"
    assert "gas_spring" not in joined, "the law has a spring in it"
    assert laws_joined(EFFECTS["presliding"]) == ("bingham",)
    assert laws_joined(EFFECTS["gas_spring"]) == (
        "bingham", "dahl", "fluid_viscous", "lugre",
    )  # fmt: skip


def test_an_effect_that_names_laws_is_refused() -> None:
    with pytest.raises(PhysicsError, match="its hooks decide which laws it joins"):

        class Named(Effect):
            """Named."""

            name = "named"
            site = "damper"
            laws = ("lugre",)

            @staticmethod
            def force(q, z, p):
                return 0.0


@pytest.mark.parametrize(
    "effects",
    [
        [],
        *(
            pytest.param([effect], marks=pytest.mark.slow)  # compiles every effect with the laws
            for effect in ("stribeck", "coil_lag", "mount_compliance", "temperature")
        ),
    ],
)
# A law with a state is compiled and fitted.
@pytest.mark.parametrize("name", ["hyperbolic", pytest.param("lagging", marks=pytest.mark.slow)])
def test_python_and_numba_agree(
    law: type[Law], slow_law: type[Law], name: str, effects: list[str]
) -> None:
    if name == "lagging" and effects == ["mount_compliance"]:
        assert not EFFECTS["mount_compliance"].joins(slow_law), "it advances a law exactly"
        return
    x, v, a, V = motion(200)
    compiled = CompiledBench(name, effects).force(x, v, a, V, DT, {})
    plain = Bench(name, {}, effects)
    begin = {f"{e}.voltage_0": float(V[0]) for e in effects}
    functions = plain.model.functions
    plain.model.z = damper.start_states(name, begin, functions.slots)
    for effect in effects:
        for state, signal in EFFECTS[effect].starts.items():
            assert signal == "V"
            plain.model.z[functions.slots.states[f"{effect}.{state}"]] = float(V[0])
    setup, work, energy = plain.model.setup, [0.0] * damper.room(len(plain.model.z)), 0.0
    before, last, z = None, 0.0, plain.model.z
    for k in range(200):
        now = damper.Inputs(*(float(s[k]) for s in (x, v, a, V)), DT, energy, 0.0, False)
        if before is None:
            force = functions.made["evaluate"](setup, now, z, list(z), list(z))[0]
        else:
            end = [0.0] * len(z)
            begin = before._replace(energy=energy)
            force, z = functions.link(damper.step)(setup, begin, now, z, end, work)[0], end
            energy += 0.5 * DT * (last * before.v + force * now.v)
        assert force == pytest.approx(compiled[k], rel=1e-10, abs=1e-10)
        before, last = now, force


def test_a_law_that_moves_by_its_rate_lags_as_it_says(slow_law: type[Law]) -> None:
    model = damper.DamperModel("lagging", {"t_0": 0.05})
    assert model.setup.active
    assert model.setup.n_moving == 1
    for _ in range(100):
        force = model.step(0.0, 0.1, 0.0, 4.0, 5e-4, 0.0, 0.0, False)
    assert force == pytest.approx(6.0 * tanh(5.0) * (1.0 - np.exp(-1.0)), rel=1e-4)


def test_fits_find_its_parameters(law: type[Law], slow_law: type[Law]) -> None:
    """Both laws are there, so that what was compiled for them serves here as well."""
    truth = {"f_c": 1.2, "f_v": 0.6, "c": 25.0, "k": 110.0, "v_s": 0.03}
    made = problem("hyperbolic", truth, [])
    starts = start_models(made, Model("hyperbolic"), 3)
    assert len(starts) == 3
    assert all(start.bounds(n)[0] <= start.value(n) <= start.bounds(n)[1]
               for start in starts for n in truth)  # fmt: skip
    assert starts[0].value("v_s") == pytest.approx(0.03, rel=0.4)
    found = fit_from_starts(made, Model("hyperbolic"))
    for name, value in truth.items():
        assert found.model.value(name) == pytest.approx(value, abs=5.0 * found.std[name])


def test_its_model_is_written_and_read(law: type[Law], tmp_path: Path) -> None:
    model = new_model("hyperbolic", ("stribeck",))
    path = tmp_path / "model.toml"
    path.write_text(model_text(model))
    assert read_model(path) == model


def test_controllers_offer_the_inverses_of_the_library_alone(law: type[Law]) -> None:
    assert law.affine()
    names = [one.name for one in invertible()]
    assert names == ["lugre", "bingham", "bouc_wen", "dahl", "tanh"]
    ports = catalogue.describe("HinfInverse").variables
    assert {"tanh.f_c", "tanh.v_s"} <= set(ports)
    assert ports["inverse"].start == "lugre"


@pytest.mark.parametrize(
    ("class_data", "said"),
    [
        ({"name": "one two"}, "one word"),
        ({"name": "other", "site": "ship"}, "site"),
        ({"name": "other", "parts": ("yield",)}, "must name"),
        ({"name": "other", "parts": ("charm",)}, "charm"),
        ({"name": "other", "command": {"c": Linear("f_c", "f_v")}}, "quantity and a parameter"),
        ({"name": "other", "command": {"y": Linear("f_c", "f_w")}}, "f_w"),
        ({"name": "other", "shapes": {"v_x": Shape(0.1, 1.0, 2, ())}}, "v_x"),
        ({"name": "other", "states": {"z": "m"}}, "no `rate`"),
        ({"name": "bingham"}, "taken"),
    ],
)
def test_a_law_that_could_not_work_is_refused(
    law: type[Law], class_data: dict[str, Any], said: str
) -> None:
    before = dict(LAWS)
    with pytest.raises(PhysicsError, match=said):
        type("Wrong", (law,), {"__doc__": "Wrong: on purpose.", **class_data})
    assert before == LAWS

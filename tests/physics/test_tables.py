"""Tables in an effect and in a law, both defined here: the same numbers wherever they are used."""

from __future__ import annotations

from collections.abc import Iterator
from math import tanh
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import force_at

from bristle.errors import PhysicsError, StudyError
from bristle.fmu import catalogue
from bristle.identification.fit import fit_from_starts
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.identification.starts import start_models
from bristle.model.model import Model, new_model
from bristle.model.model_file import model_text, read_model
from bristle.physics import damper
from bristle.physics.command import Linear, Monotone, Quadratic
from bristle.physics.effect import EFFECTS, Effect
from bristle.physics.law import Law, Shape, forget_law
from bristle.physics.parameter import Parameter, Table, climb, interpolate
from bristle.synthesis.design_file import damper_from_model
from bristle.user_code import load
from bristle.user_code.conformance import examine

DT = 2e-3
KNOTS = (-0.01, 0.0, 0.005, 0.01)  # m
VOLTS = (0.0, 2.0, 5.0, 8.0)


def sloped() -> type[Effect]:
    class Sloped(Effect):
        """Sloped: a spring whose force is a curve along the displacement.

        Leaves out speed: doubt it when the loop of the spring itself has area.
        """

        name = "sloped"
        needs = ("x",)
        passive = True
        zero_at_rest = True
        source = "made for this test, 2026"
        expect = "a force in phase with displacement, whatever the voltage"
        parameters = {"scale": Parameter(2.0, "1", (0.1, 10.0), "size of all")}
        tables = {
            "curve": Table(KNOTS, (-0.6, 0.0, 0.3, 1.2), "N", (-50.0, 50.0), "force of the spring")
        }

        @staticmethod
        def force(q, z, p):
            return p.scale * (interpolate(q.x, KNOTS, p.curve) - interpolate(0.0, KNOTS, p.curve))

    return Sloped


def mapped() -> type[Law]:
    class Mapped(Law):
        """Mapped damper: f = Y(V) tanh(v/v_s) + (c + c_1 V + c_2 V^2) v, Y climbs over a table."""

        name = "mapped"
        parts = ("yield", "viscous")
        source = "made for this test, 2026"
        parameters = {
            "c": Parameter(40.0, "N.s/m", (0.0, 1e7), "viscous coefficient"),
            "c_1": Parameter(6.0, "N.s/(m.V)", (0.0, 1e7), "its growth"),
            "c_2": Parameter(0.5, "N.s/(m.V2)", (0.0, 1e7), "its bend"),
            "v_s": Parameter(0.02, "m/s", (1e-4, 1e2), "speed over which the yield force grows"),
        }
        tables = {"map": Table(VOLTS, (2.0, 3.0, 1.0, 0.2), "N", (0.0, 1e5), "yield force, rises")}
        command = {"yield_force": Monotone("map"), "viscosity": Quadratic("c", "c_1", "c_2")}
        entries = tuple(f"map[{k}]" for k in range(1, 5))
        shapes = {"v_s": Shape(0.02, 5.0, 13, entries)}

        @staticmethod
        def yielding(q, z, p):
            return p.yield_force * tanh(q.v / p.v_s)

        @staticmethod
        def viscous(q, z, p):
            return p.viscosity * q.v

    return Mapped


@pytest.fixture
def effect() -> Iterator[type[Effect]]:
    found = sloped()
    yield found
    del EFFECTS[found.name]


@pytest.fixture
def law() -> Iterator[type[Law]]:
    found = mapped()
    yield found
    forget_law(found)


def motion(count: int = 1500) -> tuple[np.ndarray, ...]:
    t = np.arange(count) * DT
    x = 0.006 * np.sin(9.0 * t) + 0.003 * np.sin(31.0 * t)
    v = 0.054 * np.cos(9.0 * t) + 0.093 * np.cos(31.0 * t)
    a = -0.486 * np.sin(9.0 * t) - 2.883 * np.sin(31.0 * t)
    return x, v, a, 4.0 + 3.9 * np.sin(2.0 * t)


def problem(law: str, effects: list[str], values: dict[str, float]) -> Problem:
    x, v, a, V = motion()
    force = DamperForces(law, effects).force(x, v, a, V, DT, values)
    noisy = force + 0.01 * np.random.default_rng(3).standard_normal(len(x))
    return Problem([Run("made", DT, x, v, a, V, noisy, 0.01, np.zeros((4, len(x), 4)))])


# -- how a table is read


def test_interpolation_passes_through_its_knots_and_keeps_the_ends() -> None:
    values = (1.0, 3.0, 2.0, 7.0)
    assert [interpolate(x, KNOTS, values) for x in KNOTS] == list(values)
    assert interpolate(0.0025, KNOTS, values) == pytest.approx(2.5)
    assert (interpolate(-9.0, KNOTS, values), interpolate(9.0, KNOTS, values)) == (1.0, 7.0)
    some = np.linspace(-0.02, 0.02, 101)
    numpy = np.interp(some, KNOTS, values)
    assert [interpolate(x, KNOTS, values) for x in some.tolist()] == pytest.approx(numpy)


def test_a_climb_gains_each_rise_and_never_falls() -> None:
    rises = (2.0, 3.0, 0.0, 0.5)
    assert [climb(V, VOLTS, rises) for V in VOLTS] == pytest.approx([2.0, 5.0, 5.0, 5.5])
    found = [climb(V, VOLTS, rises) for V in np.linspace(-1.0, 10.0, 200).tolist()]
    assert found == sorted(found)
    assert found[-1] == 5.5


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (Table((0.0, 1.0, 1.0), (0.0, 0.0, 0.0), "N", (0.0, 1.0), "flat"), "ascending"),
        (Table((0.0, 1.0), (0.0, 0.0, 0.0), "N", (0.0, 1.0), "short"), "2 knots and 3 values"),
        (Table((0.0, 1.0), (0.0, 2.0), "N", (0.0, 1.0), "high"), r"curve\[2\] = 2.0 lies outside"),
    ],
)
def test_a_table_that_could_not_work_is_refused(table: Table, said: str) -> None:
    with pytest.raises(PhysicsError, match=said):
        type("Wrong", (Effect,), {
            "__doc__": "Wrong: on purpose.", "name": "wrong", "tables": {"curve": table},
            "force": staticmethod(lambda q, z, p: 0.0),
        })  # fmt: skip
    assert "wrong" not in EFFECTS


# -- an effect


def test_the_values_of_a_table_are_parameters_of_their_own(effect: type[Effect]) -> None:
    assert list(effect.parameters) == ["scale", "curve[1]", "curve[2]", "curve[3]", "curve[4]"]
    p = effect.values_of({"curve[3]": 0.9})
    assert (p.scale, p.curve) == (2.0, (-0.6, 0.0, 0.9, 1.2))
    values = {"sloped.curve[4]": 2.0}
    bare = force_at("bingham", x=0.0075, values=values)
    with_it = force_at("bingham", x=0.0075, values=values, effects=["sloped"])
    assert with_it - bare == pytest.approx(2.0 * 0.5 * (0.3 + 2.0), rel=1e-14)


@pytest.mark.slow  # 4 s: a learned curve is a table too, and is examined by default
def test_the_effect_conforms(effect: type[Effect]) -> None:
    failed = [check for check in examine(effect) if not check.holds]
    assert failed == []


def test_an_fmu_names_each_value(effect: type[Effect]) -> None:
    ports = catalogue.describe("LuGreDamper").variables
    assert ports["sloped.curve[4]"].start == 1.2
    assert ports["sloped.curve[4]"].unit == "N"
    slave = catalogue.instantiate("LuGreDamper")
    slave.set_boolean([slave._index["sloped.on"]], [True])
    slave.set_real([slave._index["sloped.curve[4]"], slave._index["displacement"]], [2.0, 0.0075])
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    assert slave["force"] == pytest.approx(2.3, rel=1e-12)


@pytest.mark.slow  # an own effect with a table is compiled and fitted
def test_a_fit_finds_a_curve(law: type[Law], effect: type[Effect]) -> None:
    # The law is there, so that what is compiled serves below as well.
    # The size of all is held: with it free the curve has one degree of freedom too many; and so is
    # the value at zero, to which the others are measured.
    truth = {f"sloped.curve[{k}]": v for k, v in enumerate((-2.0, 0.0, 0.4, 3.0), 1)}
    made = problem("bingham", ["sloped"], {**truth, "sloped.scale": 2.0})
    held = ("sloped.scale", "sloped.curve[2]")
    given = {"sloped.scale": 2.0, "sloped.curve[2]": 0.0}
    found = fit_from_starts(made, Model("bingham", ("sloped",), given, held), 2)
    for name, value in truth.items():
        if name not in held:
            assert found.model.value(name) == pytest.approx(value, abs=5.0 * found.std[name])
            assert found.std[name] < 0.1


def test_a_model_file_lists_a_curve(effect: type[Effect], tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    model = new_model("bingham", ("sloped",))
    model = model.with_values({"sloped.curve[2]": 0.1}, {"sloped.curve[2]": 0.02})
    path.write_text(model_text(model))
    assert "curve = [" in path.read_text()
    assert read_model(path) == model
    assert model_text(read_model(path), path) == path.read_text()
    assert damper_from_model(path).values["sloped.curve[2]"] == 0.1
    assert model.free()[-4:] == [f"sloped.curve[{k}]" for k in range(1, 5)]


def test_a_model_file_may_give_plain_numbers(effect: type[Effect], tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    head = 'schema = 1\nlaw = "bingham"\n\n[effects.sloped]\nparameters = '
    path.write_text(head + "{ curve = [-1.0, 0.0, { value = 500.0, unit = 'mN' }, 2.5] }\n")
    values = read_model(path).values
    assert [values[f"sloped.curve[{k}]"] for k in range(1, 5)] == [-1.0, 0.0, 0.5, 2.5]
    path.write_text(head + "{ curve = [-1.0, 0.0] }\n")
    with pytest.raises(StudyError, match=r":5: .*a list of 4 values"):
        read_model(path)
    path.write_text(head + "{ curve = [-1.0, 0.0, 99.0, 2.5] }\n")
    with pytest.raises(StudyError, match=r"curve\[3\] = 99 is outside -50 to 50"):
        read_model(path)


FILE = '''"""A spring by a curve."""

from bristle.physics.effect import Effect, Table, interpolate

KNOTS = (-0.02, 0.0, 0.02)


class Curved(Effect):
    """Curved: a spring by a curve.

    Leaves out speed.
    """

    name = "curved"
    needs = ("x",)
    source = "made for this test, 2026"
    expect = "a force in phase with displacement"
    tables = {"curve": Table(KNOTS, (-1.0, 0.0, 2.0), "N", (-50.0, 50.0), "force")}

    @staticmethod
    def force(q, z, p):
        return interpolate(q.x, KNOTS, p.curve)
'''


def test_a_file_of_a_users_own_may_have_a_table(tmp_path: Path) -> None:
    path = tmp_path / "curved.py"
    path.write_text(FILE)
    try:
        found = load.load_file(path)
        assert found.own
        known = damper.functions_of("bingham", ["curved"]).slots.parameters
        assert "curved.curve[3]" in known
        assert force_at("bingham", x=0.01, effects=["curved"]) == pytest.approx(1.0)
    finally:
        load.unload_effects()


# -- a law


def test_a_law_finds_its_quantities_at_the_voltage(law: type[Law]) -> None:
    p = law.at({}, 3.5)
    assert law.seen() == ("yield_force", "viscosity", "v_s")
    assert p.yield_force == pytest.approx(2.0 + 3.0 + 0.5)
    assert p.viscosity == pytest.approx(40.0 + 6.0 * 3.5 + 0.5 * 3.5**2)
    assert law.driven() == ("map[2]", "map[3]", "map[4]", "c_1", "c_2")
    assert not law.affine(), "controllers cannot invert it"
    assert law.yield_parameters() == tuple(f"map[{k}]" for k in range(1, 5))
    expected = 5.5 * tanh(1.5) + p.viscosity * 0.03
    assert force_at("mapped", v=0.03, V=3.5) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    "effects",
    [
        [],
        *(
            pytest.param([effect], marks=pytest.mark.slow)  # compiles every effect with the law
            for effect in ("stribeck", "coil_lag", "sloped")
        ),
    ],
)
def test_python_and_numba_agree(law: Any, effect: Any, effects: list[str]) -> None:
    x, v, a, V = motion(100)
    compiled = DamperForces("mapped", effects).force(x, v, a, V, DT, {"coil_lag.tau": 1e-4})
    for k in (0, 40, 99):
        if effects == ["coil_lag"] and k:
            continue  # it lags
        start = {f"coil_lag.{state}_0": float(V[k]) for state in ("voltage", "field")}
        model = damper.DamperModel("mapped", {**start, "coil_lag.tau": 1e-4}, effects)
        plain = model.force(*(float(s[k]) for s in (x, v, a, V)), DT, 0.0, 0.0, False)
        assert plain == pytest.approx(compiled[k], rel=1e-12)


def test_a_fit_finds_the_map(law: type[Law], effect: type[Effect], tmp_path: Path) -> None:
    truth = {"map[1]": 1.0, "map[2]": 2.0, "map[3]": 1.5, "map[4]": 0.5, "c": 30.0, "v_s": 0.03}
    made = problem("mapped", [], {**truth, "c_1": 4.0, "c_2": 0.3})
    start = start_models(made, Model("mapped"), 1)[0]
    assert start.value("map[2]") == pytest.approx(2.0, abs=0.7)
    found = fit_from_starts(made, Model("mapped"), starts=2)
    for name, value in truth.items():
        assert found.model.value(name) == pytest.approx(value, abs=5.0 * found.std[name])
    path = tmp_path / "model.toml"
    model = new_model("mapped").with_values(found.model.values, found.std)
    path.write_text(model_text(model))
    assert read_model(path) == model
    text = path.read_text()
    assert "map = [" in text


def test_linear_is_written_as_it_was() -> None:
    assert Linear("f_c", "f_v").source(lambda name: name, "") == "f_c + f_v * V"

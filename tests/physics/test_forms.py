"""A chosen form of the command: what it gives, for every law, in hooks and in generated code."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, ClassVar

import pytest
from rigs import Bench

from bristle import units
from bristle.errors import PhysicsError
from bristle.physics import damper
from bristle.physics.command import MOST_KNOTS, Constant, Linear, chosen_source, rising
from bristle.physics.damper import DamperModel
from bristle.physics.effect import effects_of
from bristle.physics.forms import choosable, joined_form, split_form
from bristle.physics.generate import generate
from bristle.physics.law import Law, base_and_variant, forget_law, law_code, law_names
from bristle.physics.laws import LAWS, laws_of
from bristle.physics.parameter import Parameter
from bristle.user_code.trial import cycle

NAMES = [law.name for law in laws_of("damper") if choosable(law)]  # others have a form of their own
KNOTS = (0.0, 1.5, 4.0)
LEVELS = (0.0, 0.7, 1.5, 2.0, 4.0)


def formed(name: str, form: str) -> type[Law]:
    return LAWS[joined_form(name, form, KNOTS if form == "table" else ())]


def forces(law: str, values: dict[str, float] | None = None, V: float = 2.0) -> list[float]:
    bench = Bench(law, values)
    out = []
    for k in range(1, 120):
        x, v = 6e-3 * math.sin(0.1 * k), 0.06 * math.cos(0.1 * k)
        out.append(bench.move(x, v, V, 0.01))
    return out


@pytest.mark.parametrize("name", NAMES)
def test_a_table_and_a_parabola_on_the_line_give_the_forces_of_the_line(name: str) -> None:
    for V in (0.7, 4.0):
        line = forces(name, V=V)
        assert forces(f"{name}[quadratic]", V=V) == line  # no bend: to the last bit
        assert forces(formed(name, "table").name, V=V) == pytest.approx(line, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("form", ["quadratic", "table"])
@pytest.mark.parametrize("name", NAMES)
def test_hooks_and_generated_code_agree_on_the_form(name: str, form: str) -> None:
    law = formed(name, form)
    values = {key: p.value for key, p in law.parameters.items()}
    for key in law.driven():  # a quarter off the line, all in bounds
        values[key] = 1.25 * values[key] if values[key] else -1e-3 * max(values.values())
    setup, slots = damper.setup_of(law.name, values, []), damper.LIBRARY.slots
    assert setup.law % 64 == law_code(name)
    for k, quantity in enumerate(law.command):
        for V in (*LEVELS, 9.0):
            code = generate(
                "quantity",
                "def quantity(form, p, V):\n"
                f"    return {chosen_source('0.0', slots.law_parameters, k, 'V')}",
                slots,
            )
            seen = code(setup.law // 64, setup.p, V)
            if quantity in choosable(law.base):
                assert seen == pytest.approx(getattr(law.at(values, V), quantity), rel=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_no_form_creates_energy(name: str) -> None:
    for form in ("quadratic", "table"):
        for V in (0.0, 2.0, 8.0):
            cycle(formed(name, form), {}, 0.006, 2.0, V)


def test_a_parabola_keeps_its_largest_value() -> None:
    values = [rising(1.0, 2.0, -0.1, 0.5 * k) for k in range(40)]
    assert all(a <= b for a, b in pairwise(values))
    assert values[20:] == [11.0] * 20
    assert rising(1.0, 2.0, 0.5, 3.0) == 1.0 + 6.0 + 4.5


def test_a_table_rises_between_its_knots_and_holds_beyond() -> None:
    law = formed("bingham", "table")
    values = {"yield_force[1]": 1.0, "yield_force[2]": 3.0, "yield_force[3]": 0.5}
    seen = [law.at(values, V).yield_force for V in (-1.0, 0.0, 0.75, 1.5, 2.75, 4.0, 9.0)]
    assert seen == pytest.approx([1.0, 1.0, 2.5, 4.0, 4.25, 4.5, 4.5])
    assert all(law.parameters[f"yield_force[{k}]"].bounds[0] == 0.0 for k in (1, 2, 3))
    assert "gains from 1.5 to 4 V" in law.parameters["yield_force[3]"].text


def test_the_lag_of_a_law_comes_before_its_form() -> None:
    name = "modified_bouc_wen[table 0 1 2]"
    gains = {"yield_force[2]": 5.0, "yield_force[3]": 0.0}
    slow = DamperModel(name, {**gains, "eta": 1.0, "command_0": 0.0})
    fast = DamperModel(name, {**gains, "eta": 1e3, "command_0": 0.0})
    for model in (slow, fast):
        for _ in range(100):
            force = model.step(0.0, 0.05, 0.0, 1.0, 1e-3, 0.0, 0.0, False)
        model.last = force
    assert slow.last < 0.8 * fast.last


@pytest.mark.parametrize("name", NAMES)
def test_every_law_has_the_forms_and_their_units_are_known(name: str) -> None:
    for form in ("quadratic", "table"):
        law = formed(name, form)
        assert law.Values._fields == law.base.Values._fields
        assert not law.affine()
        assert law.has("command")
        for parameter in law.parameters.values():
            assert units.canonical(parameter.unit) == parameter.unit
            assert parameter.bounds[0] <= parameter.value <= parameter.bounds[1]
        shaped = {n for shape in law.shapes.values() for n in shape.shapes} | set(law.shapes)
        assert shaped <= set(law.parameters)


def test_a_form_lists_as_no_law_of_its_own() -> None:
    formed("lugre", "quadratic")
    assert not [name for name in (*LAWS, *law_names()) if "[" in name]
    assert law_code("lugre[quadratic]") % 64 == law_code("lugre")


def test_variants_have_the_forms() -> None:
    law, variant = base_and_variant("bingham_standard[quadratic]")
    assert law is LAWS["bingham[quadratic]"]
    assert variant.values == base_and_variant("bingham_standard")[1].values


def test_an_effect_that_bends_the_command_is_not_offered_twice() -> None:
    plain = {effect.name for effect in effects_of("damper", "bingham")}
    bent = {effect.name for effect in effects_of("damper", "bingham[quadratic]")}
    assert plain - bent == {"saturation"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("bingham[cubic]", "no form 'cubic'"),
        ("bingham[table 0]", "2 to 6 knots"),
        ("bingham[table 0 2 1]", "ascending"),
        ("bingham[table 0 nan 2]", "ascending"),
        ("bingham[table 0 one]", "must be numbers"),
        ("bingham[quadratic 1]", "no knots"),
        (f"bingham[table {' '.join(map(str, range(MOST_KNOTS + 1)))}]", "2 to 6 knots"),
    ],
)
def test_a_wrong_form_is_refused(name: str, text: str) -> None:
    with pytest.raises(PhysicsError, match=text):
        base_and_variant(name)


def test_names_and_forms_go_together() -> None:
    assert split_form("lugre_standard[table 0 0.5 3]") == ("lugre_standard", "table", (0, 0.5, 3))
    assert split_form("lugre") == ("lugre", "", ())
    assert joined_form("lugre", "linear") == joined_form("lugre", "") == "lugre"
    with pytest.raises(KeyError):
        LAWS["nobody[quadratic]"]


class Own(Law):
    """A law of a user's own: a sign and a dashpot."""

    name = "own_of_forms"
    parts = ("yield", "sign", "viscous")
    source = "a test"
    parameters: ClassVar = {
        "a": Parameter(2.0, "N", (0.0, 1e3), "level"),
        "b": Parameter(1.0, "N/V", (0.0, 1e3), "slope"),
        "c": Parameter(50.0, "N.s/m", (0.0, 1e5), "damping"),
    }
    command: ClassVar = {"held": Linear("a", "b"), "drag": Constant("c")}

    @staticmethod
    def limit(q: Any, z: Any, p: Any) -> Any:
        return p.held

    @staticmethod
    def viscous(q: Any, z: Any, p: Any) -> Any:
        return p.drag * q.v


forget_law(Own)


@pytest.fixture
def own() -> Iterator[type[Law]]:
    LAWS[Own.name] = Own
    yield Own
    forget_law(Own)


def test_a_law_of_ones_own_has_the_forms(own: type[Law]) -> None:
    name = f"{own.name}[table 0 1 2]"
    assert list(LAWS[name].parameters) == ["held[1]", "held[2]", "held[3]", "c"]
    model = DamperModel(name, {"held[1]": 1.0, "held[2]": 0.0, "held[3]": 4.0, "c": 10.0})
    seen = [model.force(0.0, 0.1, 0.0, V, 1e-3, 0.0, 0.0, False) for V in (0.5, 1.0, 1.5, 3.0)]
    assert seen == pytest.approx([2.0, 2.0, 4.0, 6.0])
    bent = DamperModel(f"{own.name}[quadratic]", {"held_bend": 0.5})
    assert bent.force(0.0, 0.1, 0.0, 2.0, 1e-3, 0.0, 0.0, False) == pytest.approx(2 + 2 + 2 + 5)


def test_a_law_without_a_line_in_the_command_has_no_form(own: type[Law]) -> None:
    class Fixed(Own):
        """Nothing depends on the command."""

        name = "own_without_command"
        command: ClassVar = {"held": Constant("a"), "drag": Constant("c")}

    try:
        with pytest.raises(PhysicsError, match="no quantity that is linear in the command"):
            base_and_variant("own_without_command[quadratic]")
    finally:
        forget_law(Fixed)

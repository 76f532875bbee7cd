"""The equations of a model: what laws and effects state of themselves, with the model's numbers."""

import re

import pytest

from bristle.model.equations import equations, formulas, symbols
from bristle.model.model import Fact, Model
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import laws_of


def value(number: float, unit: str, std: float | None = None, free: bool = True) -> Fact:
    return Fact(number, unit, -1e9, 1e9, free, std, "identified")


def bingham(effect: dict[str, Fact] | None = None, **more) -> Model:
    facts = {
        "f_c": value(1.5, "N", 0.01), "f_v": value(0.75, "N/V", 0.002), "c_0": value(40.0, "N.s/m"),
        "c_v": value(5.0, "N.s/(m.V)", 0.5), "v_n": value(20.0, "mm/s", 1.0),
        "exponent": value(1.0, "1", free=False),
    }  # fmt: skip
    return Model("bingham", **more).with_facts({**facts, **(effect or {})})


def test_numbers_stand_in_place_of_names_in_si_with_their_intervals():
    (found,) = equations(bingham())
    assert found.formula == "f = (f_c + f_v V) sgn(v) + (c_0 + c_v V) v exp(-|v|/v_n)"
    assert found.numbers == ("f = (1.500 + 0.7500 V) sgn(v) + (40 + 5.00 V) v exp(-|v|/0.0200)")
    assert "(1.500 ± 0.020)" in found.intervals
    assert "/(0.0200 ± 0.0020)" in found.intervals  # mm/s in the model's file


def test_the_command_has_its_own_symbol_which_is_told_where_it_is_no_voltage():
    assert symbols(bingham(), equations(bingham())) == "In SI units."
    driven = bingham().with_drive("current")
    told = equations(driven)
    assert symbols(driven, told) == "In SI units; I is the current [A]."
    assert told[0].numbers.startswith("f = (1.500 + 0.7500 I) sgn(v) + (40 + 5.00 I) v ")
    assert not any(re.search(r"\bV\b", text) for text in told[0])
    assert symbols(driven, [one._replace(formula="f = k x") for one in told]) == "In SI units."


def test_effects_have_their_own_names_and_negative_numbers_their_brackets():
    spring = {
        "gas_spring.preload": value(-0.5, "N"), "gas_spring.k": value(150.0, "N/m"),
        "gas_spring.k_2": value(0.0, "N/m2"), "gas_spring.k_3": value(1e5, "N/m3"),
    }  # fmt: skip
    _, found = equations(bingham(spring, effects=("gas_spring",)))
    assert found.of == "gas_spring"
    assert found.numbers == "F = (-0.5) + 150 x + 0 x^2 + 100000 x^3"


def test_a_law_that_does_without_a_part_shows_no_formula_that_has_it():
    held = {"exponent": value(0.0, "1", free=False)}
    assert equations(bingham(held)) == []


def test_code_that_waits_for_consent_states_nothing():
    assert equations(bingham(only_shown=("bingham",))) == []


@pytest.mark.parametrize("known", [*laws_of(), *EFFECTS.values()], ids=lambda one: one.name)
def test_every_law_and_effect_states_a_formula_with_its_parameters(known):
    found = formulas(known.__doc__ or "")
    assert found
    names = " ".join(found)
    assert any(name in names for name in known.parameters)


def test_prose_of_a_docstring_is_no_formula():
    assert formulas("Two words: no sign.\n\n    Prose with a = b in it.\n") == []
    text = "A: it acts.\n\n        F = k x,   K the stiffness,   k = 2 N/m\n\n    Prose.\n"
    assert formulas(text) == ["F = k x", "k = 2 N/m"]

"""Formulas as MathML: well-formed and whole; what is no formula stays as it was typed."""

import re
from xml.etree import ElementTree

import pytest

from bristle.model.equations import formulas
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import laws_of
from bristle.view.formula import formula as formula_html


def tree(formula: str) -> ElementTree.Element:
    return ElementTree.fromstring(formula_html(formula))


def text(formula: str) -> str:
    return re.sub(r"\s", "", "".join(tree(formula).itertext()))


def test_fractions_powers_indices_and_greek_letters():
    found = formula_html("F = k_3 x^2/(2 L) + sigma_0 z'")
    assert "<mfrac>" in found
    assert "<msub><mi>σ</mi><mi>0</mi></msub>" in found  # noqa: RUF001
    assert "<mo>′</mo>" in found  # noqa: RUF001
    assert text("a/(b + c)") == "ab+c"  # a fraction needs no brackets


def test_bars_open_and_close():
    assert text("(s |v| z |z| + 1)") == "(s|v|z|z|+1)"
    assert formula_html("exp(-|v|/v_n)").count("<mo>|</mo>") == 2


def test_a_sign_before_a_digit_is_a_difference_behind_a_factor():
    assert text("x -1") == "x−1"  # noqa: RUF001
    assert "<mn>-3</mn>" in formula_html("(-3, 1)")


def test_numbers_with_intervals_and_powers_of_ten():
    assert text("(103.1 × 10³ ± 2.2 × 10³) x") == "(103.1×10³±2.2×10³)x"  # noqa: RUF001


@pytest.mark.parametrize("typed", ["with x_s: F = 1", "(a + b", "a +", "|x", "a ; b", ""])
def test_what_is_no_formula_stays_as_it_was_typed(typed):
    found = tree(typed)
    assert found.find("code") is not None
    assert "".join(found.itertext()) == typed


def test_markup_in_a_formula_is_escaped():
    assert "<b>" not in formula_html("<b>x</b> = 1")
    assert "<b>" not in formula_html("x < b > c")


def test_nearly_all_formulas_of_laws_and_effects_are_set():
    found = [one for known in (*laws_of(), *EFFECTS.values()) for one in formulas(known.__doc__)]
    typed = [one for one in found if "<code>" in formula_html(one)]
    assert typed == ["with x_s: F = limit mu m"]
    for one in found:
        tree(one)

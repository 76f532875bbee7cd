"""Units: spellings, factors with their source, dimensions as in FMI 2.0, and refusals."""

from __future__ import annotations

from math import isclose, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bristle import units
from bristle.errors import UnitError

SYMBOLS = ("m", "s", "A", "K", "mol", "rad", "Hz", "N", "Pa", "J", "W", "V", "Ohm", "kg", "cd")
SYMBOLS += ("mm", "kN", "mA", "us", "GPa", "deg", "g", "in", "ft", "lbf", "psi", "%", "min", "Gal")


def exponents(**base: int) -> tuple[int, ...]:
    return tuple(base.get(name, 0) for name in units.DIMENSIONS)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("N s/m", "N.s/m"),
        ("N·s/m", "N.s/m"),
        ("N*s/m", "N.s/m"),
        ("N s m^-1", "N.s/m"),
        ("N.s/m", "N.s/m"),
        ("m/s^2", "m/s2"),
        ("m/s**2", "m/s2"),
        ("m/s²", "m/s2"),
        ("m s⁻²", "m/s2"),
        ("m/s/s", "m/s2"),
        ("m / s2", "m/s2"),
        ("m s^(-2)", "m/s2"),
        ("N s/(m V)", "N.s/(m.V)"),
        ("N.s/m/V", "N.s/(m.V)"),
        ("1/s", "1/s"),
        ("s-1", "1/s"),
        ("m/m", "1"),
        ("", "1"),
        ("-", "1"),
        ("1", "1"),
        ("µm", "um"),
        ("\N{GREEK SMALL LETTER MU}m", "um"),
        ("\N{OHM SIGN}", "Ohm"),
        ("sec", "s"),
        ("°", "deg"),
        ("°C", "degC"),
    ],
)
def test_every_spelling_comes_out_in_one(text: str, name: str) -> None:
    assert units.canonical(text) == name


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        ("m/s2", 1.0, exponents(m=1, s=-2)),
        ("N.s/m", 1.0, exponents(kg=1, s=-1)),
        ("N.s/(m.V)", 1.0, exponents(m=-2, s=2, A=1)),
        ("kN", 1e3, exponents(kg=1, m=1, s=-2)),
        ("kN/mm", 1e6, exponents(kg=1, s=-2)),
        ("mm", 1e-3, exponents(m=1)),
        ("cm/s", 1e-2, exponents(m=1, s=-1)),
        ("mA", 1e-3, exponents(A=1)),
        ("V", 1.0, exponents(kg=1, m=2, s=-3, A=-1)),
        ("J", 1.0, exponents(kg=1, m=2, s=-2)),
        ("W", 1.0, exponents(kg=1, m=2, s=-3)),
        ("Pa", 1.0, exponents(kg=1, m=-1, s=-2)),
        ("Hz", 1.0, exponents(s=-1)),
        ("deg", pi / 180, exponents(rad=1)),
        ("%", 0.01, exponents()),
        # ISO 80000-3 (g); NIST SP 811 (2008), appendix B.8: in, lbf, psi (7 digits).
        ("g", 9.80665, exponents(m=1, s=-2)),
        ("in", 0.0254, exponents(m=1)),
        ("lbf", 4.4482216152605, exponents(kg=1, m=1, s=-2)),
        ("kgf", 9.80665, exponents(kg=1, m=1, s=-2)),
        ("daN", 10.0, exponents(kg=1, m=1, s=-2)),
        ("psi", pytest.approx(6894.757, rel=1e-7), exponents(kg=1, m=-1, s=-2)),
        ("Gal", 0.01, exponents(m=1, s=-2)),
    ],
)
def test_factor_and_dimension(text: str, factor: float, dimension: tuple[int, ...]) -> None:
    unit = units.parse(text)
    assert (unit.factor, unit.dimension, unit.offset) == (factor, dimension, 0.0)


def test_celsius_and_fahrenheit_have_an_offset_and_stand_alone() -> None:
    assert units.convert(20.0, "degC", "K") == pytest.approx(293.15)
    assert units.convert(293.15, "K", "degC") == pytest.approx(20.0)
    assert units.convert(212.0, "degF", "degC") == pytest.approx(100.0)
    assert units.convert(-40.0, "degC", "degF") == pytest.approx(-40.0)
    with pytest.raises(UnitError, match=r"degC in \"N/degC\".*In a product write K"):
        units.parse("N/degC")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("n", 'Did you mean "N"'),
        ("hz", 'Did you mean "Hz"'),
        ("lb", 'Did you mean "lbf"'),
        ("degc", 'Did you mean "degC"'),
        ("foo", "Examples: m/s2"),
        ("gram", "Mass is in kg"),
        ("Mg", "Mass is in kg"),
        ("N s/m V", "two ways"),
        ("m^0.5", "whole powers"),
        ("m0", "whole powers"),
        ("2 m", "whole powers"),
        ("(m.s)2", "whole powers"),
        ("m/s2)", r'at "\)"'),
        ("(m/s2", r'at "\("'),
        ("N/", "its end"),
        ("m..s", "at"),
        ("m9.m", "its powers"),
        ("m" * 1000, "1000 characters"),
        ("(" * 70, "cannot be read"),
        ("nm9/Gs9", "its powers"),
    ],
)
def test_what_cannot_be_read_is_refused(text: str, says: str) -> None:
    with pytest.raises(UnitError, match=says):
        units.parse(text)


def test_units_of_different_dimension_do_not_convert() -> None:
    assert not units.same_dimension("rad/s", "Hz")
    assert units.same_dimension("N", "kg.m/s2")
    with pytest.raises(UnitError, match=r'"N" \[kg.m/s2\] cannot become "m" \[m\]'):
        units.convert(1.0, "N", "m")
    with pytest.raises(UnitError, match="g is the acceleration of gravity"):
        units.convert(1.0, "g", "kg")


@st.composite
def unit_texts(draw: st.DrawFn, most: int = 2) -> str:
    """Products over products, in the spellings that people use."""
    dot = draw(st.sampled_from([".", " ", "·", "*", " . "]))
    power = st.sampled_from(["", "", "2", "^2", "**2", "²", "^-1", "-2", "⁻²"])
    factor = st.builds(str.__add__, st.sampled_from(SYMBOLS), power)
    over = draw(st.lists(factor, min_size=1, max_size=most))
    under = draw(st.lists(factor, max_size=most))
    text = dot.join(over)
    if under:
        text += "/" + (under[0] if len(under) == 1 else f"({dot.join(under)})")
    return text


@given(unit_texts())
def test_canonical_name_reads_back_as_the_same_unit(text: str) -> None:
    unit = units.parse(text)
    assert units.parse(unit.name) == unit
    assert " " not in unit.name
    assert "^" not in unit.name


@given(unit_texts(1), unit_texts(1))
def test_dimension_and_factor_of_a_quotient(first: str, second: str) -> None:
    one, two = units.parse(first), units.parse(second)
    quotient = units.parse(f"({first})/({second})")
    assert quotient.dimension == tuple(
        a - b for a, b in zip(one.dimension, two.dimension, strict=True)
    )
    assert isclose(quotient.factor, one.factor / two.factor, rel_tol=1e-13)


@given(st.floats(-1e9, 1e9), st.sampled_from([("mm", "in"), ("g", "m/s2"), ("degC", "K")]))
def test_there_and_back_is_the_same_value(value: float, pair: tuple[str, str]) -> None:
    there = units.convert(value, *pair)
    assert units.convert(there, *reversed(pair)) == pytest.approx(value, rel=1e-12, abs=1e-9)


def test_one_unit_to_itself_changes_nothing() -> None:
    assert units.convert(0.1, "g", "g") == 0.1
    assert units.convert(3.0, "mm", "m") == 0.003
    assert units.convert(0.02, "m", "mm") == 20.0

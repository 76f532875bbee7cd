"""Closed forms of a learned curve: the formula behind it comes back, with its numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bristle.learning.closed_forms import (
    CENTRED,
    FORMS,
    MAPS,
    closed_forms,
    fitted_about,
    formula_of,
    in_words,
    name_of,
    nearest_of,
)
from bristle.learning.curve import Curve
from bristle.learning.effect_file import MATH

KNOTS = np.linspace(-0.015, 0.015, 13)  # m
GAP = 0.004  # m
SCALES = {
    "power": 1.6, "dead band": GAP, "contact above": GAP, "contact below": GAP, "ripple": 0.011,
}  # fmt: skip


def curve_of(values, along="displacement", part="force", knots=KNOTS):
    return Curve(part, along, (), tuple(knots), tuple(values))


@pytest.mark.parametrize("form", FORMS[1:], ids=lambda f: f.name)
def test_a_form_without_noise_comes_back(form):
    d = SCALES.get(form.name, 0.006)
    c, m, n = 0.4, 2.0, -1.1
    values = form.at(KNOTS, d) @ np.array([c, m, n][: 1 + len(form.columns)])
    found = closed_forms(curve_of(values), [0.01] * len(KNOTS))
    own = next(one for one in found if one.name == form.name)
    assert own.left < 0.03
    assert own.values[:2] == pytest.approx((c, m), rel=0.15)
    if form.scales is not None:
        assert own.values[2] == pytest.approx(d, rel=0.06)
    # Another form may follow the same few knots as well; never one that is far off.
    assert found[0].left <= own.left * 1.25**3 + 0.01


def test_few_numbers_win_where_more_do_hardly_better():
    rng = np.random.default_rng(3)
    values = 320.0 * KNOTS + rng.normal(0.0, 0.05, len(KNOTS))
    assert closed_forms(curve_of(values), [0.05] * len(KNOTS))[0].name == "line"


def test_a_curve_without_a_unit_along_one_without_has_a_slope():
    knots = np.linspace(0.6, 3.0, 9)
    curve = curve_of(0.22 * (knots - 1.5), "age", "yield", knots)
    best = closed_forms(curve, [0.01] * 9)[0]
    assert in_words(best, curve) == "a line of slope 0.22"


def test_a_slope_over_a_temperature_is_per_kelvin():
    knots = np.array([20.0, 25.0, 30.0, 45.0])  # °C
    curve = replace(
        curve_of(-0.006 * (knots - 30.0), "temperature", "yield", knots), measured="degC"
    )
    best = closed_forms(curve, [0.001] * 4)[0]
    assert in_words(best, curve) == "a line of slope -0.006 per K"
    assert [unit for _, _, unit in formula_of(best, curve).parameters] == ["1/K"]


@pytest.mark.parametrize("form", CENTRED, ids=lambda f: f.name)
def test_a_form_off_centre_comes_back_with_its_centre(form):
    knots = np.linspace(-0.015, 0.015, 25)
    values = 0.4 + 2.0 * form.at(knots - 0.004, 0.003)[:, 1]
    values += np.random.default_rng(5).normal(0.0, 0.01, len(knots))
    curve = curve_of(values, part="friction", knots=knots)
    best = closed_forms(curve, [0.01] * len(knots))[0]
    assert best.form is form
    assert best.values == pytest.approx((0.4, 2.0, 0.003, 0.004), rel=0.15)
    assert f"{form.name} at {1e3 * best.centre:.3g} mm over" in in_words(best, curve)
    formula = formula_of(best, curve)
    units = {"c": "N", "m": "N", "d": "m", "s0": "m"}
    assert {n: unit for n, _, unit in formula.parameters if n != "c"} == {
        n: unit for n, unit in units.items() if n != "c"
    }
    p = SimpleNamespace(c=0.0, **{n: value for n, value, _ in formula.parameters if n != "c"})
    known = {one: getattr(math, one) for one in MATH}
    away = eval(formula.g, known | {"p": p, "q": SimpleNamespace(x=0.002, v=0.1)})
    assert away == pytest.approx(best.at(np.array([0.002]))[0] - best.values[0], rel=1e-6)


def test_a_bell_about_zero_keeps_the_form_without_a_centre():
    knots = np.linspace(-0.015, 0.015, 25)
    for seed in range(10):
        noise = np.random.default_rng(seed).normal(0.0, 0.03, len(knots))
        values = np.exp(-((knots / 0.004) ** 2)) + noise
        found = closed_forms(curve_of(values, part="friction", knots=knots), [0.03] * len(knots))
        assert found[0].name == "bell"
        assert not any(one.form.centred for one in found)


def test_a_smooth_curve_of_chance_is_no_bell_off_centre():
    knots = np.linspace(-0.015, 0.015, 13)
    alike = np.exp(-0.5 * ((knots[:, None] - knots) / 0.006) ** 2) + 1e-6 * np.eye(13)
    root = np.linalg.cholesky(alike)
    for seed in range(40):
        values = root @ np.random.default_rng(seed).normal(size=13)
        found = fitted_about(CENTRED[0], knots, values, np.full(13, 1.0 / 0.05))
        assert found is None


def test_a_form_that_explains_nearly_nothing_is_not_the_nearest():
    knots = np.linspace(-0.015, 0.015, 25)
    values = np.sign(np.sin(np.arange(25.0) ** 2))
    found = closed_forms(curve_of(values, part="friction", knots=knots), [0.01] * 25)
    assert found[0].left > 0.5
    assert nearest_of(found) is None


def test_chance_has_no_form():
    values = np.random.default_rng(1).normal(0.0, 1.0, len(KNOTS))
    assert name_of(closed_forms(curve_of(values), [0.01] * len(KNOTS))) is None


def test_a_force_in_proportion_to_acceleration_is_a_mass():
    knots = np.linspace(-4.0, 4.0, 9)  # m/s2
    curve = curve_of(3.2 * knots, "acceleration", knots=knots)
    best = closed_forms(curve, [0.1] * 9)[0]
    assert "an added mass of 3.2 kg" in in_words(best, curve)
    formula = formula_of(best, curve)
    assert [(n, unit) for n, _, unit in formula.parameters] == [("c", "N"), ("m", "kg")]


@pytest.mark.parametrize(
    ("form", "unit"), [("line", "N/m"), ("parabola", "N/m2"), ("cubic", "N/m3")]
)
def test_slopes_have_their_units(form, unit):
    own = next(one for one in FORMS if one.name == form)
    curve = curve_of(own.at(KNOTS, 1.0) @ np.array([0.0, 5.0]))
    found = next(one for one in closed_forms(curve, [0.1] * 13) if one.name == form)
    assert {n: u for n, _, u in formula_of(found, curve).parameters}["m"] == unit


def test_what_the_law_has_already_is_no_number_of_the_formula():
    curve = curve_of(-0.4 * np.exp(-((KNOTS / 0.005) ** 2)), part="fluid")
    best = closed_forms(curve, [0.01] * 13)[0]
    formula = formula_of(best, curve)
    assert best.name == "bell"
    assert [n for n, _, _ in formula.parameters] == ["m", "d"]
    assert not formula.text.startswith("c")


def test_a_contact_on_one_side_is_none_along_a_speed():
    values = 800.0 * np.maximum(KNOTS - GAP, 0.0)
    best = closed_forms(curve_of(values), [0.01] * 13)[0]
    assert best.name == "contact above"
    assert best.values[1:] == pytest.approx((800.0, GAP), rel=0.01)
    along_speed = closed_forms(curve_of(values, "velocity"), [0.01] * 13)
    assert not [one for one in along_speed if one.form.bent]


VOLTS = np.linspace(0.0, 7.5, 12)


@pytest.mark.parametrize(
    ("form", "given"),
    [(MAPS[0], {"m": 0.7}), (MAPS[1], {"d": 1.7}), (MAPS[2], {"d": 3.0})],
    ids=lambda one: getattr(one, "name", ""),
)
def test_a_map_of_the_command_has_a_formula_that_ends_where_the_command_does(form, given):
    values = form.at(VOLTS, given.get("d", 1.0), 7.5) @ np.array([0.0, given.get("m", 1.0)])
    curve = curve_of(values, "voltage", "command", VOLTS)
    best = closed_forms(curve, [0.01] * 12)[0]
    assert best.name == form.name
    formula = formula_of(best, curve)
    assert {n: value for n, value, _ in formula.parameters} == pytest.approx(given, rel=0.03)
    units = {"m": "1", "d": "1" if form.name == "power" else "V"}
    assert all(unit == units[n] for n, _, unit in formula.parameters)
    known = {one: getattr(math, one) for one in MATH}
    p = SimpleNamespace(**{n: value for n, value, _ in formula.parameters})
    for V, value in zip(VOLTS, values, strict=True):
        q = SimpleNamespace(V=float(V))
        assert eval(formula.g, known | {"p": p, "q": q}) == pytest.approx(value, abs=0.03)


def test_a_flat_curve_has_no_forms():
    assert closed_forms(curve_of(np.zeros(13)), [0.0] * 13) == []

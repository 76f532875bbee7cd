"""Curves of an isolation layer or a storey: what is hidden comes back, and its effect acts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.identification.building_sites import StructureProblem, structure_run
from bristle.identification.rig_fit import fit_line
from bristle.learning.closed_forms import closed_forms, formula_of, in_words
from bristle.learning.curve import Curve, CurvePlace, may_change, parts_at
from bristle.learning.effect_file import effect_text
from bristle.learning.normal import Normal, residual_of
from bristle.learning.screen import promises
from bristle.learning.signals import ALONG
from bristle.physics.effect import EFFECTS, Q
from bristle.physics.laws import law_of_part
from bristle.user_code.conformance import examine
from bristle.user_code.load import defined

STEP, NOISE = 0.004, 0.03  # s, N
T = STEP * np.arange(1500)
LAYER, STOREY = CurvePlace("layer"), CurvePlace("storey2")
MEMORY = {"tau": 0.2, "way": 0.004, "early": 0.02}


def runs(hidden, place=LAYER):
    """Return two runs of a line, k = 1200 N/m and c = 3 N s/m, with something hidden beside it."""
    out = []
    for seed in range(2):
        random = np.random.default_rng(seed)
        w = 2.0 * np.pi * random.uniform(0.5, 4.0, 8)
        angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
        size = 0.03 / w
        x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
        force = 1200.0 * x + 3.0 * v + hidden(x, v) + NOISE * random.standard_normal(len(T))
        none = np.zeros((0, len(T), 4))
        out.append(structure_run(f"run{seed}", STEP, (x, v, a, 0.0 * x), force, NOISE, none))
    return StructureProblem(out, place.storey)


def first_of(hidden, place=LAYER):
    problem = runs(hidden, place)
    residual = residual_of(problem, fit_line(problem, law_of_part(place.name).name).model)
    return residual, promises(residual)


def gap(x):
    return 200.0 * (np.maximum(x - 0.006, 0.0) + np.minimum(x + 0.006, 0.0))


HIDDEN = {
    "a spring that stiffens": (lambda x, v: 3e5 * x**3, "force", "displacement"),
    "a gap on either side": (lambda x, v: gap(x), "force", "displacement"),
    "a rub at mid-stroke": (
        lambda x, v: 0.2 * np.sign(v) * np.exp(-((x / 0.004) ** 2)), "friction", "displacement",
    ),
    "a rub that fades with speed": (
        lambda x, v: 0.3 * np.sign(v) * np.exp(-np.abs(v) / 0.03), "friction", "speed",
    ),
    "a damping that grows outwards": (lambda x, v: 4e4 * x**2 * v, "damping", "displacement"),
}  # fmt: skip


@pytest.mark.parametrize("case", HIDDEN)
def test_the_hidden_curve_comes_first(case):
    hidden, part, along = HIDDEN[case]
    residual, found = first_of(hidden)
    best = found[0]
    assert (best.curve.part, best.curve.along, best.curve.at) == (part, along, "layer")
    assert best.loss < 2.0  # noise alone leaves 1
    assert best.loss < 0.25 * Normal(residual).without_curve()


def test_in_a_storey_it_is_the_same_along_drift():
    _, found = first_of(HIDDEN["a gap on either side"][0], STOREY)
    assert found[0].curve.words() == "an added force along drift"
    assert found[0].curve.at == "storey2"


def test_noise_alone_promises_nothing_worth_a_name():
    residual, found = first_of(lambda x, v: 0.0 * x)
    without = Normal(residual).without_curve()
    assert all(one.loss > 0.99 * without for one in found)


def test_what_the_line_has_already_is_no_part_of_the_curve():
    _, found = first_of(HIDDEN["a gap on either side"][0])
    curve = found[0].curve
    rest, aside = curve.held
    assert curve.knots[rest] == 0.0  # a building at rest stays there
    assert 0.0 < abs(curve.knots[aside]) < 0.006
    assert curve.values[rest] == curve.values[aside] == 0.0
    best = closed_forms(curve, [0.01] * len(curve.knots))[0]
    assert best.name == "dead band"
    assert best.values[1:] == pytest.approx((200.0, 0.006), rel=0.1)
    assert "then" in in_words(best, curve)
    formula = formula_of(best, curve)
    assert [(name, unit) for name, _, unit in formula.parameters] == [("m", "N/m"), ("d", "m")]


@pytest.mark.parametrize(
    ("side", "name", "size"), [(1.0, "contact above", 300.0), (-1.0, "contact below", 300.0)]
)
def test_a_stop_on_one_side_is_told_with_its_side(side, name, size):
    _, found = first_of(lambda x, v: side * size * np.maximum(side * x - 0.005, 0.0))
    curve = found[0].curve
    best = closed_forms(curve, [0.01] * len(curve.knots))[0]
    assert best.name == name
    assert best.values[1:] == pytest.approx((size, 0.005), rel=0.1)
    assert f"a {name} beyond" in in_words(best, curve)


def test_a_slope_beside_the_curve_is_the_line_s():
    knots = tuple(np.linspace(-0.012, 0.012, 11))
    bent = tuple(2e7 * np.array(knots) ** 3 - 500.0 * np.array(knots))
    best = closed_forms(Curve("force", "displacement", (), knots, bent, at="layer"), [0.01] * 11)[0]
    assert (best.name, best.values[1]) == ("cubic", pytest.approx(2e7))
    assert best.left < 1e-6


def test_what_weakens_a_building_ends_with_the_data():
    knots = tuple(np.linspace(-0.012, 0.012, 11))
    soft = Curve("force", "displacement", (), knots, tuple(-2e6 * np.array(knots) ** 3), at="layer")
    best = next(one for one in closed_forms(soft, [0.01] * 11) if one.name == "cubic")
    formula = formula_of(best, soft)
    assert formula.ends
    assert "max(q.x, -0.012), 0.012" in formula.g
    stiff = replace(soft, values=tuple(-value for value in soft.values))
    formula = formula_of(replace(best, values=(0.0, 2e6)), stiff)
    assert (formula.ends, formula.positive) == (False, ("m",))


def curve_of(part, along, place):
    memory = tuple((name, MEMORY[name]) for name in ALONG[along].memory)
    values = (
        (-0.3, 0.0, 0.5, 0.4, 0.2)
        if parts_at(place)[part].low < -1.0
        else (0.0, 0.2, 0.5, 0.4, 0.3)
    )
    knots = (-0.008, 0.0, 0.003, 0.006, 0.009)
    return Curve(part, along, memory, knots, values, (1,), 0.003, at=place.name)


def test_every_part_along_every_signal_is_an_effect_in_its_storey():
    texts = {}
    for place in (LAYER, STOREY):
        pairs = [(p, a) for p in parts_at(place) for a in ALONG if may_change(p, a, place)]
        assert {part for part, _ in pairs} == {"force", "friction", "spring", "damping"}
        for part, along in pairs:
            name = f"learned_{place.name}_{part}_{along}"
            texts[name] = effect_text(name, curve_of(part, along, place), "made for a test, 2026")
    zero = Q(*(0.0 for _ in Q._fields))._replace(dt=STEP, stiffness=1e3)
    moved = zero._replace(x=0.004, v=0.1, drift=0.004, drift_rate=0.1)
    with defined(texts):
        for name in texts:
            effect = EFFECTS[name]
            z, p = effect.State(*(0.004 for _ in effect.states)), effect.values_of({})
            assert effect.sites == ("structure",)
            if "storey2" in name:
                spring = effect.hooks()["spring"]
                assert spring(moved._replace(storey=1.0), z, p) == 0.0
                assert np.isfinite(spring(moved._replace(storey=2.0), z, p))
                assert effect.parameters["which"].value == 2.0
            else:
                assert np.isfinite(effect.hooks()["force"](moved, z, p))


def test_a_factor_never_takes_more_than_the_stiffness():
    curve = curve_of("spring", "speed", STOREY)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        low = {f"curve[{k}]": -50.0 for k in range(1, 6)}
        q = Q(*(0.0 for _ in Q._fields))._replace(drift=0.01, stiffness=1e3, storey=2.0)
        assert effect.hooks()["spring"](q, (), effect.values_of(low)) == pytest.approx(-9.8)


def test_a_learned_effect_of_a_large_building_conforms():
    curve = curve_of("force", "displacement", STOREY)
    curve = replace(curve, values=tuple(1e5 * value for value in curve.values), held=(1, 2))
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        assert [one for one in examine(EFFECTS["learned_9"]) if not one.holds] == []

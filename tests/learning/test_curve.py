"""The effect of a learned curve: its text is an effect, for any part and signal."""

from __future__ import annotations

import ast
from dataclasses import replace
from math import log

import numpy as np
import pytest

from bristle.errors import PhysicsError
from bristle.identification.problem import Problem, Run
from bristle.learning.closed_forms import closed_forms, formula_of
from bristle.learning.curve import PARTS, Curve, may_change
from bristle.learning.effect_file import effect_text
from bristle.learning.fit import begun
from bristle.learning.signals import ALONG, SLIP, slips
from bristle.physics.effect import EFFECTS, Q
from bristle.user_code.conformance import examine
from bristle.user_code.load import defined, flaw_of
from bristle.user_code.trial import probe

STEP = 0.002  # s
T = STEP * np.arange(1500)
NONE = np.zeros((0, len(T), 4))
PAIRS = [(part, along) for part in PARTS for along in ALONG if may_change(part, along)]
MEMORY = {"tau": 0.2, "way": 0.004, "early": 0.02, "turn": 0.011}


def run() -> Run:
    x = 0.008 * np.sin(9.0 * T) + 0.003 * np.sin(23.0 * T + 1.0)
    v = 0.072 * np.cos(9.0 * T) + 0.069 * np.cos(23.0 * T + 1.0)
    a = -0.648 * np.sin(9.0 * T) - 1.587 * np.sin(23.0 * T + 1.0)
    V = np.repeat([0.0, 4.0, 8.0], 500)
    return Run("run", STEP, x, v, a, V, 0.0 * T, 0.1, NONE)


def curve_of(part: str, along: str, size: float = 0.4) -> Curve:
    signal = ALONG[along]
    memory = {name: MEMORY[name] for name in signal.memory}
    values = signal.history(run(), memory)
    knots = np.linspace(values.min(), values.max(), 5)
    curve = tuple(size * np.array([0.0, 0.2, 0.5, 0.4, -0.3]))
    return Curve(part, along, tuple(memory.items()), tuple(knots), curve, (0,), 0.003, 8.0)


def slip_of(size: float = 0.4) -> Curve:
    return Curve(SLIP, SLIP, (), (0.0004, 0.002, 0.009), (size, 0.0, 2.0 * size))


def signals(now: Run, k: int, dt: float) -> Q:
    given = {"x": now.x[k], "v": now.v[k], "a": now.a[k], "V": now.V[k], "dt": dt}
    return Q(**{name: given.get(name, 0.0) for name in Q._fields})


@pytest.mark.parametrize(("part", "along"), PAIRS)
def test_every_part_along_every_signal_is_an_effect(part, along):
    curve = curve_of(part, along)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        p = effect.values_of({})
        z = effect.State(*(0.0 for _ in effect.states))
        hook = effect.hooks()[PARTS[part].hook]
        assert np.isfinite(hook(signals(run(), 700, STEP), z, p))
        assert effect.parameters["curve[2]"].value == pytest.approx(0.08)
        assert effect.assumed[0] == "curve[1]"
        probe(effect)  # as it is when a study reads the file
    assert "learned_9" not in EFFECTS


@pytest.mark.parametrize("along", [name for name, one in ALONG.items() if one.states])
def test_the_memory_of_the_hook_is_that_of_the_scan(along):
    curve, now = curve_of("fluid", along), run()
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        p, advance = effect.values_of({}), effect.hooks()["advance"]
        begin = {state: getattr(signals(now, 0, 0.0), of) for state, of in effect.starts.items()}
        z = effect.State(*(begin.get(state, 0.0) for state in effect.states))
        shown = eval(f"lambda z, p: {ALONG[along].source}", {"log": log})
        out = [shown(z, p)]
        for k in range(1, len(T)):
            means = {n: 0.5 * (getattr(now, n)[k - 1] + getattr(now, n)[k]) for n in "xvaV"}
            middle = signals(now, k, STEP)._replace(**means)
            z = effect.State(*advance(middle, z, p))
            z = effect.State(*advance(signals(now, k, 0.0), z, p))
            out.append(shown(z, p))
    expected = ALONG[along].history(now, dict(curve.memory))
    assert np.max(np.abs(np.array(out) - expected)) < 0.02 * np.ptp(expected)


def test_a_curve_for_each_direction_is_that_of_the_scan():
    curve, now = curve_of("force", "stroke", 0.5), run()
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        p, force = effect.values_of({}), effect.hooks()["force"]
        found = np.array([force(signals(now, k, STEP), (), p) for k in range(len(T))])
        assert effect.assumed == ("curve[1]", "turn")
        assert not effect.passive  # round a cycle it may give energy
    along = ALONG["stroke"].history(now, dict(curve.memory))
    expected = np.interp(along, curve.knots, curve.values)
    moving = np.abs(now.v) > 3.0 * curve.slow  # nearer to rest one curve passes into the other
    assert found[moving] == pytest.approx(expected[moving], abs=0.003)


@pytest.mark.parametrize("along", [n for n, one in ALONG.items() if not (one.memory or one.states)])
def test_a_formula_is_its_form_of_the_signal(along):
    now = run()
    s = ALONG[along].history(now, {})
    knots = np.linspace(s.min(), s.max(), 7)
    curve = Curve("force", along, (), tuple(knots), tuple(0.4 * (knots / s.max()) ** 2), (), 0.001)
    best = next(one for one in closed_forms(curve, [0.001] * 7) if one.name == "parabola")
    text = effect_text("learned_9", curve, "made for a test, 2026", formula_of(best, curve))
    with defined({"learned_9": text}):
        effect = EFFECTS["learned_9"]
        probe(effect)
        p, force = effect.values_of({}), effect.hooks()["force"]
        found = np.array([force(signals(now, k, STEP), (), p) for k in range(len(T))])
    moving = np.abs(now.v) > 5.0 * curve.slow
    assert found[moving] == pytest.approx(np.asarray(best.at(s))[moving], abs=0.003)


def test_its_file_is_an_effect_that_is_accepted():
    text = effect_text("learned_9", curve_of("fluid", "displacement", 0.5), "made for a test, 2026")
    assert flaw_of("learned_9", text) == ""


@pytest.mark.slow  # 5 s each: with every law; by default its file is accepted as a user's own
@pytest.mark.parametrize("closed", [False, True])
def test_a_learned_effect_conforms_as_any_other(closed):
    curve = curve_of("fluid", "displacement", 0.5)
    formula = None
    if closed:
        values = tuple(0.3 * np.exp(-((np.array(curve.knots) / 0.005) ** 2)))
        curve = Curve("fluid", "displacement", (), curve.knots, values)
        best = next(one for one in closed_forms(curve, [0.01] * 5) if one.name == "bell")
        formula = formula_of(best, curve)
    text = effect_text("learned_9", curve, "made for a test, 2026", formula)
    with defined({"learned_9": text}):
        failed = [check for check in examine(EFFECTS["learned_9"]) if not check.holds]
    assert failed == []


@pytest.mark.slow  # 3 s: examined as any effect, by default a curve is
def test_elastic_slip_elements_conform():
    with defined({"learned_9": effect_text("learned_9", slip_of(), "made for a test, 2026")}):
        assert [check for check in examine(EFFECTS["learned_9"]) if not check.holds] == []


def test_elastic_slip_elements_are_those_of_the_scan():
    curve, now = slip_of(), run()
    text = effect_text("learned_9", curve, "made for a test, 2026")
    with defined({"learned_9": text}):
        effect = EFFECTS["learned_9"]
        assert effect.passive
        assert [one.bounds[0] for one in effect.parameters.values()] == [0.0, 0.0, 0.0]
        p, hooks = effect.values_of({}), effect.hooks()
        z, out = effect.State(0.0, 0.0, 0.0), [0.0]
        for k in range(1, len(T)):
            v = 0.5 * (now.v[k - 1] + now.v[k])
            z = effect.State(*hooks["advance"](signals(now, k, STEP)._replace(v=v), z, p))
            out.append(hooks["force"](signals(now, k, STEP), z, p))
    expected = slips(now, np.array(curve.knots)) @ curve.values
    assert np.max(np.abs(np.array(out) - expected)) < 0.01
    assert np.max(np.abs(expected)) == pytest.approx(1.2)  # N, all of them slip


def test_a_current_is_told_as_one():
    for part, along in (("yield_field", "speed"), ("command", "voltage")):
        curve = replace(curve_of(part, along), drive="current")
        text = effect_text("learned_9", curve, "made for a test, 2026")
        assert '"V"' not in text.replace('needs = ("V",)', "").replace('"v", "V")', "")
        assert "[V]" not in text
    assert "Largest command of the runs [A]" in effect_text(
        "learned_9", replace(curve_of("yield_field", "speed"), drive="current"), "a test, 2026"
    )
    with defined({"learned_9": text}):
        assert EFFECTS["learned_9"].parameters["curve[2]"].unit == "A"
        problem = Problem([replace(run(), drive="current")])
        assert problem.size("A") == problem.size("V") == 8.0
        assert problem.size("N/A2") == problem.size("N/V2") != 1.0


def test_a_factor_never_turns_the_force_round():
    curve = curve_of("fluid", "displacement", 1.5)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        low, _ = effect.parameters["curve[3]"].bounds
        p = effect.values_of({f"curve[{k}]": low for k in range(1, 6)})
        factor = effect.hooks()["factor"](signals(run(), 700, STEP), (), p)
        assert factor >= 0.02
        assert effect.passive


def test_a_name_that_is_taken_is_refused_and_nothing_stays():
    text = effect_text("gas_spring", curve_of("force", "displacement"), "a test, 2026")
    before = set(EFFECTS)
    with pytest.raises(PhysicsError, match=r"gas_spring.*taken"), defined({"gas_spring": text}):
        pass
    assert set(EFFECTS) == before


@pytest.mark.parametrize("origin", ['study of rig "B"', r"study C:\new\"", 'study """ö\'s"""'])
def test_what_a_study_is_called_stands_in_the_file_as_it_is(origin):
    text = effect_text("learned_9", curve_of("force", "displacement"), origin)
    with defined({"learned_9": text}):
        assert EFFECTS["learned_9"].source == origin


def test_what_a_channel_is_called_stands_in_the_file_as_it_is():
    name = r"oil\new of \"\"\"pump"
    curve = Curve("force", name, (), (-1.0, 0.0, 2.0), (0.0, 0.1, 0.3), measured="1")
    tree = ast.parse(effect_text("learned_9", curve, "made for a test, 2026"))
    made = next(node for node in tree.body if isinstance(node, ast.ClassDef))
    assert f"that depends on {name}." in (ast.get_docstring(made) or "")
    texts = {node.value for node in ast.walk(made) if isinstance(node, ast.Constant)}
    assert {name, f"an error that depends on {name}", f"{name}, which runs tell"} <= texts


@pytest.mark.parametrize(
    ("knots", "unit", "bounds"),
    [
        ((-5.0, 0.0, 5.0), "N", (-105.0, 105.0)),  # symmetric: its middle says nothing of its size
        ((0.0, 2.0), "N", (-20.0, 22.0)),
        ((1.0e5, 1.01e5), "Pa", (-1000.0, 2.02e5)),  # a run of another level stays within
        ((290.0, 330.0), "K", (0.0, 730.0)),
    ],
)
def test_what_follows_a_channel_has_bounds_from_the_range_of_the_channel(knots, unit, bounds):
    values = tuple(0.1 * k for k in range(len(knots)))
    curve = Curve("force", "oil", (), knots, values, measured=unit)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        signal = EFFECTS["learned_9"].parameters["signal"]
    assert signal.bounds == pytest.approx(bounds)
    assert signal.value == pytest.approx(0.5 * (knots[0] + knots[-1]))


def test_a_text_that_is_not_right_leaves_nothing_behind():
    before = set(EFFECTS)
    good = effect_text("learned_8", curve_of("force", "displacement"), "a test, 2026")
    with (
        pytest.raises(PhysicsError, match=r"learned_9\.py"),
        defined({"learned_8": good, "learned_9": "import os\n"}),
    ):
        pass
    assert set(EFFECTS) == before


def test_the_values_of_a_learned_effect_are_not_scaled_to_the_rig():
    large = replace(run(), force=500.0 * np.sin(9.0 * T))  # N; defaults are for a rig of 10 N
    curve = curve_of("force", "displacement", 300.0)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        problem = Problem([large])
        assert problem.scaled("bingham", "learned_9.curve[2]") == pytest.approx(60.0)
        assert (
            problem.scaled("bingham", "gas_spring.k")
            > 1e3
            > EFFECTS["gas_spring"].parameters["k"].value
        )


def test_a_fit_of_a_command_map_begins_where_the_damper_sees_a_command():
    knots, values = (0.0, 2.0, 5.0, 8.0), (0.0, -3.0, -4.0, 0.0)
    curve = Curve("command", "voltage", (), knots, values, held=(0, 3))
    assert begun(curve) == pytest.approx((0.0, -1.8, -4.0, 0.0))
    assert begun(replace(curve, part="force")) == values

"""Which curves promise to explain a residual: the hidden one first, none where noise is all."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bingham_runs import NOISE, NOWHERE, STEP, VALUES, T, runs

from bristle.data.extra_channels import Extra
from bristle.errors import RecordError
from bristle.identification.fit import fit
from bristle.identification.problem import Problem, Run, tracks_of
from bristle.learning.effect_file import effect_text
from bristle.learning.normal import Normal, hats_at, residual_of
from bristle.learning.rule import LEARN
from bristle.learning.screen import distinct, knots_of, promises, signals
from bristle.learning.signals import SLIP, rebuilt, slips
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.user_code.load import defined


@cache
def first_of(hidden):
    problem = runs(hidden)
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    return promises(residual_of(problem, base))


@pytest.mark.parametrize("order", [1, -1])
def test_memories_that_are_looked_at_are_those_of_all_runs_whatever_their_rates(order):
    fine, _, other = runs().runs
    part = {name: getattr(other, name)[::10] for name in ("x", "v", "a", "V", "force")}
    coarse = replace(other, dt=10.0 * STEP, draws=NOWHERE[:, ::10], **part)  # 6 s, as the fine one
    problem = Problem([fine, coarse][::order])
    residual = residual_of(problem, Model("bingham", (), VALUES))
    taus = {memory["tau"] for _, memory, _ in signals(residual, ["recent_speed"])}
    assert taus == {0.1, 0.5}  # s; two samples of 20 ms or more, a third of a run or less


def test_a_channel_besides_those_that_are_known_is_a_signal_as_well():
    pressure = 2e6 + 1e6 * np.sin(5.3 * T)
    hidden = 1.5 * np.tanh((pressure - 2e6) / 1e6)
    plain = runs(lambda x, v, V, F: F + hidden)
    extra = {
        "oil_pressure": Extra(pressure, "Pa"),
        "gauge": Extra(np.cos(3.0 * T), "counts"),
        "still": Extra(np.ones(len(T)), "K"),
    }
    problem = Problem([replace(run, extra=extra) for run in plain.runs])
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    best = promises(residual_of(problem, base))[0]
    assert (best.curve.part, best.curve.along) == ("force", "oil_pressure")
    assert best.curve.measured == "Pa"
    assert best.curve.words() == "an added force along oil pressure"
    assert best.loss < 2.0
    only = promises(residual_of(problem, base), along=["gauge"])
    assert {one.curve.along for one in only} <= {"gauge"}
    text = effect_text("learned_1", best.curve, "a trial")
    assert 'channels = {"signal": "oil_pressure"}' in text
    assert "interpolate(p.signal, KNOTS, p.curve)" in text
    with defined({"learned_1": text}):
        effect = EFFECTS["learned_1"]
        assert effect.assumed == ("signal",)
        assert problem.tells(effect)
        assert not plain.tells(effect)
        with pytest.raises(RecordError, match="learned_1 follows the channel oil_pressure, which"):
            tracks_of(["learned_1"], {}, "run_3")
        with pytest.raises(RecordError, match=r"oil_pressure is in K, and .* it in Pa"):
            tracks_of(["learned_1"], {"oil_pressure": Extra(pressure, "K")}, "run_3")


def run_of(x):
    return Run("run", STEP, x, 0.0 * x, 0.0 * x, 0.0 * x, 0.0 * x, NOISE, NOWHERE)


def bell(x):
    return 1.0 - 0.5 * np.exp(-((x / 0.004) ** 2))


CASES = {
    "fluid along displacement": (lambda x, v, V, F: F * bell(x), "fluid", "displacement"),
    "an added spring": (lambda x, v, V, F: F + 150.0 * x, "force", "displacement"),
    "an added mass": (
        lambda x, v, V, F: F + 0.4 * np.gradient(v, STEP), "force", "acceleration",
    ),
    "a guide that is worn on the way out, and elsewhere on the way back": (
        lambda x, v, V, F: F + np.where(v > 0.0, 1.0 - bell(x - 0.004), bell(x + 0.006) - 1.0),
        "force", "stroke",
    ),
    "thickening under a field": (
        lambda x, v, V, F: F * (1.0 + 0.1 * V / (1.0 + (0.1 / v) ** 4)), "field", "speed",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_hidden_curve_comes_first(case):
    hidden, part, along = CASES[case]
    best = first_of(hidden)[0]
    # At high speed a Bingham damper's yield force is nearly all of its force.
    assert best.curve.part.endswith(part)
    assert best.curve.along == along
    assert best.loss < 2.0  # noise alone leaves 1; the law's parameters move to first order


def test_elastic_slip_elements_are_found_with_no_negative_force():
    travels = np.array([0.001, 0.006])  # m
    problem = runs(lambda x, v, V, F: F + slips(run_of(x), travels) @ [0.8, 1.5])
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    residual = residual_of(problem, base)
    best = promises(residual, along=(SLIP, "travel"))[0]
    assert best.curve.part == SLIP
    assert min(best.curve.values) >= 0.0
    # The law had taken up a part of them: the joint fit gives it back.
    assert best.loss < 0.1 * Normal(residual).without_curve()


def test_a_memory_is_found_between_the_nodes_of_the_scan():
    tau, way = 0.23, 0.004  # s, m

    def hidden(x, v, V, F):
        moved = replace(run_of(x), v=v)
        return F * (1.0 + rebuilt(moved, {"tau": tau, "way": way}))

    problem = runs(hidden)
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    best = promises(residual_of(problem, base), along=("rebuilding",))[0]
    memory = dict(best.curve.memory)
    assert memory["tau"] == pytest.approx(tau, rel=0.3)
    assert memory["way"] == pytest.approx(way, rel=0.3)
    assert best.loss < 2.0


def test_the_elastic_part_of_a_law_is_no_yield_force():
    problem = runs()
    values = {**Model("tanh").values, "k": 400.0}
    run = problem.runs[0]
    columns = residual_of(problem, Model("tanh", (), values)).parts
    without = residual_of(problem, Model("tanh", (), {**values, "k": 0.0})).parts
    assert np.ptp(columns["fluid"] - without["fluid"]) > 0.5 * 400.0 * np.ptp(run.x) / NOISE
    assert columns["yield"] == pytest.approx(without["yield"], abs=1e-6)


def test_noise_alone_promises_nothing_worth_a_name():
    problem = runs()
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    residual = residual_of(problem, base)
    without = Normal(residual).without_curve()
    found = promises(residual)
    assert without == pytest.approx(1.0, abs=0.05)
    assert all(one.loss > 0.99 * without for one in found)


def test_sums_over_knots_are_those_of_columns():
    problem = runs()
    residual = residual_of(problem, Model("bingham", (), VALUES))
    x = np.concatenate(
        [run.x[keep] for run, keep in zip(residual.runs, residual.keeps, strict=True)]
    )
    knots = knots_of(x, 7)
    hats = hats_at(x, knots)
    dense = np.zeros((len(x), 7))
    np.add.at(dense, (np.arange(len(x))[:, None], hats.at), hats.share)
    columns = np.hstack([residual.known, dense * residual.parts["fluid"][:, None]])
    weighted = columns * residual.weight[:, None]
    normal = Normal(residual).with_curve(residual.parts["fluid"], hats, list(range(7)))
    assert np.allclose(normal.grams.sum(axis=0), weighted.T @ columns, rtol=1e-9, atol=1e-9)
    assert np.allclose(normal.sides.sum(axis=0), weighted.T @ residual.r, rtol=1e-9, atol=1e-9)


def test_what_a_stretch_alone_tells_does_not_spoil_the_scan():
    problem = runs()
    residual = residual_of(
        problem, fit(problem, Model("bingham", (), VALUES), with_std=False).model
    )
    rare = 1e-4 * np.random.default_rng(7).standard_normal(len(residual.r))
    rare[residual.fold == 3] = 1.0  # a parameter that the other stretches hardly tell
    unsteady = replace(residual, known=np.column_stack([residual.known, rare]))
    assert Normal(unsteady).without_curve() < LEARN.unsteady
    steady = Normal(residual).without_curve()
    assert Normal(unsteady).without_curve() == pytest.approx(steady, rel=0.2)


def test_knots_stand_at_the_levels_that_a_command_holds():
    V = np.repeat([0.0, 2.0, 8.0], 100)
    assert knots_of(V, 13) == pytest.approx([0.0, 2.0, 8.0])


def test_one_curve_of_a_kind_is_fitted():
    found = first_of(CASES["fluid along displacement"][0])
    kept = distinct(found, 4)
    kinds = [(one.curve.part, one.curve.along) for one in kept]
    assert kinds[0] == ("fluid", "displacement")
    assert len(set(kinds)) == len(kinds) <= 4
    assert ("fluid", "stroke") not in kinds  # it contains the one along displacement


def test_a_level_per_run_with_noise_is_a_knot_and_none_stands_between():
    random = np.random.default_rng(1)
    levels = np.array([20.0, 30.0, 35.0, 45.0])  # °C, each for a run
    warm = np.repeat(levels, 500) + random.normal(0.0, 0.2, 2000)
    assert knots_of(warm, 13) == pytest.approx(levels, abs=0.1)
    drifting = np.linspace(20.0, 45.0, 2000) + random.normal(0.0, 0.2, 2000)
    assert len(knots_of(drifting, 13)) == 13

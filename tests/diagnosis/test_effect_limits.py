"""How large effects may still be: intervals of a fit, noise, what no run shows, and the words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.diagnosis.effect_limits import NO_AMOUNT, EffectLimit, effect_limits, limit_of
from bristle.diagnosis.effect_size import STANDS_OUT, Sized, SizeSearch, resolved
from bristle.diagnosis.view import verdict_view
from bristle.diagnosis.words import limit_rows
from bristle.identification.fit import intervals_of, refine
from bristle.identification.problem import residuals
from bristle.identification.search import HUBER
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.view.blocks import Table
from tests.diagnosis.test_limits import VALUES, T, problem_of, steady, steps

SPRING = "gas_spring"


@pytest.fixture(scope="module")
def known():
    """Return two runs of a Bingham damper, the law fitted to them."""
    problem = problem_of(steps)
    model = refine(Model("bingham", (), VALUES), problem)
    return SizeSearch(problem, model, problem.expectation(model), 6000)


def test_the_limit_of_a_linear_effect_is_that_of_a_fit_with_it(known):
    limit = limit_of(Sized(SPRING, known))
    joined = Model("bingham", (SPRING,), {**known.model.values, "gas_spring.k": 1.0}, fixed=(
        "gas_spring.preload", "gas_spring.k_2", "gas_spring.k_3",
    ))  # fmt: skip
    fitted = refine(joined, known.problem)
    std = intervals_of(known.problem, fitted).std["gas_spring.k"]
    # A normal estimate, cut off at zero: the end lies 0.5 to 3 deviations above what was found.
    assert 0.5 * std < limit.largest - max(fitted.value("gas_spring.k"), 0.0) < 3.0 * std
    assert (limit.parameter, limit.unit, limit.falls, limit.coarse) == ("k", "N/m", False, False)


@pytest.mark.parametrize("name", [SPRING, "quadratic_damping", "saturation", "stribeck"])
def test_a_change_in_proportion_is_not_simulated_again_and_another_one_is(known, name):
    sized = Sized(name, known)
    for size in (1.0, 0.01, 0.3, 0.1):
        alone = Sized(name, known).change(size)
        assert np.allclose(sized.change(size), alone, rtol=0.0, atol=2e-6 * np.abs(alone).max())


def test_a_limit_on_the_command_has_the_unit_of_the_runs(known):
    runs = [replace(run, drive="current") for run in known.problem.runs]
    driven = SizeSearch(known.problem.of(runs), known.model, known.expected, 6000)
    assert limit_of(Sized("saturation", driven)).unit == "A"
    assert limit_of(Sized("saturation", known)).unit == "V"
    assert limit_of(Sized(SPRING, driven)).unit == "N/m"


def test_a_tenth_of_the_noise_allows_a_tenth(known):
    problem = problem_of(steps, noise=1e-3)
    model = refine(Model("bingham", (), VALUES), problem)
    finer = SizeSearch(problem, model, problem.expectation(model), 6000)
    wide, narrow = (limit_of(Sized("fluid_inertia", one)).largest for one in (known, finer))
    assert 4.0 < wide / narrow < 25.0  # the noise of both is drawn anew


def test_what_is_named_is_far_above_what_is_allowed_and_leaves_the_gain_of_the_rule(known):
    limit = limit_of(Sized("quadratic_damping", known))
    assert limit.named > 2.0 * limit.largest
    assert limit.named_share > limit.share
    sized = Sized("quadratic_damping", known)
    left = known.beyond(sized.change(limit.named / sized.one))
    z = np.sqrt(1.0 + np.mean(left**2))  # error over noise if that is missing
    assert 1.02 < z < 1.05


@pytest.mark.parametrize(("name", "value"), [(SPRING, 200.0), ("saturation", 2.0)])
def test_what_is_named_is_no_less_than_what_is_allowed_where_the_model_errs(known, name, value):
    sized = Sized(name, known)
    there = replace(sized.with_value(value), values={**known.model.values, **{sized.key: value}})
    runs = [replace(run, force=known.problem.predict(there, run)) for run in known.problem.runs]
    problem = known.problem.of(runs)
    model = refine(known.model, problem, 6)
    limit = limit_of(Sized(name, SizeSearch(problem, model, problem.expectation(model), 6000)))
    assert limit.named == limit.largest
    assert limit.named_share == pytest.approx(limit.share)


def test_what_is_named_is_what_the_runs_that_decide_show(known):
    sized = Sized(SPRING, known)
    alone = limit_of(sized).named
    assert limit_of(Sized(SPRING, replace(known, judging=known.problem))).named == pytest.approx(
        alone, rel=0.1
    )
    # A spring of half the stroke has half the force; the law absorbs none of it.
    half = known.problem.of([replace(run, x=0.5 * run.x) for run in known.problem.runs])
    halved = limit_of(Sized(SPRING, replace(known, judging=half)))
    assert halved.named == pytest.approx(2.0 * alone, rel=0.15)
    assert halved.largest == limit_of(sized).largest  # all that is fitted to says that


def test_a_parameter_that_the_runs_hardly_tell_is_not_moved_beyond_its_sensitivity():
    straight = {**VALUES, "v_n": 90.0}  # its exponential is one at the speeds of these runs
    problem = problem_of(steps, values=straight)
    model = replace(refine(Model("bingham", (), straight, ("v_n",)), problem), fixed=())
    known = SizeSearch(problem, model, problem.expectation(model), 6000)
    sized = Sized("quadratic_damping", known)  # what v_n would absorb, moved by many powers of ten
    alone = limit_of(sized)
    change = sized.change(alone.named / sized.one)
    assert abs(known.steps(change)[known.search.names.index("v_n")]) > 2.0
    moved = dict(known.moved(change))
    assert moved["v_n"] == 0.0
    assert moved["c_0"] != 0.0
    decided = limit_of(Sized("quadratic_damping", replace(known, judging=problem)))
    assert decided.named == pytest.approx(alone.named, rel=0.2)
    assert decided.named > decided.largest


def test_a_parameter_that_changes_nothing_on_these_runs_stays():
    problem = problem_of(lambda _: np.zeros(len(T)))
    model = replace(refine(Model("bingham", (), VALUES, ("f_v", "c_v")), problem), fixed=())
    known = SizeSearch(problem, model, problem.expectation(model), 6000)
    sized = Sized("delay", known)
    alone = limit_of(sized)
    steps_taken = dict(zip(known.search.names, known.steps(sized.change(1.0)), strict=True))
    assert steps_taken["f_v"] == steps_taken["c_v"] == 0.0
    assert steps_taken["c_0"] != 0.0
    assert known.basis.shape[1] == len(known.search.names) - 2
    decided = limit_of(Sized("delay", replace(known, judging=problem)))
    assert decided.named == pytest.approx(alone.named, rel=0.2)


def test_an_effect_that_vanishes_as_its_parameter_grows_is_limited_from_below(known):
    limit = limit_of(Sized("saturation", known))
    assert limit.falls
    assert limit.largest > limit.named > 0.0  # V_s; the smaller, the more of the effect
    assert limit.as_dict()["side"] == "above"


def test_no_play_is_limited_below_what_the_steps_of_the_integration_tell(known):
    limit = limit_of(Sized("backlash", known))
    assert limit.coarse
    assert (limit.share, limit.named) == (None, None)
    lag = limit_of(Sized("coil_lag", known))
    assert 1e-4 < lag.largest < 4e-3  # s; a sample is 2 ms


@pytest.mark.parametrize("times", [1.5, 4.0])
@pytest.mark.parametrize("name", ["mount_compliance", "presliding", "backlash"])
def test_a_limit_allows_what_is_in_series_with_the_damper(known, name, times):
    sized = Sized(name, known)
    limit = limit_of(sized)
    there = limit.largest / times if sized.falls else limit.largest * times
    with_it, without = sized.with_value(there), sized.without()
    problem = known.problem
    runs = [
        replace(
            run, force=run.force + problem.predict(with_it, run) - problem.predict(without, run)
        )
        for run in problem.runs
    ]
    added = problem.of(runs)
    model = refine(known.model, added, 6)
    told = limit_of(Sized(name, SizeSearch(added, model, added.expectation(model), 6000))).largest
    assert told <= there if sized.falls else told >= there


def test_a_joint_is_looked_at_from_where_it_stands_out_of_a_rigid_one(known):
    sized = Sized("mount_compliance", known)
    size = resolved(sized, 1e-9)
    at, rigid = (np.clip(known.beyond(sized.change(one)), -HUBER, HUBER) for one in (size, 1e-3))
    assert size < 0.1
    assert np.linalg.norm(at) >= STANDS_OUT * np.linalg.norm(rigid)


def test_a_few_samples_far_out_do_not_bend_the_model(known):
    rng = np.random.default_rng(2)
    change = 3.0 * known.basis[:, 0]
    noise = rng.standard_normal(len(known.plain))
    spiked = noise + change
    spiked[:: len(noise) // 40] += 500.0
    kept = known.refitted(spiked) - (noise - known.basis @ (known.basis.T @ noise))
    kept[:: len(noise) // 40] = 0.0
    assert np.linalg.norm(kept) < 3.0  # least squares leaves some hundred
    assert np.linalg.norm(known.beyond(spiked - noise)) > 50.0


def test_what_hides_an_effect_is_told():
    problem = problem_of(steady)
    model = refine(Model("bingham", (), VALUES, ("f_v", "c_v")), problem)
    still = SizeSearch(problem, model, problem.expectation(model), 6000)
    found = {one.effect: one for one in effect_limits(still, ("coil_lag", SPRING), ("coil_lag",))}
    assert found["coil_lag"].why == "the command is constant"
    assert found[SPRING].why == ""
    sprung = {**VALUES, "gas_spring.k": 50.0, "gas_spring.k_3": 1e4}
    both = Model("bingham", (SPRING,), sprung, ("f_v", "c_v", "gas_spring.k_2"))
    taken = SizeSearch(problem, both, problem.expectation(both), 6000)
    assert limit_of(Sized("duffing", taken)).why == "gas_spring.k_3 hides it"


def test_every_effect_says_how_much_there_is_of_it():
    for name, effect in EFFECTS.items():
        if not effect.own:
            assert effect.amount.removeprefix("1/") in effect.parameters, name


def test_an_effect_without_an_amount_has_no_limit_and_says_why(known, monkeypatch):
    monkeypatch.setattr(EFFECTS["stribeck"], "amount", "")
    one, other = effect_limits(known, ("stribeck", SPRING))
    assert (one.effect, one.why) == (SPRING, "")
    assert (other.effect, other.why) == ("stribeck", NO_AMOUNT)
    rows = [limit.as_dict() for limit in (one, other)]
    assert limit_rows({"findings": [{"limits": rows}]})[1] == ["Stribeck effect", NO_AMOUNT, "", ""]


def test_the_table_has_units_as_people_write_them():
    limits = [
        EffectLimit("coil_lag", "tau", "s", False, 1.4e-3, 2e-4, 0.011, 2e-3),
        EffectLimit("mount_compliance", "k", "N/m", True, 2.1e7, None, None, None, True),
        EffectLimit("base_friction", why="f_c hides it"),
    ]
    verdict = {"findings": [{"site": "damper", "limits": [one.as_dict() for one in limits]}]}
    assert limit_rows(verdict) == [
        ["coil lag", "tau below 1.4 ms", "0.02 %", "11 ms"],
        ["mount compliance", "k above 21 MN/m", "below a sample", "no size"],
        ["base friction", "f_c hides it", "", ""],
    ]
    tables = [one.header for one in verdict_view({"kind": "none", **verdict}).every(Table)]
    assert tables == [("effect", "at most (95 %)", "of force", "named from")]
    assert not list(verdict_view({"kind": "none", "findings": []}).every(Table))


def test_the_models_own_parameters_move_so_that_what_is_left_is_least(known):
    sized = Sized("quadratic_damping", known)
    limit = limit_of(sized)
    moved = dict(limit.moved)
    assert set(moved) == set(known.model.free())
    joined = sized.with_value(limit.largest)
    values = {**joined.values, **{n: joined.value(n) + by for n, by in moved.items()}}
    change = residuals(known.problem, replace(joined, values=values), known.expected)
    left = known.counts * change - known.plain
    asked = known.beyond(sized.change(limit.largest / sized.one))
    assert np.linalg.norm(left - asked) < 0.05 * np.linalg.norm(asked)
    assert limit.as_dict()["moved"] == moved

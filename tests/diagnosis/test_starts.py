"""Where searches begin: one linear step ranks the starts, and little of the data suffices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bristle.data.measurement import measurements_of_frame
from bristle.diagnosis import trials
from bristle.diagnosis.trials import joinable, short_search, try_all
from bristle.identification.fit import fit_from_starts, refine
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.identification.start_grid import SearchContext, initial_guesses, ranked_guesses
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS

DT, RATE = 0.002, 500.0
SPRING = "gas_spring"
LAW = {"f_c": 1.3, "f_v": 0.83, "c_0": 40.0, "c_v": 15.0, "v_n": 0.05, "exponent": 1.0}


def recorded_rig(effects, values, count=3):
    """Return measurements of a Bingham damper with effects, with noise of 1 %."""
    rng = np.random.default_rng(3)
    runs = []
    for number in range(count):
        t = np.arange(3000) * DT
        x = sum(
            0.004 * np.sin(2.0 * np.pi * f * t + p) / f
            for f, p in zip((0.7, 1.9, 3.3), rng.uniform(0.0, 6.3, 3), strict=True)
        )
        v = np.gradient(x, DT)
        V = 4.0 * (np.floor(t / 1.5 + number) % 2)
        clean = (
            Problem([])
            .bench(Model("bingham", effects))
            .force(x, v, np.gradient(v, DT), V, DT, {**LAW, **values})
        )
        noisy = [c + 0.01 * c.std() * rng.standard_normal(len(t)) for c in (x, v, V, clean)]
        names = ("displacement [m]", "velocity [m/s]", "voltage [V]", "force [N]")
        frame = pd.DataFrame({"time [s]": t, **dict(zip(names, noisy, strict=True))})
        frame.attrs["name"] = f"run_{number + 1}"
        runs += measurements_of_frame(frame)
    return runs


def rig(effects, values):
    """Return the problem of fitting to such a rig."""
    runs = recorded_rig(effects, values)
    return Problem([prepare(run, seed=k) for k, run in enumerate(runs)])


@pytest.fixture(scope="module")
def springy():
    problem = rig(("gas_spring",), {"gas_spring.k": 200.0, "gas_spring.preload": 0.4})
    return SearchContext(fit_from_starts(problem, Model("bingham"), starts=2).model, problem)


def test_a_start_from_which_nothing_moves_is_left_out():
    # On a bench no spring is there to soften: k_3 < 0 has no force, and costs what the law costs.
    small = 7e4  # N/m3, a fiftieth of the first guess
    hidden = rig(("duffing",), {"duffing.k_3": small, "duffing.shape": 3.0})
    context = SearchContext(refine(Model("bingham", values=LAW), hidden), hidden)
    begun = ranked_guesses("duffing", context)
    assert begun
    assert all(one.model.value("duffing.k_3") > 0.0 for one in begun)
    found = short_search("duffing", context, begun)
    x = 0.01  # m
    force = found.model.value("duffing.k_3") * x**3
    assert force == pytest.approx(small * x**3, rel=0.5)


def test_a_linear_effect_is_found_by_the_first_step(springy):
    (best,) = ranked_guesses("gas_spring", springy)
    others = [
        ranked_guesses(name, springy)[0].cost for name in ("stribeck", "saturation", "asymmetry")
    ]
    assert best.cost < 0.3 * min(others)
    assert best.model.value("gas_spring.k") == pytest.approx(200.0, rel=0.05)


def test_a_short_search_ends_where_a_long_one_does(springy):
    guesses = short_search("gas_spring", springy, ranked_guesses("gas_spring", springy))
    fitted = refine(guesses.model, springy.train, 20)
    assert guesses.cost < 0.3 * springy.cost
    assert fitted.value("gas_spring.k") == pytest.approx(200.0, rel=0.05)
    assert fitted.value("gas_spring.preload") == pytest.approx(0.4, rel=0.1)


def test_a_search_that_has_ended_is_not_begun_again(springy):
    first, *_ = trials.guesses_of([SPRING], springy)[SPRING]
    assert first.settled
    assert short_search(SPRING, springy, [first]).model is first.model


def test_the_noise_of_a_model_is_drawn_once(springy, monkeypatch):
    train = springy.train
    drawn = train.expectation(springy.base)
    monkeypatch.delattr(Problem, "predict")
    assert train.expectation(replace(springy.base)) is drawn
    with pytest.raises(AttributeError):
        train.expectation(springy.base, 4)


@pytest.mark.parametrize("effect", joinable(Model("bingham")))
def test_starts_cover_the_grid_and_differ(springy, effect):
    found = initial_guesses(effect, springy.base, springy.train)
    nodes = int(np.prod([len(values) for values in EFFECTS[effect].start_grid.values()]))
    assert len(found) % nodes == 0
    values = {tuple(sorted(model.values.items())) for model in found}
    assert len(values) == len(found)


def test_the_effect_that_is_there_promises_most(springy):
    (there,) = initial_guesses("gas_spring", springy.base, springy.train)
    data = springy.screening("gas_spring")
    for name in ("quadratic_damping", "asymmetry"):
        others = initial_guesses(name, springy.base, springy.train)
        assert max(map(data.promise, others)) < 0.3 * data.promise(there)


def test_what_cannot_win_is_not_searched_further(springy, monkeypatch):
    searched = []

    def noted(name, *given):
        searched.append(name)
        return short_search(name, *given)

    monkeypatch.setattr(trials, "short_search", noted)
    found = try_all(springy.base, springy.train, springy.train)
    assert found[0].effects == ("gas_spring",)
    assert found[0].refined
    assert {one.effects[-1] for one in found} == set(joinable(springy.base, problem=springy.train))
    assert "gas_spring" in searched
    assert len(searched) < len(found) / 2
    assert not any(one.refined for one in found if one.effects[-1] not in searched)


def test_where_nothing_is_missing_hardly_an_effect_is_screened(springy, monkeypatch):
    looked = []
    plain = trials.screened

    def noted(name, *given):
        looked.append(name)
        return plain(name, *given)

    monkeypatch.setattr(trials, "screened", noted)
    trials.guesses_of(["gas_spring", "delay"], springy)
    assert "gas_spring" in looked
    looked.clear()
    whole = refine(springy.base.with_effect("gas_spring"), springy.train)
    names = joinable(whole, problem=springy.train)
    found = trials.guesses_of(names, SearchContext(whole, springy.train))
    assert set(found) == set(names)
    assert len(looked) < len(names) / 2

"""A run cut out of a longer one begins with what its force tells that the damper held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bristle.data.measurement import measurements_of_frame
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, Run
from bristle.identification.run_start import MOVING, SETTLING, under_load_text
from bristle.model.model import Model

DT, NOISE = 0.002, 0.02
MODEL = Model(
    "lugre",
    (),
    {
        "sigma_a": 4000.0, "sigma_0": 1000.0, "sigma_1": 5.0, "sigma_2": 30.0, "sigma_b": 10.0,
        "v_n": 0.05, "a_0": 800.0,
    },
)  # fmt: skip

FADES = Model(  # behind a dashpot: 17 N at first would be the load of 7.5 N later
    "modified_bouc_wen",
    (),
    {
        "f_c": 12.0, "f_v": 0.0, "rho": 1000.0, "c_0": 5.0, "c_v": 0.0, "c_1": 3000.0, "c_1v": 0.0,
    },
)  # fmt: skip


def recorded(x, begin=0, offset=0.0, model=MODEL):
    """Return the run of a motion x from sample `begin` on, with the force that a model has had."""
    t = np.arange(len(x)) * DT
    v = np.gradient(x, DT)
    a, V = np.gradient(v, DT), np.full(len(t), 2.0)
    whole = Run("whole", DT, x, v, a, V, np.zeros(len(t)), NOISE, np.zeros((1, len(t), 4)))
    force = Problem([whole]).predict(model, whole) + offset
    noise = np.random.default_rng(1).standard_normal((3, len(t)))
    frame = pd.DataFrame(
        {
            "time [s]": t[begin:] - t[begin],
            "displacement [m]": (x + 1e-6 * noise[0])[begin:],
            "velocity [m/s]": (v + 1e-4 * noise[1])[begin:],
            "voltage [V]": V[begin:],
            "force [N]": (force + NOISE * noise[2])[begin:],
        }
    )
    (one,) = measurements_of_frame(frame)
    return prepare(one)


def stop_and_go():
    t = np.arange(6000) * DT
    turns = np.clip(np.mod(t, 4.0) / 1.0, 0.0, 1.0) - np.clip(np.mod(t, 4.0) - 2.0, 0.0, 1.0)
    return 0.01 * (1.0 - np.cos(np.pi * turns))


def left(run, model=MODEL):
    """Return what a model does not predict (n,) [N] of a run."""
    return run.force - Problem([run]).predict(model, run)


@pytest.mark.parametrize("begin", [750, 1700])  # the rests after a stroke out and one back
def test_a_run_cut_out_under_load_is_judged_once_the_bristles_have_slipped(begin):
    run = recorded(stop_and_go(), begin)
    forgetful = left(replace(run, rest=0))
    assert run.skip > SETTLING
    assert float(np.std(forgetful[: run.skip])) > 20.0 * NOISE  # the bent bristles
    assert float(np.sqrt(np.mean(forgetful[run.skip :] ** 2))) < 3.0 * NOISE


def test_a_run_that_sets_out_from_rest_is_judged_from_there_however_soon_it_moves():
    t = np.arange(3000) * DT
    swinging = 0.01 * (1.0 - np.cos(2.0 * np.pi * 1.5 * t))
    turning = round(0.5 / 1.5 / DT)  # the speed is zero as at first, and the bristles are bent
    assert recorded(swinging).opening == 0
    assert recorded(swinging, turning).opening > SETTLING


@pytest.mark.parametrize("begin", [750, 1700])
def test_bristles_begin_with_the_load_under_which_a_run_begins(begin):
    run = recorded(stop_and_go(), begin)
    assert SETTLING <= run.rest <= run.skip
    assert float(np.sqrt(np.mean(left(run) ** 2))) < 3.0 * NOISE  # from the first sample on
    (deflection,) = Problem([run]).carrying(MODEL, run).values()
    assert deflection * run.force[0] > 0.0


@pytest.mark.parametrize("held", [1.0, 0.9])
def test_plates_behind_play_begin_with_the_load_or_the_nearest_that_they_hold(held):
    values = {"f_c": 8.0, "c": 20.0, "k": 0.0, "f_0": 0.0, "rho": 4e3, "play": 2e-4, "gamma": 1.0}
    model = Model("friction_damper", (), values)
    run = recorded(stop_and_go(), 750, model=model)
    assert run.rest
    weaker = model.with_values({"f_c": held * 8.0})
    (offset,) = Problem([run]).carrying(weaker, run).values()
    assert offset * run.force[0] > 0.0
    at_rest = left(run, weaker)[: run.rest]
    assert abs(float(np.mean(at_rest))) < (1.05 - held) * abs(float(run.force[0]))


def test_an_effect_in_the_place_of_the_sign_carries_the_load_of_a_law_without_states():
    run = recorded(stop_and_go(), 750)
    law = Model("bingham", ("presliding",), {"f_c": 12.0, "presliding.x_s": 2e-3})
    start = Problem([run]).carrying(law, run)
    rested = left(run, law)[5 : run.rest]
    assert list(start) == ["presliding.direction_0"]
    assert abs(float(np.mean(rested))) < 0.03 * abs(float(np.mean(run.force[: run.rest])))


@pytest.mark.parametrize(
    "model",
    [
        Model("bingham", (), {"f_c": 12.0}),  # nothing in it carries a force at rest
        FADES,
        replace(MODEL, values={**MODEL.values, "sigma_a": np.nan}),
    ],
)
def test_a_model_that_carries_no_load_at_rest_begins_at_zero(model):
    run = recorded(stop_and_go(), 750)
    assert Problem([run]).carrying(model, run) == {}


def test_a_part_of_a_run_rests_only_where_it_begins_with_it():
    run = recorded(stop_and_go(), 750)
    assert run.of(slice(100, None)).rest == 0
    assert run.of(slice(None, None, 5)).rest == run.rest // 5
    assert run.of(slice(0, 50)).rest == 50


def test_runs_that_begin_under_load_are_told_with_it():
    assert under_load_text({}) == ""
    assert under_load_text({"run_2": -2.2846}).startswith("run_2 (-2.28 N) begins at rest")
    assert under_load_text({"a": 1.0, "b": 2.0}).startswith("a (1 N), b (2 N) begin at rest")


def test_bristles_that_never_slip_tell_no_force_of_each_run():
    x = 0.01 * np.sin(2.0 * np.pi * 1.1 * np.arange(3000) * DT)
    run = recorded(x, begin=800, offset=30.0)
    law = Model("dahl", (), {"f_c": 0.1, "f_v": 0.0, "rho": 1.0, "c_0": 60.0, "c_v": 0.0})
    (deflection,) = Problem([run]).carrying(law, run).values()
    assert abs(deflection) <= 1.01 * float(np.ptp(run.x))
    assert abs(float(np.mean(left(run, law)))) > 25.0


TWO_STATES = Model("modified_bouc_wen")  # what its dashpot holds lasts longer than any settling
STATED = [(Model("bouc_wen"), 1), (Model("fluid_viscous"), 1), (TWO_STATES, 2), (MODEL, 1)]


@pytest.mark.parametrize(("model", "states"), STATED)
def test_a_run_cut_out_of_a_motion_tells_what_the_damper_held(model, states):
    t = np.arange(4000) * DT
    x = 0.006 * np.sin(2.0 * np.pi * 1.1 * t) + 0.003 * np.sin(2.0 * np.pi * 2.9 * t + 1.0)
    run = recorded(x, begin=800, model=model)
    assert (run.skip, run.rest) == (MOVING, 0)
    remembers = slice(0, run.opening)
    forgetful = run.force - Problem([run]).predict(model, replace(run, opening=0))
    assert float(np.std(forgetful[remembers])) > 5.0 * NOISE
    for part in (remembers, slice(run.opening, None)):
        assert float(np.sqrt(np.mean(left(run, model)[part] ** 2))) < 1.3 * NOISE
    assert len(Problem([run]).carrying(model, run)) == states


def test_gaps_and_a_law_that_overflows_tell_no_start():
    t = np.arange(4000) * DT
    run = recorded(0.01 * np.sin(5.0 * t), begin=800)
    spoilt = replace(run, force=np.where(np.arange(len(run.force)) < 9, 1e6, run.force))
    lost = replace(spoilt, left_out={"missing": np.arange(len(run.force)) < 9})
    (start,) = Problem([run]).carrying(MODEL, run).values()
    assert Problem([lost]).carrying(MODEL, lost) == {
        "bristle_deflection_0": pytest.approx(start, rel=0.02)
    }
    wild = replace(MODEL, values={**MODEL.values, "sigma_a": np.nan})
    assert Problem([run]).carrying(wild, run) == {}


def test_a_run_from_rest_without_load_is_judged_from_its_begin():
    t = np.arange(3000) * DT
    run = recorded(np.where(t > 1.0, 0.01 * np.sin(3.0 * (t - 1.0)), 0.0))
    assert (run.skip, run.rest, run.opening) == (SETTLING, 0, 0)


def test_a_preload_costs_no_more_than_a_fifth_of_a_run():
    slow = 0.01 * np.linspace(0.0, 1.0, 4000) ** 6
    assert SETTLING < recorded(slow, offset=50.0).skip <= 800

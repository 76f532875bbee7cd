"""A run cut out of a longer one is judged from where the damper has forgotten how it began."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.data.measurement import measurements_of_frame
from bristle.identify.model import Model, Problem, Run
from bristle.identify.prepare import SETTLING, prepare

DT, NOISE = 0.002, 0.02
MODEL = Model(
    "lugre",
    (),
    {
        "sigma_a": 4000.0, "sigma_0": 1000.0, "sigma_1": 5.0, "sigma_2": 30.0, "sigma_b": 10.0,
        "v_n": 0.05, "a_0": 800.0,
    },
)  # fmt: skip


def recorded(x, begin=0, offset=0.0):
    """Return the run of a motion x from sample `begin` on, with the force that MODEL has had."""
    t = np.arange(len(x)) * DT
    v = np.gradient(x, DT)
    a, V = np.gradient(v, DT), np.full(len(t), 2.0)
    whole = Run("whole", DT, x, v, a, V, np.zeros(len(t)), NOISE, np.zeros((1, len(t), 4)))
    force = Problem([whole]).predict(MODEL, whole) + offset
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


@pytest.mark.parametrize("begin", [750, 1700])  # the rests after a stroke out and one back
def test_a_run_cut_out_under_load_is_judged_once_the_bristles_have_slipped(begin):
    run = recorded(stop_and_go(), begin)
    left = run.force - Problem([run]).predict(MODEL, run)
    assert run.skip > SETTLING
    assert float(np.std(left[: run.skip])) > 20.0 * NOISE  # the bent bristles, which nobody knows
    assert float(np.sqrt(np.mean(left[run.skip :] ** 2))) < 3.0 * NOISE


def test_a_run_cut_out_of_a_motion_is_judged_once_the_bristles_have_slipped():
    t = np.arange(5000) * DT
    run = recorded(0.01 * np.sin(2.0 * t), begin=800)  # it turns there: the force has lost its load
    left = run.force - Problem([run]).predict(MODEL, run)
    assert run.skip > SETTLING
    assert float(np.std(left[: run.skip])) > 20.0 * NOISE
    assert float(np.sqrt(np.mean(left[run.skip :] ** 2))) < 2.0 * NOISE


def test_a_run_from_rest_without_load_is_judged_from_its_begin():
    t = np.arange(3000) * DT
    run = recorded(np.where(t > 1.0, 0.01 * np.sin(3.0 * (t - 1.0)), 0.0))
    assert run.skip == SETTLING


def test_a_preload_costs_no_more_than_a_fifth_of_a_run():
    slow = 0.01 * np.linspace(0.0, 1.0, 4000) ** 6
    assert SETTLING < recorded(slow, offset=50.0).skip <= 800

"""A velocity computed from the displacement is recognised, and left out where it would mislead."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.cut_off import derived_velocity
from bristle.data.measurement import measurements_of_frame
from bristle.diagnosis.prepared import corrected
from bristle.diagnosis.sensor_faults import sensor_faults
from bristle.identification.prepare import prepare

DT = 0.01
T = np.arange(1500) * DT
RATE = 2.0 * np.pi * 0.9


def bench(velocity, x, noise=None):
    frame = pd.DataFrame({"time": T, "x": x, "v": velocity, "F": 100.0 * np.tanh(velocity / 0.01)})
    specs = {
        "time": ChannelSpec("time", "s"), "displacement": ChannelSpec("x", "m", noise=noise),
        "velocity": ChannelSpec("v", "m/s"), "force": ChannelSpec("F", "N"),
    }  # fmt: skip
    return measurements_of_frame(frame, "run", specs)[0]


def noisy(seed=0):
    return 0.012 * np.sin(RATE * T) + 3e-6 * np.random.default_rng(seed).standard_normal(len(T))


def differences(x):
    step = np.diff(x) / DT
    return {
        "backward": np.append(step[0], step),
        "forward": np.append(step, step[-1]),
        "central": np.gradient(x, DT),
    }


@pytest.mark.parametrize("how", ["backward", "forward", "central"])
def test_a_difference_is_recognised_also_after_rounding(how):
    x = noisy()
    assert derived_velocity(bench(differences(x)[how], x)) == how
    rounded = np.round(differences(x)[how], 5)
    assert derived_velocity(bench(rounded, np.round(x, 9))) == how


def test_an_instrument_is_not_taken_for_a_difference():
    v = 0.012 * RATE * np.cos(RATE * T)
    own = np.random.default_rng(1).standard_normal(len(T))
    assert derived_velocity(bench(v + 5e-4 * own, noisy())) == ""
    # A good velocity beside a displacement without noise is near every difference of it.
    assert derived_velocity(bench(v, 0.012 * np.sin(RATE * T), noise=0.0)) == ""


def test_the_motion_is_that_of_the_displacement_alone():
    x = noisy()
    late = prepare(bench(differences(x)["backward"], x))
    truth = 0.012 * RATE * np.cos(RATE * T)
    inner = slice(50, -50)
    error = np.sqrt(np.mean((late.v - truth)[inner] ** 2))
    # Half a sample late would be 1.9 mm/s RMS off.
    assert np.std(np.diff(truth)) / 2.0 == pytest.approx(1.35e-3, rel=0.05)
    assert error < 2e-4


def test_it_is_told_as_what_it_is():
    x = noisy()
    run = bench(differences(x)["backward"], x)
    faults = sensor_faults([run])
    assert [(one.channel, one.kind) for one in faults] == [("velocity", "derived")]
    assert faults[0].value == pytest.approx(0.5 * DT)
    assert "backward difference of displacement" in faults[0].text
    assert not corrected([run], faults)[0].has("velocity")
    # A central difference is not late: nothing is wrong with it.
    assert sensor_faults([bench(differences(x)["central"], x)]) == []

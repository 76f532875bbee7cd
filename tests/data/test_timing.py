"""A channel whose clock is late or fast comes to the times of the others, with its noise."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.corrections import Correction
from bristle.data.decimate import in_time
from bristle.data.measurement import Known, measurements_of
from bristle.data.read import read_table


def placed(channels, corrections, step=0.002, begin=0.0):
    known = {name: np.ones(len(y), dtype=bool) for name, y in channels.items()}
    return in_time(channels, known, step, corrections, begin)


def test_a_late_channel_is_moved_and_its_end_is_lost():
    t = np.arange(3000) * 0.002
    late = {"displacement": np.sin(3.0 * (t - 0.01))}
    moved = placed(late, [Correction("displacement", "delay", 0.01)])
    assert np.abs(moved.channels["displacement"] - np.sin(3.0 * t))[:-5].max() < 1e-4
    assert np.flatnonzero(moved.lost["displacement"]).tolist() == [*range(2995, 3000)]


def test_a_clock_gains_from_the_begin_of_the_record_on():
    t = 40.0 + np.arange(3000) * 0.002
    fast = {"displacement": np.sin(3.0 * t / 1.001)}
    moved = placed(fast, [Correction("displacement", "clock", 1e-3)], begin=40.0)
    known = ~moved.lost["displacement"]
    assert np.abs(moved.channels["displacement"] - np.sin(3.0 * t))[known].max() < 1e-4
    assert 2970 < known.sum() < 2980  # 40 ms at the start of this part are before it


def force_of(t):
    return 5.0 * np.tanh(72e-3 * np.cos(9.0 * t) / 3e-3) + 90.0 * 72e-3 * np.cos(9.0 * t)


@pytest.mark.parametrize("late", [0.004, 0.0045, 0.005])
@pytest.mark.parametrize("rate", [0.0, 250.0])
def test_a_force_that_was_moved_has_the_noise_that_it_still_has(late, rate, tmp_path):
    t = np.arange(12000) * 0.002
    force = force_of(t - late) + np.random.default_rng(3).normal(0.0, 0.3, len(t))
    x = 8e-3 * np.sin(9.0 * t)
    frame = np.column_stack([t, x, force])
    titles = "time [s],x [m],force [N]"
    np.savetxt(tmp_path / "run.csv", frame, delimiter=",", header=titles, comments="")
    known = Known(rate=rate, corrections=(Correction("force", "delay", late),))
    (run,) = measurements_of(read_table(tmp_path / "run.csv"), known=known)
    left = (run["force"] - force_of(run.time))[run.valid("force")]
    assert run.valid("force").mean() > 0.9
    assert np.std(left) / run.noise["force"] == pytest.approx(1.0, abs=0.06)


def test_a_force_without_noise_is_lost_where_it_jumps_alone():
    t = np.arange(3000) * 0.002
    for force in (np.sin(9.0 * (t - 0.005)), force_of(t - 0.005)):
        moved = placed({"force": force}, [Correction("force", "delay", 0.005)])
        assert moved.lost["force"].mean() < 0.1


def test_a_noise_that_is_given_is_that_of_the_instrument_with_its_gain(tmp_path):
    t = np.arange(500) * 0.004
    table = np.column_stack([t, 8e-3 * np.sin(9.0 * t), 5.0 * force_of(t)])
    titles = "time [s],x [m],force [N]"
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header=titles, comments="")
    table = read_table(tmp_path / "run.csv")
    channels = {
        "time": ChannelSpec("time [s]"), "displacement": ChannelSpec("x [m]"),
        "force": ChannelSpec("force [N]", noise=0.05),
    }  # fmt: skip
    known = Known(corrections=(Correction("force", "gain", 5.0),))
    (run,) = measurements_of(table, channels, known=known)
    assert run.noise["force"] == pytest.approx(0.01)

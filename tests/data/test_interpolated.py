"""Channels that a laboratory interpolated: told with their rate, and nothing else is."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.data.checks.recording import check_recording, interpolated
from bristle.data.measurement import measurements_of_frame

T = 0.002 * np.arange(4000)


def motion(t, noise=0.01):
    rng = np.random.default_rng(3)
    tones = sum(np.sin(2.0 * np.pi * f * t + f) / f for f in (0.7, 1.9, 4.3))
    return tones + noise * rng.standard_normal(len(t))


@pytest.mark.parametrize("ratio", [2.0, 2.5, 5.0, 8.3])
@pytest.mark.parametrize("digits", [4, 6, 16])
def test_a_linear_interpolation_is_told_with_its_rate(ratio, digits):
    coarse = np.arange(0.0, T[-1] + 0.1, 0.002 * ratio)
    y = np.round(np.interp(T, coarse, motion(coarse)), digits)
    assert interpolated(y) == pytest.approx(ratio, rel=0.25)


def test_what_was_measured_is_not():
    steps = np.round(motion(T, 0.0), 3)  # an instrument of few steps
    triangle = np.abs((0.7 * T) % 1.0 - 0.5)
    staircase = np.repeat(motion(T)[::5], 5)
    for y in (motion(T), motion(T, 0.0), steps, triangle, staircase, np.zeros(4000), T[:50]):
        assert interpolated(y) == 0.0


def test_a_run_s_finding_names_channel_and_rate_and_leaves_the_command():
    coarse = T[::5]
    force, ramp = np.interp(T, coarse, motion(coarse)), np.interp(T, [0.0, 4.0, 8.0], [0, 5, 1])
    columns = {"displacement [m]": 1e-3 * motion(T), "force [N]": force, "voltage [V]": ramp}
    (run,) = measurements_of_frame(pd.DataFrame({"time [s]": T, **columns}), "run")
    (found,) = [one for one in check_recording([run]) if one.kind == "interpolated"]
    assert (found.channel, found.level) == ("force", "warning")
    assert "100 samples per second were measured" in found.text
    assert "rate = 100" in found.do

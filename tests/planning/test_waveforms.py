"""Planned tests begin and end at rest, keep the limits of the rig, and have levels that it has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bristle.errors import StudyError
from bristle.planning.limits import (
    RESERVE,
    RigLimits,
    Test,
    limits_given,
    read_quantity,
    read_rig,
    with_given,
)
from bristle.planning.waveforms import COMMANDS, MOTIONS, Command, Waveform, command_of, shape_of

LIMITS = RigLimits(
    stroke=20e-3, speed=0.25, acceleration=8.0, command=(0.0, 5.0), duration=5.0, rate=200.0
)
OWN = [name for name in MOTIONS if name != "record"]


@pytest.mark.parametrize("kind", OWN)
def test_a_motion_has_unit_peak_and_begins_and_ends_at_rest(kind: str) -> None:
    t = np.arange(1001) / 200.0
    x, v, a = shape_of(Waveform(kind, 0.6, 4.0, seed=3), t)
    assert np.max(np.abs(x)) == pytest.approx(1.0)
    assert max(abs(y[k]) for y in (x, v) for k in (0, -1)) < 1e-3 * np.max(np.abs(v))
    # The velocity and the acceleration are those of the displacement.
    assert np.max(np.abs(np.gradient(x, t)[2:-2] - v[2:-2])) < 0.05 * np.max(np.abs(v))
    assert np.max(np.abs(np.gradient(v, t)[2:-2] - a[2:-2])) < 0.25 * np.max(np.abs(a))


@pytest.mark.parametrize("kind", OWN)
@pytest.mark.parametrize("limited", ["stroke", "speed", "acceleration"])
def test_a_test_keeps_every_limit_with_a_reserve(kind: str, limited: str) -> None:
    limits = replace(LIMITS, **{limited: 0.2 * getattr(LIMITS, limited)})
    one = Test(Waveform(kind, 0.6, 4.0, seed=3), Command("held", 0.0, 5.0), seconds=5.0)
    signals = one.signals(limits)
    shares = [
        np.max(np.abs(signals.x)) / limits.stroke, np.max(np.abs(signals.v)) / limits.speed,
        np.max(np.abs(signals.a)) / limits.acceleration,
    ]  # fmt: skip
    assert max(shares) == pytest.approx(0.9)


@pytest.mark.parametrize("kind", list(COMMANDS))
def test_a_command_stays_between_its_levels(kind: str) -> None:
    t = np.arange(2001) / 200.0
    V = command_of(Command(kind, 1.0, 4.0, 0.8, seed=2), t)
    assert V.min() >= 1.0
    assert V.max() <= 4.0 + 1e-12
    assert V.max() == pytest.approx(4.0, abs=0.6)


def test_an_amplifier_with_a_slew_gets_ramps_and_one_with_levels_gets_these() -> None:
    one = Test(Waveform("sine", 0.6, 1.0), Command("switched", 0.0, 5.0, 0.5), seconds=5.0)
    slow = one.signals(replace(LIMITS, slew=10.0)).V
    assert np.max(np.abs(np.diff(slow))) * LIMITS.rate <= 10.0 * RESERVE * (1.0 + 1e-9)
    smooth = Test(Waveform("sine", 0.6, 1.0), Command("sine", 0.0, 5.0, 2.0), seconds=5.0)
    levels = smooth.signals(replace(LIMITS, levels=(0.0, 2.0, 5.0))).V
    assert {*levels.tolist()} == {0.0, 2.0, 5.0}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"stroke": 0.0}, "allow no motion"), ({"band": (5.0, 1.0)}, "lowest frequency first"),
        ({"command": (5.0, 0.0)}, "least value first"), ({"slew": 0.0}, "cannot change"),
        ({"runs": 0}, "1 or more"), ({"duration": 1.0}, "2 s or more"),
        ({"rate": 20.0}, "400 or more"), ({"pause": -1.0}, "0 or more"),
        ({"band": (0.01, 0.05)}, "not one period"),
        ({"command": (0.2, 0.8), "levels": (0.0, 1.0, 2.0)}, "levels = 0, 1, 2: none of them"),
    ],
)  # fmt: skip
def test_limits_that_allow_no_test_are_refused(wrong: dict[str, object], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        with_given(LIMITS, wrong)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("20 mm", "m", 0.02), ("20mm", "m", 0.02), (0.02, "m", 0.02), ("2 kN", "N", 2000.0),
     ("10m/s2", "m/s2", 10.0), ("5V/s", "V/s", 5.0), ("2e-3m", "m", 0.002)],
)  # fmt: skip
def test_a_quantity_is_a_number_with_its_unit(text: str, unit: str, value: float) -> None:
    assert read_quantity(text, unit) == pytest.approx(value)


@pytest.mark.parametrize("text", ["twenty mm", "20 kg", "20", "nan m", "inf m", ""])
def test_what_is_no_quantity_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(StudyError, match=r'^= .*"20 mm"'):
        read_quantity(text, "m")


def test_a_command_takes_no_level_outside_its_range() -> None:
    limits = with_given(LIMITS, {"command": (0.0, 1.6), "levels": (0.0, 1.0, 2.0)})
    assert (limits.levels, limits.command) == ((0.0, 1.0), (0.0, 1.0))
    test = Test(Waveform("sine", 0.5, 0.5), Command("switched", 0.0, limits.nearest(1.6), 1.0))
    assert test.signals(limits).V.max() == 1.0


def test_limits_from_python_are_read_as_those_of_a_file() -> None:
    given = {"band": ("0.2 Hz", "4 Hz"), "slew": "20 A/s", "levels": [0, "2 A"], "speed": 0.1}
    assert limits_given(given, "current") == {
        "band": (0.2, 4.0), "slew": 20.0, "levels": (0.0, 2.0), "speed": 0.1
    }  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"runs": "6"}, "whole number"), ({"band": 5.0}, "expected a list of 2"),
        ({"band": ("1 Hz",)}, "is a list of 1"), ({"motions": "sine"}, "expected a list"),
        ({"motions": ["sinus"]}, '"sine"'), ({"commands": []}, "empty"),
        ({"command": (0.0, np.nan)}, "command = nan"), ({"strok": 1.0}, "stroke"),
    ],
)  # fmt: skip
def test_limits_from_python_that_are_none_are_refused(wrong: dict[str, Any], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        limits_given(wrong)


def test_a_rig_file_is_read_with_every_mistake_and_its_line(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text(
        'schema = 1\n[limits]\nstroke = "15 mm"\nband = ["0.2 Hz", "10 Hz"]\nruns = 6\n'
        'levels = ["0 A", "1 A", "2 A"]\nmotions = ["sine"]\n'
    )
    assert read_rig(file, "current") == {
        "stroke": 0.015, "band": (0.2, 10.0), "runs": 6, "levels": (0.0, 1.0, 2.0),
        "motions": ("sine",),
    }  # fmt: skip
    file.write_text('schema = 1\n[limits]\nstroke = "15 kg"\nmotions = ["square"]\nstrok = 1\n')
    with pytest.raises(StudyError) as told:
        read_rig(file)
    for part in (":3: [limits] stroke", ":4: ", "square", "strok"):
        assert part in str(told.value)

"""Test signals: their values, their rates, and texts that are no signal."""

from __future__ import annotations

from math import cos, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bristle.errors import PhysicsError
from bristle.physics.signals import KINDS, PARAMETERS, rate, read_steps, value

NONE: list[float] = [0.0]
TIMES = [0.0, 0.5, 0.8, 2.0]
SAMPLES = [1.0, 3.0, -2.0, 0.0]
SMOOTH = ["constant", "sine", "chirp", "half_sine"]


def numbers(**given: float) -> list[float]:
    assert set(given) <= set(PARAMETERS)
    return [given.get(name, parameter.value) for name, parameter in PARAMETERS.items()]


def at(kind: str, t: float, **given: float) -> float:
    return value(KINDS[kind], t, numbers(**given), NONE, NONE)


def slope(kind: str, t: float, **given: float) -> float:
    return rate(KINDS[kind], t, numbers(**given), NONE, NONE)


def test_constant() -> None:
    assert [at("constant", t, level=-2.5) for t in (-1.0, 0.0, 7.0)] == [-2.5] * 3
    assert slope("constant", 1.0, level=-2.5) == 0.0


def test_sine_about_its_offset_from_its_start() -> None:
    given = {"amplitude": 2.0, "frequency": 0.5, "phase": 0.3, "offset": 1.0, "start": 3.0}
    assert at("sine", 2.999, **given) == 1.0
    assert at("sine", 4.2, **given) == pytest.approx(1.0 + 2.0 * sin(pi * 1.2 + 0.3), rel=1e-14)
    expected = 2.0 * pi * cos(pi * 1.2 + 0.3)
    assert slope("sine", 4.2, **given) == pytest.approx(expected, rel=1e-13)
    assert slope("sine", 2.999, **given) == 0.0


def test_a_sine_has_no_end() -> None:
    assert at("sine", 1e3 + 0.25, duration=1.0) == pytest.approx(1.0, abs=1e-9)


def test_half_sine_is_one_arch() -> None:
    given = {"amplitude": 2.0, "duration": 0.2, "start": 1.0, "offset": 0.5}
    found = [at("half_sine", t, **given) for t in (0.9, 1.0, 1.1, 1.2, 5.0)]
    assert found == pytest.approx([0.5, 0.5, 2.5, 0.5, 0.5], abs=1e-14)
    assert slope("half_sine", 1.0, **given) == pytest.approx(2.0 * pi / 0.2)
    assert slope("half_sine", 1.3, **given) == 0.0


@pytest.mark.parametrize(("frequency", "frequency_end"), [(1.0, 10.0), (10.0, 1.0), (3.0, 3.0)])
def test_a_chirp_sweeps_its_frequency_linearly(frequency: float, frequency_end: float) -> None:
    given = {"frequency": frequency, "frequency_end": frequency_end, "duration": 70.0}
    for t in (0.0, 20.0, 65.0):
        # The frequency is the rate of the phase, seen at the zero crossings next to t.
        crossings = []
        step = 1e-4
        s = t
        while len(crossings) < 2 and s < 70.0:
            a, b = at("chirp", s, **given), at("chirp", s + step, **given)
            if a <= 0.0 < b:
                crossings.append(s - a * step / (b - a))
            s += step
        middle = 0.5 * (crossings[0] + crossings[1])
        expected = frequency + (frequency_end - frequency) * middle / 70.0
        assert 1.0 / (crossings[1] - crossings[0]) == pytest.approx(expected, rel=2e-3)


def test_a_chirp_ends_with_its_duration() -> None:
    assert at("chirp", 1.0, duration=1.0, offset=0.2) == 0.2
    assert slope("chirp", 1.0, duration=1.0) == 0.0


@given(
    kind=st.sampled_from(SMOOTH),
    t=st.floats(0.0, 3.0),
    amplitude=st.floats(-5.0, 5.0),
    frequency=st.floats(0.0, 5.0),
    frequency_end=st.floats(0.0, 5.0),
    phase=st.floats(-3.0, 3.0),
    offset=st.floats(-2.0, 2.0),
    start=st.floats(-1.0, 1.0),
    duration=st.floats(0.5, 4.0),
)
def test_the_rate_is_the_derivative_of_the_value(kind: str, t: float, **given: float) -> None:
    d = 1e-5
    for edge in (given["start"], given["start"] + given["duration"]):
        assume(abs(t - edge) > 2.0 * d)  # kinks and jumps have none
    centred = (at(kind, t + d, **given) - at(kind, t - d, **given)) / (2.0 * d)
    # The third derivative of the fastest signal here is 5 (2 pi 10)^3.
    assert slope(kind, t, **given) == pytest.approx(centred, abs=5e-4)


def test_steps_hold_each_value_until_the_next() -> None:
    times, samples = read_steps("0.5:1 1.5:-4 3:0.25")
    assert (times, samples) == ([0.5, 1.5, 3.0], [1.0, -4.0, 0.25])
    found = [
        value(KINDS["steps"], t, numbers(), times, samples)
        for t in (0.0, 0.49, 0.5, 1.49, 1.5, 3.0, 99.0)
    ]
    assert found == [0.0, 0.0, 1.0, 1.0, -4.0, 0.25, 0.25]
    assert rate(KINDS["steps"], 1.5, numbers(), times, samples) == 0.0


def test_a_step_at_a_time_that_was_added_up_is_not_late() -> None:
    times, samples = read_steps("0:1 0.3:2")
    added = sum([0.1] * 3), 0.7 - 0.4  # hosts add up their steps
    assert min(added) < 0.3 < max(added)
    for t in (0.3, *added):
        assert value(KINDS["steps"], t, numbers(), times, samples) == 2.0
    assert value(KINDS["steps"], 0.3 - 1e-6, numbers(), times, samples) == 1.0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no pair; give TIME:VALUE pairs"),
        ("0", '"0" is not TIME:VALUE'),
        ("0:1 1:", '"1:" is not TIME:VALUE'),
        ("0:x", '"0:x" is not TIME:VALUE'),
        ("0:nan", '"0:nan" is not TIME:VALUE, two finite numbers'),
        ("inf:1", '"inf:1" is not TIME:VALUE, two finite numbers'),
        ("0:1, 2:3", '"0:1," is not TIME:VALUE'),
        ("0:1 0:2", "the time 0 s does not follow 0 s"),
        ("1:1 0.5:2", "the time 0.5 s does not follow 1 s"),
    ],
)
def test_texts_that_are_no_steps(text: str, says: str) -> None:
    with pytest.raises(PhysicsError, match=says):
        read_steps(text)


def test_csv_is_linear_between_its_samples_and_zero_outside() -> None:
    found = [
        value(KINDS["csv"], t, numbers(), TIMES, SAMPLES) for t in (-0.1, 0.25, 0.5, 0.65, 2.0, 2.1)
    ]
    assert found == pytest.approx([0.0, 2.0, 3.0, 0.5, 0.0, 0.0], abs=1e-14)


@given(t=st.floats(-0.5, 2.5))
def test_the_rate_of_csv_is_its_slope(t: float) -> None:
    d = 1e-6
    assume(min(abs(t - edge) for edge in TIMES) > 2.0 * d)
    csv = KINDS["csv"]
    centred = (
        value(csv, t + d, numbers(), TIMES, SAMPLES) - value(csv, t - d, numbers(), TIMES, SAMPLES)
    ) / (2.0 * d)
    assert rate(csv, t, numbers(), TIMES, SAMPLES) == pytest.approx(centred, abs=1e-6)


def test_at_a_sample_the_rate_is_that_of_what_follows() -> None:
    found = [rate(KINDS["csv"], t, numbers(), TIMES, SAMPLES) for t in TIMES]
    assert found == pytest.approx([4.0, -5.0 / 0.3, 2.0 / 1.2, 0.0])


def test_every_kind_has_been_tried() -> None:
    assert set(KINDS) == {*SMOOTH, "steps", "csv"}
    assert len(set(KINDS.values())) == len(KINDS)

"""Loops of single cycles: which cycles are chosen, what stands in their panels."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from bristle.comparison.predictions import RunPrediction
from bristle.comparison.view import chosen_cycles, draw_cycle, ribbon, under
from bristle.data.cycles import by_level, cycles, largest, steady

DT = 1e-3  # s
TIME = np.arange(0.0, 4.0, DT)
OMEGA = 2.0 * np.pi * 2.0  # rad/s


def sine(amplitude: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    return amplitude * np.sin(OMEGA * TIME), amplitude * OMEGA * np.cos(OMEGA * TIME)


def made(level: np.ndarray, **more) -> RunPrediction:
    x, v = sine(0.01)
    force = 5.0 * np.tanh(v / 0.01) * (1.0 + level)
    spread = np.zeros((1, len(TIME)))
    coordinates = {"displacement": x, "velocity": v, "speed": abs(v), "voltage": level}
    noise = np.full(len(TIME), 0.1)
    return RunPrediction(
        "run", DT, force, force - 0.1, noise, 0.1, spread, coordinates, **{"skip": 0, **more}
    )


def test_a_sine_of_two_hertz_has_two_cycles_a_second_each_of_twice_its_amplitude():
    x, v = sine()
    found = cycles([(x, v, np.zeros_like(x))])
    # From the first turn at 0.375 s to the last one in 4 s there are 7 periods.
    assert len(found) == 7
    assert {one.end - one.begin for one in found} <= {499, 500, 501}
    assert all(one.travel == pytest.approx(2.0, rel=1e-4) for one in found)


def test_the_largest_cycle_of_a_growing_motion_is_its_last_one():
    x, v = sine()
    part = largest(x * (1.0 + TIME), v * (1.0 + TIME))
    assert part is not None
    assert TIME[part.stop - 1] == pytest.approx(3.875, abs=0.02)  # the last turn before 4 s
    assert largest(x * np.nan, v) is None
    assert largest(TIME, np.ones_like(TIME)) is None


def test_noise_about_rest_is_no_reversal():
    v = np.concatenate([np.cos(OMEGA * TIME[:250]), np.zeros(500), np.cos(OMEGA * TIME[250:])])
    noisy = v + np.random.default_rng(1).normal(0.0, 0.01, len(v))
    x = np.cumsum(noisy) * DT
    assert len(cycles([(x, noisy, np.zeros_like(x))])) == 7


def test_each_range_of_the_level_gives_its_largest_cycle_at_a_held_level():
    x, v = sine()
    x, v = x * (1.0 + TIME), v * (1.0 + TIME)
    level = np.where(TIME < 2.0, 2.0, 6.0)
    found = cycles([(x, v, level)])
    low, high = by_level(found)
    assert (low.level, high.level) == (2.0, 6.0)
    assert all(steady(one, found) for one in (low, high))
    last = [one for one in found if one.level == 2.0 and one.spread == 0.0][-1]
    assert low == last  # it grows, so the last one is the largest
    assert by_level([]) == []


def test_cycles_are_told_by_the_command_and_by_speed_where_it_does_not_vary():
    levels = np.where(TIME < 2.0, 2.0, 6.0)
    assert [one.text for one in chosen_cycles([made(levels)])] == ["2 V", "6 V"]
    still = chosen_cycles([made(np.full_like(TIME, 3.0))])
    assert [one.text for one in still] == ["up to 130 mm/s"]  # 10 mm at 2 Hz is 126 mm/s


def test_where_the_command_is_held_cycles_are_told_by_the_temperature_of_their_runs():
    runs = []
    for temperature in (20.0, 60.0):
        one = made(np.full_like(TIME, 3.0), labels={"temperature": temperature})
        one.coordinates["temperature"] = np.full_like(TIME, temperature)
        runs.append(one)
    texts = [one.text for one in chosen_cycles(runs)]
    assert texts == ["temperature 20 °C", "temperature 60 °C"]


def test_a_level_that_moves_within_a_cycle_is_told_as_a_range():
    (one,) = chosen_cycles([made(TIME)], most=1)
    low, high = (float(part) for part in one.text.removesuffix(" V").split(" to "))
    assert high - low == pytest.approx(0.45, abs=0.09)  # 90 % of half a second


def test_no_cycle_is_drawn_across_a_gap_or_without_motion():
    known = np.ones(len(TIME), dtype=bool)
    known[::400] = False
    assert chosen_cycles([made(TIME, known=known)]) == []
    index = np.arange(len(TIME)) + np.arange(len(TIME)) // 400
    assert chosen_cycles([made(TIME, index=index)]) == []
    bare = made(TIME)
    del bare.coordinates["velocity"]
    assert chosen_cycles([bare]) == []


def test_another_model_is_judged_on_the_same_cycles():
    before = made(np.where(TIME < 2.0, 2.0, 6.0))
    after = RunPrediction(**{**vars(before), "predicted": before.measured})
    shown = chosen_cycles([before])
    assert [one.z for one in shown] == pytest.approx([1.0, 1.0], rel=0.01)  # a robust z
    again = under(shown, [after])
    assert [one.part for one in again] == [one.part for one in shown]
    assert [one.z for one in again] == [0.0, 0.0]


def test_the_band_is_twice_the_noise_about_the_model_all_around_the_loop():
    (one, _) = chosen_cycles([made(np.where(TIME < 2.0, 2.0, 6.0))])
    axes = Figure().add_subplot()
    draw_cycle(axes, one, "displacement")
    (band,) = [each for each in axes.collections if isinstance(each, PolyCollection)]
    corners = np.array([path.vertices[:4] for path in band.get_paths()])
    assert len(corners) == one.part.stop - one.part.start - 1
    heights = corners[:, 3, 1] - corners[:, 0, 1]
    assert heights == pytest.approx(2 * 1.96 * 0.1)


def test_a_ribbon_follows_a_curve_that_turns_back():
    x = np.array([0.0, 1.0, 0.0])
    corners = ribbon(x, np.zeros(3), np.ones(3))
    assert corners.shape == (2, 4, 2)
    assert corners[1, :, 0].tolist() == [1.0, 0.0, 0.0, 1.0]


def test_a_level_of_the_command_is_called_by_its_own_value():
    levels = np.select([TIME < 1.3, TIME < 2.6], [0.0, 1.25], 3.0)
    noisy = levels + 1e-4 * np.random.default_rng(1).standard_normal(len(TIME))
    texts = [one.text for one in chosen_cycles([made(noisy)])]
    assert texts == ["0 V", "1.25 V", "3 V"]

"""Channels besides those that bristle knows: what is taken for one, and what is wrong with one."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.checks.channels import check_channels
from bristle.data.extra_channels import MAX_CHANNELS, found_in, refused_name, unit_of
from bristle.data.guess import guess_channels
from bristle.data.measurement import Known, Measurement, measurements_of
from bristle.data.table import Table, from_arrays

N = 1000
T = np.arange(N) * 0.002
X = 0.01 * np.sin(9.0 * T)
PRESSURE = 3.0 + np.sin(2.0 * T)
PLAIN = {
    "time [s]": T,
    "x [m]": X,
    "v [m/s]": 0.09 * np.cos(9.0 * T),
    "F [N]": 20.0 * np.tanh(np.cos(9.0 * T)),
}
WANTED = {"p": ChannelSpec("p [bar]", "bar")}


def table(**more: np.ndarray) -> Table:  # type: ignore[type-arg]
    """Return a run with more columns; the last word of a name, after two _, is its unit."""
    named = {f"{key.partition('__')[0]} [{key.partition('__')[2]}]": y for key, y in more.items()}
    return from_arrays({**PLAIN, **named}, "run", {})


def extra_of(made: Table) -> dict[str, ChannelSpec]:
    guesses = guess_channels(made)
    return found_in(made, [one.column for one in guesses], [one.channel for one in guesses])


def read(made: Table, wanted: dict[str, ChannelSpec] = WANTED, rate: float = 0.0) -> Measurement:
    channels = {
        "time": ChannelSpec("time [s]"), "displacement": ChannelSpec("x [m]"),
        "velocity": ChannelSpec("v [m/s]"), "force": ChannelSpec("F [N]"),
    }  # fmt: skip
    (one,) = measurements_of(made, channels, known=Known(extra=wanted, rate=rate))
    return one


def test_a_column_with_a_title_and_a_unit_is_kept_under_a_name_from_its_title():
    noise = np.random.default_rng(1).standard_normal((3, N))
    made = from_arrays(
        {
            **PLAIN, "Öl-Druck [bar]": PRESSURE, "Force 2 (kN)": noise[0], "gauge 1 [µe]": noise[1],
            "no unit": noise[2],
        },
        "run", {},
    )  # fmt: skip
    found = extra_of(made)
    assert {name: spec.unit for name, spec in found.items()} == {
        "ol_druck": "bar", "force_2": "kN", "gauge_1": "µe",
    }  # fmt: skip


def test_a_second_time_an_index_and_a_copy_in_other_units_are_no_channels():
    made = table(
        clock__h=T / 3600.0, sample__1=np.arange(N, dtype=float), stroke__mm=1e3 * X,
        p__bar=PRESSURE, p_again__kPa=100.0 * PRESSURE,
    )  # fmt: skip
    assert list(extra_of(made)) == ["p"]


def test_of_very_many_columns_the_first_are_kept():
    random = np.random.default_rng(3)
    made = table(**{f"gauge{k}__rad": random.standard_normal(N) for k in range(MAX_CHANNELS + 5)})
    assert list(extra_of(made)) == [f"gauge{k}" for k in range(MAX_CHANNELS)]


def test_two_of_one_name_are_told_apart_and_no_name_is_one_that_means_something():
    made = from_arrays(
        {**PLAIN, "p [bar]": PRESSURE, "P (psi)": PRESSURE**2, "Speed [rad/s]": PRESSURE**3},
        "run", {},
    )  # fmt: skip
    assert list(extra_of(made)) == ["p", "p_2", "speed_2"]
    assert refused_name("force").endswith("[channels.force] is its place")
    assert refused_name("Oil") == "small letters, digits and _ are right, a letter first"
    assert refused_name("frequency") == "a coordinate, a label or a port has this name"


@pytest.mark.parametrize(
    ("written", "kept"),
    [("bar", "Pa"), ("kN", "N"), ("mm/m", "1"), ("degC", "degC"), ("%", "%"), ("counts", "counts")],
)
def test_a_unit_is_brought_to_si_where_it_is_known(written, kept):
    assert unit_of(ChannelSpec("p", written)) == kept


def test_a_channel_is_read_in_si_beside_the_others_and_cut_with_them():
    run = read(table(p__bar=PRESSURE))
    assert "p" not in run.channels
    np.testing.assert_allclose(run.extra["p"].values, 1e5 * PRESSURE, rtol=1e-9)
    assert run.extra["p"].unit == "Pa"
    part = run.part(100, 200, "part")
    np.testing.assert_array_equal(part.extra["p"].values, run.extra["p"].values[100:200])


def test_a_unit_that_is_not_known_is_kept_as_it_is():
    run = read(table(gauge__counts=PRESSURE), {"gauge": ChannelSpec("gauge [counts]", "counts")})
    np.testing.assert_allclose(run.extra["gauge"].values, PRESSURE)
    assert (run.extra["gauge"].unit, run.extra["gauge"].known_unit) == ("counts", "1")


def test_values_that_are_missing_are_interpolated_and_cut_nothing():
    slow = np.where(np.arange(N) % 10 == 3, PRESSURE, np.nan)
    run = read(table(p__bar=slow))
    assert len(run.time) == N
    assert run.measured.all()
    np.testing.assert_allclose(run.extra["p"].values, 1e5 * PRESSURE, rtol=1e-2)
    assert any("p: 90 % of its values are missing and are interpolated" in one for one in run.notes)


@pytest.mark.parametrize(
    ("column", "why"),
    [
        (np.full(N, np.nan), "p: left out of this run: it has 0 values; 20 or more are needed"),
        (
            np.where((T > 0.5) & (T < 1.5), np.nan, PRESSURE),
            "p: left out of this run: no value from 0.5 s to 1.5 s",
        ),
        (np.where(T < 1.0, 1e38, PRESSURE), "p: left out of this run: no value from 0 s to 1 s"),
    ],
)
def test_a_run_is_of_use_without_a_channel_that_is_not(column, why):
    run = read(table(p__bar=column))
    assert len(run.time) == N
    assert not run.extra
    assert why in run.notes


def test_a_column_that_another_run_lacks_or_has_in_another_unit_is_told():
    lacking = read(table())
    assert not lacking.extra
    assert any(
        'p: left out of this run: run: no column is called "p [bar]"' in note
        for note in lacking.notes
    )
    other = read(table(p__kPa=PRESSURE), {"p": ChannelSpec("p", "bar")})
    assert (
        'p: left out of this run: "p [kPa]" is in kPa here, and in bar in study.toml' in other.notes
    )


def test_a_column_with_words_costs_the_channel_alone():
    words = np.array(["high"] * N, dtype=object)
    run = read(table(p__bar=words))
    assert not run.extra
    assert any(note.startswith('p: left out of this run: column "p [bar]"') for note in run.notes)


def test_a_faster_channel_is_averaged_where_runs_are_decimated():
    noisy = PRESSURE + 0.5 * np.random.default_rng(2).standard_normal(N)
    run = read(table(p__bar=noisy), rate=50.0)
    assert len(run.time) == len(run.extra["p"].values) == N // 10
    left = 1e-5 * run.extra["p"].values - (3.0 + np.sin(2.0 * run.time))
    assert float(np.std(left)) < 0.5 / np.sqrt(5.0)


def test_a_channel_that_stands_still_or_is_cut_off_is_told():
    made = table(p__bar=np.minimum(PRESSURE, 3.5), q__V=np.full(N, 2.5), r__V=np.zeros(N))
    wanted = {"p": WANTED["p"], "q": ChannelSpec("q [V]", "V"), "r": ChannelSpec("r [V]", "V")}
    run = read(made, wanted)
    said = {
        one.channel: one for one in check_channels(run, run["velocity"]) if one.channel in wanted
    }
    assert said["p"].kind == "clipping"
    assert said["p"].text.startswith("p stays at exactly 350 kPa in 1 stretches")
    assert said["q"].text == "q is 2.5 V throughout."
    assert said["r"].do


def test_a_slow_logger_that_repeats_its_last_value_is_not_cut_off():
    held = PRESSURE[(np.arange(N) // 25) * 25]
    run = read(table(p__bar=held))
    assert not [one for one in check_channels(run, run["velocity"]) if one.channel == "p"]


def test_a_temperature_is_a_coordinate_within_the_run_besides_its_mean():
    warm = 20.0 + 3.0 * T
    run = read_warm(table(T_oil__degC=np.where(np.arange(N) % 50 == 7, warm, np.nan)))
    assert run.labels == {"temperature": 22.9}
    assert run.extra["temperature"].unit == "degC"
    np.testing.assert_allclose(run.extra["temperature"].values[7:957], warm[7:957], atol=1e-6)
    few = read_warm(table(T_oil__degC=np.where(np.arange(N) < 30, warm, np.nan)))
    assert list(few.labels) == ["temperature"]
    assert not few.extra


def read_warm(made: Table) -> Measurement:
    (run,) = measurements_of(made)
    return run


def test_what_bare_data_hold_besides_is_kept_as_well():
    (run,) = measurements_of(table(p__bar=PRESSURE))
    assert run.extra["p"].unit == "Pa"

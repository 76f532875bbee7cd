"""The staircase of a history, for the terminal."""

from __future__ import annotations

from io import StringIO

from rich.console import Console

from bristle.study import Step
from bristle.study.history import staircase

STEPS = [
    Step(0, "begin with lugre", "made"),
    Step(1, "identify lugre", "", {}, {"z_train": 6.3, "z_holdout": 6.6, "rms_holdout": 0.88}),
    Step(2, "edited by hand", ""),
    Step(3, "add gas_spring", "", {"z_holdout": 3.0}, {"z_holdout": 1.02, "rms_holdout": 0.2}),
]


def test_bars_fall_with_the_error_on_a_scale_of_ratios():
    lines = str(staircase(STEPS)).splitlines()
    bars = [line.count("#") for line in lines]
    assert "not judged" in lines[1]
    assert bars[2] == 40
    assert bars[3] == round(40 * 0.582)  # log 3 / log 6.6, from what the next step began with
    assert bars[4] == 1
    assert "error 0.88 N, training z = 6.30" in lines[2]
    assert lines[-1].endswith("| 1")


def test_plain_text_holds_nothing_but_ascii():
    assert str(staircase(STEPS)).isascii()


def test_on_a_terminal_it_is_coloured():
    out = StringIO()
    Console(file=out, force_terminal=True, width=120).print(staircase(STEPS))
    assert "\u2588" in out.getvalue()
    assert "\x1b[" in out.getvalue()


def test_an_empty_history_says_so():
    assert str(staircase([])) == "The history is empty."


def test_a_name_longer_than_its_column_is_cut_visibly():
    long = [Step(0, "identify modified_bouc_wen[quadratic] + gas_spring", "", {}, {"z_holdout": 3})]
    assert "0 identify modified_bouc_wen[quadrati...  ####" in str(staircase(long))
    (line,) = {line for line in str(staircase(STEPS)).splitlines() if "add gas_spring" in line}
    assert line.startswith("3 add gas_spring    #")


def test_each_step_tells_the_low_pass_of_its_own_error():
    told = [{"z_holdout": 4.0, "rms_holdout": 2.0, **own} for own in ({}, {"cut_off": 0.0})]
    told.append({**told[0], "cut_off": 5.0})
    steps = [Step(k, f"identify {k}", "", {}, one) for k, one in enumerate(told)]
    lines = str(staircase(steps, cut_off=18.0)).splitlines()
    assert [line.partition("2 N")[2] for line in lines[1:4]] == [" below 18 Hz", "", " below 5 Hz"]


def test_a_step_with_the_low_passed_error_alone_says_so_beside_one_with_the_error():
    low = {"z_holdout": 4.0, "rms_holdout": 2.0, "share_holdout": 0.2, "cut_off": 18.0}
    new = {**low, "z_holdout": 2.0, "error_holdout": 2.5, "error_share_holdout": 0.24}
    steps = [Step(1, "old", "", {}, low), Step(2, "new", "", {}, new)]
    old, now = str(staircase(steps)).splitlines()[1:3]
    assert old.endswith("error 2 N (20.0 %) below 18 Hz")
    assert now.endswith("error 2.5 N (24.0 %)")

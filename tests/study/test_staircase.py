"""The table of a history: the error of each model on held-out runs, step by step."""

from __future__ import annotations

from bristle.study import Step
from bristle.study.history import history_steps
from bristle.study.view import steps_table
from bristle.view import terminal

STEPS = [
    Step(0, "begin with lugre", "made"),
    Step(1, "identify lugre", "", {}, {"z_train": 6.3, "z_holdout": 6.6, "rms_holdout": 0.88}),
    Step(2, "edited by hand", ""),
    Step(3, "add gas_spring", "", {"z_holdout": 3.0}, {"z_holdout": 1.02, "rms_holdout": 0.2}),
]


def rows(*steps, cut_off=0.0):
    return [list(row) for row in steps_table(history_steps(steps), cut_off).rows]


def test_each_step_has_its_error_or_what_the_next_one_began_with():
    assert rows(*STEPS) == [
        ["0 begin with lugre", "not judged", "", "", ""],
        ["1 identify lugre", "0.88", "", "6.60", "6.30"],
        ["2 edited by hand", "", "", "3.00", ""],
        ["3 add gas_spring", "0.2", "", "1.02", ""],
    ]


def test_the_unit_stands_in_the_header_and_z_is_explained_beside_it():
    table = steps_table(history_steps(STEPS))
    assert list(table.header) == ["step", "error [N]", "of force", "z", "z train"]
    assert "z: error / noise" in table.note
    assert max(map(len, terminal.lines(table))) <= terminal.WIDTH


def test_an_empty_history_has_no_row():
    assert rows() == []


def test_each_step_tells_the_low_pass_of_its_own_error():
    told = [{"z_holdout": 4.0, "rms_holdout": 2.0, **own} for own in ({}, {"cut_off": 0.0})]
    told.append({**told[0], "cut_off": 5.0})
    steps = [Step(k, f"identify {k}", "", {}, one) for k, one in enumerate(told)]
    assert [row[0] for row in rows(*steps, cut_off=18.0)] == [
        "0 identify 0 (below 18 Hz)", "1 identify 1", "2 identify 2 (below 5 Hz)",
    ]  # fmt: skip


def test_a_step_with_the_low_passed_error_alone_says_so_beside_one_with_the_error():
    low = {"z_holdout": 4.0, "rms_holdout": 2.0, "share_holdout": 0.2, "cut_off": 18.0}
    new = {**low, "z_holdout": 2.0, "error_holdout": 2.5, "error_share_holdout": 0.24}
    assert [row[:3] for row in rows(Step(1, "old", "", {}, low), Step(2, "new", "", {}, new))] == [
        ["1 old (below 18 Hz)", "2", "20.0 %"], ["2 new", "2.5", "24.0 %"],
    ]  # fmt: skip

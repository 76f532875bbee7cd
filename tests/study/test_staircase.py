"""The table of a history: the error of each model on held-out runs, step by step."""

from __future__ import annotations

from bristle.study import Step
from bristle.study.history import history_steps
from bristle.study.view import steps_table
from bristle.view import terminal

STEPS = [
    Step(0, "begin with lugre", "made"),
    Step(1, "identify lugre", "", {}, {"z_train": 6.3, "z_holdout": 6.6, "error_holdout": 0.88}),
    Step(2, "edited by hand", ""),
    Step(3, "add gas_spring", "", {"z_holdout": 3.0}, {"z_holdout": 1.02, "error_holdout": 0.2}),
]


def rows(*steps):
    return [list(row) for row in steps_table(history_steps(steps)).rows]


def test_each_fitted_step_has_its_error_or_what_the_next_one_began_with():
    assert rows(*STEPS) == [
        ["1 identify lugre", "0.88", "", "6.60", "6.30"],
        ["2 edited by hand", "", "", "3.00", ""],
        ["3 add gas_spring", "0.2", "", "1.02", ""],
    ]


def test_the_unit_stands_in_the_header_and_z_is_explained_beside_it():
    table = steps_table(history_steps(STEPS))
    assert list(table.header) == ["step", "error [N]", "of force", "z", "z train"]
    assert "z: error / noise" in table.note
    assert max(map(len, terminal.lines(table))) <= terminal.WIDTH


def test_a_study_that_is_not_fitted_shows_its_model():
    assert rows(STEPS[0]) == [["0 begin with lugre", "not fitted", "", "", ""]]


def test_an_empty_history_has_no_row():
    assert rows() == []

"""One view of a result says the same on a terminal, in a notebook and on the page."""

from __future__ import annotations

import pytest

from bristle.errors import RunError
from bristle.view import Viewable, terminal
from bristle.view.blocks import Next, Table, Text, View, view_of
from bristle.view.html import answer, notebook, page_data

WIDE = Table(("case", *(f"a long title {k} [m/s²]" for k in range(12))),
             [["one", *(f"{k}.25" for k in range(12))]], range(1, 13))  # fmt: skip
VIEW = View(
    "The <law> misses a spring.",
    (
        Text("k = 154.5 ± 0.3 N/m.", "say"), Text("Left out: run 3.", "note"),
        Next("bristle add rig spring", "adds it"),
    ),
    (WIDE, Text("z = 1.03.")),
    "blue",
)  # fmt: skip


class Result(Viewable):
    pass


@view_of(Result)
def result_view(_found: Result) -> View:
    return VIEW


def test_a_terminal_shows_the_answer_and_says_where_the_details_are() -> None:
    said = terminal.text(VIEW, elsewhere="bristle report rig")
    assert said.splitlines() == [
        "The <law> misses a spring.", "k = 154.5 ± 0.3 N/m.", "Note: Left out: run 3.", "",
        "Next:  bristle add rig spring   # adds it",
        "Details:  --details, or bristle report rig",
    ]  # fmt: skip


def test_details_hold_every_number_within_100_columns() -> None:
    said = terminal.text(VIEW, details=True)
    assert all(f"{k}.25" in said for k in range(12))
    assert "z = 1.03." in said
    assert max(map(len, said.splitlines())) <= terminal.WIDTH


def test_the_same_words_are_in_html_and_on_the_page() -> None:
    whole = notebook(VIEW)
    assert "The &lt;law&gt; misses a spring." in whole
    assert all(f">{k}.25</td>" in whole for k in range(12))
    assert "<li>Left out: run 3.</li>" in answer(VIEW)
    assert [one["text"] for one in page_data(VIEW.blocks)] == [
        "k = 154.5 ± 0.3 N/m.", "Left out: run 3.",
    ]  # fmt: skip


def test_a_shell_shows_the_words_and_what_has_no_figure_says_so() -> None:
    assert repr(Result()).splitlines()[0] == "<Result: The <law> misses a spring.>"
    with pytest.raises(RunError, match="nothing to draw"):
        Result().plot()


def test_a_column_without_a_title_and_without_cells_takes_no_width() -> None:
    table = Table(("site", "", "z [-]"), [["damper", "", "1.03"]], (2,))
    assert terminal.lines(table) == ["  site      z [-]", "  damper     1.03"]


def test_a_long_name_before_numbers_goes_on_below_itself() -> None:
    name = "5 take friction_damper; add f_0_by_pressure, asymmetry, delay (not proven)"
    table = Table(("step", "error [N]", "of force", "z", "z train"),
                  [[name, "75.5", "11.1 %", "10.2", "9.8"]], range(1, 5))  # fmt: skip
    *titles, first, last = terminal.lines(table)
    assert max(map(len, [*titles, first, last])) <= terminal.WIDTH
    assert first.split()[-5:] == ["75.5", "11.1", "%", "10.2", "9.8"]
    assert " ".join(f"{first[:70]} {last}".split()) == name

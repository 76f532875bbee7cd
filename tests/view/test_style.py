"""Headings of figures: lines that fit, and no unit alone on the last one."""

from bristle.view.style import Page

HEADING = "plan_3: sine of 15 mm at 1.79 Hz, voltage in steps of 0.888 s between 0 and 4.57 V"


def test_no_unit_stands_alone_on_a_line_of_a_heading():
    for width in (3.0, 5.0, 6.4, 9.2):
        texts = [one.get_text() for one in Page(width, 2.0, HEADING).figure.texts]
        (told,) = [text for text in texts if text.startswith("plan_3")]
        lines = told.splitlines()
        assert " ".join(lines) == HEADING
        assert lines[-1].endswith("4.57 V")

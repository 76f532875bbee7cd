"""A force of no effect in the library: a curve is learned of it, kept, shown and added."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from answers import Capture, asked, told


def test_the_curve_is_the_force_that_was_hidden(learned_study: Path) -> None:
    found = json.loads((learned_study / "reports" / "learned_1.json").read_text())
    assert found["kept"] is True
    assert (found["part"], found["along"], found["site"]) == ("force", "displacement", "damper")
    assert (found["unit"], found["along_unit"]) == ("N", "m")
    assert found["z"] == pytest.approx(1.0, abs=0.1)
    assert found["z_before"] > 5.0 * found["z"]
    x, force = np.array(found["knots"]), np.array(found["values"])
    # A straight line may go to the spring of the law, and a constant to its zero.
    off = force - 1.5 * np.sin(x / 2e-3)
    left = off - np.polyval(np.polyfit(x, off, 1), x)
    inside = abs(x) < 0.015
    assert np.abs(left[inside]).max() < 0.3
    assert "learned_1 is an added force along displacement" in found["sentences"][0]


def test_it_is_added_as_any_effect_and_explains_the_runs(
    learned_study: Path, capsys: Capture
) -> None:
    step = json.loads((learned_study / "history" / "002" / "step.json").read_text())
    assert step["what"] == "add learned_1"
    assert step["after"]["z_holdout"] == pytest.approx(1.0, abs=0.1)
    assert step["before"]["z_holdout"] > 5.0
    assert asked(capsys, "compare", learned_study)["z"] == pytest.approx(1.0, abs=0.1)
    assert asked(capsys, "report", learned_study)["trouble"] is None
    page = (learned_study / "reports" / "report.html").read_text()
    assert "learned_1 is an added force along displacement" in page


def test_without_its_file_the_study_says_what_is_gone(learned_study: Path, capsys: Capture) -> None:
    (learned_study / "effects" / "learned_1.py").unlink()
    assert "learned_1" in told(capsys, "compare", learned_study, code=2)


def test_what_cannot_be_learned_is_refused_in_one_line(
    learned_study: Path, capsys: Capture
) -> None:
    for words, why in (
        (("--along", "temprature"), "temprature"), (("--as", "forse"), "forse"),
        (("--name", "learned_1", "--along", "displacement", "--as", "force"), "learned_1"),
    ):  # fmt: skip
        assert why in told(capsys, "learn", learned_study, *words, code=2)

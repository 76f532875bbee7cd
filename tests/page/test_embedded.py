"""The linked pictures of a report: one file with all its data, that a browser shows offline."""

from __future__ import annotations

import base64
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from page.browsing import expect, needs_browser, shots

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "comparison"))
from predictions_made import predictions_with

from bristle.comparison.comparison import compare_predictions
from bristle.page.embedded import linked_section, script
from bristle.view.html import page as whole_page
from bristle.view.html import unpack


@pytest.fixture(scope="module")
def found():
    return compare_predictions(predictions_with(count=2))


def data_of(section: str):
    text = re.search(r'id="linked-data">([A-Za-z0-9+/=]+)<', section)
    assert text
    return unpack(base64.b64decode(text[1]))


def test_the_section_holds_the_samples_of_all_runs(found):
    data = data_of(linked_section(found))
    assert [run["name"] for run in data["runs"]] == ["run_0", "run_1"]
    for run, one in zip(data["runs"], found.predictions, strict=True):
        assert run["measured"] == pytest.approx(one.measured[one.skip :], abs=1e-5)
        assert run["velocity"] == pytest.approx(one.coordinates["velocity"][one.skip :], abs=1e-6)


def test_long_runs_are_thinned_so_that_a_report_stays_below_eight_megabytes(found):
    data = data_of(linked_section(found, most=1000))
    assert data["every"] == 8
    assert sum(len(run["time"]) for run in data["runs"]) <= 1000
    # eight signals of four bytes each, and a third more as base64
    assert 60_000 * 8 * 4 * 4 / 3 < 8e6 / 2


def test_nothing_is_fetched_and_the_modules_are_one_script(found):
    section = linked_section(found)
    assert section.startswith('<section class="linked" hidden>')  # where no script runs
    assert "http" not in section
    assert not re.search(r"^(import|export) ", script(), re.MULTILINE)
    assert "</script" not in script()
    assert "@media print { .linked { display: none; } }" in section


DRAWN = """() => [...document.querySelectorAll('#linked canvas')].every((c) =>
  c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((one) => one !== 0))"""


@pytest.mark.parametrize(
    "theme",
    [
        pytest.param(theme, marks=[*needs_browser, pytest.mark.slow])  # Chromium takes 3 s
        for theme in ("light", "dark")
    ],
)
def test_a_browser_shows_them_and_a_choice_in_one_is_told(found, tmp_path, theme):
    file = tmp_path / "report.html"
    file.write_text(whole_page("A report", [linked_section(found)], ""), encoding="utf-8")
    errors: list[str] = []
    with shots.chromium(1000, theme) as page:
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.goto(file.as_uri())
        page.locator("section.linked").wait_for()
        canvases = page.locator("#linked canvas")
        expect(canvases).to_have_count(5)  # force and error over time, two loops, the map
        page.wait_for_function(DRAWN)
        canvases.nth(2).focus()
        page.keyboard.press("ArrowRight")
        status = page.locator("#linked [role=status]")
        expect(status).to_contain_text("Chosen: ")
        told = status.inner_text()
        assert np.isfinite(float(told.rpartition(" ")[2].rstrip(".")))
        ground = page.evaluate("() => getComputedStyle(document.body).backgroundColor")
        assert ground == ("rgb(255, 255, 255)" if theme == "light" else "rgb(20, 25, 29)")
    assert errors == []

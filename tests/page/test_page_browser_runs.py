"""Views 7, 8 and 9 in a real Chromium: sliders, dropped records, designs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made import write_runs
from page.browsing import Watched, expect, needs_browser, shots
from page.served import page_on

from bristle.study import create_study

pytestmark = needs_browser


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browsed")
    create_study(folder / "rig", write_runs(folder / "lab", 4, seconds=3.0), law="bingham")
    return folder


DROP = """
(text) => {
  const carried = new DataTransfer();
  carried.items.add(new File([text], "shake.csv"));
  const event = new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true });
  document.querySelector(".dropped").dispatchEvent(event);
}
"""


def simulation(page: Any, seen: Watched) -> Any:
    """Open view 7, wait until its run is there, and return the slider of the voltage."""
    page.goto(seen.client.server.address.partition("#")[0] + "#/-/simulate")
    slider = page.locator(r"#slider-voltage\.level")
    slider.wait_for(timeout=600_000)
    return slider


@pytest.mark.slow  # a browser
def test_a_slider_moves_the_building_and_two_settings_are_compared(home: Path) -> None:
    with page_on(home) as client, shots.chromium(1280) as page:
        seen = Watched(page, client)
        slider = simulation(page, seen)
        slider.focus()
        page.keyboard.press("Home")
        seen.wait("voltage.level=0", 60.0)
        seen.press("Keep this setting")
        slider.focus()
        page.keyboard.press("End")
        seen.wait("voltage.level=10", 60.0)
        expect(page.get_by_text(re.compile(r"17501 rows in \d+ ms"))).to_have_count(1)
        seen.wait("kept: el_centro_lugre_passive, voltage.level = 0", 10.0)
        row = page.get_by_role("row", name=re.compile("structure.base_displacement"))
        kept, now = (float(row.locator("td").nth(k).inner_text()) for k in (0, 1))
        assert kept > 3.0 * now > 0.0
        seen.wait("--spectrum --set voltage.level=10", 60.0)
        page.locator("#control").select_option("Skyhook")
        seen.wait("now: el_centro_lugre_passive, skyhook", 120.0)
        seen.wait("kept: el_centro_lugre_passive, voltage.level = 0", 10.0)
        page.get_by_role("button", name="Play").click()
        page.get_by_role("button", name="Pause").wait_for()
        expect(page.locator(".play output")).not_to_have_text("0.0 s")
        assert not seen.errors


@pytest.mark.slow  # a browser
def test_a_record_is_dropped_onto_the_simulation(home: Path) -> None:
    rows = "".join(f"{0.02 * k:.2f},{np.sin(0.12 * k):.6f}\n" for k in range(500))
    with page_on(home) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        simulation(page, seen)
        page.evaluate(DROP, "time [s],acceleration [m/s2]\n" + rows)
        page.get_by_text(re.compile("now: el_centro_lugre_passive, shake.csv")).wait_for()
        expect(page.locator("#record")).to_contain_text("shake.csv (dropped)")
        page.get_by_text(re.compile(r"--set ground.record=uploads/record-")).first.wait_for()
        page.evaluate(DROP, "a,b\nx,y\n")
        page.get_by_role("alert").get_by_text("shake.csv").wait_for()
        seen.press("Back to the first scenario")
        page.get_by_text("now: el_centro_lugre_passive", exact=True).wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        # The refused file is an answer of the server that the browser's console notes.
        assert [text for text in seen.errors if "422" not in text] == []


@pytest.mark.slow  # a browser, and designs
def test_weights_are_moved_and_solved(home: Path) -> None:
    with page_on(home) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        page.goto(client.server.address.partition("#")[0] + "#/rig/design")
        page.get_by_role("heading", name="Not solved yet").wait_for(timeout=120_000)
        slider = page.locator(r"#weight-acceleration\.corner")
        slider.focus()
        page.keyboard.press("End")
        expect(page.locator("form .slider").nth(1)).to_contain_text("200 rad/s")
        page.keyboard.press("Home")
        page.locator("form").get_by_text("1 rad/s", exact=True).wait_for()
        seen.press("Default values")
        seen.press("Solve")
        page.get_by_role("heading", name=re.compile(r"Gamma is 6\.0")).wait_for(timeout=120_000)
        page.get_by_role("link", name="Compare it under ground motions").wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        assert (home / "rig" / "design" / "hinf_1.json").is_file()
        assert not seen.errors


@pytest.mark.slow  # a browser, and comparisons
def test_controllers_are_compared_and_a_comparison_is_cancelled(home: Path) -> None:
    with page_on(home) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        page.goto(client.server.address.partition("#")[0] + "#/rig/controllers")
        page.get_by_role("heading", name="Not compared yet").wait_for(timeout=120_000)
        page.get_by_label("Members for the worst case").fill("0")
        page.get_by_role("button", name="Remove motion 2").click()
        page.get_by_label("clipped LQG").uncheck()
        seen.press("Compare")
        page.get_by_text("Skyhook has the lowest peak acceleration").wait_for(timeout=300_000)
        expect(page.locator("table").get_by_role("row", name=re.compile("^Skyhook"))).to_have_count(
            1
        )
        with page.expect_download() as download:
            seen.press("Download the report")
        assert download.value.suggested_filename == "report.html"
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        page.get_by_label("clipped LQG").check()
        seen.press("Compare")
        seen.press("Cancel")
        page.get_by_text("Cancelled", exact=True).wait_for(timeout=60_000)
        page.get_by_text("Skyhook has the lowest peak acceleration").wait_for()
        expect(page.locator("#comparison option")).to_have_count(1)
        page.evaluate(DROP, "time [s],acceleration [m/s2]\n0,0\n0.02,1\n0.04,0\n")
        page.locator("#motion-1").get_by_text("shake.csv (dropped)").first.wait_for(
            state="attached"
        )
        assert not seen.errors

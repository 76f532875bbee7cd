"""The page in a real Chromium, driven by Playwright: skipped where either is missing."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from page.served import Client, page_on
from study.made import write_runs

from bristle.study import Study, create_study

ROOT = Path(__file__).resolve().parents[2]
VIEWS = ("home", "data", "fit", "errors", "verdict", "history", "hand_on", "simulate", "design")
AXE = "axe-core@4.10.3"
SERIOUS = ("serious", "critical")


def pictures() -> ModuleType:
    """Return the script that takes the screenshots: it starts the browser."""
    spec = importlib.util.spec_from_file_location(
        "docs_page_pictures", ROOT / "docs" / "page_pictures.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


shots = pictures()
pytestmark = [
    pytest.mark.skipif(
        importlib.util.find_spec("playwright") is None, reason="Playwright is not installed"
    ),
    pytest.mark.skipif(shots.browser_path() is None, reason="there is no Chromium"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]


class Watched:
    """A page of the browser, with what its console and its network saw."""

    def __init__(self, page: Any, client: Client) -> None:
        self.page, self.client = page, client
        self.errors: list[str] = []
        self.elsewhere: list[str] = []
        own = f"http://127.0.0.1:{client.server.guard.port}/"
        page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "request",
            lambda r: (
                None if r.url.startswith((own, "data:", "blob:")) else self.elsewhere.append(r.url)
            ),
        )
        page.goto(client.server.address)
        page.wait_for_selector("html[data-ready]", timeout=60_000)

    def open(self, study: str, view: str) -> None:
        shots.open_view(self.page, self.client.server.address, study, view)

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def wait(self, text: str, seconds: float = 300.0) -> None:
        self.page.get_by_text(text).first.wait_for(timeout=1000.0 * seconds)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browsed")
    create_study(folder / "rig", write_runs(folder / "lab", 4, seconds=3.0), law="bingham")
    return folder


@pytest.fixture
def browsed(home: Path) -> Iterator[Watched]:
    with page_on(home) as client, shots.chromium(400) as page:
        yield Watched(page, client)


def test_views_open_on_a_narrow_screen_without_an_error_or_a_foreign_request(
    browsed: Watched,
) -> None:
    page = browsed.page
    assert "token" not in page.url
    for view in ("home", "data", "history", "hand_on"):
        browsed.open("rig", view)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400, view
        assert page.locator("h1").count() == 1
    page.reload()
    page.wait_for_selector("html[data-ready='rig/hand_on']")
    assert not browsed.errors
    assert not browsed.elsewhere


def axe(folder: Path) -> str:
    """Return the source of axe-core from the npm registry; skip where it cannot be had."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("npm is not installed, which fetches axe-core")
    done = subprocess.run(
        [npm, "pack", AXE, "--silent"], cwd=folder, capture_output=True, text=True, check=False,
        timeout=120,
    )  # fmt: skip
    if done.returncode:
        pytest.skip(f"{AXE} cannot be fetched: {done.stderr[-200:]}")
    shutil.unpack_archive(folder / done.stdout.strip().splitlines()[-1], folder)
    return (folder / "package" / "axe.min.js").read_text(encoding="utf-8")


def findings(page: Any, source: str) -> list[str]:
    """Return the serious findings of axe-core on what is shown."""
    page.evaluate(source + "; undefined")
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{one['id']}: {node['html'][:120]}"
        for one in found["violations"]
        if one["impact"] in SERIOUS
        for node in one["nodes"]
    ]


@pytest.mark.slow
def test_the_hour_on_an_example_from_its_making_to_a_running_fmu(tmp_path: Path) -> None:
    """Look, fit, see where it fails, diagnose, add, hand on: with a reload, two tabs, a cancel."""
    source = axe(tmp_path)
    home = tmp_path / "home"
    home.mkdir()
    serious: dict[str, list[str]] = {}
    with page_on(home) as client, shots.chromium(1280, accept_downloads=True) as page:
        seen = Watched(page, client)
        seen.press("Make the example bench")
        page.wait_for_selector("html[data-ready='example_bench/data']", timeout=120_000)

        page.get_by_role("link", name="Next: fit the model").click()
        page.get_by_role("heading", name="Not identified yet").wait_for()
        seen.press("Identify")
        page.get_by_role("heading", name="The laws side by side").wait_for(timeout=300_000)
        page.locator("main canvas").nth(2).wait_for(timeout=120_000)

        page.get_by_role("link", name="Next: where it fails").click()
        page.wait_for_selector("canvas.brush", timeout=120_000)
        box = page.locator("canvas.brush").first.bounding_box()
        page.mouse.move(box["x"] + 200, box["y"] + 60)
        page.mouse.down()
        page.mouse.move(box["x"] + 400, box["y"] + 60, steps=4)
        page.mouse.up()
        seen.wait("Chosen:")
        page.keyboard.press("Escape")
        page.locator("canvas.brush").nth(2).focus()
        page.keyboard.press("ArrowRight")
        seen.wait("Chosen:")

        page.get_by_role("link", name="Next: what is missing").click()
        seen.press("Diagnose")
        page.get_by_role("button", name="Cancel").click()
        seen.wait("Cancelled")
        assert Study(home / "example_bench").verdict() is None
        page.get_by_role("button", name="Diagnose", exact=True).click()
        page.get_by_role("button", name="Cancel").wait_for()
        page.get_by_role("heading", name=re.compile("What remains of the cost")).wait_for(
            timeout=300_000
        )
        page.reload()  # in the middle of a diagnosis
        page.get_by_role("button", name="Cancel").wait_for(timeout=60_000)
        other = page.context.new_page()
        other.goto(f"http://127.0.0.1:{client.server.guard.port}/#/example_bench/verdict")
        other.get_by_role("button", name="Cancel").wait_for(timeout=60_000)
        assert other.get_by_role("button", name="Diagnose", exact=True).is_disabled()
        for tab in (page, other):
            tab.get_by_text("Missing physics found").wait_for(timeout=600_000)
        other.close()

        page.get_by_role("link", name=re.compile("^Next: add")).click()
        page.get_by_role("button", name=re.compile("^Add gas_spring")).click()
        page.get_by_role("heading", name=re.compile("fell from")).wait_for(timeout=300_000)

        seen.open("example_bench", "hand_on")
        seen.press("Write the report")
        page.get_by_role("button", name="Download reports/report.html").wait_for(timeout=300_000)
        seen.press("Export the damper as an FMU")
        fmu = page.get_by_role("button", name="Download export/example_bench_damper.fmu")
        fmu.wait_for(timeout=300_000)
        with page.expect_download() as taken:
            fmu.click()
        given = tmp_path / "damper.fmu"
        taken.value.save_as(given)

        for view in VIEWS:
            seen.open("example_bench", view)
            for theme in ("light", "dark"):
                if found := findings(page, source):
                    serious[f"{view}, {theme}"] = found
                page.locator("#theme").click()
        assert not serious, json.dumps(serious, indent=2)
        assert not seen.errors
        assert not seen.elsewhere
    exported = home / "example_bench" / "export"
    assert given.read_bytes() == (exported / "example_bench_damper.fmu").read_bytes()
    done = subprocess.run(
        [sys.executable, "-m", "bristle.cli", "run", str(exported / "bench.toml"), "--set",
         "run.stop=1.0", "--no-figure", "--out", str(tmp_path / "out")],
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


SAME = """
async (values) => {
  const { postPacked } = await import("/api.mjs");
  const one = window.bristleSimulation;
  const here = await one.engine.run(values);
  const there = await postPacked("simulate", { ...one.what, values });
  const share = (size, b) => Math.abs(size) / (b.peak || 1);
  const apart = (a, b) =>
    Math.max(...Array.from(b.values, (value, k) => share(a.values[k] - value, b)));
  const most = (of) => Math.max(...here.outputs.map((a, k) => of(a, there.outputs[k])));
  return {
    here: one.engine.runsHere(values), commands: [here.command, there.command],
    rows: [here.time.length, there.time.length],
    curves: most(apart),
    peaks: most((a, b) => share(a.peak - b.peak, b)),
  };
}
"""
"""Runs a setting in the page and on the server: how far curves and peaks are apart."""

DROP = """
(text) => {
  const carried = new DataTransfer();
  carried.items.add(new File([text], "shake.csv"));
  const event = new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true });
  document.querySelector(".dropped").dispatchEvent(event);
}
"""


def simulation(page: Any, seen: Watched) -> Any:
    """Open view 7, wait until its engine is there, and return the slider of the voltage."""
    page.goto(seen.client.server.address.partition("#")[0] + "#/-/simulate")
    page.wait_for_selector("[data-engine]", timeout=600_000)
    return page.locator(r"#slider-voltage\.level")


@pytest.mark.slow
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
        assert page.get_by_text(re.compile(r"17501 rows in \d+ ms")).count() == 1
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
        page.wait_for_timeout(400)
        assert page.locator(".play output").inner_text() != "0.0 s"
        assert not seen.errors


@pytest.mark.slow
def test_a_record_is_dropped_onto_the_simulation(home: Path) -> None:
    rows = "".join(f"{0.02 * k:.2f},{np.sin(0.12 * k):.6f}\n" for k in range(500))
    with page_on(home) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        simulation(page, seen)
        page.evaluate(DROP, "time [s],acceleration [m/s2]\n" + rows)
        page.get_by_text(re.compile("now: el_centro_lugre_passive, shake.csv")).wait_for()
        assert "shake.csv (dropped)" in page.locator("#record").inner_text()
        assert page.get_by_text(re.compile(r"--set ground.record=uploads/record-")).count() > 0
        page.evaluate(DROP, "a,b\nx,y\n")
        page.get_by_role("alert").get_by_text("shake.csv").wait_for()
        seen.press("Back to the first scenario")
        page.get_by_text("now: el_centro_lugre_passive", exact=True).wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        # The refused file is an answer of the server that the browser's console notes.
        assert [text for text in seen.errors if "422" not in text] == []


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="needs bristle[native]")
def test_the_page_and_the_server_compute_the_same(home: Path) -> None:
    with page_on(home) as client, shots.chromium(1280) as page:
        seen = Watched(page, client)
        simulation(page, seen)
        assert page.get_attribute("[data-engine]", "data-engine") == "page"
        found = page.evaluate(SAME, {"voltage.level": 6.5, "damper.sigma_2": 130.0})
        assert found["here"]
        assert found["commands"][0] == found["commands"][1]
        assert found["rows"][0] == found["rows"][1] == 17501
        assert found["curves"] < 1e-6  # the server's curves are sent as 32-bit floats
        assert found["peaks"] < 1e-10
        assert not seen.errors


@pytest.mark.slow
def test_weights_are_moved_solved_and_the_closed_loop_is_drawn(home: Path) -> None:
    with page_on(home) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        page.goto(client.server.address.partition("#")[0] + "#/rig/design")
        page.get_by_role("heading", name="Not solved yet").wait_for(timeout=120_000)
        slider = page.locator(r"#weight-acceleration\.corner")
        slider.focus()
        page.keyboard.press("End")
        assert "200 rad/s" in page.locator("form .slider").nth(1).inner_text()
        page.keyboard.press("Home")
        page.locator("form").get_by_text("1 rad/s", exact=True).wait_for()
        seen.press("As it begins")
        seen.press("Solve")
        page.get_by_role("heading", name=re.compile(r"Gamma is 6\.0")).wait_for(timeout=120_000)
        page.get_by_role("row", name=re.compile("0.6 g, damper.force")).wait_for(timeout=120_000)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        assert (home / "rig" / "design" / "hinf_1.json").is_file()
        assert not seen.errors

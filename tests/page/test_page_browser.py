"""The page in a real Chromium, driven by Playwright: skipped where either is missing."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from made import write_runs
from page.browsing import Watched, expect, needs_browser, shots
from page.served import page_on

from bristle.examples.make import Choice, make_bench
from bristle.study import Study, create_study

VIEWS = (
    "home", "data", "fit", "errors", "verdict", "history", "hand_on", "simulate", "design",
    "controllers",
)  # fmt: skip
AXE = "axe-core@4.10.3"
WORST = ("moderate", "serious", "critical")

pytestmark = needs_browser


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browsed")
    create_study(folder / "rig", write_runs(folder / "lab", 4, seconds=3.0), law="bingham")
    return folder


@pytest.fixture
def browsed(home: Path) -> Iterator[Watched]:
    with page_on(home) as client, shots.chromium(400) as page:
        yield Watched(page, client)


@pytest.mark.slow  # 7 s, a browser: by default test_embedded.py opens one
def test_views_open_on_a_narrow_screen_without_an_error_or_a_foreign_request(
    browsed: Watched,
) -> None:
    page = browsed.page
    assert "token" not in page.url
    for view in ("home", "data", "history", "hand_on"):
        browsed.open("rig", view)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400, view
        expect(page.locator("h1")).to_have_count(1)
    page.reload()
    page.wait_for_selector("html[data-ready='rig/hand_on']")
    assert not browsed.errors
    assert not browsed.elsewhere


@pytest.mark.slow  # a browser
def test_the_residual_is_drawn_without_and_with_what_was_found(tmp_path: Path) -> None:
    files = write_runs(tmp_path / "lab", 3, seconds=3.0)
    study = create_study(tmp_path / "home" / "rig", files, law="bingham").study
    study.model()
    refined = {"effects": ["gas_spring"], "values": {"gas_spring.k": 50.0}}
    verdict = {"kind": "unknown", "effects": [], "sites": {}, "ranking": [], "untestable": []}
    study.write_verdict({"schema": 2, **verdict, "sensors": [], "reasons": [], "refined": refined})
    with page_on(study.folder.parent) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        seen.open("rig", "verdict")
        page.get_by_role("heading", name="The residual before and after gas_spring").wait_for()
        expect(page.get_by_text("does not explain the error")).to_have_count(1)
        expect(page.locator("main canvas")).to_have_count(4)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        assert not seen.errors


@pytest.mark.slow  # a browser
def test_a_unit_and_a_sign_are_corrected_by_menus(tmp_path: Path) -> None:
    files = write_runs(tmp_path / "lab", 3, seconds=2.0)
    folder = create_study(tmp_path / "home" / "rig", files, law="bingham").study.folder
    with page_on(folder.parent) as client, shots.chromium(400) as page:
        seen = Watched(page, client)
        seen.open("rig", "data")
        seen.press("Correct a column, a unit or a sign")
        write = page.get_by_role("button", name="Write these channels into the study")
        unit = page.get_by_label("unit of F [N]")
        unit.fill("V")
        page.get_by_text("no unit of this quantity").wait_for()
        expect(write).to_be_disabled()
        unit.fill("kN")
        force = page.locator("figure", has=page.get_by_role("heading", name="F [N]", exact=True))
        force.get_by_label("turn the sign").check()
        page.get_by_text('"F [N]" in kN, sign turned').wait_for()
        expect(page.locator("section[aria-label='force before and after'] canvas")).to_have_count(2)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        force.get_by_label("is").select_option("voltage")  # U [V] gives its place
        page.get_by_text('voltage: "F [N]" in kN').wait_for()
        expect(page.locator("#column-U-V-")).to_have_value("")
        force.get_by_label("is").select_option("force")
        page.locator("#column-U-V-").select_option("voltage")
        page.get_by_text('"F [N]" in kN, sign turned').wait_for()
        write.click()
        page.get_by_text("F [N] (sign turned)").wait_for()
        page.locator("#commands code", has_text="bristle study channels rig").wait_for()
    assert Study(folder).settings.channels["force"].sign == -1
    # A choice that is refused is an answer 422, which the console tells.
    assert all("422" in one for one in seen.errors)


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
    """Return what axe-core finds on what is shown, minor findings left out."""
    page.evaluate(source + "; undefined")
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{one['id']}: {node['html'][:120]}"
        for one in found["violations"]
        if one["impact"] in WORST
        for node in one["nodes"]
    ]


@pytest.mark.slow  # a browser, and a diagnosis
def test_files_that_are_clean_have_their_verdict_after_five_clicks(tmp_path: Path) -> None:
    make_bench(tmp_path / "lab", Choice(nothing=True, law="bingham", seed=4))
    files = sorted((tmp_path / "lab" / "data").glob("*.csv"))
    home = tmp_path / "home"
    home.mkdir()
    clicks = "window.clicks = 0; addEventListener('click', (e) => { clicks += e.isTrusted; }, true)"
    with page_on(home) as client, shots.chromium(1280) as page:
        seen = Watched(page, client)
        page.evaluate(clicks)
        page.locator("#files").set_input_files(files)  # dropped
        seen.press("Make the study")
        page.get_by_role("link", name="Next: fit the model").wait_for(timeout=120_000)
        page.get_by_role("link", name="What is missing").click()
        seen.press("Diagnose")
        page.get_by_text("Nothing is missing from").wait_for(timeout=600_000)
        assert 0 < page.evaluate("window.clicks") <= 5


@pytest.mark.slow  # a browser: all steps of a study
def test_the_hour_on_an_example_from_its_making_to_a_running_fmu(tmp_path: Path) -> None:
    """Look, fit, see where it fails, diagnose, add, hand on: with a reload, two tabs, a cancel."""
    source = axe(tmp_path)
    home = tmp_path / "home"
    home.mkdir()
    faults: dict[str, list[str]] = {}
    with page_on(home) as client, shots.chromium(1280, accept_downloads=True) as page:
        seen = Watched(page, client)
        seen.press("Make the example bench")
        page.wait_for_selector("html[data-ready='example_bench/data']", timeout=120_000)

        page.get_by_role("link", name="Next: fit the model").click()
        page.get_by_role("heading", name="Not identified yet").wait_for()
        seen.press("Identify")
        page.get_by_role("heading", name="Not identified yet").wait_for(
            state="detached", timeout=300_000
        )
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
        expect(other.get_by_role("button", name="Diagnose", exact=True)).to_be_disabled()
        for tab in (page, other):
            tab.get_by_text("Missing from the model").wait_for(timeout=600_000)
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
                    faults[f"{view}, {theme}"] = found
                page.locator("#theme").click()
        assert not faults, json.dumps(faults, indent=2)
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

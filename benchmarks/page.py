"""The local page in a real Chromium: how fast it opens, redraws and answers, and what it takes.

Needs Playwright and Chromium. The browser shares the machine with the server, as a user's does.
"""

from __future__ import annotations

import importlib.util
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._rows import Row

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).resolve().parent.parent
RUNS, SECONDS, RATE = 7, 12.0, 500.0
"""The study of the brush: as many held-out runs, each so long, sampled at [Hz]."""
BRUSHES, SLIDES, STARTS = 25, 40, 3
FRAME = """
() => new Promise((done) => {
  const began = performance.now();
  window.bristleAct();
  requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - began)));
})
"""
"""Milliseconds from an act until the frame with its pictures is on the screen."""


def run() -> list[Row]:
    """Return the figures of the page."""
    spec = importlib.util.spec_from_file_location("shots", ROOT / "docs" / "page_pictures.py")
    assert spec is not None
    assert spec.loader is not None
    shots = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(shots)
    if importlib.util.find_spec("playwright") is None or shots.browser_path() is None:
        return [Row("page", "not measured: Playwright or Chromium is not installed")]
    with tempfile.TemporaryDirectory(prefix="bristle_page_") as name:
        folder = Path(name)
        _make_study(folder)
        with shots.chromium(1280) as page:
            ready = statistics.median(_seconds_to_ready(folder, page) for _ in range(STARTS))
            with _served(folder) as (process, address):
                page.goto(address)
                page.wait_for_selector("html[data-ready]", timeout=60_000)
                shots.open_view(page, address, "rig", "errors")
                brush = _brushes(page)
                slide = _slides(page, address)
                for view in shots.VIEWS:
                    shots.open_view(page, address, "rig", view)
                own = _memory(process.pid)
                worker = max((_memory(child) for child in _children(process.pid)), default=0.0)
    samples = round(RUNS * SECONDS * RATE)
    middle, late = statistics.median(slide), float(np.quantile(slide, 0.95))
    drawn = statistics.median(brush)
    return [
        Row("page ready after the command", f"{ready:.2f} s", "<= 3 s", ready / 3.0),
        Row("brush to redrawn views, 7 runs of 12 s", f"{drawn:.0f} ms", "<= 100 ms", drawn / 100),
        Row("slider to redrawn scenario, median", f"{middle:.0f} ms", "<= 150 ms", middle / 150.0),
        Row("slider to redrawn scenario, 95 %", f"{late:.0f} ms", "<= 300 ms", late / 300.0),
        Row("page: server and worker, most memory", f"{own + worker:.0f} MB", "<= 600 MB",
            (own + worker) / 600.0, f"the server alone {own:.0f} MB"),
        Row("page: samples that a brush looks at", str(samples)),
    ]  # fmt: skip


def _make_study(folder: Path) -> None:
    """Make a study with `RUNS` held-out runs of random motion and one for training."""
    from bristle.study import create_study

    files = []
    for k in range(RUNS + 1):
        generator = np.random.default_rng(k)
        time_, x, v = np.arange(round(SECONDS * RATE)) / RATE, 0.0, 0.0
        for _ in range(20):
            frequency, phase = generator.uniform(0.5, 5.0), generator.uniform(0.0, 6.28)
            turn, size = 2.0 * np.pi * frequency, generator.normal() * 3e-3
            x = x + size * np.sin(turn * time_ + phase)
            v = v + size * turn * np.cos(turn * time_ + phase)
        level = np.repeat(generator.choice([0.0, 2.0, 4.0, 6.0], 24), len(time_) // 24)
        force = (1.3 + 0.8 * level) * np.tanh(v / 2e-3) + 40.0 * v + 150.0 * x
        columns = [time_, x, v, force, level]
        columns[1:4] = [y + 0.01 * np.std(y) * generator.standard_normal(len(y))
                        for y in columns[1:4]]  # fmt: skip
        name = f"{'train' if k == 0 else 'holdout'}_{k}.csv"
        files.append(folder / name)
        np.savetxt(
            files[-1], np.column_stack(columns), delimiter=",", comments="",
            header="time [s],x [m],v [m/s],F [N],U [V]",
        )  # fmt: skip
    create_study(folder / "rig", files, law="bingham")


@contextmanager
def _served(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Give a page that the command serves, and its address."""
    order = [sys.executable, "-m", "bristle.cli", "page", str(folder / "rig"), "--no-browser"]
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        order, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": path}
    )
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.terminate()
        process.wait(20.0)
        process.stdout.close()


def _seconds_to_ready(folder: Path, page: Page) -> float:
    """Return the time from the command to the first view, drawn from measurements."""
    began = time.perf_counter()
    with _served(folder) as (_, address):
        page.goto(address)
        page.wait_for_selector("html[data-ready='rig/data']", timeout=60_000)
        return time.perf_counter() - began


def _brushes(page: Page) -> list[float]:
    """Return the milliseconds from a brushed stretch of time until all pictures show it."""
    page.evaluate(
        "() => { window.bristleAct = () => { const t = 11 * Math.random();"
        " window.bristleLinked.chooseTime([[t, t + 1], [0, 0]]); }; }"
    )
    return [float(page.evaluate(FRAME)) for _ in range(BRUSHES)]


def _slides(page: Page, address: str) -> list[float]:
    """Return the milliseconds from a moved slider until the scenario is drawn anew."""
    page.evaluate("location.hash = '#/rig/simulate'")
    page.wait_for_selector("[data-engine]", timeout=600_000)  # else the server computes the first
    act: Any = """
    async () => {
      const one = window.bristleSimulation;
      const began = performance.now();
      one.values["voltage.level"] = Number((10 * Math.random()).toPrecision(4));
      await one.run();
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
      return performance.now() - began;
    }
    """
    return [float(page.evaluate(act)) for _ in range(SLIDES)][2:]


def _children(pid: int) -> list[int]:
    listed = Path(f"/proc/{pid}/task/{pid}/children")
    threads = Path(f"/proc/{pid}/task")
    if not listed.is_file():
        return []
    found = [one / "children" for one in threads.iterdir()]
    return [int(word) for file in found for word in file.read_text().split()]


def _memory(pid: int) -> float:
    """Return the memory [MB] that a process has taken at the most; 0 where nobody tells."""
    file = Path(f"/proc/{pid}/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", file.read_text()) if file.is_file() else None
    return int(found[1]) / 1024.0 if found else 0.0

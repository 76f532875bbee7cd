"""A scenario in WebAssembly against the compiled engine: seconds, rows, bytes. Needs Node, zig."""

from __future__ import annotations

import gzip
import json
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from bristle.core.jit import compiled
from bristle.engine.coupled import Coupled, RecordLayout, linked, substeps_of
from bristle.engine.time_loop import INLINE, integrate
from bristle.errors import BuildError
from bristle.export.web import export_web
from bristle.system.scenario import load_scenario

from ._rows import Row

SCENARIOS = {"el_centro_lugre_passive": 0.1, "el_centro_0p6g_clipped": 0.2}
"""With the seconds that a run may take."""
TIMES = 9
SCRIPT = Path(__file__).resolve().parent.parent / "tests" / "web" / "rows.mjs"


def run() -> list[Row]:
    """Return the figures of both scenarios, and of the module."""
    if shutil.which("node") is None:
        return [Row("WebAssembly", "not measured: Node is not installed")]
    rows = []
    with tempfile.TemporaryDirectory(prefix="bristle_web_") as name:
        folder = Path(name)
        try:
            for scenario, goal in SCENARIOS.items():
                rows += _scenario(scenario, goal, folder)
        except BuildError as error:
            return [Row("WebAssembly", f"not measured: {error}")]
        wasm = (folder / "scenario.wasm").read_bytes()
    small = len(gzip.compress(wasm, 9))
    return [
        *rows,
        Row("WebAssembly, module", f"{len(wasm) / 1e3:.0f} kB", "<= 150 kB", len(wasm) / 150e3),
        Row("WebAssembly, module compressed", f"{small / 1e3:.0f} kB", "<= 60 kB", small / 60e3),
    ]


def _scenario(name: str, goal: float, folder: Path) -> list[Row]:
    export_web(name, folder)
    ours, theirs = [], []
    for _ in range(TIMES):  # in turn, so that a busy moment hits both
        ours.append(_node(folder))
        theirs.append(_compiled(name))
    seconds, numba = statistics.median(ours), statistics.median(theirs)
    ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
    worst = _worst(name, folder)
    return [
        Row(f"WebAssembly, {name}", f"{seconds:.3f} s", f"<= {goal:g} s", seconds / goal),
        Row(
            f"WebAssembly, {name}, over numba", f"{ratio:.2f} x; numba {numba:.3f} s", "<= 1.3 x",
            ratio / 1.3,
        ),
        Row(f"WebAssembly, {name}, worst row over its peak", f"{worst:.1e}", "<= 1e-12",
            worst / 1e-12),
    ]  # fmt: skip


def _node(folder: Path) -> float:
    """Return the seconds of a run in Node, its first ones left out."""
    order = ["node", str(SCRIPT), str(folder), "4", "{}"]
    said = subprocess.run(order, capture_output=True, text=True, check=True).stdout
    return float(min(json.loads(said)["seconds"][1:]))


def _compiled(name: str) -> float:
    """Return the seconds of the compiled time loop alone."""
    scenario = load_scenario(name)
    found = []
    for _ in range(3):
        system = RecordLayout(scenario)
        substeps = substeps_of(scenario, system)
        h = scenario.step / substeps
        table = np.zeros((scenario.steps + 1, len(system.outputs)))
        slots = np.array(list(system.outputs.values()), dtype=np.int64)
        given = (
            (scenario.steps, substeps, h), system.sources(), system.coupled(h), system.sampled(h),
            system.start_values(), slots, table,
        )  # fmt: skip
        loop = compiled(linked(system.dampers, system.structures)(integrate), INLINE)
        before = time.perf_counter()
        loop(*given)
        found.append(time.perf_counter() - before)
    return min(found[1:])


def _worst(name: str, folder: Path) -> float:
    """Return the largest difference of a row, over the peak of its output."""
    right = Coupled().run(load_scenario(name))
    outputs = json.loads((folder / "scenario.json").read_text())["outputs"]
    table = np.fromfile(folder / "rows.bin").reshape(len(outputs), -1)
    worst = 0.0
    for one, column in zip(outputs, table, strict=True):
        peak = float(np.max(np.abs(right[one["name"]])))
        if peak > 0.0:
            worst = max(worst, float(np.max(np.abs(column - right[one["name"]]))) / peak)
    return worst

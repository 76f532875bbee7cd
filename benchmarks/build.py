"""The build of all FMUs into an empty folder, and again where nothing has changed."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ._rows import Row

ROOT = Path(__file__).resolve().parent.parent
BUILD = (
    "import sys, pathlib; from bristle.fmu.build import build, plan; "
    "from bristle.fmu.catalogue import component_names; folder = pathlib.Path(sys.argv[1]); "
    "print(len([build(plan(name), folder) for name in component_names()]))"
)


def run() -> list[Row]:
    """Return the wall time of a first and of a second build, each in a fresh process."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first, count = build_afresh(BUILD, folder)
        built = _written(folder)
        second, _ = build_afresh(BUILD, folder)
        rebuilt = len(set(_written(folder).items()) - set(built.items()))
    return [
        Row(f"build of all {count} FMUs", f"{first:.2f} s", "<= 10 s", first / 10.0),
        Row(
            "the same a second time",
            f"{second:.2f} s; {rebuilt} built again",
            "0 built again",
            1.0 + rebuilt if rebuilt else 0.0,
        ),
    ]


def build_afresh(code: str, folder: Path) -> tuple[float, int]:
    """Build into a folder; return the seconds of the whole process and the number of FMUs.

    Parameters
    ----------
    code : str
        What builds into the folder that is its argument, and prints the number.
    folder : Path
    """
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    before = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        env={**os.environ, "PYTHONPATH": path}, check=True, capture_output=True, text=True,
    )  # fmt: skip
    return time.perf_counter() - before, int(done.stdout)


def _written(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.fmu")}

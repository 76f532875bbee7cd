"""Seconds of one identification and one diagnosis as a user meets them: in a fresh process.

Timed from outside, start of Python, reading of seven CSV files and compiling included.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .cases import ROOT, make
from .plan import Task

CODE = {
    "identification": """
from bristle.identification.fit import fit_from_starts
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import Model
fit_from_starts(Problem([prepare(m) for m in train]), Model(law))
""",
    "diagnosis": """
from bristle.diagnosis import diagnose_rig
from bristle.model.model import Model
diagnose_rig(train, holdout, Model(law))
""",
}
READ = """
import sys
from pathlib import Path
from bristle.data.measurement import read_measurements
folder, law = Path(sys.argv[1]), sys.argv[2]
train = read_measurements(sorted(folder.glob("train_*.csv")))
holdout = read_measurements(sorted(folder.glob("holdout_*.csv")))
"""
TASK = Task("effect", "gas_spring", "linear", 0.15, 0.01, "bench_10N", "lugre", 20)


def measure() -> dict[str, float]:
    """Return seconds by name: with an empty cache of compiled code, and with a filled one."""
    from tests.independent.generate import write

    times: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as place:
        data = Path(place, "data")
        write(make(TASK), data)
        for what in ("identification", "diagnosis"):
            cache = Path(place, what)
            for how in ("nothing compiled yet", "compiled before"):
                times[f"one {what}, fresh process, {how}"] = _once(data, cache, what)
    return times


def _once(data: Path, cache: Path, what: str) -> float:
    environment = {**os.environ, "BRISTLE_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    before = time.perf_counter()
    subprocess.run(
        [sys.executable, "-c", READ + CODE[what], str(data), TASK.law],
        check=True, env=environment, cwd=data, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return time.perf_counter() - before

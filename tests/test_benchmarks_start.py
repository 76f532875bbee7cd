"""Every benchmark starts: it prints its rows, or is still at work after two minutes."""

from __future__ import annotations

import json
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import benchmarks

NAMES = [m.name for m in pkgutil.iter_modules(benchmarks.__path__) if not m.name.startswith("_")]
AT_WORK = 120.0
"""Seconds after which a benchmark counts as started: many take hours, and have no small case."""


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_starts(name: str) -> None:
    command = [sys.executable, "-m", "benchmarks", name, "--json"]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=AT_WORK,
            check=False,
            cwd=Path(__file__).parents[1],
        )
    except subprocess.TimeoutExpired:
        return
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout)

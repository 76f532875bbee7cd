"""Every benchmark starts: it prints its rows, or is still at work after two minutes."""

from __future__ import annotations

import json
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import benchmarks

FOUND = pkgutil.iter_modules(benchmarks.__path__)
NAMES = [m.name for m in FOUND if not (m.ispkg or m.name.startswith("_"))]
COMMANDS = ("paper", "train")
"""What has options of its own in place of rows."""
AT_WORK = 120.0
"""Seconds after which a benchmark counts as started: many take hours, and have no small case."""


@pytest.mark.slow  # a process a benchmark: it starts and is at work
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
            cwd=Path(__file__).parents[2],
        )
    except subprocess.TimeoutExpired:
        return
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout)


@pytest.mark.slow  # a process a command: each has a help
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_of_the_benchmarks_says_what_it_does(name: str) -> None:
    command = [sys.executable, "-m", "benchmarks", name, "--help"]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2]
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.startswith("usage:")

"""The command line as a user meets it: a fresh process, from the shell to the last file."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from bristle.fmu.build import ensure
from bristle.system.scenario import load_scenario

from ._rows import Row, Times, interleave

SCENARIO = "el_centro_lugre_passive"
ROOT = Path(__file__).resolve().parent.parent


def run() -> list[Row]:
    """Return the wall time of a whole run, FMUs already built, and of `--help`."""
    for component in load_scenario(SCENARIO).components.values():
        ensure(component.made_of(), **component.made_with())
    jobs = {"run": lambda: command("run", SCENARIO), "help": lambda: command("--help")}
    times = interleave(jobs, 5)
    return [
        _row(
            "bristle run, El Centro with LuGre at 4 V, files and figure included", times["run"], 4.0
        ),
        _row("bristle --help", times["help"], 0.3),
    ]


def _row(name: str, times: Times, goal: float) -> Row:
    return Row(name, str(times), f"<= {goal:g} s", times.median / goal)


def command(*arguments: str) -> float:
    """Run the command line in an empty folder; return 0, to be timed as a whole."""
    with tempfile.TemporaryDirectory() as folder:
        code = (
            "import sys; sys.path.insert(0, sys.argv.pop(1)); from bristle.cli import main; main()"
        )
        subprocess.run(
            [sys.executable, "-c", code, str(ROOT), *arguments],
            cwd=folder, check=True, stdout=subprocess.DEVNULL,
        )  # fmt: skip
    return 0.0

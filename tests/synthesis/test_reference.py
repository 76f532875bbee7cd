"""The frozen controllers, and the command that makes them."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from benchmarks.paper import reference
from bristle.component.controller_file import Controller, read_controller
from bristle.errors import DesignError
from bristle.physics.building import paper_building
from bristle.synthesis import DesignResult, Task


@pytest.mark.parametrize("kind", ["hinf", "lpv", "lqg"])
def test_frozen_controllers_are_of_the_reference_task(
    kind: str, frozen: Path, request: pytest.FixtureRequest
) -> None:
    here: DesignResult = request.getfixturevalue(kind)
    controller = read_controller(frozen / f"{kind}.json")
    controller.check_building(paper_building())
    assert controller.design == Task(kind, title=reference.TITLE).data()
    assert (controller.n, controller.rows) == (here.controller.n, here.controller.rows)
    for name in ("gamma", "norm", "largest_norm", "least_gamma"):
        if name in here.facts:
            assert controller.facts[name] == pytest.approx(here.facts[name], rel=2e-3)
    assert gain(controller, 0) == pytest.approx(gain(here.controller, 0), rel=0.05)


def gain(c: Controller, row: int) -> complex:
    """Return the controller's response at the first mode, which no change of states alters."""
    n = c.n
    A = np.array(c.A[row * n * n : (row + 1) * n * n]).reshape(n, n)
    B, C = np.array(c.B[row * n : (row + 1) * n]), np.array(c.C[row * n : (row + 1) * n])
    turn = np.exp(1j * 13.195 * c.sample_period)
    return complex(C @ np.linalg.solve(turn * np.eye(n) - A, B))


def test_the_command_writes_what_it_says(
    tmp_path: Path,
    hinf: DesignResult,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(reference, "design", lambda task: hinf)
    assert reference.main(["--out", str(tmp_path / "new")]) == 0
    paths = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in paths] == ["hinf.json", "lpv.json", "lqg.json"]
    assert read_controller(paths[0]) == hinf.controller


def test_the_command_answers_2_where_it_cannot_write(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert reference.main(["--out", str(tmp_path / "file" / "below")]) == 2
    assert "DesignError" in capsys.readouterr().err


def test_a_failing_design_answers_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(task: Task) -> DesignResult:
        raise DesignError("no controller")

    monkeypatch.setattr(reference, "design", fail)
    assert reference.main(["--out", str(tmp_path)]) == 2
    assert "DesignError: no controller" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow  # a process that designs
@pytest.mark.parametrize(("kind", "seconds"), [("hinf", 5.0), ("lpv", 15.0)])
def test_a_design_in_a_fresh_process_is_quick(kind: str, seconds: float) -> None:
    code = (
        f"from bristle.synthesis import Task, design; print(design(Task({kind!r})).facts['gamma'])"
    )
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert time.perf_counter() - begin < seconds
    assert float(done.stdout) < 10.0

"""Where one output's estimate is worth nothing, the error of the run is unknown, and never 0."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from toys import Maker

from bristle.cli import main
from bristle.engine.coupling_error import expect, find_step
from bristle.engine.results import judged_by
from bristle.errors import ScenarioError
from bristle.system.scenario import load_scenario

SHORT = ["el_centro_0p6g_clipped", "--set", "run.stop=1.2"]
"""A controller that switches: with Jacobi the force jumps a step late, however short the step."""
JACOBI = [*SHORT, "--set", "run.algorithm=jacobi", "--no-figure"]


def test_export_ssp_says_unknown_and_the_least_that_a_run_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export-ssp", *SHORT, "-o", str(tmp_path / "clipped.ssp")]) == 0
    jacobi, seidel = capsys.readouterr().out.splitlines()[-2:]
    told = re.search(r"jacobi: unknown, at least (\d+) % of the peak of ([\w.]+);", jacobi)
    assert told is not None
    assert re.search(r"gauss-seidel: [\d.]+ % of the peak of structure", seidel)
    out = str(tmp_path / "out")
    assert main(["run", *JACOBI, "--coupling-error", "--json", "--out", out]) == 0
    errors = json.loads(capsys.readouterr().out)["coupling_error"]
    assert not errors["damper.force"]["worth"]
    assert errors[told[2]]["least"] == pytest.approx(float(told[1]) / 100.0, rel=0.05)
    assert errors[told[2]]["least"] >= errors["damper.force"]["least"] > 0.1


@pytest.mark.slow  # 4 s: find_step refuses by default
def test_a_tolerance_is_not_kept_where_the_error_is_unknown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["run", *JACOBI, "--tolerance", "0.5%", "--out", str(tmp_path / "out")]
    assert main(given) == 1
    said = capsys.readouterr().err
    assert re.search(r"is unknown, at least \d+ % of the peak of", said)
    assert "keeps the coupling error" not in said


def made(scenario: Any, force: float) -> pd.DataFrame:
    """Return a run whose force is off by so much, beside a source that is exact."""
    time = np.arange(scenario.steps + 1) * scenario.step
    columns = {"one.value": np.sin(time), "two.y": (1.0 + force) * np.cos(time)}
    frame = pd.DataFrame(columns, index=time)
    frame.attrs["made"] = {"title": "", "file": "", "step": scenario.step}
    frame.attrs["units"] = {}
    return frame


@pytest.fixture
def pair(scenario_of: Maker) -> Any:
    """Return a scenario of two foreign FMUs."""
    file = scenario_of(
        {"one": "Ramp", "two": "Integrator"}, {"two.u": "one.value"}, step=0.1, stop=2.0
    )
    return load_scenario(file)


@pytest.mark.parametrize("factors", [(0.1, -0.1, 0.1), (0.1, 0.12, 0.15), (0.1, 0.0, 0.1)])
def test_from_finer_steps_too_the_exact_source_does_not_stand_for_the_rest(
    pair: Any, factors: tuple[float, ...]
) -> None:
    def again(one: Any, engine: str) -> pd.DataFrame:
        if engine == "compiled":
            raise ScenarioError("foreign")
        return made(one, factors[round(np.log2(0.1 / one.step)) % 3])

    assert judged_by(again(pair, "fmu")) == ["one.value", "two.y"]
    for one in expect(pair, again):
        assert (one.error, one.step, one.output) == (None, None, "two.y")
        assert re.search(r"unknown, at least [\d.]*[1-9][\d.]* % of the peak of two\.y", str(one))


def test_a_step_with_an_unknown_error_is_no_end_where_a_finer_one_tells(pair: Any) -> None:
    def again(one: Any, engine: str) -> pd.DataFrame:
        if engine == "compiled":
            raise ScenarioError("foreign")
        parts = round(0.1 / one.step)
        return made(one, 3.0 if parts == 1 else 0.1 / parts)  # unstable at the longest step

    assert find_step(pair, 0.011, again).step == pytest.approx(0.1 / 16)

"""Scenarios give the same rows with native FMUs as with those in Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from both_forms import needs_zig

from bristle.campaign import ensemble
from bristle.cli import main
from bristle.engine.run import run
from bristle.errors import RunError
from bristle.system.scenario import stock_scenarios

pytestmark = needs_zig

LONGEST = 4.0
"""Simulated time [s] that each scenario is run for at most."""


def difference(one: pd.DataFrame, other: pd.DataFrame) -> float:
    """Return the largest difference of a column, as a share of its peak."""
    assert list(one.columns) == list(other.columns)
    peaks = one.abs().max().replace(0.0, 1.0)
    return float(((one - other).abs().max() / peaks).max())


@pytest.mark.slow  # every component is compiled: all stock scenarios
@pytest.mark.parametrize("scenario", sorted(stock_scenarios()), ids=lambda path: path.stem)
def test_every_stock_scenario_gives_the_same_rows(scenario: Path) -> None:
    stop = {"run.stop": LONGEST} if "el_centro" in scenario.stem else {}
    native = run(scenario, stop, fmus="native")
    assert difference(run(scenario, stop), native) <= 1e-12
    assert np.isfinite(native.to_numpy()).all()


@pytest.mark.slow  # a building and damper are compiled
def test_a_run_in_python_takes_them_and_so_do_the_runs_of_its_coupling_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = {}
    for form in ("python", "native"):
        if form == "native":  # none of its runs may fall back
            monkeypatch.setattr("bristle.fmu.build.ensure", None)
        shown[form] = run("bench_sine_bingham", {"run.stop": 0.1}, fmus=form, coupling_error=True)
    assert difference(shown["python"], shown["native"]) <= 1e-12
    errors = [frame.attrs["coupling_error"] for frame in shown.values()]
    assert errors[0] == errors[1]
    assert shown["python"].attrs["made"]["fmus"] != shown["native"].attrs["made"]["fmus"]


def test_forms_that_are_none_are_refused() -> None:
    with pytest.raises(RunError, match=r'fmus "wasm" is not known') as caught:
        run("bench_sine_bingham", fmus="wasm")
    assert caught.value.exit_code == 2
    with pytest.raises(RunError, match="steps no FMUs"):
        run("bench_sine_bingham", fmus="native", engine="compiled")


SOURCES = (
    'schema = 1\ntitle = "two sources"\n[run]\nstop = 0.1\nstep = 0.01\n'
    '[components.ground]\nfmu = "GroundMotion"\nparameters = { peak = 2.0 }\n'
    '[components.level]\nfmu = "ConstantVoltage"\nparameters = { level = 3.0 }\n'
)


def test_an_ensemble_steps_native_fmus(tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(SOURCES)
    runs = {}
    for form in ("python", "native"):
        file = tmp_path / f"{form}.toml"
        file.write_text(
            'schema = 1\nscenario = "two.toml"\nruns = 4\nseed = 7\nengine = "fmu"\n'
            f'fmus = "{form}"\n[vary]\n"level.level" = {{ uniform = [1.0, 4.0] }}\n'
            '[outputs]\n"level.voltage" = ["peak", "rms"]\n'
        )
        runs[form] = ensemble(file, workers=2)
    assert runs["native"].failures == []
    columns = [runs[form].runs[["peak level.voltage", "rms level.voltage"]] for form in runs]
    assert difference(*columns) <= 1e-12
    assert runs["native"].runs["peak level.voltage"].nunique() == 4
    assert runs["python"].plan.digest() != runs["native"].plan.digest()


def test_the_command_steps_native_fmus(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(SOURCES)
    assert main(["run", "two.toml", "--fmus", "native", "--no-figure", "--out", "native"]) == 0
    assert main(["run", "two.toml", "--no-figure", "--out", "python"]) == 0
    texts = [Path(name, "results.csv").read_text().splitlines() for name in ("native", "python")]
    rows = [[line for line in text if not line.startswith("#")] for text in texts]
    assert rows[0] == rows[1]
    assert texts[0] != texts[1]  # they say which FMUs made them
    capsys.readouterr()
    assert main(["run", "two.toml", "--fmus", "native", "--engine", "compiled"]) == 2
    assert "steps no FMUs" in capsys.readouterr().err

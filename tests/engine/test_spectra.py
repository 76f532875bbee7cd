"""Response spectra of a run: what the command writes is what the function gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bristle.cli import main
from bristle.engine.results import spectra, write_spectra
from bristle.errors import RunError


def test_the_command_writes_the_spectra_of_ground_and_floors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order = ["run", "half_sine_pulse", "--engine", "compiled", "--no-figure", "--set",
             "run.stop=2.0", "--out", str(tmp_path)]  # fmt: skip
    assert main([*order, "--spectrum"]) == 0
    assert "spectrum.csv" in capsys.readouterr().out
    written = pd.read_csv(tmp_path / "spectrum.csv")
    results = pd.read_csv(tmp_path / "results.csv", comment="#")
    floor = next(name for name in written if "floor" in name)
    column = next(name for name in results if name.partition(" ")[0] == floor.partition(" ")[0])
    time = results.iloc[:, 0].to_numpy()
    found = spectra({column.partition(" ")[0]: results[column].to_numpy()}, time[1] - time[0])
    assert written["period [s]"].to_numpy() == pytest.approx(found["period"], rel=1e-8)
    values = found[column.partition(" ")[0]]
    assert written[floor].to_numpy() == pytest.approx(values, rel=1e-4)
    # A run without spectra leaves none of an older one.
    assert main(order) == 0
    assert not (tmp_path / "spectrum.csv").exists()


def test_a_run_without_a_building_has_no_spectrum(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order = ["run", "bench_sine_bingham", "--engine", "compiled", "--no-figure", "--spectrum",
             "--set", "run.stop=0.2", "--out", str(tmp_path)]  # fmt: skip
    assert main(order) == 1
    assert "no output is an acceleration" in capsys.readouterr().err
    assert (tmp_path / "results.csv").is_file()


def test_rows_that_are_too_far_apart_have_no_spectrum() -> None:
    with pytest.raises(RunError, match="too few"):
        spectra({"ground.ground_acceleration": np.zeros(10)}, 1.0)


def test_a_run_that_failed_in_its_first_step_has_no_spectrum(tmp_path: Path) -> None:
    frame = pd.DataFrame({"ground.ground_acceleration": [0.0]}, index=[0.0])
    with pytest.raises(RunError, match="one row alone"):
        write_spectra(frame, tmp_path / "spectrum.csv")


def test_an_acceleration_that_is_not_finite_has_no_spectrum() -> None:
    broken = np.where(np.arange(100) == 7, np.nan, 0.0)
    with pytest.raises(RunError, match=r"ground\.ground_acceleration: not finite"):
        spectra({"ground.ground_acceleration": broken}, 0.002)

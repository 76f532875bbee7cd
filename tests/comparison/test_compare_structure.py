"""A damper inside a building: the truth is right within its noise, force measured or not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made import write

from bristle import run
from bristle.comparison.predictions import run_predictions
from bristle.identification.building_sites import StructureProblem, structure_run
from bristle.model.model import Model
from bristle.study import create_study
from bristle.study.steps import compare_study

LEVELS = ("base", "floor1", "floor2")
KINDS = ("displacement", "velocity", "acceleration_absolute")


def measured(path: Path, factor: float, seed: int, *, force: bool) -> Path:
    """Write what instruments of 0.5 % noise see of El Centro on the building with its damper."""
    overrides = {"ground.factor": factor, "run.stop": 9.0}
    frame = run("el_centro_lugre_passive", overrides, engine="compiled")
    random = np.random.default_rng(seed)
    columns = {"ground_acceleration [m/s2]": frame["ground.ground_acceleration"].to_numpy()}
    for level in LEVELS:
        for kind in KINDS:
            name = f"{level}_{kind}"
            unit = frame.attrs["units"][f"structure.{name}"]
            columns[f"{name} [{unit}]"] = frame[f"structure.{name}"].to_numpy()
    if force:
        columns["force [N]"] = frame["damper.force"].to_numpy()
    noisy = {
        name: y + 0.005 * np.std(y) * random.standard_normal(len(y)) for name, y in columns.items()
    }
    noisy["voltage [V]"] = frame["voltage.voltage"].to_numpy()
    return write(path, {"time [s]": frame.index.to_numpy(), **noisy})


@pytest.mark.parametrize("force", [True, False])
def test_the_true_damper_is_right_within_its_noise(tmp_path, force):
    files = [
        measured(tmp_path / f"{role}_{k}.csv", factor, k, force=force)
        for k, (role, factor) in enumerate((("train", 0.45), ("holdout", 0.3)))
    ]
    study = create_study(tmp_path / "tower", files, rig="structure").study
    truth = compare_study(study)
    assert truth.quantity == ("force" if force else "reconstructed force")
    assert 0.7 < truth.z < 1.35
    wrong = study.model().with_values({"sigma_a": 1300.0})
    assert compare_study(study, wrong).z > 1.5 * truth.z


def test_samples_that_are_left_out_leave_time_and_history_alone():
    n, dt = 4000, 0.002
    t = np.arange(n) * dt
    w = 2.0 * np.pi * 1.5
    x, v, a = 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w**2 * np.sin(w * t)
    model = Model("bingham", ("presliding",))
    draws = np.zeros((2, n, 4))
    every = structure_run("r", dt, (x, v, a, np.zeros(n)), np.zeros(n), 0.01, draws)
    whole = run_predictions(StructureProblem([every]), model)[0]
    keep = np.abs(v) > 0.03
    some = structure_run("r", dt, (x, v, a, np.zeros(n)), np.zeros(n), 0.01, draws, keep)
    part = run_predictions(StructureProblem([some]), model)[0]
    index = some.keep
    assert 0.3 < len(index) / n < 0.9
    assert part.time == pytest.approx(t[index])
    for name, values in part.coordinates.items():
        assert values == pytest.approx(whole.coordinates[name][index]), name
    assert part.predicted == pytest.approx(whole.predicted[index])
    assert part.numerical == pytest.approx(whole.numerical[index])
    assert np.std(part.numerical) > 0.0

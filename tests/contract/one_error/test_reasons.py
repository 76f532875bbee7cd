"""Why samples are left out: told by reason, and of the data alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from shaken import building, friction, measured, shake

from bristle.cli import main
from bristle.identification.building_sites import StructureRun
from bristle.identification.error import errors_by_run
from bristle.identification.rig import DAMPER, building_rig
from bristle.model.model import Model

HOUSE = building(2)


def frame(seed: int, clip: float | None = None) -> pd.DataFrame:
    random = np.random.default_rng(seed)
    t = np.arange(3000) / 500.0
    x = 8e-3 * np.sin(2 * np.pi * (1.1 + 0.2 * seed) * t) * np.minimum(1.0, t)
    x += 2e-3 * np.sin(2 * np.pi * 2.3 * t + seed)
    v = np.gradient(x, t)
    force = 5.0 * np.tanh(v / 4e-3) + 90.0 * v
    force = force + 0.05 * random.standard_normal(len(t))
    if clip is not None:
        force = np.clip(force, -clip, clip)
    x = x + 2e-5 * random.standard_normal(len(t))
    return pd.DataFrame({"time [s]": t, "x [mm]": 1e3 * x, "F [N]": force})


def left_out_of(folder: Path, frames: list[pd.DataFrame], *more: str) -> dict[str, int]:
    """Return what `identify` leaves out of the held-out run, by reason."""
    folder.mkdir(parents=True)
    for k, one in enumerate(frames):
        one.to_csv(folder / f"r{k}.csv", index=False)
    rig = folder / "rig"
    new = ["study", "new", str(rig), "--data", str(folder / "r*.csv"), "--law", "bingham", *more]
    assert main(new) == 0
    assert main(["study", "roles", str(rig), "--train", "r0", "--holdout", "r1"]) == 0
    assert main(["identify", str(rig), "--starts", "1"]) == 0
    answer = json.loads((rig / "reports" / "identify.json").read_text())
    return answer["error"]["holdout"]["left_out"]


def test_missing_and_masked_samples_are_told_apart(tmp_path: Path):
    spoilt = frame(2)
    spoilt.loc[700:702, "F [N]"] = np.nan
    spoilt.loc[[1200, 1900], "F [N]"] += 300.0
    found = left_out_of(tmp_path / "a", [frame(1), spoilt], "--mask")
    assert found["missing"] == 3
    assert found["masked"] == 2
    assert set(found) <= {"missing", "masked", "settling at the start"}


def test_saturated_samples_are_told_as_such(tmp_path: Path):
    frames = [frame(1, clip=13.6), frame(2, clip=14.0)]
    there = int(np.sum(np.abs(frames[1]["F [N]"]) >= 14.0))
    found = left_out_of(tmp_path / "b", frames)
    assert there > 20
    assert found["saturated"] >= there


@pytest.fixture(scope="module")
def house():
    runs = [measured(shake(HOUSE, seed, friction, samples=4000), seed) for seed in (1, 2)]
    return building_rig(runs[:1], runs[1:], HOUSE)


@pytest.mark.parametrize(
    ("site", "line"), [(DAMPER, ""), ("layer", "linear_layer"), ("storey1", "linear_storey")]
)
def test_in_a_building_the_samples_of_the_error_are_the_same_for_every_law(house, site, line):
    found = []
    for law in ("bingham", "lugre", "tanh"):
        problem = house.sites(Model(law))[site].train
        (error,) = errors_by_run(problem, Model(line or law))
        found.append((error.samples, error.total, dict(error.left_out), error.signal))
    assert found[0] == found[1] == found[2]
    assert found[0][2] == {"settling at the start": 25}
    (run,) = house.sites(Model("bingham"))[DAMPER].train.runs
    assert isinstance(run, StructureRun)
    assert len(run.force) < 4000  # those at rest, which its fit leaves out, are in the error

"""A force that its load cell cut off is left out by identification and comparison alike."""

from __future__ import annotations

import numpy as np
import pytest
from made import write

from bristle.study.identify import identify_study
from bristle.study.steps import compare_study
from bristle.study.study import Study

DT = 0.004
T = np.arange(0.0, 12.0, DT)


def written(folder, name: str, seed: int, end: float = 0.0):
    """Write a run of a Bingham damper; its force is cut off at `end`, 0 for nowhere."""
    rng = np.random.default_rng(seed)
    turns = 2.0 * np.pi * rng.uniform(0.5, 3.0, 6)[:, None] * T + rng.uniform(0.0, 6.0, (6, 1))
    rates = np.gradient(turns[:, :2], T[:2], axis=1)[:, :1]
    x = 1e-3 * np.sum(np.sin(turns), axis=0)
    v = 1e-3 * np.sum(rates * np.cos(turns), axis=0)
    force = 5.0 * np.sign(v) + 60.0 * v * np.exp(-np.abs(v) / 0.5)
    shown = force + rng.normal(0.0, 0.05, len(T))
    if end:
        shown = np.clip(shown, -end, end)
    x = 1e3 * (x + rng.normal(0.0, 2e-6, len(T)))
    columns = {"time [s]": T, "x [mm]": x, "v [mm/s]": 1e3 * v, "force [N]": shown}
    return write(folder / f"{name}.csv", columns)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cut")
    files = [written(folder, "a", 1), written(folder, "cut", 2, 7.2), written(folder, "c", 3)]
    return Study.create(folder / "rig", files, law="bingham")


def test_what_a_load_cell_cut_off_is_in_no_fit_and_no_error(study):
    found = identify_study(study)
    assert found.after["z_train"] < 1.15
    assert [note for note in found.notes if note.startswith("cut: force is cut off at 7.2 N")]
    assert found.model.values["f_c"] == pytest.approx(5.0, abs=0.1)
    compared = compare_study(Study(study.folder), role="train")
    assert max(run.z for run in compared.runs) < 1.2

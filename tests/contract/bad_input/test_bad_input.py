"""Input that cannot be right, or says little: one clear message, and the study as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from shaken import building, friction, measured, shake

import bristle
from bristle.cli import main

HOUSE = building(2)


def test_a_building_with_a_saturated_force_names_runs_channel_and_samples() -> None:
    runs = []
    for seed in (1, 2):
        one = measured(shake(HOUSE, seed, friction, samples=2000), seed, name=f"run{seed}")
        force = np.clip(one["force"], -0.003, 0.003)
        runs.append(replace(one, channels={**one.channels, "force": force}))
    words = bristle.diagnose(runs[:1], "bingham", holdout=runs[1:], building=HOUSE).words
    assert "run1: of force 0 of 2,000 samples can be used (2,000 saturated)" in words
    assert "measure with a wider range, or leave the run out" in words


def test_names_with_one_level_and_two_motions_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, frequency in (("a_0_5A", 1.0), ("a_0-5A", 2.0), ("a_1_5A", 1.0)):
        t = np.arange(600) / 100.0
        x = 10.0 * np.sin(2.0 * np.pi * frequency * t)
        force = 400.0 * np.tanh(np.gradient(x, t) / 4.0)
        frame = pd.DataFrame({"time [s]": t, "x [mm]": x, "F [N]": force})
        frame.to_csv(tmp_path / f"{name}.csv", index=False)
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(tmp_path / "*.csv")]) == 0
    said = capsys.readouterr().out
    assert "a_0-5A.csv and a_0_5A.csv tell the same, 0.5 A, and their motions differ" in said

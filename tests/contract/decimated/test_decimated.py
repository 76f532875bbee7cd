"""A fast record is judged at all its samples, and what is printed is the error of the model."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

import bristle
from bristle.cli import main
from bristle.identification.prepare import prepare
from bristle.study.run_facts import RunChoices

SECONDS = 3.0


def record(path: Path, rate: float, seed: int, noise: float = 0.0, corner: float = 0.0) -> Path:
    """Write a run of a linear damper, 800 N.s/m and 2000 N/m, on a motion up to 20 Hz."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, SECONDS, 1.0 / rate)
    x, v = np.zeros_like(t), np.zeros_like(t)
    for f in np.arange(1.0, 20.0, 0.7):
        size, w, phase = 0.3 * random.normal(), 2.0 * np.pi * f, random.uniform(0.0, 6.0)
        x, v = x + size * np.sin(w * t + phase), v + size * w * np.cos(w * t + phase)
    columns = [x, 0.8 * v + 2.0 * x]
    columns = [y + noise * np.std(y) * random.normal(size=len(t)) for y in columns]
    if corner:
        columns = [sosfilt(butter(4, corner, fs=rate, output="sos"), y) for y in columns]
    np.savetxt(path, np.column_stack([t, *columns]), "%.6f", ",", header="time [s],x [mm],F [N]",
               comments="")  # fmt: skip
    return path


def study(folder: Path, rate: float, **how: float) -> Path:
    files = [record(folder / f"run_{seed}.csv", rate, seed, **how) for seed in range(3)]
    bristle.Study.create(folder / "rig", files)
    return folder / "rig"


@pytest.mark.parametrize(
    ("rate", "how"),
    [(3000.0, {}), (1024.0, {"noise": 0.01}), (5000.0, {"noise": 0.002, "corner": 200.0})],
    ids=["noise_free", "white_noise", "low_passed"],
)
def test_no_sample_of_a_smooth_record_is_left_out(tmp_path, rate, how) -> None:
    for one in bristle.Study(study(tmp_path, rate, **how)).read():
        assert one.parts > 1
        assert one.measured.all()
        assert prepare(one).judged.all()
        assert not any("jump" in note for note in one.notes)


def test_a_linear_damper_at_3_khz_is_identified(tmp_path, capsys) -> None:
    folder = study(tmp_path, 3000.0)
    assert main(["identify", str(folder)]) == 0
    said = capsys.readouterr().out
    percent = re.search(r"\(([\d.]+) %\) on the held-out runs", said)
    assert percent
    assert float(percent[1]) < 1.0


def test_a_low_passed_force_stays_as_little_known_when_it_is_decimated(tmp_path) -> None:
    folder = study(tmp_path, 3000.0, noise=0.01, corner=100.0)
    files, whole = [tmp_path / "run_0.csv"], RunChoices(rate=0.0)
    fast = bristle.Study.create(tmp_path / "all", files, runs=whole).read()[0]
    slow = bristle.Study(folder).read()[0]
    assert fast.noise_facts["force"].colour == slow.noise_facts["force"].colour == "hidden"
    assert slow.noise["force"] <= fast.noise["force"]

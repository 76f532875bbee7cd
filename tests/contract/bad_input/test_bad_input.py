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
    said = " ".join(capsys.readouterr().out.split())
    assert "a_0-5A.csv and a_0_5A.csv tell the same, 0.5 A, and their motions differ" in said


def bench_run(seed: int) -> pd.DataFrame:
    """Return a short run of a damper, force and motion."""
    random = np.random.default_rng(seed)
    t = np.arange(1500) / 200.0
    x = 8e-3 * np.sin(2.0 * np.pi * (0.9 + 0.3 * seed) * t) + 2e-3 * np.sin(19.0 * t + seed)
    v = np.gradient(x, t)
    force = 6.0 * np.tanh(v / 5e-3) + 70.0 * v + 0.05 * random.standard_normal(len(t))
    return pd.DataFrame({"time [s]": t, "x [m]": x, "F [N]": force})


def test_seconds_called_milliseconds_make_no_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = bench_run(1).rename(columns={"time [s]": "time [ms]"})
    frame.to_csv(tmp_path / "run.csv", index=False)
    study = tmp_path / "s"
    assert main(["study", "new", str(study), "--data", str(tmp_path / "run.csv")]) != 0
    said = " ".join(capsys.readouterr().err.split())
    assert "the runs last 0.00749 s at most, with 200000 samples per second" in said
    assert "--channel time=COLUMN@UNIT" in said
    assert not study.exists()


def content(study: Path) -> dict[str, bytes]:
    """Return what a study's files hold, but for its lock and the picture of a check."""
    files = (one for one in study.rglob("*") if one.is_file() and one.name != ".lock")
    return {str(one.relative_to(study)): one.read_bytes() for one in files}


def study_of(folder: Path, runs: list[pd.DataFrame]) -> Path:
    for k, run in enumerate(runs):
        run.to_csv(folder / f"run_{k}.csv", index=False)
    rig = folder / "rig"
    new = ["study", "new", str(rig), "--data", str(folder / "run_*.csv"), "--law", "tanh"]
    assert main(new) == 0
    return rig


@pytest.mark.parametrize("command", [["identify"], ["diagnose"], ["plan"]])
def test_a_run_of_which_scattered_gaps_take_more_than_half_is_refused_with_a_way_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    runs = [bench_run(seed) for seed in (1, 2, 3)]
    runs[2].loc[np.random.default_rng(9).random(1500) < 0.55, "F [N]"] = np.nan
    rig = study_of(tmp_path, runs)
    before = content(rig)
    capsys.readouterr()
    name, *options = command
    assert main([name, str(rig), *options]) == 2
    (said,) = [one for one in capsys.readouterr().err.splitlines() if "run_2" in one]
    assert "samples; a fit needs 200 or more without a gap" in said
    assert 'role = "exclude" in its [[runs]] of study.toml' in said
    assert "STUDY" not in said
    assert content(rig) == before


def test_a_force_saturated_in_more_than_half_is_told_and_carries_no_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [bench_run(seed) for seed in (1, 2)]
    for run in runs:
        run["F [N]"] = run["F [N]"].clip(-5.0, 5.0)
    rig = study_of(tmp_path, runs)
    model = (rig / "model.toml").read_bytes()
    assert main(["diagnose", str(rig)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "The force is saturated in" in told
    assert " samples); 20 % is the most" in told
    assert "Measure with a wider range, or leave these runs out." in told
    assert (rig / "model.toml").read_bytes() == model


def test_a_force_that_drives_the_motion_is_told_where_a_model_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [bench_run(seed) for seed in (1, 2, 3)]
    runs[1]["F [N]"] *= -1.0
    rig = study_of(tmp_path, runs)
    capsys.readouterr()
    assert main(["identify", str(rig), "--starts", "1"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "The force drives the motion in run_1, as no damper does: its sign is wrong" in said
    for more in ([], ["--closure"]):
        assert main(["learn", str(rig), *more]) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert (
            "nothing can be learned from these runs. The force drives the motion in run_1" in said
        )


BURST = """from math import exp

from bristle.physics.law import Constant, Law, Parameter


class Burst(Law):
    '''Burst: a drag that grows beyond all bounds with the speed.'''

    name = "burst"
    parts = ("sign", "viscous")
    source = "made for this test, 2024"
    parameters = {
        "f": Parameter(5.0, "N", (0.0, 1e3), "yield force"),
        "c": Parameter(1.0, "N", (1e-3, 1e3), "drag"),
    }
    command = {"held": Constant("f"), "drag": Constant("c")}

    @staticmethod
    def limit(q, z, p):
        return p.held

    @staticmethod
    def viscous(q, z, p):
        return p.drag * q.v * exp(1e3 * abs(q.v))
"""


def test_a_law_that_is_not_finite_on_one_run_is_refused_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [bench_run(1), bench_run(2)]
    runs[1]["x [m]"] *= 5.0  # so fast that the square of the law's drag is beyond all numbers
    rig = study_of(tmp_path, runs)
    (rig / "laws").mkdir(exist_ok=True)
    (rig / "laws" / "burst.py").write_text(BURST)
    before = content(rig)
    capsys.readouterr()
    assert main(["identify", str(rig), "--law", "burst", "--starts", "1"]) == 2
    said = capsys.readouterr().err
    assert "run_1: the force of the model burst is not finite there, so there is no error." in said
    assert "or another law" in said
    assert content(rig) == before

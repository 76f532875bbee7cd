"""A force that was low-passed and never rests: nobody knows its noise, and no command tells a z."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from bristle.cli import main
from bristle.study.study import Study

RATE, OVER, SECONDS = 500.0, 4, 5.0  # the logger's; the recorder filters before it
CORNER = 60.0  # Hz, of the recorder's filter
MOTIONS = ((12e-3, 1.3), (20e-3, 0.9), (15e-3, 1.7))
HARD = 2.9e6  # N/m3


def write_runs(folder: Path, hard: float, filtered: tuple[int, ...] = (1, 2, 3)) -> None:
    """Write runs of a damper beside a spring that grows stiffer, or is none; some filtered."""
    random = np.random.default_rng(3)
    t = np.arange(int(SECONDS * RATE * OVER)) / (RATE * OVER)
    for k, (size, f) in enumerate(MOTIONS, 1):
        x = size * (np.sin(2.0 * np.pi * f * t) + 0.3 * np.sin(4.62 * np.pi * f * t + 1.0))
        v = np.gradient(x, t)
        force = 60.0 * np.tanh(v / 0.01) + 400.0 * v + hard * x**3
        force += random.standard_normal(t.size)
        corner = butter(4, CORNER, fs=RATE * OVER, output="sos")
        rows = np.column_stack([t, 1e3 * (x + 2e-6 * random.standard_normal(t.size)), force])
        rows[:, 2] = sosfiltfilt(corner, force) if k in filtered else force
        title = "time [s],displacement [mm],force [N]"
        path = folder / f"run{k}.csv"
        np.savetxt(path, rows[::OVER], delimiter=",", header=title, comments="", fmt="%.9g")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], Path]:
    """Return a function that makes a study of such runs, its model identified, once of each."""

    @cache
    def study(hard: float) -> Path:
        folder = tmp_path_factory.mktemp("made")
        write_runs(folder, hard)
        rig, data = str(folder / "rig"), str(folder / "*.csv")
        assert main(["study", "new", rig, "--data", data, "--law", "tanh"]) == 0
        assert main(["identify", rig, "--starts", "2"]) == 0
        return folder / "rig"

    return study


@pytest.fixture
def study_of(
    made: Callable[[float], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[[float], Path]:
    """Return a function that returns a copy of such a study."""

    def copy(hard: float) -> Path:
        kept = made(hard)
        capsys.readouterr()
        return Path(shutil.copytree(kept, tmp_path / "rig"))

    return copy


def test_a_held_out_run_of_another_device_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_runs(tmp_path, 0.0)
    run = np.loadtxt(tmp_path / "run2.csv", delimiter=",", skiprows=1)
    run[:, 2] += 8.0 * np.abs(run[:, 1]) * np.sign(run[:, 2])
    title = "time [s],displacement [mm],force [N]"
    np.savetxt(tmp_path / "run2.csv", run, delimiter=",", header=title, comments="", fmt="%.9g")
    study, data = str(tmp_path / "rig"), str(tmp_path / "*.csv")
    assert main(["study", "new", study, "--data", data, "--law", "tanh"]) == 0
    assert main(["identify", study, "--starts", "2"]) == 0
    told = "The held-out runs err far more than the training runs: they do what no training run"
    assert told in " ".join(capsys.readouterr().out.split())


def test_a_held_out_run_of_unknown_noise_explains_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_runs(tmp_path, HARD, filtered=(2,))
    study, data = str(tmp_path / "rig"), str(tmp_path / "*.csv")
    assert main(["study", "new", study, "--data", data, "--law", "tanh"]) == 0
    assert main(["identify", study, "--starts", "2"]) == 0
    assert main(["add", study, "asymmetry"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "not known on the held-out runs and" in told
    assert "The noise explains it" not in told


def numbers_of_z(value: Any, key: str = "") -> list[Any]:
    """Return all values of keys that are a z, wherever they are in an answer."""
    if isinstance(value, dict):
        return [one for name, part in value.items() for one in numbers_of_z(part, str(name))]
    if isinstance(value, list):
        return [one for part in value for one in numbers_of_z(part, key)]
    return [value] if key == "z" or key.startswith("z_") else []


def test_identify_and_compare_tell_no_z(
    study_of: Callable[[float], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    study = study_of(0.0)
    assert main(["identify", str(study), "--dry-run", "--details"]) == 0
    told = capsys.readouterr().out
    rows = [line for line in told.splitlines() if line.startswith("  z, ")]
    assert len(rows) == 2
    assert all(row.count("not known") == 2 for row in rows)
    assert "How much of it is noise is not known" in told
    assert "times the noise" not in told
    assert main(["identify", str(study), "--dry-run", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["noise_known"] is False
    assert set(numbers_of_z(answer)) == {None}
    assert "NaN" not in json.dumps(answer)

    assert main(["compare", str(study)]) == 0
    told = capsys.readouterr().out
    assert "noise included, which is not known" in told
    assert "times the noise" not in told
    assert "what exceeds" not in told
    assert "nan" not in told
    assert main(["compare", str(study), "--json"]) == 0
    assert set(numbers_of_z(json.loads(capsys.readouterr().out))) == {None}

    steps = Study(study).history.steps()
    assert all("z_holdout" not in step.after for step in steps)
    assert main(["report", str(study)]) == 0
    told = capsys.readouterr().out
    assert "How much of it is noise is not known." in told
    assert "z" not in told.partition("Report")[0].split()
    assert "nan" not in told
    page = (study / "reports" / "report.html").read_text(encoding="utf-8")
    assert "z = not known" in page
    assert "nan to nan" not in page


@pytest.mark.slow  # every effect is fitted to noise that nobody knows
def test_where_the_noise_is_not_known_nothing_is_said_to_be_missing_or_to_be_all_there(
    study_of: Callable[[float], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    study = study_of(0.0)
    assert main(["diagnose", str(study), "--json"]) == 0
    verdict = json.loads(capsys.readouterr().out)
    assert verdict["kind"] == "insufficient"
    assert verdict["effects"] == []
    assert verdict["noise_known"] is False
    assert set(numbers_of_z(verdict)) == {None}
    assert re.search(  # an effect of a few hundredths of a per cent is what the filter looks like
        r"No effect of the library lowers the error.* is unexplained, noise included"
        r"|falls from 0\.\d\d % to 0\.\d\d % of the force, noise included\. How much of the",
        verdict["words"],
    )
    assert "[channels.force]" in verdict["words"]


def test_an_effect_is_named_for_the_error_that_it_takes(
    study_of: Callable[[float], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    study = study_of(HARD)
    assert main(["diagnose", str(study)]) == 0
    told = capsys.readouterr().out
    assert told.startswith("Missing from the model: Duffing spring")

    assert "of the force, noise included" in " ".join(told.split())
    assert "z = " not in told
    verdict = json.loads((study / "verdict.json").read_text(encoding="utf-8"))
    assert set(numbers_of_z(verdict)) == {None}
    best = max(verdict["ranking"], key=lambda row: row["gain"])
    assert (best["effect"], best["gain"] > 0.9) == ("duffing", True)


def test_noise_that_the_user_states_is_known(
    study_of: Callable[[float], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    study = study_of(0.0)
    settings = study / "study.toml"
    text = settings.read_text(encoding="utf-8")
    settings.write_text(text.replace("[channels.force]\n", "[channels.force]\nnoise = 0.3\n"))
    assert main(["identify", str(study), "--dry-run", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["noise_known"] is True
    assert 0.3 < answer["after"]["z_holdout"] < 3.0

"""Published measurements of real rigs: all are read, with sensible guesses.

The data lie beside the repository where there are any; they are not part of it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.data.guess import guess_channels, left_out
from bristle.data.measurement import read_measurements
from bristle.data.read import read_table
from bristle.study import create_study
from bristle.study.data_check import check_data

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"  # ../shared/data
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the reference data are not there")


def guesses(path: Path, rig: str = "bench", levels: list[str] | None = None) -> dict[str, tuple]:  # type: ignore[type-arg]
    found = guess_channels(read_table(path), rig, levels)
    assert all(guess.reason and not guess.doubt for guess in found)
    return {guess.channel: (guess.column, guess.unit, guess.sign) for guess in found}


@pytest.mark.parametrize(
    "path", sorted((DATA / "mr_damper_utfpr").glob("*.csv")), ids=lambda p: p.stem
)
def test_crank_driven_damper(path: Path) -> None:
    assert guesses(path) == {
        "time": ("time_s", "s", 1),
        "displacement": ("displacement_mm", "mm", 1),
        "velocity": ("velocity_mm_s", "mm/s", 1),
        "voltage": ("coil_voltage_V", "V", 1),
        "force": ("force_N", "N", 1),
    }
    (run,) = read_measurements([path])
    assert run.step == pytest.approx(0.01, rel=1e-6)
    assert run.measured.all()
    assert 0.2 < run.noise["force"] < 20.0


def test_crank_driven_damper_as_a_study(tmp_path: Path) -> None:
    files = sorted((DATA / "mr_damper_utfpr").glob("*.csv"))[::6]
    look = check_data(create_study(tmp_path / "rig", files).study)
    kinds = {finding.kind for finding in look.findings}
    assert look.ok, repr(look)
    # Its README: velocity is a numerical derivative, force carries about 130 N, one voltage a run.
    assert {"derived", "offset", "drive"} <= kinds
    assert not kinds & {"clipping", "gain", "two rigs"}


def test_velocity_to_force_set_is_turned_in_sign(tmp_path: Path) -> None:
    path = DATA / "mr_damper_mathworks" / "mrdamper.csv"
    assert guesses(path) == {
        "time": ("time_s", "s", 1),
        "velocity": ("velocity_cm_s", "cm/s", 1),
        "force": ("force_N", "N", -1),
    }
    (run,) = read_measurements([path])
    assert len(run.time) == 3499
    assert np.corrcoef(run["velocity"], run["force"])[0, 1] == pytest.approx(0.81, abs=0.01)
    look = check_data(create_study(tmp_path / "rig", [path]).study)
    assert look.ok


def test_tribometer_with_samples_missing(tmp_path: Path) -> None:
    path = DATA / "friction_tribometer" / "tribometer_reciprocating.csv"
    found = guesses(path)
    assert found["displacement"] == ("position_mm", "mm", 1)
    assert found["force"][0] == "friction_force_N"
    assert left_out(read_table(path), guess_channels(read_table(path))) == ["normal_force_N"]
    pieces = read_measurements([path])
    assert [len(piece.time) for piece in pieces][-1] > 42000
    assert all(piece.step == pytest.approx(0.005, rel=1e-6) for piece in pieces)
    assert any("missing" in note for note in pieces[0].notes)


@pytest.mark.parametrize("name", ["bi_bncs_cnp100.csv", "bi_bncs_ica50.csv.gz"])
def test_shake_table(name: str) -> None:
    path = DATA / "shake_table_base_isolated" / name
    levels = ["base", *(f"floor{k}" for k in range(1, 6))]
    found = guesses(path, "structure", levels)
    assert found["ground_acceleration"] == ("ground_acc_m_s2", "m/s2", 1)
    for k, level in enumerate(levels, 1):
        assert found[f"{level}_acceleration_absolute"][0] == f"acc{k}_abs_m_s2"
        assert found[f"{level}_displacement"][0] == f"disp{k}_rel_m"

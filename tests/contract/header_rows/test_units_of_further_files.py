"""All files of a study have the units of the first: another one is refused, none is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main

T = np.arange(600) / 200.0


def written(path: Path, names: str, units: str, turn: float) -> Path:
    x, v = 8.0 * np.sin(turn * T), 8.0 * turn * np.cos(turn * T)
    rows = (
        f"{a:.4f},{b:.4f},{c:.4f}"
        for a, b, c in zip(T, x, 2.0 * np.tanh(v / 9.0) + 0.01 * v, strict=True)
    )
    path.write_text("\n".join([names, *([units] if units else []), *rows, ""]))
    return path


@pytest.fixture
def first(tmp_path: Path) -> Path:
    return written(tmp_path / "run1.csv", "Time,Disp,Force", "s,mm,kN", 7.0)


def new(tmp_path: Path) -> int:
    return main(["study", "new", str(tmp_path / "rig"), "--data", str(tmp_path / "run*.csv")])


def test_a_file_without_units_is_said(tmp_path: Path, first: Path, capsys) -> None:
    written(tmp_path / "run2.csv", "Time,Disp,Force", "", 9.0)
    assert new(tmp_path) == 0
    taken = 's for "Time", mm for "Disp", kN for "Force" are taken, as in run1.csv'
    assert f"run2.csv: no units: {taken}" in " ".join(capsys.readouterr().out.split())
    third = written(tmp_path / "more.csv", "Time,Disp,Force", "", 8.0)
    assert main(["study", "extend", str(tmp_path / "rig"), str(third)]) == 0
    assert f"more.csv: no units: {taken}" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("unit", ["N", "tf"])
def test_another_unit_and_an_unknown_one_are_refused(tmp_path, first, capsys, unit) -> None:
    written(tmp_path / "run2.csv", "Time,Disp,Force", f"s,mm,[{unit}]", 9.0)
    assert new(tmp_path) == 2
    said = capsys.readouterr().err
    assert "run2.csv" in said
    assert unit in said
    assert "All runs of a study" in said or "all runs of a study" in said


def test_a_unit_that_is_given_for_a_first_file_without_any(tmp_path: Path, capsys) -> None:
    written(tmp_path / "run1.csv", "Time,Disp [mm],Force", "", 7.0)
    written(tmp_path / "run2.csv", "Time,Disp [mm],Force", "s,mm,kN", 9.0)
    command = ["study", "new", str(tmp_path / "rig"), "--data", str(tmp_path / "run*.csv")]
    assert main([*command, "--channel", "force=Force@N"]) == 2
    assert '"Force" is in kN, and in N in' in capsys.readouterr().err

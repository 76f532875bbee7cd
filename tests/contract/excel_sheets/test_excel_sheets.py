"""Of the sheets of a workbook that with the channels is read, and the others are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from bristle.cli import main
from bristle.data.read import read_table

T = 0.005 * np.arange(300)
RUN = [("time [s]", "x [mm]", "F [kN]")] + [
    (t, 5.0 * np.sin(9.0 * t), 0.3 * np.tanh(9.0 * np.cos(9.0 * t))) for t in T.tolist()
]
LOAD = [0.1 * k for k in range(15)]
CALIBRATION = [("load [kN]", "signal [mV]"), *((a, 3.0 * a) for a in LOAD)]
CYCLES = [("time [s]", "peak x [mm]", "peak F [kN]"), *((a, 5.0, 0.3) for a in LOAD)]
LONG = [("load [kN]", "signal [mV]"), *((0.1 * k, 0.3 * k) for k in range(900))]


def book(file: Path, **sheets: list[Any]) -> Path:
    out = openpyxl.Workbook()
    out.remove(out.active)
    for title, rows in sheets.items():
        sheet = out.create_sheet(title)
        for row in rows:
            sheet.append(row)
    out.save(file)
    return file


@pytest.mark.parametrize("before", [CALIBRATION, CYCLES, LONG, [("made by", "me"), (1, 2)]])
def test_what_stands_before_the_channels_is_not_taken_for_them(
    tmp_path: Path, capsys, before: list[Any]
) -> None:
    file = book(tmp_path / "run.xlsx", Before=before, Data=RUN)
    assert read_table(file).rows == 300
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f'run.xlsx: sheet "Data" is read; "Before" ({len(before) - 1} row' in said.replace(
        "(2 row", "(1 row"
    )


def test_of_two_runs_the_other_is_named(tmp_path: Path, capsys) -> None:
    file = book(tmp_path / "run.xlsx", one=RUN, two=RUN[:200])
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert 'sheet "one" is read; "two" (199 rows: time [s], x [mm], F [kN]) is not.' in said


def test_where_a_channel_is_on_another_sheet_the_sheet_is_named(tmp_path: Path, capsys) -> None:
    motion, load = ([(row[0], row[k]) for row in RUN] for k in (1, 2))
    file = book(tmp_path / "run.xlsx", motion=motion, load=load)
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "no column can be the force" in said
    assert '"load" (300 rows: time [s], F [kN]) is not.' in said


def test_a_hidden_sheet_is_named(tmp_path: Path) -> None:
    file = book(tmp_path / "run.xlsx", Data=RUN, Old=RUN)
    changed = openpyxl.load_workbook(file)
    changed["Old"].sheet_state = "hidden"
    changed.save(file)
    assert read_table(file).remarks == ('sheet "Data" is read; "Old" (hidden) is not',)

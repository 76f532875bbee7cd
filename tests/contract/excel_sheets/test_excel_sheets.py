"""Of the sheets of a workbook that with the channels is read, and the others are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from bristle.cli import main
from bristle.data.read import read_table
from bristle.study import Study

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
    assert 'sheet "one" is read; "two" (199 rows: time [s], x [mm], F [kN]) is not: ' in said
    assert "--sheet NAME reads another, --sheet '*' each as a run." in said
    study = Study(tmp_path / "s")
    assert [len(run.time) for run in study.read()] == [300]


@pytest.mark.parametrize(
    ("sheet", "lengths"), [("one", [300]), ("two", [199]), ("*", [300, 199]), ("old", [100])]
)
def test_a_sheet_is_chosen_and_stays_so(tmp_path: Path, sheet: str, lengths: list[int]) -> None:
    file = book(tmp_path / "a.xlsx", Log=CALIBRATION, one=RUN, two=RUN[:200], old=RUN[:101])
    book(tmp_path / "b.xlsx", one=RUN[:240], old=RUN[:90], two=RUN[:220])
    changed = openpyxl.load_workbook(file)
    changed["old"].sheet_state = "hidden"
    changed.save(file)
    folder = str(tmp_path / "s")
    assert main(["study", "new", folder, "--data", str(file), "--sheet", sheet, "--quiet"]) == 0
    assert [len(run.time) for run in Study(folder).read()] == lengths
    hold = ["--holdout", "b.xlsx", "--quiet"]
    assert main(["study", "extend", folder, str(tmp_path / "b.xlsx"), *hold]) == 0
    added = {"one": [239], "two": [219], "*": [239, 89, 219], "old": [89]}[sheet]
    assert [len(run.time) for run in Study(folder).read()] == lengths + added
    book(tmp_path / "c.xlsx", Log=CALIBRATION, **{sheet.replace("*", "alone"): RUN[:210]})
    assert main(["study", "extend", folder, str(tmp_path / "c.xlsx"), "--quiet"]) == 0
    assert len(Study(folder).read()[-1].time) == 209
    assert main(["study", "channels", folder, "--channel", "force=F@N", "--quiet"]) == 0


@pytest.mark.parametrize(
    ("name", "sheet", "said"),
    [
        ("a.xlsx", "three", 'no sheet is called "three"; there are "one", "two".'),
        ("a.csv", "one", "this is no workbook, and has no sheet to choose."),
    ],
)
def test_a_sheet_that_is_not_there(tmp_path: Path, capsys, name: str, sheet: str, said: str):
    book(tmp_path / "a.xlsx", one=RUN, two=RUN)
    (tmp_path / "a.csv").write_text("\n".join(",".join(map(str, row)) for row in RUN))
    new = ["study", "new", str(tmp_path / "s"), "--data", str(tmp_path / name), "--sheet", sheet]
    assert main([*new, "--quiet"]) == 2
    assert said in " ".join(capsys.readouterr().err.split())


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

"""Three rows above the numbers: names and units count, what else loggers write there does not."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from bristle.cli import main

T = np.arange(400) / 200.0
X = 5.0 * np.sin(9.0 * T)
V = 2.0 + np.sin(2.0 * T)
F = 300.0 * V * np.tanh(np.cos(9.0 * T) / 0.1) + 20.0 * np.cos(9.0 * T)
NAMES, UNITS = "Time,Disp,Coil,Load", "s,mm,V,N"


def made(tmp_path: Path, *header: str, sep: str = ",", comma: bool = False) -> Path:
    """Return a file of four columns below some rows of a header, which commas part."""
    rows = [f"{t:.4f},{x:.4f},{v:.4f},{f:.4f}" for t, x, v, f in zip(T, X, V, F, strict=True)]
    text = "\n".join([*header, *rows]).replace(",", sep)
    if comma:
        text = text.replace(".", ",")
    path = tmp_path / "run.csv"
    path.write_text(text + "\n", encoding="utf-8")
    return path


def channels(tmp_path: Path, file: Path) -> dict[str, dict[str, object]]:
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 0
    read: dict[str, dict[str, object]] = tomllib.loads((tmp_path / "rig/study.toml").read_text())[
        "channels"
    ]
    return read


@pytest.mark.parametrize(
    "header",
    [
        (NAMES, UNITS, ",CH1,CH2,CH3"),
        (NAMES, UNITS, "1,2,3,4"),
        (NAMES, "1,2,3,4", UNITS),
        (NAMES, UNITS, ",0,1,2"),
        (NAMES, "double,double,double,float", UNITS),
        (NAMES, UNITS, "N,N,N,N"),
        (NAMES, UNITS, "Smp,Min,Avg,Max"),
        (NAMES, UNITS, "logger clock,LVDT 3 at rod,coil drive,cell 25 kN"),
        (NAMES, UNITS, "logger time [s],rod LVDT 50 [mm],drive 10 [V],load cell 25 [kN]"),
        (NAMES, UNITS, "CH0,CH1,CH2,CH3", "raw,raw,raw,filtered"),
        ("logger,LVDT 50,drive,cell 25 kN", NAMES, UNITS),
        ("Operator,A. N. Other,,", "", NAMES, "", UNITS, "A1,A2,A3,A4"),
        ("[s],[mm],[V],[N]", NAMES),
    ],
)
def test_names_and_units_are_told_by_each_other(tmp_path, header) -> None:
    read = channels(tmp_path, made(tmp_path, *header))
    assert {name: (one["column"], one["unit"]) for name, one in read.items()} == {
        "time": ("Time", "s"), "displacement": ("Disp", "mm"), "voltage": ("Coil", "V"),
        "force": ("Load", "N"),
    }  # fmt: skip


def test_decimal_commas_and_german_rows(tmp_path) -> None:
    file = made(
        tmp_path, "Zeit,Weg,Spannung,Kraft", "[s],[mm],[V],[kN]", "MW,MW,MW,MW", sep=";", comma=True
    )
    read = channels(tmp_path, file)
    assert (read["force"]["column"], read["force"]["unit"]) == ("Kraft", "kN")


def test_a_logger_of_instants_names_columns_units_and_processing(tmp_path) -> None:
    rows = [f'"2024-03-01 13:27:{10 + t:06.3f}",{k},{x:.4f},{f:.3f}'
            for k, (t, x, f) in enumerate(zip(T, X, F, strict=True))]  # fmt: skip
    header = (
        '"TOA5","CR6","CR6","1234","CR6.Std.08","CPU:rig.CR6","5511","Fast"',
        '"TIMESTAMP","RECORD","Disp","Load"', '"TS","RN","mm","N"', '"","","Smp","Smp"',
    )  # fmt: skip
    (tmp_path / "rig.dat").write_text("\n".join([*header, *rows]) + "\n")
    read = channels(tmp_path, tmp_path / "rig.dat")
    assert read["time"]["unit"] == "s"
    assert (read["force"]["column"], read["force"]["unit"]) == ("Load", "N")


def test_a_workbook_with_a_third_row(tmp_path) -> None:
    book = openpyxl.Workbook()
    for row in (NAMES.split(","), UNITS.split(","), ["AI0", "AI1", "AI2", "AI3"]):
        book.active.append(row)
    for row in zip(T.tolist(), X.tolist(), V.tolist(), F.tolist(), strict=True):
        book.active.append(row)
    book.save(tmp_path / "run.xlsx")
    assert channels(tmp_path, tmp_path / "run.xlsx")["force"]["column"] == "Load"


@pytest.mark.parametrize(
    "header",
    [
        ("Time [s],Disp [mm],Coil [V],Load [kN]", UNITS),
        ("Time_s,Disp_mm,Coil_V,Load_kN", UNITS),
        ("Time [s],Disp [mm],Coil [V],Load [N]",
         "logger time [s],rod LVDT 50 [mm],drive 10 [V],load cell 25 [kN]"),
        ("Zeit,K1,K2,K3", UNITS, "time,rod displacement,coil voltage [V],load cell 25 [kN]"),
    ],
)  # fmt: skip
def test_rows_that_contradict_each_other_on_a_unit_are_named(tmp_path, capsys, header) -> None:
    file = made(tmp_path, *header)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) != 0
    said = capsys.readouterr().err
    assert "the title says" in said
    assert "kN" in said
    assert "--channel" in said
    assert not (tmp_path / "rig").exists()


def test_numbers_that_begin_as_a_count_are_numbers(tmp_path) -> None:
    lines = ["time [s],x [mm],F [N]", *(f"{k},{k + 1},{(k * 7) % 5 + 2}" for k in range(60))]
    (tmp_path / "count.csv").write_text("\n".join(lines) + "\n")
    from bristle.data.read import read_table

    assert read_table(tmp_path / "count.csv").rows == 60


def test_titles_that_blanks_part_above_a_table_of_tabs(tmp_path: Path) -> None:
    file = made(tmp_path, "Time[s] Disp[mm] Coil[V] Load[N]", sep="\t", comma=True)
    read = channels(tmp_path, file)
    assert {name: (one["column"], one["unit"]) for name, one in read.items()} == {
        "time": ("Time[s]", "s"), "displacement": ("Disp[mm]", "mm"),
        "voltage": ("Coil[V]", "V"), "force": ("Load[N]", "N"),
    }  # fmt: skip


def test_units_with_a_full_stop_and_fahrenheit_in_a_row_of_units(tmp_path: Path) -> None:
    read = channels(tmp_path, made(tmp_path, "Time,Disp,Oil temperature,Load", "sec.,in.,F,lbs."))
    assert {name: one["unit"] for name, one in read.items()} == {
        "time": "s", "displacement": "in", "temperature": "degF", "force": "lbf",
    }  # fmt: skip


def test_the_advice_for_an_unknown_unit_names_none_that_would_be_wrong(tmp_path, capsys) -> None:
    file = made(tmp_path, "Time [s],Disp [counts],Coil [V],Load [N]")
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 2
    said = capsys.readouterr().err
    assert '--channel "displacement=Disp [counts]@UNIT", where UNIT is what it is in' in said

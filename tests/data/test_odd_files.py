"""Files that are a little off: what is read all the same, and what is told of the rest."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import measurements_of
from bristle.data.noise import spikes_of
from bristle.data.pieces import pieces_of
from bristle.data.read import read_table
from bristle.data.table import Table, from_arrays, table_from_frame
from bristle.errors import RecordError, StudyError
from bristle.study.steps import create_study

T = 0.01 * np.arange(120)
TITLES = ["time [s]", "x [mm]", "F [N]"]
ROWS = np.column_stack([T, np.sin(9.0 * T), np.cos(9.0 * T)])


def sheet(path: Path, rows: list[list[object]], merged: str = "") -> Table:
    """Write rows into a workbook, and read it."""
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    if merged:
        book.active.merge_cells(merged)
    book.save(path)
    return read_table(path)


def values(table: Table) -> np.ndarray:
    return np.column_stack([table.values[title] for title in TITLES])


# -- workbooks and delimited text


def test_a_table_that_begins_in_the_second_column_is_read(tmp_path: Path) -> None:
    moved = [[None, *TITLES], *([None, *row] for row in ROWS.tolist())]
    np.testing.assert_allclose(values(sheet(tmp_path / "a.xlsx", moved)), ROWS)
    under = sheet(tmp_path / "b.xlsx", [["Report of test 7"], [], *moved])
    np.testing.assert_allclose(values(under), ROWS)
    assert [column.text for column in under.columns] == TITLES


def test_a_row_without_its_first_value_stays_in_its_columns(tmp_path: Path) -> None:
    rows = ROWS.tolist()
    rows[0][0] = rows[60][0] = None
    found = values(sheet(tmp_path / "a.xlsx", [TITLES, *rows]))
    assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == [0, 60]
    np.testing.assert_allclose(found[:, 1:], ROWS[:, 1:])


def test_merged_cells_above_the_titles_do_no_harm(tmp_path: Path) -> None:
    rows = [["Report of test 7"], TITLES, *ROWS.tolist()]
    np.testing.assert_allclose(values(sheet(tmp_path / "a.xlsx", rows, "A1:C1")), ROWS)
    units = [["Report"], ["time", "x", "F"], ["s", "mm", "N"], *ROWS.tolist()]
    assert sheet(tmp_path / "b.xlsx", units, "A1:C1").columns[1].unit.name == "mm"
    with pytest.raises(RecordError, match="B2:C2 are merged"):
        sheet(tmp_path / "c.xlsx", units, "B2:C2")


@pytest.mark.parametrize(("count", "told"), [(1, "one row of numbers"), (2, "2 rows of numbers")])
def test_too_few_rows_are_told_as_such(tmp_path: Path, count: int, told: str) -> None:
    path = tmp_path / "short.csv"
    path.write_text("\n".join([",".join(TITLES), *("0.0,1.0,2.0" for _ in range(count))]) + "\n")
    with pytest.raises(StudyError, match=rf"{told}: no column can be .* the time in fewer than 10"):
        create_study(tmp_path / "rig", [path])
    with pytest.raises(RecordError, match=told):
        measurements_of(read_table(path))


# -- two columns of one name


def test_two_columns_of_one_name_are_refused_where_names_are_all_there_is(tmp_path: Path) -> None:
    frame = pd.DataFrame(ROWS, columns=["time [s]", "F [N]", "F [N]"])
    with pytest.raises(RecordError, match=r'frame: 2 columns are called "F \[N\]"'):
        table_from_frame(frame)
    path = tmp_path / "two.parquet"
    pq.write_table(pa.table(list(map(pa.array, ROWS.T)), names=list(frame.columns)), path)
    with pytest.raises(RecordError, match=r'2 columns are called "F \[N\]". Rename'):
        read_table(path)


def test_fields_of_two_compound_datasets_stay_apart(tmp_path: Path) -> None:
    path = tmp_path / "two.h5"
    rows = np.zeros(120, dtype=[("time", "f8"), ("force", "f8")])
    with h5py.File(path, "w") as file:
        for number, name in enumerate("ab", 1):
            rows["force"] = number
            file[f"run/{name}"] = rows
    found = read_table(path).values
    assert found["force"][0] == 1.0
    assert found["run.b.force"][0] == 2.0


# -- HDF5 and LabVIEW


def test_a_unit_as_an_array_of_one_text_counts_and_a_step_that_is_no_number_does_not(
    tmp_path: Path,
) -> None:
    path = tmp_path / "unit.h5"
    with h5py.File(path, "w") as file:
        file["force"] = T
        file["force"].attrs["unit"] = np.array([b"kN"])
        file["dt"] = float("nan")
    table = read_table(path)
    assert [(column.text, column.unit.name) for column in table.columns] == [("force", "kN")]


HEADER = """LabVIEW Measurement
Separator\tTab
***End_of_Header***
Channels\t2
Y_Unit_Label\tN\tµm
X0\t{start}
Delta_X\t{step}
***End_of_Header***
"""


def labview(path: Path, start: str, step: str, titles: str) -> Table:
    """Write a file whose channels have a time each, in Windows-1252, and read it."""
    rows = "".join(f"{t:.2f}\t{f:.4f}\t{t:.2f}\t{x:.4f}\t\n" for t, x, f in ROWS)
    text = f"{HEADER.format(start=start, step=step)}{titles}\n{rows}"
    path.write_bytes(text.encode("cp1252"))
    return read_table(path)


def test_a_time_per_channel_of_labview(tmp_path: Path) -> None:
    titles = "X_Value\tForce\tX_Value\tPath\tComment"
    table = labview(tmp_path / "a.lvm", "0\t0", "0.01\t0.01", titles)
    assert [(column.text, column.unit.name) for column in table.columns] == [
        ("time [s]", "s"), ("Force [N]", "N"), ("Path [µm]", "um"),
    ]  # fmt: skip
    np.testing.assert_allclose(table.values["Path [µm]"], ROWS[:, 1], atol=1e-4)
    with pytest.raises(RecordError, match=r"differ in Delta_X \(0.01, 0.02\)"):
        labview(tmp_path / "b.lvm", "0\t0", "0.01\t0.02", titles)


def test_a_header_of_labview_that_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "run.lvm"
    rows = "".join(f"\t{f:.4f}\n" for f in ROWS[:, 2])
    path.write_text(f"{HEADER.format(start='soon', step='0.01')}X_Value\tForce\n{rows}")
    with pytest.raises(RecordError, match='X0 is "soon"; numbers are right'):
        read_table(path)


# -- runs in one file, spikes


def test_what_cannot_tell_runs_apart_is_told() -> None:
    channels = {"time": ChannelSpec("t", "s"), "displacement": ChannelSpec("x", "m")}
    words = np.array(["a"] * 60 + ["b"] * 60)
    table = from_arrays({"t": T, "x": np.full(120, np.nan), "which": words}, "run.csv")
    with pytest.raises(RecordError, match=r'column "which": it holds .* holds numbers'):
        pieces_of(table, "column which", channels)
    with pytest.raises(RecordError, match="the displacement, which tells its runs apart, is miss"):
        pieces_of(table, "rests", channels)
    short = from_arrays({"t": np.tile(T[:30], 4)}, "run.csv")
    with pytest.raises(RecordError, match="no two of its stretches have 60 samples"):
        pieces_of(short, "restart", channels)
    gap = T.copy()
    gap[60:] -= T[60]
    gap[59] = np.nan  # the last sample of the first run
    assert [part.rows for part in pieces_of(from_arrays({"t": gap}, "run"), "restart", channels)]


def test_a_spike_between_values_that_are_missing_has_its_size() -> None:
    y = 0.01 * np.sin(9.0 * T)
    y[58:63] = np.nan
    y[60] = 5.0
    (spike,) = spikes_of(T, {"force": y}, mask=True)
    assert spike.size == pytest.approx(5.0, abs=0.02)
    assert np.isnan(y[60])

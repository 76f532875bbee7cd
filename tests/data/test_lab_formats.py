"""Files as laboratories hand them over: workbooks, TDMS, HDF5, LabVIEW, test machines."""

from __future__ import annotations

import re
import sys
import zipfile
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pytest
from nptdms import ChannelObject, RootObject, TdmsWriter

from bristle.data.formats._rows import seconds_of
from bristle.data.guess import guess_channels
from bristle.data.measurement import measurements_of
from bristle.data.pieces import pieces_of, wrong_split
from bristle.data.read import files_in, read_table
from bristle.data.table import Table
from bristle.data.titles import title
from bristle.errors import RecordError

N = 400
T = np.arange(N) / 200.0
X = 5.0 * np.sin(9.0 * T)
F = 0.3 * np.tanh(np.cos(9.0 * T) / 0.1) + 0.02 * np.cos(9.0 * T)
I = np.where(T < 1.0, 0.5, 1.0)  # noqa: E741


def same(table: Table, current: bool = True) -> None:
    """Hold the measurement in a table against what was written."""
    found = {guess.channel: guess for guess in guess_channels(table)}
    (run,) = measurements_of(table, estimate=False)
    np.testing.assert_allclose(run.time - run.time[0], T, atol=1e-6)
    np.testing.assert_allclose(run["displacement"], 1e-3 * X, atol=1e-8)
    np.testing.assert_allclose(run["force"], 1e3 * F, atol=1e-5)
    if current:
        np.testing.assert_allclose(run["current"], I)
        assert found["current"].unit == "A"


# -- workbooks


def workbook(path: Path, change=lambda sheet, book: None) -> Path:
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Data"
    sheet.append(["Test of damper 7"])
    sheet.append(["Operator", "A. N. Other"])
    sheet.append(["Time", "Displacement", "Load", "Current (amp)"])
    sheet.append(["s", "mm", "kN", "A"])
    for row in zip(T.tolist(), X.tolist(), F.tolist(), I.tolist(), strict=True):
        sheet.append(row)
    change(sheet, book)
    book.save(path)
    return path


def test_a_workbook_gives_its_values(tmp_path: Path) -> None:
    table = read_table(workbook(tmp_path / "run.xlsx"))
    assert [column.text for column in table.columns][:2] == ["Time", "Displacement"]
    assert table.where(0) == "row 5"
    same(table)


def test_a_log_of_the_test_before_the_measurement_is_not_read(tmp_path: Path) -> None:
    def more(sheet, book) -> None:
        log = book.create_sheet("Log", 0)
        for row in (["Specimen", 7], ["Oil", 23.5], ["Made", "=TODAY()"]):
            log.append(row)

    table = read_table(workbook(tmp_path / "a.xlsx", more))
    assert table.rows > 10
    assert table.remarks == ('sheet "Data" is read; "Log" (3 rows: column 1, column 2) is not',)

    def uncomputed(sheet, book) -> None:
        for row in range(5, 17):
            sheet.cell(row, 1).value = "=ROW()"

    with pytest.raises(RecordError, match=r'sheet "Data", cell A5: the formula has no stored'):
        read_table(workbook(tmp_path / "b.xlsx", uncomputed))


def test_the_sheet_with_numbers_is_read(tmp_path: Path) -> None:
    def more(sheet, book) -> None:
        book.create_sheet("About", 0).append(["nothing", "but words"])
        book.create_sheet("Spare")

    table = read_table(workbook(tmp_path / "run.xlsx", more))
    assert table.remarks == ('sheet "Data" is read; "About", "Spare" are not',)
    same(table)


def test_instants_in_a_workbook(tmp_path: Path) -> None:
    def dated(sheet, book) -> None:
        for k in range(N):
            cell = sheet.cell(5 + k, 1)
            cell.value = datetime(2024, 3, 12, 23, 59, 59) + timedelta(seconds=T[k])

    same(read_table(workbook(tmp_path / "run.xlsx", dated)))


def test_merged_cells_are_refused_where_they_matter(tmp_path: Path) -> None:
    same(read_table(workbook(tmp_path / "a.xlsx", lambda s, b: s.merge_cells("A1:C1"))))
    for cells in ("B3:C3", "A7:A8"):
        path = workbook(tmp_path / "b.xlsx", lambda s, b, cells=cells: s.merge_cells(cells))
        with pytest.raises(RecordError, match=rf'sheet "Data": cells {cells} are merged'):
            read_table(path)


def test_formulas_need_their_stored_values(tmp_path: Path) -> None:
    def formula(sheet, book) -> None:
        sheet["C9"] = "=2*B9"

    with pytest.raises(RecordError, match="cell C9: the formula has no stored value"):
        read_table(workbook(tmp_path / "run.xlsx", formula))


def test_stored_values_of_formulas_count_and_macros_do_not_run(tmp_path: Path) -> None:
    plain = workbook(tmp_path / "plain.xlsx")
    path = tmp_path / "run.xlsm"
    with zipfile.ZipFile(plain) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            part = old.read(name)
            if name == "xl/worksheets/sheet1.xml":
                part = re.sub(rb'(<c r="B9"[^>]*>)<v>', rb"\1<f>1/0</f><v>", part)
            new.writestr(name, part)
        new.writestr("xl/vbaProject.bin", b"Sub Auto_Open()")
    table = read_table(path)
    assert any("macros, which are not run" in note for note in table.notes)
    assert any("1 cells hold formulas" in note for note in table.notes)
    same(table)


def test_a_workbook_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    path.write_bytes(workbook(tmp_path / "whole.xlsx").read_bytes()[:2000])
    with pytest.raises(RecordError, match="no Excel workbook, or damaged"):
        read_table(path)
    openpyxl.Workbook().save(path)
    with pytest.raises(RecordError, match="no row of numbers"):
        read_table(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("run.csv", "t,F\n")
    with pytest.raises(RecordError, match="zip archive and no Excel"):
        read_table(path)


@pytest.mark.parametrize(
    ("title", "form", "top"),
    [
        ("Duty [%]", "0%", 50.0),
        ("Duty", "0.0 %", 50.0),  # the format tells the unit that the title does not
        ("Duty [%]", '0.0"%"', 0.5),  # a word behind the number, which is one of per cent already
        ("Duty [%]", "0.00", 0.5),
    ],
)
def test_a_cell_that_is_shown_in_per_cent_is_read_so(
    tmp_path: Path, title: str, form: str, top: float
) -> None:
    def change(sheet, book) -> None:
        sheet["D3"], sheet["D4"] = title, ""
        for cell in sheet["D"][4:]:
            cell.value, cell.number_format = min(cell.value, 0.5), form

    (run,) = measurements_of(read_table(workbook(tmp_path / "run.xlsx", change)), estimate=False)
    assert np.max(run["duty"]) == pytest.approx(top)
    assert np.max(run["displacement"]) == pytest.approx(1e-3 * np.max(X))


@pytest.mark.parametrize(
    ("form", "size", "doubted"),
    [("#,##0.000,;-#,##0.000,", 1e3, True), ('0.0," kN"', 1e3, False), ('0.0," MN"', 1.0, False)],
)
def test_a_cell_that_is_shown_in_thousands_is_read_so(
    tmp_path: Path, form: str, size: float, doubted: bool
) -> None:
    def change(sheet, book) -> None:
        for cell in sheet["C"][4:]:
            cell.value, cell.number_format = size * cell.value, form

    one, other = (
        read_table(workbook(tmp_path / name, what))
        for name, what in (("a.xlsx", lambda *_: None), ("b.xlsx", change))
    )
    title = one.columns[2].text
    assert one.columns[2].stated == "kN"
    np.testing.assert_allclose(other.values[title], one.values[title])
    assert ("shown in thousands" in other.columns[2].doubt) == doubted


# -- titles and units


def test_a_row_of_units_may_hold_one_of_the_loggers_own(tmp_path: Path) -> None:
    lines = rows("%.9f", ";")
    for number, units in enumerate(("[s];[mm];[kN];[counts]", "sec;mm;kN;segments")):
        table = table_of(tmp_path, f"Zeit;Weg;Kraft;Teile\n{units}\n{lines}", f"{number}.csv")
        assert [one.name for one in table.columns] == ["Zeit", "Weg", "Kraft", "Teile"]
        (run,) = measurements_of(table, estimate=False)
        np.testing.assert_allclose(run["force"], 1e3 * F, atol=1e-5)
    plain = table_of(tmp_path, f"Log of a test;;;\nt;s;F;V\n{lines}", "plain.csv")
    assert [one.name for one in plain.columns] == ["t", "s", "F", "V"]


def test_a_time_in_a_unit_that_is_not_known_is_asked_for(tmp_path: Path) -> None:
    lines = rows("%.9f", ",")
    table = table_of(tmp_path, f"Time [ticks],x [mm],F [kN],I [A]\n{lines}", "a.csv")
    (time, *_) = guess_channels(table)
    assert (time.channel, time.unit) == ("time", "")
    assert '"ticks", is not known' in time.doubt
    table = table_of(tmp_path, f"TIME (S),X (MM),FORCE (KN),I (A)\n{lines}", "b.csv")
    same(table)
    table = table_of(tmp_path, f"time (from start),x [mm],F [kN],I [A]\n{lines}", "c.csv")
    assert guess_channels(table)[0].unit == "s"


def test_a_rest_in_the_middle_hides_no_decimal_commas(tmp_path: Path) -> None:
    lines = ["Zeit [ms];Weg [mm];Kraft [kN]"]
    for k in range(N):
        still = abs(k - N // 2) < 70
        values = (0, 0) if still else (f"{X[k]:.9f}", f"{F[k]:.9f}")
        lines.append(f"{5 * k};{values[0]};{values[1]}".replace(".", ","))
    table = table_of(tmp_path, "\n".join(lines) + "\n")
    assert table.rows == N
    assert [one.name for one in table.columns] == ["Zeit", "Weg", "Kraft"]


def test_decimal_commas_in_quotes_between_commas(tmp_path: Path) -> None:
    quoted = [
        ",".join(f'"{one:.9f}"'.replace(".", ",") for one in row)
        for row in zip(T, X, F, I, strict=True)
    ]
    titles = "Zeit [s],Weg [mm],Kraft [kN],Strom [A]"
    same(table_of(tmp_path, "\n".join([titles, *quoted]) + "\n"))


def test_symbols_by_their_units_are_titles(tmp_path: Path) -> None:
    times = [f"{1e3 * one:.6f}" for one in T]
    table = table_of(tmp_path, "t/ms;s/mm;F/kN;I/A\n" + rows("%.9f", ";", times))
    assert [one.name for one in table.columns] == ["t", "s", "F", "I"]
    same(table)
    kept = {"m/s": None, "N/mm": None, "Ch1/A": None, "F/I": None, "v/mm/s": "mm/s"}
    for text, unit in kept.items():
        found = title(0, text)
        assert (found.unit.name if found.unit else None) == unit, text


def test_a_group_with_a_time_of_its_own_is_told(tmp_path: Path) -> None:
    lines = [f"{t:.4f};{x:.9f};{t + 0.05:.4f};{f:.9f}" for t, x, f in zip(T, X, F, strict=True)]
    table = table_of(tmp_path, "\n".join(["Zeit 1 [s];Weg [mm];Zeit 2 [s];Kraft [kN]", *lines]))
    assert '"Zeit 2 [s]" is up to 0.05 s apart' in guess_channels(table)[0].doubt
    lines = [f"{t:.4f};{x:.9f};{t:.4f};{f:.9f}" for t, x, f in zip(T, X, F, strict=True)]
    table = table_of(tmp_path, "\n".join(["Zeit 1 [s];Weg [mm];Zeit 2 [s];Kraft [kN]", *lines]))
    assert not guess_channels(table)[0].doubt


# -- TDMS, HDF5


def tdms(path: Path, timed: bool = True) -> Path:
    step = {} if timed else {"wf_increment": 0.005, "wf_start_offset": 0.0}
    named = {"Time": (T, "s"), "Displacement": (X, "mm"), "Load": (F, "kN"), "Current": (I, "A")}
    if not timed:
        named.pop("Time")
    channels = [
        ChannelObject("Log", name, values, properties={"unit_string": unit, **step})
        for name, (values, unit) in named.items()
    ]
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([RootObject({"operator": "me"}), *channels])
        writer.write_segment([ChannelObject("Other", "slow", np.arange(3.0))])
    return path


@pytest.mark.parametrize("timed", [True, False])
def test_tdms_is_read_without_its_index(tmp_path: Path, timed: bool) -> None:
    path = tdms(tmp_path / "run.tdms", timed)
    assert not path.with_suffix(".tdms_index").exists()
    table = read_table(path)
    assert any('of 2 groups "Log" is read' in note for note in table.notes)
    same(table)


def test_a_time_in_another_language_counts_beside_a_waveform_of_tdms(tmp_path: Path) -> None:
    named = {"Zeit": (1e3 * T, "ms"), "Weg": (X, "mm"), "Kraft": (F, "kN")}
    channels = [
        ChannelObject("Log", name, values, properties={"unit_string": unit, "wf_increment": 1.0})
        for name, (values, unit) in named.items()
    ]
    with TdmsWriter(str(tmp_path / "run.tdms")) as writer:
        writer.write_segment(channels)
    (run,) = measurements_of(read_table(tmp_path / "run.tdms"))
    assert run.step == pytest.approx(0.005)


def test_what_is_wrong_with_a_tdms(tmp_path: Path) -> None:
    whole = tdms(tmp_path / "run.tdms").read_bytes()
    index = tmp_path / "run.tdms_index"
    index.write_bytes(b"TDSh" + whole[4:200])
    with pytest.raises(RecordError, match="this is the index of a TDMS file"):
        read_table(index)
    (tmp_path / "cut.tdms").write_bytes(whole[:60])
    with pytest.raises(RecordError, match="TDMS"):
        read_table(tmp_path / "cut.tdms")


def hdf5(path: Path, userblock: int = 0) -> Path:
    with h5py.File(path, "w", userblock_size=userblock) as file:
        group = file.create_group("run1")
        for name, values, unit in (
            ("Time", T, "s"), ("Displacement", X, "mm"), ("Load", F, "kN"), ("Current", I, "A"),
        ):  # fmt: skip
            shaped = values.reshape(1, -1) if userblock else values  # as MATLAB stores a column
            group.create_dataset(name, data=shaped).attrs["units"] = unit
        file.create_dataset("#refs#/a", data=np.arange(N))
        file.create_dataset("note", data="words")
    return path


def test_hdf5_and_mat_7_3(tmp_path: Path) -> None:
    same(read_table(hdf5(tmp_path / "run.h5")))
    path = hdf5(tmp_path / "run.mat", 512)
    content = bytearray(path.read_bytes())
    content[:26] = b"MATLAB 7.3 MAT-file, Platf"
    path.write_bytes(content)
    same(read_table(path))


def test_compound_datasets_and_rates_of_hdf5(tmp_path: Path) -> None:
    rows = np.zeros(N, dtype=[("x_mm", float), ("F_kN", float), ("I_A", float)])
    rows["x_mm"], rows["F_kN"], rows["I_A"] = X, F, I
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["log"], file["fs"] = rows, 200.0
    table = read_table(tmp_path / "run.h5")
    assert any("made from fs = 200: 0.005 s a sample" in note for note in table.notes)
    same(table)


def test_a_damaged_hdf5_is_told(tmp_path: Path) -> None:
    path = hdf5(tmp_path / "run.h5")
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(RecordError, match="no HDF5 file, or damaged"):
        read_table(path)


@pytest.mark.parametrize(
    ("make", "module", "what"),
    [(workbook, "openpyxl", "Excel"), (tdms, "nptdms", "TDMS"), (hdf5, "h5py", "HDF5")],
)
def test_a_missing_library_is_told_in_a_line(tmp_path, monkeypatch, make, module, what) -> None:
    path = make(tmp_path / "run.bin")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RecordError, match=rf"{what}.*pip install 'bristle\[formats\]'") as error:
        read_table(path)
    assert "\n" not in str(error.value)


# -- text


def table_of(tmp_path: Path, text: str, name: str = "run.txt") -> Table:
    (tmp_path / name).write_text(text)
    return read_table(tmp_path / name)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [("X_Dimension\tTime", "X_Dimension\tFrequency", "X_Dimension is Frequency; Time is right"),
     ("Y_Unit_Label\tmm\tkN", "Y_Unit_Label\tmm\tN", r"a segment of .*\[N\], .*, and the first")],
)  # fmt: skip
def test_a_segment_of_other_units_or_of_a_spectrum_is_refused(tmp_path, old, new, said) -> None:
    first, mark, last = lvm("One", 2).rpartition("Channels")
    assert old in last
    with pytest.raises(RecordError, match=rf"run\.lvm, line \d+: {said}"):
        table_of(tmp_path, f"{first}{mark}{last.replace(old, new)}", "run.lvm")


def lvm(time: str, segments: int = 1, comma: bool = False) -> str:
    lines = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
        f"Decimal_Separator\t{',' if comma else '.'}", "Multi_Headings\tYes", "X_Columns\tOne",
        "Time_Pref\tRelative", "***End_of_Header***\t", "\t",
    ]  # fmt: skip
    size = N // segments
    for part in range(segments):
        lines += [
            "Channels\t3\t\t", f"Samples\t{size}\t{size}\t{size}", "Y_Unit_Label\tmm\tkN\tA",
            "X_Dimension\tTime\tTime\tTime", "\t".join(["X0", *3 * [str(T[part * size])]]),
            "Delta_X\t0.005\t0.005\t0.005", "***End_of_Header***\t\t\t",
            "X_Value\tDisplacement\tLoad\tCurrent\tComment",
        ]  # fmt: skip
        for k in range(part * size, (part + 1) * size):
            first = f"{T[k]:.6f}" if time else ""
            lines.append(f"{first}\t{X[k]:.9f}\t{F[k]:.9f}\t{I[k]:.3f}")
    text = "\n".join(lines) + "\n"
    return text.replace(".", ",") if comma else text


@pytest.mark.parametrize(
    ("time", "segments", "comma"),
    [("yes", 1, False), ("", 1, False), ("", 2, False), ("yes", 1, True)],
)
def test_labview(tmp_path: Path, time: str, segments: int, comma: bool) -> None:
    same(table_of(tmp_path, lvm(time, segments, comma), "run.lvm"))


def rows(form: str, delimiter: str, times: list[str] | None = None) -> str:
    out = []
    for k in range(N):
        time = times[k] if times else form % T[k]
        out.append(delimiter.join([time, form % X[k], form % F[k], form % I[k]]))
    return "\n".join(out) + "\n"


MTS = """MTS793|MPT|ENU|1|0|/|.|:|1|0|0|A

Data Acquisition: Timed
Station Name: bench 3
Test File Name: sine.000

Time\tAxial Displacement\tAxial Force\tCoil Current
Sec\tmm\tkN\tA
"""

INSTRON = """"Instrument","8872"
"Test date","12/03/2024"

"Time","Extension","Load","Current"
"(sec)","(mm)","(kN)","(A)"
"""


def test_exports_of_test_machines(tmp_path: Path) -> None:
    same(table_of(tmp_path, MTS + rows("%.9f", "\t")))
    same(table_of(tmp_path, INSTRON + rows('"%.9f"', ","), "run.csv"))


def test_titles_that_come_again_before_every_block(tmp_path: Path) -> None:
    body = rows("%.9f", "\t").splitlines()
    again = "\n".join(MTS.splitlines()[2:])
    text = MTS + "\n".join(body[:200]) + "\n\n" + again + "\n" + "\n".join(body[200:]) + "\n"
    table = table_of(tmp_path, text)
    assert any("the titles come again in 1 places" in note for note in table.notes)
    same(table)


@pytest.mark.parametrize(
    ("form", "start"),
    [
        ("%d.%m.%Y %H:%M:%S.%f", datetime(2024, 3, 12, 10)),
        ("%d.%m.%Y %H:%M:%S,%f", datetime(2024, 3, 12, 23, 59, 59)),
        ("%m/%d/%Y %H:%M:%S.%f", datetime(2024, 3, 13, 10)),
        ("%Y/%m/%d %H:%M:%S.%f", datetime(2024, 3, 12, 10)),
        ("%H:%M:%S.%f", datetime(2024, 3, 12, 23, 59, 59)),
        ("%Y-%m-%dT%H:%M:%S.%f", datetime(2024, 3, 12, 10)),
    ],
)
def test_instants_of_several_countries(tmp_path: Path, form: str, start: datetime) -> None:
    times = [(start + timedelta(seconds=t)).strftime(form)[:-3] for t in T.tolist()]
    text = "Zeit;x [mm];F [kN];I [A]\n" + rows("%.9f", ";", times)
    table = table_of(tmp_path, text)
    assert any("holds instants" in note for note in table.notes)
    same(table)


@pytest.mark.parametrize("day", ["", "12.03.2024 "])
def test_whole_seconds_stand_without_a_fraction_in_any_row(day: str) -> None:
    for clocks in (["10:00:00", "10:00:00.004", "10:00:01"], ["10:00:00", "10:00:00,004"]):
        found = seconds_of([day + clock for clock in clocks])
        np.testing.assert_allclose(found, [0.0, 0.004, 1.0][: len(clocks)])


def test_times_of_day_from_midnight_in_a_workbook(tmp_path: Path) -> None:
    def clocked(sheet, book) -> None:
        for k in range(N):
            cell = sheet.cell(5 + k, 1)
            cell.value = (datetime(2024, 3, 12) + timedelta(seconds=T[k])).time()
            cell.number_format = "hh:mm:ss.000"

    same(read_table(workbook(tmp_path / "run.xlsx", clocked)))


def test_what_is_no_instant() -> None:
    assert seconds_of(["2024-03-12T10:00:00Z", "2024-03-12T10:00:01"]) is None
    assert seconds_of(["12.03.2024 25:00:00"]) is None
    assert seconds_of(["a", "b"]) is None
    assert seconds_of([]) is None
    np.testing.assert_allclose(seconds_of(["10:00:59.5", "10:01:00", "10:01:00.5"]), [0, 0.5, 1.0])


@pytest.mark.parametrize("form", ["%m/%d/%Y", "%d/%m/%Y", "%m/%d/%y", "%d/%m/%y"])
def test_a_date_that_changes_moves_on_by_a_day_in_any_country(form: str) -> None:
    begin = datetime(2024, 4, 5, 23, 59, 59)
    texts = [(begin + timedelta(seconds=k)).strftime(f"{form} %H:%M:%S") for k in range(3)]
    np.testing.assert_allclose(seconds_of(texts), [0.0, 1.0, 2.0])


# -- several runs in a file


def three(kind: str) -> str:
    lines = ["time [s],x [mm],F [kN],I [A],test"]
    clock = 0.0
    for run in (1, 2, 3):
        for k in range(N):
            time = T[k] if kind == "restart" else clock
            lines.append(f"{time:.6f},{X[k]:.9f},{F[k] * run:.9f},{I[k]:g},{run}")
            clock += 0.005
        for _ in range(500 if kind == "rests" else 0):
            lines.append(f"{clock:.6f},0,0,0,{run}")
            clock += 0.005
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("split", ["restart", "column test", "rests"])
def test_a_file_of_several_runs_is_cut(tmp_path: Path, split: str) -> None:
    table = table_of(tmp_path, three(split.split()[0]), "all.csv")
    channels = {g.channel: g for g in guess_channels(table)}
    from bristle.data.guess import specs

    where = specs(table, list(channels.values()))
    found = pieces_of(table, split, where)
    assert len(found) == 3
    assert [one.source.rpartition(", ")[2] for one in found] == ["run 1", "run 2", "run 3"]
    for number, one in enumerate(found, 1):
        top = np.max(np.abs(one.values["F [kN]"]))
        assert top == pytest.approx(number * np.max(np.abs(F)), rel=1e-6)


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("min", 1.0 / 60.0)])
def test_a_rest_lasts_as_long_in_any_unit_of_time(tmp_path: Path, unit: str, factor: float) -> None:
    title, *lines = three("rests").splitlines()
    parted = [line.partition(",") for line in lines]
    text = [f"{float(time) * factor:.9g},{rest}" for time, _, rest in parted]
    title = title.replace("[s]", f"[{unit}]")
    table = table_of(tmp_path, "\n".join([title, *text]) + "\n", "all.csv")
    from bristle.data.guess import specs

    assert len(pieces_of(table, "rests", specs(table, guess_channels(table)))) == 3


def test_a_file_of_one_run_cannot_be_cut(tmp_path: Path) -> None:
    table = table_of(tmp_path, "t [s],x [mm],F [kN],I [A]\n" + rows("%.9f", ","), "one.csv")
    from bristle.data.guess import specs

    where = specs(table, guess_channels(table))
    for split, why in (("restart", "never goes back"), ("column I [A]", ""), ("rests", "rests")):
        if why:
            with pytest.raises(RecordError, match=why):
                pieces_of(table, split, where)
        else:
            assert len(pieces_of(table, split, where)) == 2
    assert wrong_split("halves")
    assert wrong_split("column ")
    assert not wrong_split("column test no")
    with pytest.raises(RecordError, match='"restart", "rests", "column TITLE", "sheets"'):
        pieces_of(table, "halves", where)


def test_files_in_a_folder(tmp_path: Path) -> None:
    for name in (
        "b.csv",
        "a.XLSX",
        "c.csv.gz",
        ".hidden.csv",
        "~$a.xlsx",
        "notes.docx",
        "r.tdms_index",
    ):
        (tmp_path / name).write_bytes(b"")
    assert [path.name for path in files_in(tmp_path)] == ["a.XLSX", "b.csv", "c.csv.gz"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordError, match=r"no file in it ends in \.csv"):
        files_in(tmp_path / "empty")


def test_a_mat_file_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "run.mat").write_bytes(b"something else entirely" * 30)
    with pytest.raises(RecordError, match="no MAT file"):
        read_table(tmp_path / "run.mat")


def test_ten_channels_named_force_are_told_in_one_line(tmp_path: Path) -> None:
    titles = ["t [s]", "x [mm]", *["force [kN]"] * 10]
    lines = [",".join(titles)]
    for k in range(N):
        lines.append(",".join(f"{one:.9f}" for one in (T[k], X[k], *[F[k]] * 10)))
    guesses = guess_channels(table_of(tmp_path, "\n".join(lines), "run.csv"))
    force = next(one for one in guesses if one.channel == "force")
    assert force.column == "force [kN]"
    assert (
        'so could be "force [kN] (2)", "force [kN] (3)", "force [kN] (4)" and 6 more' in force.doubt
    )
    assert "--channel force=COLUMN" in force.doubt
    assert len(force.reason) < 250

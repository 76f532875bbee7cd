"""Tables of numbers from every format that laboratories hand over."""

from __future__ import annotations

import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bristle.data import formats
from bristle.data.read import read_table
from bristle.data.table import Table, table_from_frame
from bristle.errors import RecordError

TIME = np.arange(80) * 0.002
MOTION = 1.5 * np.sin(40.0 * TIME)
FORCE = -2.25 * np.cos(40.0 * TIME)


def body(separator: str, decimal: str = ".", end: str = "") -> str:
    rows = zip(TIME, MOTION, FORCE, strict=True)
    lines = [separator.join(f"{v:.6f}".replace(".", decimal) for v in row) + end for row in rows]
    return "\n".join(lines)


def read(folder: Path, text: str | bytes, name: str = "run.csv") -> Table:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path)


def check(table: Table, units: tuple[str | None, ...] = ("s", "mm", "kN")) -> None:
    assert tuple(c.unit.name if c.unit else None for c in table.columns) == units
    for column, wanted in zip(table.columns, (TIME, MOTION, FORCE), strict=True):
        np.testing.assert_allclose(table.values[column.text], wanted, atol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        "time [s],x [mm],F [kN]\n" + body(","),
        "time_s,x_mm,F_kN\n" + body(","),
        "Time (s)\tPosition (mm)\tLoad (kN)\n" + body("\t") + "\n",
        "t / s;s / mm;F / kN;\n" + body(";", ",", ";"),
        "Zeit in s;Weg in mm;Kraft in kN\r\n" + body(";", ",").replace("\n", "\r\n"),
        "t, s;x, mm;F, kN\n" + body(";"),
        "Zeit;Weg;Kraft\ns;mm;kN\n" + body(";", ","),
        "Zeit;Weg;Kraft\n[s];[mm];[kN]\n" + body(";", ","),
        "Test 42\nOperator;N. N.\nRate;500\n\nt;x;F\n(s);(mm);(kN)\n" + body(";", ","),
        "# time_s x_mm F_kN\n" + body(" "),
        "Time  Rod position  Load cell\ns  mm  kN\n" + body("   "),
        "# made by hand\n# twice\ntime [s],x [mm],F [kN]\n" + body(",") + "\n# the end\n",
        '"time [s]","x [mm]","F [kN]"\n' + body(","),
    ],
)
def test_delimited_text_as_recorders_write_it(tmp_path: Path, text: str) -> None:
    check(read(tmp_path, text))


def test_numbers_keep_the_line_they_are_from(tmp_path: Path) -> None:
    table = read(tmp_path, "a\n\ntime [s],x [mm],F [kN]\n" + body(","))
    assert table.where(0) == "line 4"
    assert table.lines[-1] == 3 + len(TIME)


@pytest.mark.parametrize("end", ["", "\n# end"])  # a comment among the rows takes the slow way
def test_blank_lines_are_no_samples(tmp_path: Path, end: str) -> None:
    head, rows = "time [s],x [mm],F [kN]\n", body(",").split("\n")
    parted = "\n".join([*rows[:40], "", "  ", *rows[40:]])
    table = read(tmp_path, head + parted + end)
    check(table)
    assert table.lines[[39, 40]].tolist() == [41, 44]
    check(read(tmp_path, (head + body(",") + end).replace("\n", "\r\r\n")))


@pytest.mark.parametrize("end", ["", "\n# end"])
def test_tabs_alone_are_a_row_of_missing_values(tmp_path: Path, end: str) -> None:
    rows = body("\t").split("\n")
    rows[7] = "\t\t"
    table = read(tmp_path, "time [s]\tx [mm]\tF [kN]\n" + "\n".join(rows) + "\n\t\t" + end)
    assert table.lines.tolist()[:80] == [*range(2, 82)]
    assert np.isnan([values[7] for values in table.values.values()]).all()


def test_gzip_and_other_encodings(tmp_path: Path) -> None:
    text = "time [s],x [mm],F [kN]\n" + body(",")
    check(read(tmp_path, gzip.compress(text.encode()), "run.csv.gz"))
    check(read(tmp_path, text.encode("utf-16")))
    check(read(tmp_path, b"\xef\xbb\xbf" + text.encode()))
    micro = read(tmp_path, text.replace("mm", "\u00b5m").encode("cp1252"))
    check(micro, ("s", "um", "kN"))
    assert any("Windows-1252" in note for note in micro.notes)


def test_missing_values_are_kept_as_missing(tmp_path: Path) -> None:
    rows = body(",").split("\n")
    rows[5] = "0.010000,,1.0"
    rows[6] = "0.012000,NaN,inf"
    table = read(tmp_path, "time [s],x [mm],F [kN]\n" + "\n".join(rows))
    assert np.isnan(table.values["x [mm]"][[5, 6]]).all()
    assert np.isnan(table.values["F [kN]"][6])
    assert any("infinite" in note for note in table.notes)


def test_words_among_numbers_are_told_with_their_line(tmp_path: Path) -> None:
    rows = body(",").split("\n")
    rows[20] = "0.040000,OVER,1.0"
    table = read(tmp_path, "time [s],x [mm],F [kN]\n" + "\n".join(rows))
    assert table.not_numeric == {"x [mm]": 'line 22: "OVER" is no number'}


def test_last_line_cut_off_is_said(tmp_path: Path) -> None:
    table = read(tmp_path, "time [s],x [mm],F [kN]\n" + body(",") + "\n0.16,1.")
    assert table.rows == len(TIME)
    assert any("cut off" in note for note in table.notes)


def test_titles_that_repeat_or_lack(tmp_path: Path) -> None:
    table = read(tmp_path, "time [s],F [N],F [N]\n" + body(","))
    assert [column.text for column in table.columns] == ["time [s]", "F [N]", "F [N] (2)"]
    bare = read(tmp_path, body(","))
    assert [column.text for column in bare.columns] == ["column 1", "column 2", "column 3"]
    assert any("no titles" in note for note in bare.notes)


def test_instants_become_seconds(tmp_path: Path) -> None:
    rows = [
        f"2021-03-01 12:00:{t + 3:09.6f},{x},{f}"
        for t, x, f in zip(TIME, MOTION, FORCE, strict=True)
    ]
    table = read(tmp_path, "time,x [mm],F [kN]\n" + "\n".join(rows))
    check(table)
    assert any("instants" in note for note in table.notes)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "empty"),
        ("hello world\nthis is text\nand more of it\n", "no row of numbers"),
        ("time [s],x [mm],F [kN]\n" + body(",", ","), "decimal points"),
        (
            "time [s],x [mm],F [kN]\n" + body(",").replace("0.040000,", "0.040000,1.0,", 1),
            "line 22: .* has 4 columns",
        ),
        (b"PK\x03\x04 sheet", "Excel"),
        (b"TDSm....", "TDMS"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (bytes(range(256)) * 4, "binary"),
        (b"\x1f\x8b not gzip at all", "cannot be read"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, text: str | bytes, told: str) -> None:
    with pytest.raises(RecordError, match=told) as caught:
        read(tmp_path, text)
    assert "run.csv" in str(caught.value)


def test_large_files_are_refused_before_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bristle.data.read.LARGEST", 1000)
    text = "time [s],x [mm],F [kN]\n" + body(",")
    with pytest.raises(RecordError, match="limit"):
        read(tmp_path, text)
    with pytest.raises(RecordError, match="limit"):
        read(tmp_path, gzip.compress(text.encode()), "run.csv.gz")


def test_folder_and_missing_file(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="folder"):
        read_table(tmp_path)
    with pytest.raises(RecordError, match="no such file"):
        read_table(tmp_path / "nothing.csv")


def test_parquet_with_units_in_titles_and_in_metadata(tmp_path: Path) -> None:
    frame = pd.DataFrame({"time [s]": TIME, "x [mm]": MOTION, "F [kN]": FORCE})
    frame.to_parquet(tmp_path / "run.parquet")
    check(read_table(tmp_path / "run.parquet"))
    with pytest.raises(RecordError, match="damaged"):
        read(tmp_path, b"PAR1" + bytes(50), "bad.parquet")


def test_mat_vectors_structures_and_sampling_rate(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "run.mat"
    savemat(path, {"time_s": TIME, "rig": {"x_mm": MOTION, "F_kN": FORCE[:, None]}, "name": "A"})
    check(read_table(path))
    savemat(path, {"fs": 500.0, "data": np.column_stack([MOTION, FORCE]), "few": [1.0, 2.0]})
    table = read_table(path)
    assert [column.text for column in table.columns] == ["data_1", "data_2", "time_s"]
    np.testing.assert_allclose(table.values["time_s"], TIME)
    assert any("few" in remark for remark in table.remarks)


def test_frame_with_units_in_attrs() -> None:
    frame = pd.DataFrame({"damper.force": FORCE}, index=pd.Index(TIME, name="time"))
    frame.attrs["units"] = {"time": "s", "damper.force": "N"}
    table = table_from_frame(frame)
    units = [column.unit.name for column in table.columns if column.unit]
    assert units == ["s", "N"]


READER = '''
"""Pairs: a format of this test, one pair of numbers a line after a mark."""

import numpy as np

from bristle.data.table import from_arrays


def recognises(content, suffix):
    return content.startswith(b"PAIRS") or suffix == ".pairs"


def read(content, name):
    rows = [line.split(b"|") for line in content.splitlines()[1:]]
    time, force = np.array(rows, dtype=float).T
    return from_arrays({"time [s]": time, "force [N]": force}, name)
'''


@pytest.fixture
def another_format(tmp_path, monkeypatch):
    """Put a file of one more format beside the others."""
    folder = tmp_path / "formats"
    folder.mkdir()
    (folder / "pairs.py").write_text(READER, encoding="utf-8")
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(folder)])
    formats.formats.cache_clear()
    yield
    formats.formats.cache_clear()
    sys.modules.pop(f"{formats.__name__}.pairs", None)


def test_a_format_is_one_file(tmp_path, another_format):
    path = tmp_path / "run.txt"
    path.write_text("PAIRS\n0|1.5\n0.1|-2\n", encoding="utf-8")
    table = read_table(path)
    assert [column.text for column in table.columns] == ["time [s]", "force [N]"]
    np.testing.assert_array_equal(table.values["force [N]"], [1.5, -2.0])
    path.write_text("time [s],force [N]\n0,1.5\n0.1,-2\n0.2,1\n", encoding="utf-8")
    np.testing.assert_array_equal(read_table(path).values["force [N]"], [1.5, -2.0, 1.0])


def test_a_file_of_numbers_is_read_without_pandas(tmp_path):
    """Its import takes as long as the rest of what is done with a file."""
    file = tmp_path / "run.csv"
    rows = "".join(f"{0.01 * k:.2f},{k},{-k}\n" for k in range(200))
    file.write_text("time [s],displacement [mm],force [N]\n" + rows)
    code = (
        "import sys; from bristle.data.read import read_table\n"
        "read_table(sys.argv[1]); print('pandas' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.stdout == "False\n", done.stderr


def test_an_empty_field_is_no_number(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("time [s],force [N]\n0,1\n1,\n2,-3\n")
    force = read_table(file).values["force [N]"]
    assert np.isnan(force[1])
    assert force[[0, 2]].tolist() == [1.0, -3.0]

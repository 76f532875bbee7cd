"""Ground motions of archives, and in tables of any form: read as they are, or refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bristle.data import ground_motion_file, read_ground_motion
from bristle.errors import RecordError

STEP, N = 0.005, 803
A = np.round(np.sin(0.05 * np.arange(N)) * 120.0 * np.exp(-0.004 * np.arange(N)) + 3.0, 5)  # cm/s2


def read(folder: Path, text: str | bytes, name: str = "a.txt"):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_ground_motion(name, folder)


def same(found, values=A, tolerance: float = 1e-9) -> None:
    np.testing.assert_allclose(found.time, STEP * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(found.acceleration, 0.01 * values, atol=tolerance)


def in_rows(values, columns: int, form: str) -> str:
    rows = [values[k : k + columns] for k in range(0, len(values), columns)]
    return "".join("".join(form.format(one) for one in row) + "\n" for row in rows)


# Archives ------------------------------------------------------------------------------------


def esm(**changed: str) -> str:
    told = {
        "EVENT_NAME": "SOMEWHERE", "EVENT_DATE_YYYYMMDD": "20200101", "MAGNITUDE_L_REFERENCE": "",
        "STATION_CODE": "ABC", "VS30_M/S": "", "SAMPLING_INTERVAL_S": f"{STEP:.6f}",
        "NDATA": str(N), "DURATION_S": "4.01", "STREAM": "HNE", "UNITS": "cm/s^2",
        "PGA_CM/S^2": "120", "DATABASE_VERSION": "ESM 1.0", "HEADER_FORMAT": "DYNA 1.2",
        "DATA_TYPE": "ACCELERATION", "USER1": "", "USER2": "",
    } | changed  # fmt: skip
    head = "".join(f"{key}: {value}\n" for key, value in told.items())
    return head + "".join(f"{one:.6f}\n" for one in A)


def test_esm(tmp_path: Path) -> None:
    same(read(tmp_path, esm(), "IT.ABC..HNE.D.20200101.C.ACC.ASC"))
    same(read(tmp_path, esm(UNITS="m/s^2")), 100.0 * A)
    same(read(tmp_path, esm(UNITS="mg")), 0.980665 * A)
    for changed, said in [
        ({"NDATA": "900"}, "line 7: 900 values are announced, and 803 follow"),
        ({"DATA_TYPE": "VELOCITY", "UNITS": "cm/s"}, "line 14: the values are a velocity"),
        ({"UNITS": "cm/s"}, "line 10: the values are in cm/s, which is no acceleration"),
        ({"UNITS": ""}, 'no "UNITS" in the title lines'),
        ({"DURATION_S": "8.02"}, "line 8: 803 values, 0.005 s apart, do not last 8.02 s"),
    ]:
        with pytest.raises(RecordError, match=said):
            read(tmp_path, esm(**changed))


def knet(rate: str = "200Hz", scale: str = "2000(gal)/8388608", peak: float | None = None):
    counts = np.round(A / (2000.0 / 8388608)).astype(int)
    n = N - N % 200
    counts, own = counts[:n], (counts[:n] - counts[:n].mean()) * 2000.0 / 8388608
    peak = np.abs(own).max() if peak is None else peak
    told = {
        "Origin Time": "2020/01/01 00:00:00", "Lat.": "38.0", "Long.": "142.0",
        "Depth. (km)": "24", "Mag.": "6.0", "Station Code": "ABC001", "Station Lat.": "38.1",
        "Station Long.": "141.9", "Station Height(m)": "36", "Record Time": "2020/01/01 00:00:15",
        "Sampling Freq(Hz)": rate, "Duration Time(s)": "4", "Dir.": "N-S", "Scale Factor": scale,
        "Max. Acc. (gal)": f"{peak:.3f}", "Last Correction": "2020/01/01 00:00:00", "Memo.": "",
    }  # fmt: skip
    head = "".join(f"{key:18}{value}\n" for key, value in told.items())
    return head + in_rows(counts, 8, "{:9d}"), own


def test_knet_is_read_about_the_mean_of_its_counts(tmp_path: Path) -> None:
    text, own = knet()
    found = read(tmp_path, text, "ABC0012001010000.NS")
    np.testing.assert_allclose(found.acceleration, 0.01 * own, atol=1e-12)
    np.testing.assert_allclose(found.time, STEP * np.arange(800), atol=1e-9)
    assert "mean of its counts, is taken off" in found.source
    assert "is then 1.031 m/s2, and 1.031 m/s2 is stated" in found.source
    with pytest.raises(RecordError, match="line 12: 400 values are announced, and 800 follow"):
        read(tmp_path, knet(rate="100Hz")[0])
    with pytest.raises(RecordError, match='line 14: "3 counts"; 2000'):
        read(tmp_path, knet(scale="3 counts")[0])


def cosmos(what: str = "acceleration", unit: str = "cm/sec2(04)", step: float = STEP) -> str:
    reals = np.full(100, -999.0)
    reals[[0, 1, 33, 61, 62]] = 38.2, -122.6, 1e3 * STEP, 1e3 * step, N * STEP
    head = "Corrected acceleration    (Format v01.20 with 13 text lines) Somebody\n"
    head += "".join(f"A line of text, number {k}\n" for k in range(12))
    head += " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
    head += in_rows(np.full(100, -999), 10, "{:8d}")
    head += " 100 Real-header values follow on  20 lines, Format= (5F15.6)\n"
    head += in_rows(reals, 5, "{:15.6f}")
    head += '   2 Comment line(s) follow, each starting with a "|":\n| one 12.5\n| two\n'
    head += f"  {N} {what} pts, approx   4 secs, units={unit},Format=(8f10.5)\n"
    return head + in_rows(A, 8, "{:10.5f}") + f"End-of-data for Chan  1 {what}\n"


def test_cosmos(tmp_path: Path) -> None:
    same(read(tmp_path, cosmos(), "NP.1743.HNE.V2c"))
    same(read(tmp_path, cosmos(unit="cm/s^2")))
    same(read(tmp_path, cosmos(step=-999.0)))  # that of the recorder counts
    found = read(tmp_path, cosmos() + cosmos("velocity", "cm/sec(05)"))
    same(found)
    assert found.source.endswith("beside it, and not read: velocity")
    for text, said in [
        (cosmos() + cosmos(), "holds 2 accelerations"),
        (cosmos("velocity", "cm/sec(05)"), "the values are a velocity"),
        (cosmos(unit="counts (50)"), "raw counts"),
        (cosmos().replace("803 acc", "8030 acc"), "8030 values in about 4 s"),
    ]:
        with pytest.raises(RecordError, match=said):
            read(tmp_path, text)


def smc(first: str = "2 CORRECTED ACCELEROGRAM", rate: float = 200.0) -> str:
    whole, reals = np.full(48, -32768), np.full(50, 1.7e38)
    whole[15:17], reals[1] = (2, N), rate
    head = first + "\n" + "".join(f"line {k} of the text\n" for k in range(9)) + "*\n"
    head += in_rows(whole, 8, "{:10d}") + in_rows(reals, 5, "{:15.7E}")
    return head + "| a comment\n|\n" + in_rows(A, 8, "{:10.4f}")


def test_smc(tmp_path: Path) -> None:
    same(read(tmp_path, smc(), "a.smc"), tolerance=1e-6)
    with pytest.raises(RecordError, match="the values are a velocity"):
        read(tmp_path, smc("3 VELOCITY"))
    with pytest.raises(RecordError, match=r"line 18: 1.7e\+38 samples per second"):
        read(tmp_path, smc(rate=1.7e38))


# Tables --------------------------------------------------------------------------------------


def table(sep: str, decimal: str, head: str, quoted: bool = False, factor: float = 1.0) -> str:
    def text(value: float, places: int) -> str:
        plain = f"{value:.{places}f}".replace(".", decimal)
        return f'"{plain}"' if quoted else plain

    rows = (f"{text(STEP * k, 3)}{sep}{text(factor * one, 7)}\n" for k, one in enumerate(A))
    return head + "".join(rows)


HELD: dict[str, tuple[str, str]] = {
    "sep=;": (table(";", ",", "sep=;\nTime [s];Acc [cm/s²]\n"), "cp1252"),
    "commas and Latin-1": (table(";", ",", "Zeit [s];Beschleunigung [cm/s²]\n"), "latin-1"),
    "quoted": (table(",", ".", '"Time (s)","Acceleration (gal)"\n', quoted=True), "utf-8"),
    "quoted commas": (table(",", ",", '"time [s]","acc [cm/s2]"\n', quoted=True), "utf-8"),
    "a row of units": (table("\t", ",", "Time\tAcc\n[s]\t[cm/s2]\n"), "utf-16"),
    "a preamble": (table(";", ".", "Station;ABC\nDate;2020\n\nt;a\ns;gal\n"), "utf-8"),
    "the titles of an FMU": (
        table(",", ".", "time [s],acceleration [m/s2]\n", quoted=True, factor=0.01), "utf-8"
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", HELD)
def test_tables_are_read_as_measurements_are(tmp_path: Path, form: str) -> None:
    text, encoding = HELD[form]
    same(read(tmp_path, text.encode(encoding), "a.csv"))
    same(read_ground_motion(ground_motion_file("a.csv", tmp_path), tmp_path))


def test_days_of_a_calendar_count_from_the_first(tmp_path: Path) -> None:
    rows = "".join(f"{45000.25 + STEP * k / 86400:.11f};{one}\n" for k, one in enumerate(A))
    found = read(tmp_path, f"Time [day];Acc [gal]\n{rows}")
    np.testing.assert_allclose(found.time, STEP * np.arange(N), atol=2e-6)


Broken = Callable[[str], str]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("0,100;", "0,095;"), "line 22: the time 0.095 s appears twice"),
        (lambda text: text.replace(";3,0000000\n", ";\n", 1), "line 2: a value is missing"),
        (lambda text: text.replace("[cm/s²]", "[cm]"), "no column is an acceleration"),
    ],
)
def test_what_is_wrong_has_its_line(tmp_path: Path, change: Broken, said: str) -> None:
    text = change(table(";", ",", "Zeit [s];Beschleunigung [cm/s²]\n"))
    with pytest.raises(RecordError, match=said):
        read(tmp_path, text)

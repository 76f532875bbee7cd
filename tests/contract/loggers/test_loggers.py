"""Layouts of loggers and test machines, and times as they write them, with invented numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.guess import guess_channels, specs
from bristle.data.measurement import measurements_of
from bristle.data.pieces import pieces_of
from bristle.data.read import read_table
from bristle.errors import RecordError

N = 600
T = np.arange(N) / 500.0
V = 120.0 * np.cos(10.0 * T)  # mm/s
X, U = 12.0 * np.sin(10.0 * T), np.where(T < 0.63, 0.5, 1.5)
F = 1400.0 * np.tanh(V / 30.0) + 2.0 * V + 150.0 * U * np.tanh(V / 20.0) + 30.0
BEGIN = datetime(2024, 3, 12, 10, 0, 0)
Form = Callable[[float], str]


def point(places: int = 5) -> Form:
    return lambda value: f"{value:.{places}f}"


def comma(places: int = 5) -> Form:
    return lambda value: f"{value:.{places}f}".replace(".", ",")


def clock(form: str = "%Y-%m-%d %H:%M:%S.%f", cut: int = 3) -> Form:
    def text(second: float) -> str:
        whole = (BEGIN + timedelta(seconds=float(second))).strftime(form)
        return whole[: len(whole) - cut]

    return text


def rows(sep: str, columns: Iterable[np.ndarray], *forms: Form) -> str:
    return "".join(
        sep.join(form(one) for form, one in zip(forms, row, strict=True)) + "\n"
        for row in zip(*columns, strict=True)
    )


P, C, K = point(), comma(), point(0)
COUNT = np.arange(1.0, N + 1.0)
BASE = (T, X, U, F)

LAYOUTS = {
    "TOA5": '"TOA5","CR6","CR6","12","Std.10","CPU:x.CR6","5","Fast"\n'
    '"TIMESTAMP","RECORD","Disp_Avg","Coil_Avg","Load_Avg"\n"TS","RN","mm","Volts","kN"\n'
    '"","","Avg","Avg","Avg"\n'
    + rows(",", (T, COUNT, X, U, F / 1e3), lambda t: f'"{clock()(t)}"', K, P, P, point(8)),
    "PicoScope": "Time,Displacement,Coil,Force\n(ms),(mm),(V),(kN)\n\n"
    + rows(",", (1e3 * (T - 0.3), X, U, F / 1e3), P, P, P, point(8)),
    "FlexLogger": "Log settings,\nProject,a test\n\nTime,Displacement (mm),Coil (V),Force (N)\n"
    + rows(",", BASE, clock(), P, P, P),
    "DAQExpress": "Timestamp,Disp [mm],Coil [V],Load [N]\n"
    + rows(",", BASE, clock("%m/%d/%Y %I:%M:%S.%f %p", 0), P, P, P),
    "milliseconds behind a colon": "Time,Disp [mm],Coil [V],Load [N]\n"
    + rows(",", BASE, clock("%H:%M:%S:%f"), P, P, P),
    "date, milliseconds behind a colon": "Time;Disp [mm];Coil [V];Load [N]\n"
    + rows(";", BASE, clock("%d.%m.%Y %H:%M:%S:%f"), C, C, C),
    "catman": "HBM_CATMAN_DATAFILE_40\nBegin\nT0 = 12.03.2024 10:00:00\n"
    "Time  1 - default sample rate [s]\tWeg [mm]\tSpule [V]\tKraft [kN]\n0\t1\t2\t3\n"
    + rows("\t", (T, X, U, F / 1e3), C, C, C, comma(8)),
    "catman, four rows": "Time  1 - default sample rate\tDisp\tCoil\tForce\ns\tmm\tV\tN\n"
    "MX840\tMX840\tMX840\tMX840\n" + "\t".join(["12.03.2024 10:00:00"] * 4) + "\n"
    + rows("\t", BASE, C, C, C, C),
    "Dewesoft": "File name: run.d7d\nStart time: 3/12/2024 10:00:00.000\nSample rate: 500 Hz\n\n"
    "Events\nEvent Type\tEvent\tTime\tComment\n1\tstoring started\t0.0000\t\n\nData1\n"
    "Time\tDisp\tCoil\tForce\ns\tmm\tV\tN\n" + rows("\t", BASE, P, P, P, P),
    "imc": "Zeit;Weg;Spule;Kraft\ns;mm;V;kN\n"
    + rows(";", (T, X, U, F / 1e3), *(lambda v: f"{v:.7E}".replace(".", ","),) * 4),
    "MTS": "MTS793|MPT|ENU|1|0|0|0|A\n\nData Acquisition: Timed\nTime: 1.8 Sec  3/12/2024\n\n"
    "Axial Force\tAxial Displacement\tTime\tCoil\nkN\tmm\tSec\tV\n"
    + rows("\t", (F / 1e3, X, T, U), point(8), P, P, P),
    "Instron": "Specimen,1\nRate,500 Hz\n\n"
    "Total Time (s),Position(Linear:Position) (mm),Load(Linear:Load) (N),Coil (V)\n"
    + rows(",", (T, X, F, U), *(lambda v: f'"{v:.5f}"',) * 4),
    "Graphtec": '"Vendor","Graphtec"\n"Sampling interval","2ms"\n"Amp settings"\n"Data"\n'
    '"Number","Date&Time","ms","CH1 disp","CH2 coil","CH3 force"\n"NO.","Time","ms","mm","V","N"\n'
    + rows(",", (COUNT, T, (2.0 * (COUNT - 1)) % 1000, X, U, F), K, clock(cut=7), K, P, P, P),
    "Hioki": '"File name","a.MEM"\n"CH","U1-1","U1-2","U1-3"\n"Mode","V","V","V"\n'
    '"Time(s)","Disp[mm]","Coil[V]","Force[N]"\n' + rows(",", BASE, *(lambda v: f"{v:.8E}",) * 4),
    "SignalExpress": "channel names:\nDisp - mm\tCoil - V\tLoad - kN\nstart times:\n"
    + "\t".join(["12.03.2024 10:00:00,000"] * 3) + "\ndt:\n0,002\t0,002\t0,002\ndata:\n"
    + rows("\t", (X, U, F / 1e3), C, C, comma(8)),
    "bars": "Time, sec|Disp., mm|Coil volts, V|Force, N\n" + rows("|", BASE, P, P, P, P),
    "groups alone": "Zeit [ms];Weg [um];Spule [mV];Kraft [N]\n"
    + rows(";", (1e3 * T, 1e3 * X, 1e3 * U, F), *(lambda v: f"{v:,.0f}".replace(",", "."),) * 4),
    "date, time and ms": "Date;Time;ms;Disp [mm];Coil [V];Force [N]\n"
    + rows(";", (T, T, (2.0 * (COUNT - 1)) % 1000, X, U, F), clock("%d.%m.%Y", 0),
           clock("%H:%M:%S", 0), K, C, C, C),
    "minutes and seconds": "Time,Disp [mm],Coil [V],Load [N]\n"
    + rows(",", BASE, clock("%M:%S.%f"), P, P, P),
    "dates of MATLAB": "Time,Disp [mm],Coil [V],Load [N]\n"
    + rows(",", BASE, clock("%d-%b-%Y %H:%M:%S.%f"), P, P, P),
    "timedelta of pandas": "Time,Disp [mm],Coil [V],Load [N]\n"
    + rows(",", BASE, lambda t: f"0 days 00:00:{t:09.6f}", P, P, P),
    "titles of two lines": '"Time\n[s]","Disp\n[mm]","Coil\n[V]","Load\n[N]"\n'
    + rows(",", BASE, *(P,) * 4),
    "commas above semicolons": "Time [s], Disp [mm], Coil [V], Load [N]\n"
    + rows(";", BASE, *(C,) * 4),
    "a rate above": "Abtastrate;500;Hz\n\nNr.;Weg [mm];Spannung [V];Kraft [N]\n"
    + rows(";", (COUNT, X, U, F), K, C, C, C),
    "a step above": "Operator: me\nSampling period [ms]: 2\nScan\tDisp [mm]\tCoil [V]\tForce [N]\n"
    + rows("\t", (COUNT, X, U, F), K, P, P, P),
    "sums behind": "Time [s];Disp [mm];Coil [V];Force [N]\n" + rows(";", BASE, *(P,) * 4)
    + "\nMax;12.0;1.5;1850\nMin;-12.0;0.5;-1850\n\nEnd of test 12.03.2024\n",
    "signs of minus": "Time [s];Disp [mm];Coil [V];Force [N]\n"
    + rows(";", BASE, *(lambda v: f"{v:.5f}".replace("-", "\u2212"),) * 4),
    "units behind a slash": "Time;Disp;Coil;Force\n/s;/mm;/V;/kN\n"
    + rows(";", (T, X, U, F / 1e3), P, P, P, point(8)),
    "units in brackets below titles, of blanks": "Time Disp Coil Force\n[s] [mm] [V] [N]\n"
    + rows(" ", BASE, P, P, P, P),
    "units behind a slash in titles": "t/s;Disp/mm;Coil/V;F/N\n" + rows(";", BASE, P, P, P, P),
    "a channel that ends early, between tabs": "Time [s]\tDisp [mm]\tCoil [V]\tForce [N]\tTemp\n"
    + rows("\t", (*BASE, COUNT), P, P, P, P, lambda v: "21.5" if v < 0.4 * N else ""),
}  # fmt: skip


@pytest.mark.parametrize("logger", LAYOUTS)
def test_layouts(tmp_path: Path, logger: str) -> None:
    (tmp_path / "run.csv").write_text(LAYOUTS[logger], encoding="utf-8")
    (run,) = measurements_of(read_table(tmp_path / "run.csv"), estimate=False)
    assert run.step == pytest.approx(0.002, rel=1e-6)
    np.testing.assert_allclose(run["displacement"], 1e-3 * X, atol=1e-6)
    np.testing.assert_allclose(run["force"], F, atol=0.51)
    np.testing.assert_allclose(run["voltage"], U, atol=0.001)


BLOCK = "Time;Disp;Coil;Force\ns;mm;V;N\n"
OWN = rows(";", BASE, P, P, P, P)


@pytest.mark.parametrize(
    ("text", "encoding", "left"),
    [(BLOCK + OWN, "utf-16-le", N), (BLOCK + OWN + "\0\0", "utf-8", N),
     ((BLOCK + OWN)[:-4], "utf-8", N - 1), (BLOCK + OWN[:-1], "utf-8", N)],
)  # fmt: skip
def test_ends_and_encodings(tmp_path: Path, text: str, encoding: str, left: int) -> None:
    (tmp_path / "run.csv").write_bytes(text.encode(encoding))
    (run,) = measurements_of(read_table(tmp_path / "run.csv"), estimate=False)
    np.testing.assert_allclose(run["force"], F[:left], atol=0.01)
    cut = f"line {N + 2}, the last one, is cut off and left out" in run.notes
    assert cut == (left < N)


def test_a_block_in_another_unit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(f"{BLOCK}{OWN}\n{BLOCK.replace(';N', ';kN')}{OWN}")
    with pytest.raises(RecordError, match='line 605: the units are "s;mm;V;kN" here'):
        read_table(tmp_path / "run.csv")


@pytest.mark.parametrize("row", ["1;1;1;10", "0;-50;0;-2000", "1.8;50;10;2000"])
def test_a_row_of_scales_above_the_numbers_is_told(tmp_path: Path, row: str) -> None:
    (tmp_path / "run.csv").write_text(f"{BLOCK}{row}\n{OWN}")
    with pytest.raises(RecordError, match="first row of numbers may be one of scales or ranges"):
        measurements_of(read_table(tmp_path / "run.csv"))


def test_a_universal_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "run.unv").write_text("    -1\n    58\nDisp\n" + "  1.0  2.0\n" * 90 + "    -1\n")
    with pytest.raises(RecordError, match=r"a universal file \(UFF\), which is not read"):
        read_table(tmp_path / "run.unv")


# Times ---------------------------------------------------------------------------------------


def timed(folder: Path, title: str, time: np.ndarray, form: Form = P, columns=(X, U, F)) -> Path:
    body = rows(",", (time, *columns), form, P, P, P)
    (folder / "run.csv").write_text(f"{title},Disp [mm],Coil [V],Force [N]\n{body}")
    return folder / "run.csv"


def told(file: Path, capsys, *options: str) -> tuple[int, str]:
    made = ["study", "new", str(file.parent / "rig"), "--data", str(file), "--quiet", *options]
    code = main(made)
    seen = capsys.readouterr()
    return code, " ".join((seen.out + seen.err).split())


MICROS = 2000 * (COUNT - 1)
WRAPPED = {
    "16 bits": ("Time [us]", (MICROS + 60000) % 65536, K),
    "32 bits": ("micros", (MICROS + 2**32 - 500000) % 2**32, K),
    "a second": ("Time [s]", T % 1.0, P),
    "a minute": ("Time [s]", (T + 59.3) % 60.0, P),
    "a day": ("Time [s]", (T + 86399.5) % 86400.0, P),
}


@pytest.mark.parametrize("kind", WRAPPED)
def test_counters_go_on(tmp_path: Path, capsys, kind: str) -> None:
    title, time, form = WRAPPED[kind]
    file = timed(tmp_path, title, time, form)
    (run,) = measurements_of(read_table(file), estimate=False)
    assert run.step == pytest.approx(0.002, rel=1e-6)
    assert len(run.time) == N
    code, said = told(file, capsys)
    assert code == 0
    assert "where all channels go on: taken as a counter that ran over" in said


@pytest.mark.parametrize("order", ["descends", "is not in order"])
def test_rows_are_sorted(tmp_path: Path, capsys, order: str) -> None:
    rank = np.arange(N)[::-1] if order == "descends" else np.roll(np.arange(N), 200)
    file = timed(tmp_path, "Time [s]", T[rank], P, [one[rank] for one in (X, U, F)])
    (run,) = measurements_of(read_table(file), estimate=False)
    np.testing.assert_allclose(run["displacement"], 1e-3 * X, atol=1e-6)
    np.testing.assert_allclose(run["force"], F, atol=0.01)
    code, said = told(file, capsys)
    assert code == 0
    assert f'"Time [s]" {order}: the rows are taken in the order of time' in said


@pytest.mark.parametrize(
    ("zero", "places", "what"),
    [(45363.4, 11, "days of a calendar"), (45363.4, 8, "days of a calendar"),
     (739323.4, 10, "days of a calendar"), (0.41666667, 11, "parts of a day")],
)  # fmt: skip
def test_days_without_a_unit(tmp_path: Path, capsys, zero: float, places: int, what: str) -> None:
    file = timed(tmp_path, "Time", zero + T / 86400.0, point(places))
    (run,) = measurements_of(read_table(file), estimate=False)
    assert run.step == pytest.approx(0.002, rel=1e-4)
    assert len(run.time) == N
    code, said = told(file, capsys)
    assert code == 0
    assert f"no unit is given, and its values are {what}: " in said


def test_runs_of_a_minute_are_cut_where_that_is_asked(tmp_path: Path) -> None:
    t = np.tile(np.arange(600) / 10.0, 2)
    columns = [np.sin(2.0 * np.pi * t / 3.0), 0.0 * t, np.cos(2.0 * np.pi * t / 3.0)]
    file = timed(tmp_path, "Time [s]", t, P, columns)
    assert "a counter that ran over" in read_table(file).remarks[0]
    table = read_table(file, "restart")
    cut = pieces_of(table, "restart", specs(table, guess_channels(table)))
    assert [one.rows for one in cut] == [600, 600]


def test_a_count_of_samples_is_no_time(tmp_path: Path, capsys) -> None:
    for number in (COUNT, COUNT % 256):
        file = timed(tmp_path, "Sample", number, K)
        code, said = told(file, capsys)
        assert code == 2
        assert "--step S, the sampling step in s" in said
    assert told(file, capsys, "--step", "0.002")[0] == 0


@pytest.mark.parametrize(
    ("time", "said"),
    [(0.0 * T, "no column can be the time: --step S"), (np.floor(T), "(here about 0.00167), takes"),
     (np.floor(20.0 * T) / 20.0, "If times were written with too few digits, --step S")],
)  # fmt: skip
def test_times_that_stand_still_are_told(tmp_path: Path, capsys, time, said: str) -> None:
    code, told_of = told(timed(tmp_path, "Time", time, P), capsys)
    assert code == 2
    assert said in told_of


def test_advice_on_a_time_that_goes_back_leads_on(tmp_path: Path, capsys) -> None:
    half = N // 2
    runs = np.concatenate([T[:half], T[:half]])
    jumping = [np.concatenate([one[:half], one[100 : 100 + half]]) for one in (X, U, F)]
    file = timed(tmp_path, "Time [s]", runs, P, jumping)
    code, said = told(file, capsys)
    assert code == 2
    assert "--split restart cuts it there." in said
    assert "--step" not in said
    assert told(file, capsys, "--split", "restart")[0] == 0
    file = timed(tmp_path, "Time [s]", np.where(T[-20] == T, 0.1, T))  # one time is wrong
    with pytest.raises(RecordError, match="line 582: time goes back") as caught:
        measurements_of(read_table(file))
    assert "--split" not in str(caught.value)
    assert "All channels go on there: if the time is wrong, --step S" in str(caught.value)

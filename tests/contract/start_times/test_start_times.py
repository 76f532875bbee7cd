"""Channels that begin at other times, or are sampled at other rates, are put on one time."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, TdmsWriter

from bristle.cli import main
from bristle.data.measurement import Measurement, measurements_of
from bristle.data.read import read_table
from bristle.study.study import Study

BEGAN = np.datetime64("2024-05-06T09:10:11")


def path(t):
    return 10.0 * np.sin(2.0 * np.pi * 1.3 * t)


def force(t):
    return 400.0 * np.tanh(4.0 * np.cos(2.0 * np.pi * 1.3 * t))


def voltage(t):
    return np.where(t % 2.0 < 1.0, 1.0, 3.0)


def channel(
    name: str, f, unit: str, start=0.0, step=0.002, size=3000, offset=0.0, group="log", **more
) -> ChannelObject:
    """Return a channel of a function of the time since all began."""
    began = BEGAN + np.timedelta64(round(1e6 * start), "us")
    waveform = {"wf_start_time": began, "wf_start_offset": offset, "wf_increment": step}
    values = f(start + offset + step * np.arange(size))
    return ChannelObject(group, name, values, properties={"unit_string": unit} | waveform | more)


def tdms(file: Path, *channels: ChannelObject) -> Path:
    with TdmsWriter(str(file)) as writer:
        writer.write_segment(list(channels))
    return file


def measured(file: Path, tolerance: float = 1e-6) -> Measurement:
    """Return the run in a file, whose channels are those of the functions at its times."""
    (run,) = measurements_of(read_table(file), estimate=False)
    np.testing.assert_allclose(1e3 * run["displacement"], path(run.time), atol=tolerance)
    np.testing.assert_allclose(run["force"], force(run.time), atol=400.0 * tolerance)
    return run


MOTION = channel("displacement", path, "mm")


@pytest.mark.parametrize(
    "late", [{"start": 0.084}, {"offset": 0.084}, {"start": 0.05, "offset": 0.034}]
)
def test_a_force_that_begins_later_is_put_on_the_time_of_the_motion(tmp_path, capsys, late) -> None:
    file = tdms(tmp_path / "run.tdms", MOTION, channel("force", force, "N", **late))
    run = measured(file)
    assert run.time[0] == pytest.approx(0.084)
    assert len(run.time) == 3000 - 42
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert '"force" begins 84 ms later than "displacement"' in said
    assert "only the part that all channels have is read: 0.084 s to 5.998 s" in said


def test_a_force_that_begins_later_than_the_time_that_is_a_channel(tmp_path: Path) -> None:
    seconds = 0.002 * np.arange(3000)
    instants = BEGAN + np.round(1e6 * seconds).astype("timedelta64[us]")
    for own in (
        channel("Time", lambda t: t, "s"),
        ChannelObject("log", "Time", seconds, properties={"unit_string": "s"}),
        ChannelObject("log", "Stamp", instants),
    ):
        late = channel("force", force, "N", start=0.05, offset=0.034)
        file = tdms(tmp_path / "run.tdms", own, MOTION, late)
        assert len(measured(file).time) == 3000 - 42
        assert '"force" begins 84 ms later than "displacement"' in read_table(file).remarks[0]


def test_between_samples_it_is_interpolated_and_said(tmp_path: Path) -> None:
    file = tdms(tmp_path / "run.tdms", MOTION, channel("force", force, "N", start=0.0837))
    measured(file, 1e-3)
    assert any("put on one time, interpolated" in one for one in read_table(file).remarks)


def test_another_rate_and_another_group(tmp_path: Path) -> None:
    slow = channel("voltage", voltage, "V", step=0.01, size=600)
    file = tdms(tmp_path / "run.tdms", MOTION, slow, channel("force", force, "N", group="load"))
    run = measured(file)
    assert run.step == pytest.approx(0.002)
    np.testing.assert_array_equal(run["voltage"], voltage(np.floor(run.time / 0.01 + 1e-6) * 0.01))
    half = channel("force", force, "N", step=0.004, size=1500)
    measured(tdms(tmp_path / "half.tdms", MOTION, half), 5e-2)


@pytest.mark.parametrize(
    "told",
    [
        {"wf_xunit_string": "ms", "wf_increment": 2.0}, {"SampleRate": 500.0, "step": 3},
        {"Sampling Rate [kHz]": "0.5"},
    ],
)  # fmt: skip
def test_increments_in_ms_and_rates_of_loggers(tmp_path: Path, told) -> None:
    channels = [
        channel(n, f, u) for n, f, u in (("displacement", path, "mm"), ("force", force, "N"))
    ]
    for one in channels:
        del one.properties["wf_increment"]
        one.properties.update(told)
    file = tdms(tmp_path / "run.tdms", *channels)
    assert measured(file).step == pytest.approx(0.002)
    said = " ".join(read_table(file).remarks)
    assert (f"the time is made from {next(iter(told))}: 0.002 s" in said) is (
        "wf_increment" not in told
    )


def test_what_a_slow_channel_cuts_off_is_said(tmp_path: Path) -> None:
    slow = channel("temperature", lambda t: 25.0 + t, "degC", step=1.0, size=6)
    table = read_table(tdms(tmp_path / "run.tdms", MOTION, channel("force", force, "N"), slow))
    assert "only the part that all channels have is read: 0 s to 5 s" in " ".join(table.remarks)


def test_a_group_of_another_run_is_named_and_not_read(tmp_path: Path) -> None:
    both = [channel("force", force, "N"), channel("force", force, "N", start=60.0, group="second")]
    table = read_table(tdms(tmp_path / "run.tdms", MOTION, *both))
    assert any('group "second" (force) is not read' in remark for remark in table.remarks)


def test_channels_that_do_not_overlap_give_one_message(tmp_path: Path, capsys) -> None:
    file = tdms(tmp_path / "run.tdms", MOTION, channel("force", force, "N", start=600.0))
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "do not overlap in time" in said
    assert '"displacement" from 0 s to 5.998 s; "force" from 600 s to 606 s' in said
    assert "--step" not in said
    assert not (tmp_path / "s").exists()
    other = channel("force", force, "N", start=600.0, group="load")
    file = tdms(tmp_path / "groups.tdms", MOTION, channel("voltage", voltage, "V"), other)
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 2
    assert 'Group "load" (force) is not read: it was recorded from 600 s' in capsys.readouterr().err


HEADER = """LabVIEW Measurement\t
Separator\tTab
Decimal_Separator\t.
X_Columns\t{columns}
Time_Pref\tRelative
***End_of_Header***\t

Channels\t2\t\t
Samples\t1000\t1000\t
Date\t2024/05/06\t2024/05/06
Time\t09:10:11.0\t{clock}
Y_Unit_Label\tmm\tN
X0\t0\t{start}
Delta_X\t0.002\t{step}
***End_of_Header***\t\t
X_Value\tdisplacement\tforce\tComment
"""


@pytest.mark.parametrize(
    ("columns", "clock", "start", "step"),
    [
        ("No", "09:10:11.0", 0.084, 0.002),
        ("One", "09:10:11.0", 0.084, 0.002),
        ("No", "09:10:11.0839999999999996", 0, 0.002),
        ("No", "09:10:11.0", 0, 0.004),
    ],
)
def test_labview_by_x0_by_the_clock_and_by_delta_x(
    tmp_path: Path, columns: str, clock: str, start: float, step: float
) -> None:
    rows = np.arange(1000)
    late = 0.084 if start or "0839" in clock else 0.0
    size = 1000 if step == 0.002 else 500
    text = HEADER.format(columns=columns, clock=clock, start=start, step=step)
    for k in rows:
        time = f"{0.002 * k:.6f}" if columns == "One" else ""
        value = f"{force(late + step * k):.5f}" if k < size else ""
        text += f"{time}\t{path(0.002 * k):.6f}\t{value}\n"
    (tmp_path / "run.lvm").write_text(text)
    measured(tmp_path / "run.lvm", 1e-5 if step == 0.002 else 5e-2)
    assert read_table(tmp_path / "run.lvm").remarks


def test_the_waveform_of_a_group_is_that_of_its_channels(tmp_path: Path) -> None:
    t = 0.002 * np.arange(3000)
    group = GroupObject("log", {"wf_increment": 0.002, "wf_start_time": BEGAN})
    bare = [
        ChannelObject("log", name, values, properties={"unit_string": unit})
        for name, values, unit in (("displacement", path(t), "mm"), ("force", force(t), "N"))
    ]
    assert measured(tdms(tmp_path / "run.tdms", group, *bare)).step == pytest.approx(0.002)


def test_no_time_is_told_and_no_step_that_would_spoil_the_record(tmp_path, capsys) -> None:
    bare = [ChannelObject("log", name, path(0.002 * np.arange(300)), properties={"unit_string": u})
            for name, u in (("displacement", "mm"), ("force", "N"))]  # fmt: skip
    file = tdms(tmp_path / "run.tdms", *bare)
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]) == 2
    assert "no column can be the time: --step S, the sampling step in s" in capsys.readouterr().err


def test_two_times_in_one_table_are_doubted(tmp_path: Path, capsys) -> None:
    t = 0.002 * np.arange(3000)
    data = {"Data1_time_x [s]": t, "x [mm]": path(t), "Data1_time_F [s]": t + 0.084,
            "F [N]": force(t + 0.084)}  # fmt: skip
    file = tmp_path / "run.csv"
    rows = (",".join(f"{v:.4f}" for v in row) for row in zip(*data.values(), strict=True))
    file.write_text("\n".join([",".join(data), *rows, ""]))
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file)]) == 0
    assert "up to 0.084 s apart" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("scale", "zero", "text"),
    [
        (1 / 86400, 45418.4, "days of a calendar"),
        (1 / 86400, 739378.4, "days of a calendar"),
        (1e3, 1.714986611e12, "ms since 1970"),
        (1e6, 1.714986611e15, "us since 1970"),
    ],
)
def test_a_time_without_a_unit_that_is_an_instant(tmp_path, capsys, scale, zero, text) -> None:
    t = 0.002 * np.arange(3000)
    rows = (f"{zero + scale * a:.10f},{b:.6f},{c:.4f}"
            for a, b, c in zip(t, path(t), force(t), strict=True))  # fmt: skip
    file = tmp_path / "run.csv"
    file.write_text("\n".join(["Time,x [mm],F [N]", *rows, ""]))
    study = str(tmp_path / "s")
    assert main(["study", "new", study, "--data", str(file)]) == 0
    assert f"its values are {text}: " in " ".join(capsys.readouterr().out.split())
    (run,) = Study(study).read()
    assert run.step == pytest.approx(0.002, rel=1e-3)


def test_a_step_that_nobody_set_is_doubted(tmp_path: Path) -> None:
    unset = [channel("displacement", path, "mm", step=1.0, size=300),
             channel("force", force, "N", step=1.0, size=300)]  # fmt: skip
    table = read_table(tdms(tmp_path / "run.tdms", *unset))
    assert "wf_increment = 1 s, which may be the step that nobody set" in table.remarks[0]
    rows = "".join(f"\t{path(0.002 * k):.4f}\t{force(0.002 * k):.4f}\n" for k in range(300))
    head = HEADER.format(columns="No", clock="09:10:11.0", start=0, step=1)
    (tmp_path / "run.lvm").write_text(head.replace("Delta_X\t0.002", "Delta_X\t1") + rows)
    assert "Delta_X = 1 s, which" in read_table(tmp_path / "run.lvm").remarks[0]


def test_minutes_and_seconds_are_not_taken_for_hours_and_minutes(tmp_path, capsys) -> None:
    t = np.arange(300)
    rows = (f"{k // 60:02}:{k % 60:02},{path(0.01 * k):.4f},{force(0.01 * k):.3f}" for k in t)
    file = tmp_path / "run.csv"
    file.write_text("\n".join(["Time,x [mm],F [N]", *rows, ""]))
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file)]) == 2
    assert 'Time (line 2: "00:00" is no number)' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("of_force", "step", "start"),
    [
        ({"sample_rate": 500.0}, 0.002, 0.0),
        ({"sample_rate": 250.0}, 0.004, 0.0),
        ({"dt": 0.002, "t0": 0.084}, 0.002, 0.084),
    ],
)
def test_attributes_of_hdf5_tell_the_time_of_a_channel(tmp_path, of_force, step, start) -> None:
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["displacement"] = path(0.002 * np.arange(3000))
        file["displacement"].attrs.update(units="mm", sample_rate=500.0)
        file["force"] = force(start + step * np.arange(3000))
        file["force"].attrs.update(units="N", **of_force)
    run = measured(tmp_path / "run.h5", 5e-2 if step > 0.002 else 1e-6)
    assert run.step == pytest.approx(0.002)
    assert run.time[0] == pytest.approx(start)


def timed(name: str, t: np.ndarray) -> ChannelObject:
    return ChannelObject("log", name, t, properties={"unit_string": "s"})


def test_two_times_in_a_group_count_for_the_channels_behind_each(tmp_path: Path, capsys) -> None:
    early = 0.002 * np.arange(3000)
    late = early + 0.3
    x = ChannelObject("log", "displacement", path(early), properties={"unit_string": "mm"})
    f = ChannelObject("log", "force", force(late), properties={"unit_string": "N"})
    first, second = timed("Time1", early), timed("Time2", late)
    run = measured(tdms(tmp_path / "run.tdms", first, x, second, f))
    assert len(run.time) == 3000 - 150
    # Where their order does not tell it, it is said.
    file = tdms(tmp_path / "front.tdms", first, second, x, f)
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "front.tdms: Time1, Time2 tell different times, and Time1 is taken for all" in said
    assert "expected each of them ahead of its own channels" in said


def test_a_counter_that_begins_again_goes_on(tmp_path: Path, capsys) -> None:
    t = 0.004 * np.arange(2000)
    columns = np.column_stack([(4 * np.arange(2000)) % 4096, path(t), force(t)])
    file = tmp_path / "run.csv"
    np.savetxt(file, columns, delimiter=",", header="time [ms],disp [mm],force [N]", comments="")
    new = ["study", "new", str(tmp_path / "s"), "--data", str(file)]
    assert main(new) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert '"time [ms]" begins again after 4096 ms (line 1026), where all channels go on' in said
    (run,) = Study(tmp_path / "s").read()
    assert run.step == pytest.approx(0.004)

"""What a laboratory did wrong is named with channel, run and value, and is set right on request."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.channels import ChannelSpec
from bristle.data.checks.differing_runs import check_differing_runs
from bristle.data.checks.recording import check_recording, mains_of, moving_average, spectral_lines
from bristle.data.corrections import Correction, after, set_right, without_lines, wrong_value
from bristle.data.measurement import Measurement, measurements_of
from bristle.data.table import table_from_frame
from bristle.errors import StudyError
from bristle.study.study import Study

RATE = 500.0
SIZES = {"displacement": 0.02, "velocity": 0.15, "force": 120.0}
"""About the RMS of the channels, [m, m/s, N]."""


def run(
    seed: int, seconds: float = 6.0, rate: float = RATE, noise: float = 0.01, sine: float = 0.0
):
    """Return a Bingham damper's run: eight sines below 4 Hz or one, a voltage that is switched."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    frequencies = np.array([sine]) if sine else rng.uniform(0.4, 4.0, 8)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
    turns = 2.0 * np.pi * frequencies * t[:, None] + phases
    x = np.sum(0.01 / frequencies * np.sin(turns), axis=1)
    v = np.sum(0.01 * 2.0 * np.pi * np.cos(turns), axis=1)
    volts = np.repeat(rng.uniform(0.0, 5.0, 40), int(rate) // 2)[: len(t)]
    force = (40.0 + 25.0 * volts) * np.tanh(v / 0.02) + 300.0 * v
    clean = {"displacement": x, "velocity": v, "force": force}
    noisy = {
        name: y + noise * SIZES[name] * rng.standard_normal(len(y)) for name, y in clean.items()
    }
    return t, {**noisy, "voltage": volts}


def measured(seed: int, change=lambda channels: None, **how) -> Measurement:
    import pandas as pd

    t, channels = run(seed, **how)
    change(channels)
    frame = pd.DataFrame({"time": t, **channels})
    units = {"time": "s", "displacement": "m", "velocity": "m/s", "force": "N", "voltage": "V"}
    specs = {name: ChannelSpec(name, unit) for name, unit in units.items()}
    return measurements_of(table_from_frame(frame, f"run_{seed}"), specs)[0]


# -- lines


@pytest.mark.parametrize("channel", ["displacement", "velocity", "force", "voltage"])
def test_hum_is_named_with_channel_frequency_and_amplitude(channel):
    t, channels = run(1)
    size = 0.05 * float(np.std(channels[channel]))
    channels[channel] = channels[channel] + size * np.sin(2.0 * np.pi * 49.99 * t + 1.0)
    (line,) = spectral_lines(channels, 1.0 / RATE)
    assert (line.channel, line.mains, line.order, line.folded) == (channel, 50.0, 1, False)
    assert line.frequency == pytest.approx(49.99, abs=0.01)
    assert line.amplitude == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("seed", range(4))
def test_runs_without_a_fault_have_no_line_and_no_average(seed):
    _, channels = run(seed)
    assert spectral_lines(channels, 1.0 / RATE) == []
    assert not any(moving_average(y, 1.0 / RATE) for y in channels.values())


@pytest.mark.parametrize("frequency", [1.0, 2.5, 5.0, 10.0, 50.0 / 3.0, 20.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sine_test_and_its_harmonics_are_no_hum(frequency, noise):
    """The force has odd harmonics at 50 or 60 Hz, and the displacement some of a servo valve."""
    t, channels = run(3, sine=frequency, noise=noise)
    size = 0.02 * float(np.std(channels["displacement"]))
    for order in range(2, 12):
        wave = np.sin(2.0 * np.pi * order * frequency * t + order)
        channels["displacement"] = channels["displacement"] + size / order**2 * wave
    assert spectral_lines(channels, 1.0 / RATE) == []


def test_a_line_that_displacement_and_velocity_share_is_a_motion():
    t, channels = run(1)
    turns = 2.0 * np.pi * 50.0
    channels["displacement"] = channels["displacement"] + 2e-4 * np.sin(turns * t)
    channels["velocity"] = channels["velocity"] + 2e-4 * turns * np.cos(turns * t)
    assert spectral_lines(channels, 1.0 / RATE) == []


def test_hum_beyond_half_the_rate_is_said_to_be_aliased():
    """50 Hz at 80 samples per second show at 30 Hz."""
    t, channels = run(5, seconds=20.0, rate=80.0)
    channels["velocity"] = channels["velocity"] + 0.02 * np.sin(2.0 * np.pi * 50.0 * t)
    (line,) = spectral_lines(channels, 1.0 / 80.0)
    assert line.frequency == pytest.approx(30.0, abs=0.01)
    assert (line.mains, line.order, line.folded) == (50.0, 1, True)
    assert mains_of(41.0, 1.0 / 80.0, 0.05)[0] == 0.0


def test_the_ripple_of_a_rectifier_is_named_where_it_is_aliased():
    """Six pulses a period of 60 Hz are 360 Hz, which 500 samples per second show at 140 Hz."""
    assert mains_of(140.03, 0.002, 0.05) == (60.0, 6, True)
    assert mains_of(139.5, 0.002, 0.05)[0] == 0.0


def test_what_is_taken_off_is_the_line_alone():
    t, channels = run(2)
    y = channels["force"]
    hum = 3.0 * np.sin(2.0 * np.pi * 50.02 * t + 0.3)
    left = without_lines(y + hum, 1.0 / RATE, [50.02]) - y
    assert np.std(left) < 0.15 * np.std(hum)


def test_the_finding_says_where_the_line_is_from():
    def hum(channels):
        channels["force"] = channels["force"] + 4.0 * np.sin(0.2 * np.pi * np.arange(3000))

    (found,) = check_recording([measured(1, hum)])
    assert (found.kind, found.channel, found.run) == ("lines", "force", "run_1")
    assert "a line at 50 Hz of 3." in found.text
    assert "the mains of 50 Hz" in found.text
    assert found.fixes[0][:2] == ("force", "line")


# -- moving averages


@pytest.mark.parametrize("length", [3, 5, 10, 24])
@pytest.mark.parametrize("channel", ["displacement", "force"])
def test_a_moving_average_is_told_with_its_length(channel, length):
    _, channels = run(4)
    y = np.convolve(channels[channel], np.ones(length) / length, "valid")
    found = moving_average(y, 1.0 / RATE)
    assert found is not None
    assert found.length == length


def test_other_filters_are_no_moving_average():
    from scipy.signal import butter, sosfilt

    _, channels = run(4)
    for corner in (20.0, 60.0, 120.0):
        filtered = sosfilt(butter(2, corner, fs=RATE, output="sos"), channels["force"])
        assert moving_average(filtered, 1.0 / RATE) is None


def test_the_gaps_between_harmonics_are_no_nulls():
    """The odd harmonics of 5 Hz are 10 Hz apart, as are the nulls of 50 samples at 500 Hz."""
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    force = np.round(200.0 * np.tanh(20.0 * np.cos(10.0 * np.pi * t)), 1)
    assert moving_average(force, 1.0 / RATE) is None


# -- runs that differ


def differing(change, seeds=5, which=2):
    runs = [measured(k, change if k == which else lambda c: None) for k in range(seeds)]
    return list(check_differing_runs(runs))


@pytest.mark.parametrize(
    ("channel", "fault", "value"),
    [("force", "gain", 1.25), ("force", "gain", 0.8), ("force", "sign", -1.0),
     ("velocity", "sign", -1.0), ("displacement", "sign", -1.0), ("velocity", "gain", 1.3),
     ("displacement", "gain", 0.8)],
)  # fmt: skip
def test_a_run_that_was_scaled_or_turned_is_named(channel, fault, value):
    def change(channels):
        channels[channel] = value * channels[channel]

    (found,) = differing(change)
    assert (found.run, found.channel) == ("run_2", channel)
    (correction,) = found.fixes
    assert correction[:2] == (channel, fault)
    assert correction.value == pytest.approx(value, rel=0.03)


@pytest.mark.parametrize(("channel", "size"), [("force", 30.0), ("velocity", 0.02)])
def test_a_run_with_another_zero_is_named(channel, size):
    def change(channels):
        channels[channel] = channels[channel] + size

    (found,) = differing(change)
    assert (found.run, found.channel, found.kind) == ("run_2", channel, "run zero")
    assert found.fixes[0].value == pytest.approx(size, rel=0.1)


def test_runs_of_one_rig_do_not_differ_and_three_are_too_few():
    assert differing(lambda channels: None) == []
    double = {"force": 2.0}
    change = lambda channels: channels.update(force=double["force"] * channels["force"])  # noqa: E731
    assert differing(change, seeds=3) == []


def test_a_run_at_a_command_of_its_own_is_not_judged():
    """Its force is larger because of its voltage, or its gain: no other run can tell."""

    def change(channels):
        channels["force"] = 1.4 * channels["force"]
        channels["voltage"] = channels["voltage"] + 20.0

    assert differing(change) == []


# -- corrections


def test_corrections_take_faults_back():
    _, channels = run(6)
    force = channels["force"]
    faulty = {"force": -1.25 * force + 7.0}
    wanted = (Correction("force", "bias", 7.0), Correction("force", "gain", 1.25),
              Correction("force", "sign", -1.0))  # fmt: skip
    assert np.allclose(set_right(faulty, 0.002, wanted)["force"], force)


def test_a_zero_that_is_found_beside_a_known_gain_is_taken_off():
    _, channels = run(6)
    force = channels["force"]
    shown = {"force": -1.25 * (force + 3.0)}
    known = [Correction("force", "gain", 1.25), Correction("force", "sign", -1.0)]
    left = set_right(shown, 0.002, known)["force"] - force
    whole = [*known, *after(known, [Correction("force", "bias", float(np.mean(left)))])]
    assert np.allclose(set_right(shown, 0.002, whole)["force"], force)


@pytest.mark.parametrize(
    ("fault", "value"), [("gain", 0.0), ("gain", -1.2), ("sign", 1.0), ("line", -50.0),
                         ("clock", 0.5), ("bias", float("nan"))],
)  # fmt: skip
def test_values_that_correct_nothing_are_refused(fault, value):
    assert wrong_value(fault, value)
    assert not wrong_value("sign", -1.0)


@pytest.fixture
def folder(tmp_path):
    for k in range(4):
        t, channels = run(k, seconds=4.0)
        if k == 1:
            channels["force"] = channels["force"] + 4.0 * np.sin(2.0 * np.pi * 50.0 * t)
        if k == 2:
            channels["force"] = 1.25 * channels["force"]
        table = np.column_stack([t, *channels.values()])
        titles = "time [s],displacement [m],velocity [m/s],force [N],voltage [V]"
        np.savetxt(tmp_path / f"run_{k}.csv", table, delimiter=",", header=titles, comments="")
    main(["study", "new", str(tmp_path / "rig"), "--data", str(tmp_path / "run_*.csv")])
    return tmp_path / "rig"


def test_study_check_corrects_on_request_and_finds_nothing_then(folder, capsys):
    capsys.readouterr()
    assert main(["study", "check", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["findings"]
    named = [(one["kind"], one["run"], one["channel"]) for one in found if one["corrections"]]
    assert sorted(named) == [("lines", "run_1", "force"), ("run gain", "run_2", "force")]
    assert main(["study", "check", str(folder), "--correct"]) == 0
    text = capsys.readouterr().out
    assert "run_1: a line at 50 Hz is taken off force." in text
    assert "run_2: force is divided by 1.2" in text
    assert "has a line" not in text
    assert "what the other runs say" not in text
    study = Study(folder)
    (right,) = [one for one in study.read() if one.name == "run_2"]
    assert any("corrected: force is divided by" in note for note in right.notes)
    assert float(np.std(right["force"])) < 200.0
    written = (folder / "study.toml").read_text(encoding="utf-8")
    assert 'fault = "line"' in written


def test_wrong_corrections_are_told_with_their_line(folder):
    path = folder / "study.toml"
    text = path.read_text(encoding="utf-8")
    wrong = 'correct = [{ channel = "force", fault = "gian", value = 1.2 }]\nrole'
    path.write_text(text.replace("role", wrong, 1), encoding="utf-8")
    with pytest.raises(StudyError, match="gian"):
        Study(folder)
    path.write_text(text.replace("role", "correct = 3\nrole", 1), encoding="utf-8")
    with pytest.raises(StudyError, match=r"correct is 3: expected a list of tables, as .*gain"):
        Study(folder)

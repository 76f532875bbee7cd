"""The data check: a fault planted in a clean bench run is found, and nothing in the clean one."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from made import Columns, bench_run, write, write_runs

from bristle.cli import main
from bristle.core.finding import Finding
from bristle.data.channels import ChannelSpec
from bristle.data.checks.runs import cycles, drive_levels
from bristle.data.cut_off import clipped_ends
from bristle.errors import StudyError
from bristle.study import Study, create_study
from bristle.study.data_check import DataCheck, check_data
from bristle.view.terminal import text as shown

Spoil = Callable[[Columns], None]


def look_at(tmp_path: Path, spoil: Spoil | None = None, runs: int = 3) -> DataCheck:
    files = []
    for k in range(1, runs + 1):
        data = bench_run(k, 4.0)
        if spoil:
            spoil(data)
        files.append(write(tmp_path / f"run_{k}.csv", data))
    return check_data(create_study(tmp_path / "rig", files).study)


def found(look: DataCheck, kind: str) -> list[Finding]:
    return [finding for finding in look.findings if finding.kind == kind]


def test_clean_runs_have_nothing_to_mend(tmp_path: Path) -> None:
    look = look_at(tmp_path)
    assert look.ok
    assert {finding.kind for finding in look.findings} <= {"noise", "gain", "drive", "reading"}
    assert all(finding.level == "note" for finding in look.findings)
    excitation = look.excitations[0]
    assert excitation.drive == "voltage"
    assert excitation.cycles > 5
    assert [level for level, _ in excitation.levels] == pytest.approx([0, 2, 4, 6])
    assert "force" in shown(look.view())


def scaled(name: str, factor: float) -> Spoil:
    def spoil(data: Columns) -> None:
        data[name] = factor * data[name]

    return spoil


def replaced(name: str, make: Callable[[Columns], np.ndarray]) -> Spoil:  # type: ignore[type-arg]
    def spoil(data: Columns) -> None:
        data[name] = make(data)

    return spoil


def late(samples: float) -> Spoil:
    def spoil(data: Columns) -> None:
        t = data["time [s]"]
        data["v [mm/s]"] = np.interp(t - samples * 0.002, t, data["v [mm/s]"])

    return spoil


@pytest.mark.parametrize(
    ("title", "factor", "said"),
    [
        ("x [mm]", 1e3, "unit of the displacement"),  # mm in a column of m
        ("x [mm]", 1e-3, "unit of the displacement"),
        ("time [s]", 1e3, "unit of the time"),
        ("U [V]", 1e3, "unit of the voltage"),
        ("U [V]", -1.0, "voltage goes down to -6 V and never above zero: is its sign turned?"),
    ],
)
def test_what_no_damper_does_is_doubted_and_the_advice_sets_it_right(
    tmp_path: Path, title, factor, said
) -> None:
    def spoil(data: Columns) -> None:
        del data["v [mm/s]"]
        data[title] = factor * data[title]

    look = look_at(tmp_path, spoil)
    assert_advised(tmp_path / "rig", look, said)


def test_a_force_that_is_read_with_the_wrong_sign_is_turned_by_the_advice(tmp_path: Path) -> None:
    files = [write(tmp_path / f"run_{k}.csv", bench_run(k, 4.0)) for k in (1, 2, 3)]
    force = {"force": ChannelSpec("F [N]", "N", -1)}
    study = create_study(tmp_path / "rig", files, channels=force).study
    assert_advised(tmp_path / "rig", check_data(study), "force drives the motion")


def assert_advised(rig: Path, look: DataCheck, said: str) -> None:
    """Assert that a doubt is told, and that nothing is found once its command has run."""
    kinds = ("size", "command sign", "sign")
    (doubt, *_) = [one for kind in kinds for one in found(look, kind)]
    assert said in doubt.text
    _, _, advice = doubt.do.partition(":  bristle ")
    assert main(shlex.split(advice)) == 0
    again = check_data(Study(rig))
    assert not [one for kind in kinds for one in found(again, kind)]


def test_no_sign_is_advised_that_would_be_wrong_in_another_run(tmp_path: Path) -> None:
    files = []
    for k in range(1, 4):
        data = bench_run(k, 4.0)
        data["F [N]"] *= -1.0 if k == 2 else 1.0
        files.append(write(tmp_path / f"run_{k}.csv", data))
    look = check_data(create_study(tmp_path / "rig", files).study)
    (doubt,) = found(look, "sign")
    assert doubt.run == "run_2"
    assert "--channel" not in doubt.do


@pytest.mark.parametrize(
    ("spoil", "kind", "level", "told"),
    [
        (scaled("v [mm/s]", 1.05), "gain", "warning", "velocity is 1.0[45]"),
        (scaled("v [mm/s]", 1e-3), "gain", "error", "velocity is 0.00(1|099)"),
        (late(2.0), "delay", "warning", r"velocity comes (3\.[89]|4(\.\d+)?) ms .*later"),
        (
            replaced("v [mm/s]", lambda d: np.random.default_rng(0).normal(size=len(d["F [N]"]))),
            "derivative",
            "error",
            "not the derivative of displacement",
        ),
        (
            replaced("v [mm/s]", lambda d: np.gradient(d["x [mm]"], 0.002)),
            "derived",
            "note",
            "central differences",
        ),
        (
            replaced("F [N]", lambda d: np.clip(d["F [N]"], -3.0, 3.0)),
            "clipping",
            "warning",
            r"force stays at exactly (-)?3 N in \d+ stretches",
        ),
        (
            replaced("F [N]", lambda d: np.clip(d["F [N]"], -0.7, 0.7)),
            "clipping",
            "warning",
            r"force stays at exactly -?0\.7 N in .* and at -?0\.7 N in",
        ),
        (scaled("F [N]", 0.0), "still", "error", "force is zero throughout"),
        (scaled("x [mm]", 0.0), "still", "error", "displacement is zero throughout"),
        (
            replaced("F [N]", lambda d: d["F [N]"] + 3.0),
            "offset",
            "warning",
            "force at equal speeds to both sides has a mean of (2.9|3)",
        ),
        (
            replaced("x [mm]", lambda d: d["x [mm]"] + 3.0 * d["time [s]"]),
            "drift",
            "warning",
            "the middle of the displacement drifts",
        ),
        (
            replaced("U [V]", lambda d: np.full(len(d["F [N]"]), 4.0)),
            "drive",
            "warning",
            "voltage is 4 V in all runs: coil lag, remanence and saturation cannot be tested",
        ),
        (
            replaced("U [V]", lambda d: np.where(d["U [V]"] > 3.0, 5.0, 0.0)),
            "drive levels",
            "warning",
            "two levels, 0 and 5 V: saturation",
        ),
        (
            replaced("F [N]", lambda d: np.random.default_rng(1).normal(size=len(d["F [N]"]))),
            "sign",
            "warning",
            "neither resists nor drives",
        ),
    ],
)
def test_planted_faults_are_found(
    tmp_path: Path, spoil: Spoil, kind: str, level: str, told: str
) -> None:
    look = look_at(tmp_path, spoil)
    hits = [finding for finding in found(look, kind) if finding.level == level]
    assert hits, shown(look.view())
    assert re.search(told, hits[0].text), hits[0].text
    assert look.ok == (level != "error")


def test_wrong_sign_in_study_toml_is_found(tmp_path: Path) -> None:
    look_at(tmp_path)
    path = tmp_path / "rig" / "study.toml"
    head, force = path.read_text(encoding="utf-8").split("[channels.force]")
    path.write_text(f"{head}[channels.force]{force.replace('sign = 1', 'sign = -1')}")
    look = check_data(Study(tmp_path / "rig"))
    assert not look.ok
    assert found(look, "sign")[0].level == "error"


def test_held_out_run_beyond_the_training_is_found(tmp_path: Path) -> None:
    files = []
    for k in (1, 2, 3):
        data = bench_run(k, 4.0)
        if k == 2:  # the second of three is held out
            data["U [V]"] = 2.0 * data["U [V]"]
        files.append(write(tmp_path / f"run_{k}.csv", data))
    look = check_data(create_study(tmp_path / "rig", files).study)
    (finding,) = found(look, "beyond")
    assert (finding.run, finding.channel) == ("run_2", "voltage")
    assert finding.do.startswith("Exchange the roles (bristle study roles): run_2 to train, run_")


def test_run_of_another_rig_is_found(tmp_path: Path) -> None:
    files = []
    for k in (1, 2, 3, 4, 5):
        data = bench_run(k, 4.0)
        if k == 4:
            data["F [N]"] = 5.0 * data["F [N]"]
        files.append(write(tmp_path / f"run_{k}.csv", data))
    look = check_data(create_study(tmp_path / "rig", files).study)
    assert [finding.run for finding in found(look, "two rigs")] == ["run_4"]


def test_too_few_cycles_are_no_measurement(tmp_path: Path) -> None:
    t = np.arange(400) / 500.0
    x = 1e3 * 0.01 * np.sin(3.0 * t)
    force = 5.0 * np.cos(3.0 * t)
    file = write(tmp_path / "run.csv", {"t [s]": t, "x [mm]": x, "F [N]": force})
    look = check_data(create_study(tmp_path / "rig", [file]).study)
    assert found(look, "short")[0].level == "error"
    assert found(look, "split")[0].level == "warning"


def test_clipping_of_a_quantised_sine_is_none() -> None:
    t = np.arange(5000) / 500.0
    sine = np.sin(2.0 * np.pi * t)
    for step in (0.0, 1e-3, 0.01, 0.05):
        written = step * np.round(sine / step) if step else sine
        assert clipped_ends(written, step) == []
        cut = np.clip(written, -1.0, 0.85)
        ((share, level, stretches),) = clipped_ends(cut, step)
        assert level == pytest.approx(0.85)
        assert share == pytest.approx(0.176, abs=0.03)
        assert stretches == 10


@pytest.mark.parametrize(("stood", "seen"), [(2, False), (3, True)])
def test_three_equal_samples_at_an_end_are_a_stretch(stood: int, seen: bool) -> None:
    wave = np.concatenate([np.linspace(-1.0, 0.97, 60), np.full(stood, 1.0)])
    values = np.concatenate([np.tile(wave, 8), [0.0]])
    assert bool([end for end in clipped_ends(values, 0.0) if end[1] == 1.0]) is seen


def test_what_keeps_to_levels_by_its_nature_is_not_cut_off(tmp_path: Path) -> None:
    def spoil(data: Columns) -> None:
        t = data["time [s]"]
        data["x [mm]"] = 8.0 * np.arcsin(np.sin(9.0 * t))
        data["v [mm/s]"] = 72.0 * np.sign(np.cos(9.0 * t))

    look = look_at(tmp_path, spoil)
    assert {"velocity", "voltage"} <= {*look.runs[0].channels}
    assert not found(look, "clipping")


def test_both_ends_of_a_channel_that_is_cut_off_are_told() -> None:
    t = np.arange(5000) / 500.0
    cut = np.clip(np.sin(2.0 * np.pi * t), -0.8, 0.9)
    (lower, upper) = clipped_ends(cut, 0.0)
    assert (lower[1], upper[1]) == (-0.8, 0.9)
    assert lower[0] > upper[0] > 0.1


def test_rest_at_the_end_of_a_stroke_is_no_clipping() -> None:
    t = np.arange(3000) / 500.0
    rest = np.where(t < 1.0, 0.0, 1.0 - np.cos(2.0 * np.pi * (t - 1.0)))
    assert clipped_ends(rest, 0.0) == []


def test_levels_and_cycles() -> None:
    noise = 0.01 * np.random.default_rng(0).standard_normal(3000)
    switched = np.repeat([0.0, 4.0, 0.0, 2.0, 4.0, 2.0], 500)
    levels = drive_levels(switched + noise, 0.002, 0.01)
    assert [level for level, _ in levels] == pytest.approx([0.0, 2.0, 4.0], abs=0.01)
    assert [seconds for _, seconds in levels] == pytest.approx([2.0, 2.0, 2.0], abs=0.1)
    assert len(drive_levels(4.0 + noise, 0.002, 0.01)) == 1
    assert drive_levels(2.5 * (1.0 + np.sin(np.arange(3000) * 0.01)), 0.002, 0.0) == ()
    t = np.arange(5000) / 500.0
    assert cycles(np.sin(2.0 * np.pi * t + 0.5)) == pytest.approx(10.0, abs=0.5)


def test_commands_print_and_draw(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for k in (1, 2, 3):
        write(tmp_path / "lab" / f"run_{k}.csv", bench_run(k, 2.0))
    rig = str(tmp_path / "rig")
    assert main(["study", "new", rig, "--data", str(tmp_path / "lab" / "*.csv")]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "force" in text
    assert "it resists the motion" in text
    assert "Held out: run_2.csv" in text
    assert main(["study", "check", rig]) == 0
    assert "noise" in " ".join(capsys.readouterr().out.split())
    picture = tmp_path / "rig" / "reports" / "data_check.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["study", "check", rig, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"] is True
    assert answer["picture"] == str(picture)
    assert answer["runs"][0]["noise"]["force"] > 0.0


def test_undo_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path / "run.csv", bench_run(1, 2.0))
    rig = str(tmp_path / "rig")
    new = ["study", "new", rig, "--data", str(tmp_path / "run.csv"), "--json"]
    assert main(new) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["role"] == "train"
    assert main(["undo", rig]) == 2
    assert "nothing to undo" in capsys.readouterr().err
    study = Study(rig)
    study.add_step("add gas_spring", "to see", study.model().with_effect("gas_spring"))
    assert main(["undo", rig, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["undone"]["what"] == "add gas_spring"
    assert answer["now"]["number"] == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["study", "new", "rig", "--data", "nothing/*.csv"], "no file matches"),
        (["study", "new", "rig", "--data", __file__, "--law", "lugree"], '--law "lugree"'),
        (["study", "new", "rig", "--data", __file__, "--channel", "force"], "CHANNEL=COLUMN@UNIT"),
        (["study", "check", "nowhere"], "no study"),
        (["undo", "nowhere"], "no study"),
    ],
)
def test_wrong_commands_exit_2_and_leave_nothing(
    arguments: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_errors_end_the_check_with_2_and_advice_names_the_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t = np.arange(400) / 500.0
    columns = {"t [s]": t, "x [mm]": 0.01 * np.sin(3.0 * t), "F [N]": 5.0 * np.cos(3.0 * t)}
    rig = tmp_path / "my lab" / "rig"
    create_study(rig, [write(tmp_path / "run.csv", columns)])
    for more in ([], ["--json"]):
        assert main(["study", "check", str(rig), *more]) == 2
    assert f"bristle study channels '{rig}' --channel 'displacement=x [mm]@m'" in " ".join(
        capsys.readouterr().out.split()
    )


def test_a_study_that_is_not_there_is_made_where_it_was_looked_for(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=f"study new {tmp_path}/lab/nothing --data"):
        Study(tmp_path / "lab" / "nothing")


def test_a_channel_without_a_number_can_be_left_out_of_a_new_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = write_runs(tmp_path / "lab", count=3, seconds=2.0)
    columns = bench_run(2, 2.0)
    columns["U [V]"] = np.full_like(columns["U [V]"], np.nan)
    write(files[1], columns)
    new = ["study", "new", str(tmp_path / "rig"), "--data", *map(str, files)]
    assert main(new) == 2
    told = capsys.readouterr().err
    assert "voltage has no number" in told
    assert "--without voltage" in told
    assert main([*new, "--without", "voltage"]) == 0
    settings = Study(tmp_path / "rig").settings
    assert "voltage" not in settings.channels
    assert not settings.extra
    assert "Not used: U [V]" in " ".join(capsys.readouterr().out.split())
    assert main(["study", "new", str(tmp_path / "a"), *new[3:], "--without", "current"]) == 2
    assert "--without current: no column was taken for it" in capsys.readouterr().err


def test_files_of_several_rates_are_told_with_their_range(tmp_path: Path) -> None:
    files = write_runs(tmp_path / "lab", count=3, seconds=2.0)
    columns = bench_run(2, 8.0)
    columns["time [s]"] = columns["time [s]"] / 4.0
    write(files[1], columns)
    notes = create_study(tmp_path / "rig", files).notes
    (note,) = [one for one in notes if "decimated" in one]
    assert note.startswith("the files hold 500 to 2000 samples per second: the faster ones are")

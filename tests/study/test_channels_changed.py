"""`bristle study channels`: a study read in another way equals the one made so at the start."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write

from bristle.cli import main
from bristle.data.corrections import Correction
from bristle.errors import BristleError, StudyError
from bristle.study import Study, create_study, read_again
from bristle.study.extend import extend_study
from bristle.study.history import history_steps
from bristle.study.new import parse_channel
from bristle.study.read_again import correct_channels

RIGHT = ("force=-F [N]@kN",)
"""The title says N, and means kN; the sensor pulls where the damper pushes."""


def wrong_run(seed: int) -> dict[str, np.ndarray]:
    """Return a run whose force is in kN with the opposite sign, under a title that says N."""
    columns = bench_run(seed, seconds=2.0)
    columns["F [N]"] = -1e-3 * columns["F [N]"]
    columns["load 2 [kN]"] = columns["F [N]"] + np.random.default_rng(seed).normal(
        0.0, 1e-4, len(columns["F [N]"])
    )
    return columns


def made_at(folder: Path, *channels: str) -> Study:
    given = dict(map(parse_channel, channels))
    files = sorted((folder / "lab").glob("*.csv"))
    return create_study(folder / "home" / "rig", files, law="bingham", channels=given).study


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the folders of a study as it is guessed and of one made with the right channels."""
    folders = tmp_path_factory.mktemp("guessed"), tmp_path_factory.mktemp("right")
    for folder in folders:
        for seed in (1, 2, 3):
            write(folder / "lab" / f"run_{seed}.csv", wrong_run(seed))
    return made_at(folders[0], "force=F [N]@N").folder, made_at(folders[1], *RIGHT).folder


@pytest.fixture
def rig(both: tuple[Path, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(both[0], tmp_path / "rig"))


@pytest.fixture(scope="module")
def results(both: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Path(shutil.copytree(both[0], tmp_path_factory.mktemp("results") / "rig"))
    return identified(folder).folder


@pytest.fixture
def found(results: Path, tmp_path: Path) -> Path:
    """Return the folder of a study with results."""
    return Path(shutil.copytree(results, tmp_path / "found"))


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def given(*texts: str) -> dict[str, object]:
    return dict(map(parse_channel, texts))


def identified(folder: Path) -> Study:
    """Return the study with results, as if fit, diagnosis and learning had been."""
    study, model = Study(folder), Study(folder).model()
    model = model.with_values({"c_0": 3.0}, {"c_0": 0.1})
    study.add_step("identify bingham", "by hand", model, {}, {"z_holdout": 9.0})
    study.write_verdict({"schema": 2, "kind": "none", "effects": []})
    study.add_step("add gas_spring", "by hand", model.with_effect("gas_spring"))
    study.undo()
    study.write_report("identify.json", '{"step": 1}')
    return study


def test_the_study_equals_the_one_made_with_the_right_channels(
    both: tuple[Path, Path], rig: Path
) -> None:
    now = Study(rig).with_channels({"force": "-F [N]@kN"})
    right = Study(both[1])
    assert content(rig) == content(right.folder)
    for one, other in zip(now.read(), right.read(), strict=True):
        assert one.digest() == other.digest()
        assert one.noise == other.noise
    run = now.read()[0]
    truth = bench_run(1, seconds=2.0)["F [N]"]
    np.testing.assert_allclose(run["force"], truth, atol=1e-6 * np.abs(truth).max())


def test_the_model_begins_anew_and_what_was_found_stays_in_the_history(
    both: tuple[Path, Path], found: Path
) -> None:
    before = content(found)
    done = correct_channels(Study(found), given(*RIGHT))  # type: ignore[arg-type]
    assert [one.what for one in done.of_before] == ["identify bingham"]
    now, after = Study(found), content(found)
    assert [step.what for step in now.steps()] == ["begin anew: force"]
    assert now.verdict() is None
    assert now.runs().notes == ()
    assert after["model.toml"] == before["history/000/model.toml"]
    assert after["history/001/verdict.json"] == before["verdict.json"]
    assert after["history/001/identify.json"] == before["reports/identify.json"]
    assert after["history/001/model.toml"] == before["model.toml"]
    assert now.settings == Study(both[1]).settings
    assert [one.what for one in history_steps(now.steps())] == ["begin anew: force"]
    assert correct_channels(now, given("force=-F@N")).step is None  # type: ignore[arg-type]


def test_a_first_model_that_was_set_by_hand_stays(rig: Path) -> None:
    file = rig / "model.toml"
    file.write_text(file.read_text().replace("free = true", "free = false", 1))
    edited = file.read_bytes()
    identified(rig).with_channels({"force": "-F@kN"})
    assert file.read_bytes() == edited
    assert Study(rig).history.step(1).what == "edited by hand"


def test_runs_that_were_added_are_runs_like_the_others(found: Path, tmp_path: Path) -> None:
    more = write(tmp_path / "day_2.csv", wrong_run(7))
    study = extend_study(Study(found), [more]).study.with_channels({"force": "-F@kN"})
    assert study.runs().notes == ()
    study.add_step("identify bingham", "by hand", study.model())
    assert study.runs().notes == ()


def test_a_column_that_changes_its_place_leaves_or_joins_the_extra_channels(rig: Path) -> None:
    assert {*Study(rig).settings.extra} == {"load_2"}
    done = correct_channels(Study(rig), given("force=load 2"))  # type: ignore[arg-type]
    now = Study(rig).settings
    assert (now.channels["force"].unit, {*now.extra}) == ("kN", {"f"})
    assert now.extra["f"].column == "F [N]"
    assert len(done.notes) == 2
    back = Study(rig).with_channels({"force": "F [N]"}).settings
    assert {*back.extra} == {"load_2"}


def test_a_given_noise_stays_with_its_column_and_corrections_go(rig: Path) -> None:
    file = rig / "study.toml"
    text = file.read_text().replace('unit = "N"', 'unit = "N" # load cell\nnoise = 0.02')
    file.write_text("# of the lab\n" + text)
    Study(rig).with_corrections({"run_1": [Correction("force", "bias", 2.0)]})
    done = correct_channels(Study(rig), given("force=F@kN"))  # type: ignore[arg-type]
    now = Study(rig).settings
    assert now.channels["force"].noise == 0.02
    assert not any(run.corrections for run in now.runs)
    assert "noise of force is 0.02 kN now" in done.notes
    assert any("data/run_1.csv is no longer corrected" in note for note in done.notes)
    assert file.read_text().startswith("# of the lab\n")
    other = correct_channels(Study(rig), given("force=load 2@kN"))  # type: ignore[arg-type]
    assert Study(rig).settings.channels["force"].noise is None
    assert any("it is estimated" in note for note in other.notes)


def test_a_channel_may_be_left_out_and_a_time_be_a_step(rig: Path) -> None:
    now = Study(rig).with_channels({}, without=["velocity"])
    assert "velocity" not in now.settings.channels
    assert main(["study", "channels", str(rig), "--step", "0.002"]) == 0
    assert Study(rig).settings.channels["time"].step == 0.002
    assert Study(rig).read()[0].step == pytest.approx(0.002)


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (["--channel", "force=G@N"], 'no column is called "G"'),
        (["--channel", "force=F@V"], "no unit of this quantity; N"),
        (["--channel", "force=F@stone"], "stone"),
        (["--channel", "force=v [mm/s]"], "no unit of this quantity"),
        (["--channel", "velocity=x@mm/s"], "both claim the column"),
        (["--channel", "push=F@N"], 'there is no channel "push"'),
        (["--channel", "brace_force=F@N"], "no building has devices"),
        (["--channel", "displacement=step@mm"], "no column is called"),
        (["--without", "acceleration"], "this channel is not read"),
        (["--without", "force"], "the study needs force"),
        (["--without", "time"], "the study needs time"),
        (["--without", "force", "--channel", "force=F@kN"], "both given and left out"),
        (["--step", "-1"], "above 0"),
    ],
)
def test_what_is_wrong_is_refused_in_one_message_and_nothing_changes(
    found: Path, order: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(found)
    assert main(["study", "channels", str(found), *order]) == 2
    assert words in capsys.readouterr().err
    assert content(found) == before


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("load 2 [kN]", "load 2 [N]", "load 2"), ("load 2 [kN]", "other [kN]", "no column")],
)
def test_every_run_is_read_before_anything_is_written(
    rig: Path, old: str, new: str, words: str
) -> None:
    run = rig / "data" / "run_3.csv"
    run.write_text(run.read_text().replace(old, new))
    before = content(rig)
    with pytest.raises(BristleError, match=words):
        Study(rig).with_channels({"force": "load 2@kN"})
    assert content(rig) == before


def test_a_command_of_a_run_is_no_channel_as_well(rig: Path) -> None:
    Study(rig).with_channels({}, without=["voltage"])
    file = rig / "study.toml"
    file.write_text(file.read_text().replace("role = ", "voltage = 1.0\nrole = "))
    with pytest.raises(StudyError, match="has a level of it"):
        Study(rig).with_channels({"voltage": "U@V"})


def killed(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("at", ["_refuse_unreadable", "_refuse_other", "read_runs"])
def test_a_command_that_is_stopped_while_it_reads_changes_nothing(
    found: Path, at: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, before = Study(found), content(found)
    with monkeypatch.context() as patch:
        patch.setattr(read_again, at, killed)
        with pytest.raises(KeyboardInterrupt):
            correct_channels(study, given(*RIGHT))  # type: ignore[arg-type]
    assert content(found) == before


def test_a_result_of_the_old_channels_is_not_written(rig: Path) -> None:
    fitting, verdict = Study(rig), {"schema": 2, "kind": "none", "effects": []}
    Study(rig).with_channels({"force": "-F@kN"})
    before = content(rig)
    with pytest.raises(StudyError, match="channels have been corrected meanwhile"):
        fitting.add_step("identify bingham", "by hand", fitting.model())
    with pytest.raises(StudyError, match="channels have been corrected meanwhile"):
        fitting.write_verdict(verdict)
    assert content(rig) == before


def test_the_command_says_what_it_changes_and_what_no_longer_counts(
    found: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(found)
    order = ["study", "channels", str(found), "--channel", RIGHT[0]]
    assert main([*order, "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert '"F [N]" in N -> "F [N]" in kN, sign turned' in said
    assert "The model would begin anew; of the channels as they were: identify bingham." in said
    assert content(found) == before
    assert main([*order, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["changes"][0]["after"]["unit"] == "kN"
    assert (told["of_before"], told["step"]) == (["identify bingham"], 2)
    after = content(found)
    assert main(order) == 0
    assert "are so already" in capsys.readouterr().out
    assert content(found) == after
    assert main(["study", "channels", str(found)]) == 0
    assert 'force                        "F [N]" in kN, sign turned' in capsys.readouterr().out
    assert main(["study", "channels", str(found), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["force"]["sign"] == -1


@pytest.mark.parametrize("sign", ["", "-"])
def test_a_displacement_far_from_its_zero_is_counted_from_its_middle(tmp_path, capsys, sign):
    apart = {"near": 0.0, "far": -110.0}
    for name, offset in apart.items():
        for seed in (1, 2):
            columns = bench_run(seed, seconds=2.0)
            columns["x [mm]"] = columns["x [mm]"] + offset
            write(tmp_path / name / f"run_{seed}.csv", columns)
    given = ["--channel", f"displacement={sign}x [mm]", "--law", "bingham"]
    middles = {}
    for name in apart:
        made = ["study", "new", str(tmp_path / f"{name}_rig"), *given]
        assert main([*made, "--data", str(tmp_path / name / "*.csv")]) == 0
        said = "is counted from the middle of its range, -" in capsys.readouterr().out
        assert said is (name == "far")
        runs = Study(tmp_path / f"{name}_rig").runs().all
        middles[name] = np.array([np.mean(run["displacement"]) for run in runs])
    assert np.abs(middles["far"]).max() < 2e-3
    assert np.ptp(middles["far"] - middles["near"]) < 1e-6

"""A study's folder: made, changed by steps, undone, shared by processes, killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made import bench_run, write, write_runs

from bristle.cli import main
from bristle.errors import RecordError
from bristle.study import Study, StudyError, create_study, new_model
from bristle.study.history import History
from bristle.study.new import parse_channel


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return create_study(tmp_path / "rig", write_runs(tmp_path / "lab", 3, seconds=2.0)).study


def test_new_study_holds_data_model_and_first_step(study: Study) -> None:
    assert [run.file for run in study.settings.runs] == [f"data/run_{k}.csv" for k in (1, 2, 3)]
    assert [run.role for run in study.settings.runs] == ["train", "holdout", "train"]
    assert {path.name for path in study.folder.iterdir()} >= {
        "study.toml",
        "model.toml",
        "data",
        "effects",
        "history",
        "reports",
    }
    assert [step.number for step in study.steps()] == [0]
    assert study.model() == new_model("lugre")
    runs = study.runs()
    assert [run.name for run in runs.train] == ["run_1", "run_3"]
    assert [run.name for run in runs.holdout] == ["run_2"]
    assert set(runs.train[0].channels) == {"displacement", "velocity", "force", "voltage"}


def test_roles_follow_names(tmp_path: Path) -> None:
    for k, name in enumerate(("train_1", "train_2", "test_1")):
        write(tmp_path / f"{name}.csv", bench_run(k, 2.0))
    created = create_study(tmp_path / "rig", sorted(tmp_path.glob("*.csv")))
    assert {run.file: run.role for run in created.study.settings.runs} == {
        "data/test_1.csv": "holdout",
        "data/train_1.csv": "train",
        "data/train_2.csv": "train",
    }


def test_single_run_is_split_and_said_to_be_weaker(tmp_path: Path) -> None:
    (file,) = write_runs(tmp_path, 1, seconds=2.0)
    created = create_study(tmp_path / "rig", [file])
    runs = created.study.runs()
    assert len(runs.train[0].time) == 700
    assert len(runs.holdout[0].time) == 315  # led into by 15 that are not judged
    assert runs.holdout[0].time[15] > runs.train[0].time[-1]
    assert "weaker" in runs.notes[0]
    assert any("one run" in note for note in created.notes)


def test_steps_and_undo(study: Study) -> None:
    first = study.model()
    second = first.with_effect("gas_spring").with_values({"gas_spring.k": 81.2})
    step = study.add_step(
        "add gas_spring", "residual follows x", second, {"holdout": 1.4}, {"holdout": 1.0}
    )
    assert step.number == 1
    study.write_verdict({"schema": 2, "kind": "none"})
    third = second.with_effect("stribeck")
    study.add_step("add stribeck", "to see", third)
    assert study.verdict() is None
    again = Study(study.folder)
    assert again.model() == third
    assert again.undo().what == "add stribeck"
    assert again.model() == second
    verdict = again.verdict()
    assert verdict is not None
    assert (verdict["schema"], verdict["kind"]) == (2, "none")
    assert again.steps()[1].before == {"holdout": 1.4}
    again.undo()
    assert again.model() == first
    with pytest.raises(StudyError, match="nothing to undo"):
        again.undo()
    assert (study.folder / "history" / "undone" / "002" / "model.toml").is_file()


def test_each_step_that_is_undone_is_kept(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    model = study.model().with_effect("gas_spring")
    for name, what in (("001", "first"), ("001_2", "second"), ("001_3", "third")):
        study = Study(study.folder)
        study.add_step(what, "to see", model)
        assert main(["undo", str(study.folder)]) == 0
        kept = study.folder / "history" / "undone" / name
        assert f"({kept})" in capsys.readouterr().out
    undone = study.folder / "history" / "undone"
    files = sorted(undone.glob("*/step.json"))
    whats = [json.loads(file.read_text())["what"] for file in files]
    assert whats == ["first", "second", "third"]


def test_hand_edits_are_steps_that_undo_brings_back(study: Study) -> None:
    path = study.folder / "model.toml"
    path.write_text(path.read_text().replace("value = 650.0", "value = 700.0"), encoding="utf-8")
    edited = Study(study.folder)
    assert edited.model().values["sigma_a"] == 700.0
    edited.add_step("add gas_spring", "to see", edited.model().with_effect("gas_spring"))
    assert [step.what for step in edited.steps()][1:] == ["edited by hand", "add gas_spring"]
    edited.undo()
    assert edited.model().values["sigma_a"] == 700.0
    edited.undo()
    assert edited.model().values["sigma_a"] == 650.0


def test_a_verdict_is_on_the_model_that_was_edited(study: Study) -> None:
    study.write_verdict({"schema": 2, "kind": "none", "effects": []})
    path = study.folder / "model.toml"
    path.write_text(path.read_text() + "# of the lab\n")
    note = (Study(study.folder).verdict() or {})["notes"][0]
    assert note.startswith("model.toml has been edited since this verdict. Diagnose again:")
    study = Study(study.folder)
    study.model()
    study.write_verdict({"schema": 2, "kind": "unknown", "effects": []})
    assert [step.what for step in study.steps()] == ["begin with lugre", "edited by hand"]
    assert "notes" not in (study.verdict() or {})
    study.undo()
    assert (study.verdict() or {})["kind"] == "none"


def test_change_by_another_process_is_not_overwritten(study: Study) -> None:
    other = Study(study.folder)
    other.add_step("add gas_spring", "first", other.model().with_effect("gas_spring"))
    with pytest.raises(StudyError, match="changed meanwhile"):
        study.add_step("add stribeck", "too late", new_model("lugre", ("stribeck",)))
    with pytest.raises(StudyError, match="changed meanwhile"):
        study.write_verdict({"schema": 2})
    study.model()
    study.write_verdict({"schema": 2})


def test_process_that_writes_is_waited_for(study: Study) -> None:
    code = (
        "import sys, time\nfrom bristle.study import Study\n"
        "with Study(sys.argv[1]).writing():\n    print('in', flush=True)\n    time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(study.folder)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "in\n"
        with pytest.raises(StudyError, match="another process"), study.writing(patience=0.2):
            pass
        assert study.model() == new_model("lugre")  # reading needs no lock
    finally:
        process.kill()
        process.communicate()
    study.write_report("a.txt", "free again")


def test_two_processes_add_steps_without_losing_any(study: Study) -> None:
    code = (
        "import sys\nfrom bristle.study import Study, StudyError\ndone = 0\n"
        "while done < 5:\n    s = Study(sys.argv[1])\n    m = s.model()\n"
        "    try:\n        s.add_step(f'{sys.argv[2]} {done}', 'test', m)\n        done += 1\n"
        "    except StudyError as e:\n        assert 'meanwhile' in str(e), e\n"
    )
    processes = [
        subprocess.Popen([sys.executable, "-c", code, str(study.folder), name]) for name in "ab"
    ]
    assert [process.wait(timeout=120) for process in processes] == [0, 0]
    whats = sorted(step.what for step in study.steps()[1:])
    assert whats == sorted(f"{name} {k}" for name in "ab" for k in range(5))


def test_killed_process_leaves_a_readable_study(study: Study) -> None:
    code = (
        "import sys\nfrom bristle.study import Study\ns = Study(sys.argv[1])\n"
        "print('in', flush=True)\n"
        "while True:\n    s.add_step('step', 'x' * 20000, s.model())\n    s.undo()\n"
    )
    for k in range(2):
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(study.folder)], stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(0.05 + 0.023 * k)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        again = Study(study.folder)
        last = again.steps()[-1]
        assert again.model() == new_model("lugre")
        assert not (study.folder / "history" / ".pending").exists()
        assert (study.folder / "model.toml").read_bytes() == (
            again.history.model_file(last.number).read_bytes()
        )


@pytest.mark.parametrize("what", ["add", "undo"])
def test_change_cut_short_is_completed(
    study: Study, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = study.model().with_effect("gas_spring")
    if what == "undo":
        study.add_step("add gas_spring", "why", model)
    recover = History.recover

    def killed(self: History) -> None:
        if self.pending.is_file():
            raise KeyboardInterrupt
        recover(self)

    monkeypatch.setattr(History, "recover", killed)
    with pytest.raises(KeyboardInterrupt):
        study.add_step("add gas_spring", "why", model) if what == "add" else study.undo()
    monkeypatch.undo()
    again = Study(study.folder)
    assert ("gas_spring" in again.model().effects) == (what == "add")
    assert len(again.steps()) == (2 if what == "add" else 1)


def test_no_study_and_damaged_step(tmp_path: Path, study: Study) -> None:
    with pytest.raises(StudyError, match=r"no study.*bristle study new"):
        Study(tmp_path / "nowhere")
    (study.folder / "history" / "000" / "step.json").write_text("{}", encoding="utf-8")
    with pytest.raises(StudyError, match="no step of a study"):
        study.steps()


def test_bad_beginnings_leave_nothing_behind(tmp_path: Path) -> None:
    files = write_runs(tmp_path / "lab", 2, seconds=2.0)
    before = sorted(tmp_path.rglob("*"))
    same = write(tmp_path / "lab" / "run_1b.csv", bench_run(1, 2.0))
    bare = bench_run(5, 2.0)
    bare["Kraft"] = bare.pop("F [N]")
    no_unit = write(tmp_path / "lab" / "no_unit.csv", bare)
    still = write(
        tmp_path / "lab" / "other.csv", {"t [s]": bare["time [s]"], "T [degC]": bare["Kraft"]}
    )
    with pytest.raises(StudyError, match=r"same measurement.*nothing can be held out"):
        create_study(tmp_path / "rig", [files[0], same])
    with pytest.raises(
        StudyError, match='unit of "Kraft" is not given: --channel "force=Kraft@UNIT"'
    ):
        create_study(tmp_path / "rig", [no_unit])
    left = r"no column can be a displacement(.|\n)*no other column of numbers is left"
    with pytest.raises(StudyError, match=left):
        create_study(tmp_path / "rig", [still])
    with pytest.raises(StudyError, match=r'no_unit.csv: there is no column "F \[N\]"'):
        create_study(tmp_path / "rig", [files[0], no_unit])
    with pytest.raises(StudyError, match="there already"):
        create_study(tmp_path / "lab", files)
    with pytest.raises(RecordError, match="no such file"):
        create_study(tmp_path / "rig", [tmp_path / "nothing.csv"])
    for file in (same, no_unit, still):
        file.unlink()
    assert sorted(tmp_path.rglob("*")) == before


def test_channels_can_be_given(tmp_path: Path) -> None:
    data = bench_run(1, 2.0)
    data["Ch7"] = -1e-3 * data.pop("F [N]")
    file = write(tmp_path / "run.csv", data)
    channels = dict([parse_channel("force=-Ch7@kN")])
    study = create_study(tmp_path / "rig", [file], channels=channels).study
    assert study.settings.channels["force"].sign == -1
    (run,) = study.read()
    assert abs(run["force"]).max() == pytest.approx(1e3 * abs(data["Ch7"]).max())


@pytest.mark.parametrize("text", ["force", "forse=F@N", "force=F@Newt", "=F@N"])
def test_given_channels_that_cannot_be_read(text: str) -> None:
    with pytest.raises(StudyError, match="--channel"):
        parse_channel(text)


def test_held_out_twin_of_a_training_run_is_refused(study: Study) -> None:
    data = study.folder / "data"
    (data / "run_2.csv").write_bytes((data / "run_1.csv").read_bytes())
    with pytest.raises(StudyError, match="the same measurement as run_1"):
        study.runs()


def test_no_run_held_out_is_refused(study: Study) -> None:
    path = study.folder / "study.toml"
    path.write_text(path.read_text().replace('"holdout"', '"train"'), encoding="utf-8")
    with pytest.raises(StudyError, match='no run has role = "holdout"'):
        Study(study.folder).runs()


def test_structure_takes_its_building_along(tmp_path: Path) -> None:
    import numpy as np

    run = bench_run(1, 2.0)
    t, x = run["time [s]"], run["x [mm]"]
    data = {"t [s]": t, "ground_acc [g]": np.sin(t), "disp1 [mm]": x, "disp2 [mm]": 2.0 * x}
    file = write(tmp_path / "run.csv", data)
    building = tmp_path / "house.toml"
    building.write_text(
        'schema = 1\nname = "house"\nmasses = [2.0, 1.0]\nstiffnesses = [100.0, 900.0]\n'
        'base = "isolated"\ndamping_ratio = 0.01\n',
        encoding="utf-8",
    )
    study = create_study(tmp_path / "rig", [file], rig="structure", building=building).study
    assert study.model().building == "house.toml"
    assert (study.folder / "house.toml").is_file()
    assert set(study.settings.channels) == {
        "time",
        "ground_acceleration",
        "base_displacement",
        "floor1_displacement",
    }
    with pytest.raises(StudyError, match="--building goes with"):
        create_study(tmp_path / "other", [file], building=building)

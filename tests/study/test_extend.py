"""Runs are added to a study as its others are read; where anything is wrong it stays as it was."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from made import bench_run, write, write_runs

from bristle.cli import main
from bristle.errors import BristleError, StudyError
from bristle.study.extend import extend_study
from bristle.study.history import EARLIER, Step
from bristle.study.run_facts import RunChoices
from bristle.study.steps import create_study
from bristle.study.study import FILE, Study, additions, behind_data, unknown_to_model

SECONDS = 2.0


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("extend")
    files = write_runs(folder / "lab", 2, seconds=SECONDS)
    create_study(folder / "my_rig", files, law="bingham")
    return folder / "my_rig"


@pytest.fixture
def rig(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "my_rig"))


def new_run(folder: Path, name: str = "day_2", seed: int = 7) -> Path:
    return write(folder / f"{name}.csv", bench_run(seed, SECONDS))


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def identified(rig: Path) -> Study:
    """Return the study with a second model, as if a fit had found it, and a verdict on it."""
    study = Study(rig)
    study.add_step("identify bingham", "by hand", study.model())
    study.write_verdict({"schema": 2, "kind": "none", "effects": []})
    return study


def test_a_run_is_added_and_all_else_stays(rig: Path, tmp_path: Path) -> None:
    before = content(rig)
    path = rig / "study.toml"
    path.write_text(path.read_text().replace("[channels.force]", "# of the lab\n[channels.force]"))
    extended = extend_study(Study(rig), [new_run(tmp_path)])
    assert [(run.file, run.role) for run in extended.runs] == [("data/day_2.csv", "train")]
    assert extended.notes == ("day_2.csv is for training; --holdout 'day_2.csv' holds it out",)
    after = content(rig)
    assert {*after} - {*before} == {"data/day_2.csv", FILE}
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"study.toml"}
    assert "# of the lab" in path.read_text()
    runs = extended.study.runs()
    assert [run.name for run in runs.train] == ["run_1", "day_2"]
    assert runs.notes == ()  # the model was not identified yet


def test_roles_follow_what_is_given_then_names_then_the_count(rig: Path, tmp_path: Path) -> None:
    def roles(names: list[str], **choices: object) -> list[str]:
        folder = Path(shutil.copytree(rig, tmp_path / f"rig_{len(list(tmp_path.iterdir()))}"))
        files = [new_run(folder / "new", name, seed) for seed, name in enumerate(names, 20)]
        found = extend_study(Study(folder), files, **choices)  # type: ignore[arg-type]
        return [run.role for run in found.runs]

    assert roles(["a", "b", "c"]) == ["train", "holdout", "train"]
    assert roles(["a", "b_valid"]) == ["train", "holdout"]
    assert roles(["b_valid"]) == ["holdout"]
    assert roles(["a", "b"], holdout=["a*"]) == ["holdout", "train"]
    assert roles(["a", "b"], roles={"a.csv": "holdout", "b.csv": "train"}) == ["holdout", "train"]
    table = tmp_path / "table.csv"
    table.write_text("file,role\na.csv,test\nb.csv,exclude\n")
    assert roles(["a", "b"], choices=RunChoices(table=table)) == ["test", "exclude"]


def test_the_next_command_says_that_the_model_does_not_know_them(rig: Path, tmp_path: Path) -> None:
    study = identified(rig)
    extended = extend_study(study, [new_run(tmp_path)])
    (text,) = extended.study.runs().notes
    assert text.startswith("1 run was added after the present model was identified: day_2.")
    assert "bristle identify" in text
    assert extended.study.verdict() is None
    kept = json.loads((rig / "history" / "001" / EARLIER).read_text())
    assert kept["kind"] == "none"
    (addition,) = additions(extended.study)
    assert (addition.step, addition.files) == (1, ("data/day_2.csv",))
    extended.study.add_step("identify bingham", "by hand", extended.study.model())
    assert unknown_to_model(extended.study) == []
    assert extended.study.runs().notes == ()
    extended.study.undo()
    assert behind_data(extended.study) == text
    assert isinstance(extended.study.steps()[0], Step)


def test_a_step_with_the_number_of_an_undone_one_knows_the_runs(rig: Path, tmp_path: Path) -> None:
    study = identified(rig)
    study.add_step("add stribeck", "by hand", study.model().with_effect("stribeck"))
    study = extend_study(study, [new_run(tmp_path)]).study
    study.undo()
    assert unknown_to_model(study) == ["data/day_2.csv"]
    study.add_step("identify bingham", "on all runs", study.model())
    assert study.history.numbers() == [0, 1, 2]
    assert behind_data(study) == ""


def test_a_run_that_was_taken_out_again_is_not_told(rig: Path, tmp_path: Path) -> None:
    extended = extend_study(identified(rig), [new_run(tmp_path)])
    study = extended.study.with_roles({"day_2": "exclude"})
    assert behind_data(study) == ""


def _other_unit(path: Path) -> None:
    path.write_text(path.read_text().replace("F [N]", "F [kN]"))


def _no_force(path: Path) -> None:
    path.write_text(path.read_text().replace("F [N]", "weight [N]"))


def _text(path: Path) -> None:
    path.write_text("no table\n")


def _back_in_time(path: Path) -> None:
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:40], lines[10], *lines[40:]]) + "\n")


def _known(path: Path) -> None:
    write(path, bench_run(1, SECONDS))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (_other_unit, r'"F \[N\]" \(force\)'),
        (_no_force, r'no column "F \[N\]" \(force\)'),
        (_text, "day_3"),
        (_back_in_time, "day_3"),
        (_known, "same measurement as run_1"),
        (lambda path: path.unlink(), "no such file"),
    ],
)
def test_the_study_stays_as_it_was(
    rig: Path, tmp_path: Path, spoil: Callable[[Path], None], words: str
) -> None:
    study, before = identified(rig), content(rig)
    files = [new_run(tmp_path), new_run(tmp_path, "day_3", 8)]
    spoil(files[1])
    with pytest.raises(BristleError, match=words):
        extend_study(study, files)
    assert content(rig) == {**before, **{k: v for k, v in content(rig).items() if k in before}}
    assert {*content(rig)} == {*before}
    assert content(rig)["study.toml"] == before["study.toml"]


def test_names_that_are_taken_are_refused(rig: Path, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"run_1\.csv is there already"):
        extend_study(Study(rig), [new_run(tmp_path, "run_1")])
    twice = [new_run(tmp_path / "a"), new_run(tmp_path / "b", seed=8)]
    with pytest.raises(StudyError, match=r"2 files are called day_2\.csv"):
        extend_study(Study(rig), twice)
    with pytest.raises(StudyError, match="no measurements"):
        extend_study(Study(rig), [])


def test_a_study_of_one_run_needs_one_held_out(tmp_path: Path) -> None:
    (file,) = write_runs(tmp_path / "lab", 1, seconds=SECONDS)
    study = create_study(tmp_path / "one", [file], law="bingham").study
    more = new_run(tmp_path)
    with pytest.raises(StudyError, match="no run of the study would be held out"):
        extend_study(study, [more])
    assert len(extend_study(study, [more], holdout=["day_2.csv"]).study.runs().holdout) == 1


def test_a_level_in_the_name_of_a_file_is_that_of_the_new_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def held(name: str, seed: int) -> Path:
        columns = bench_run(seed, SECONDS)
        del columns["U [V]"]
        return write(tmp_path / f"{name}.csv", columns)

    files = [held("a_I1A", 1), held("b_I2A", 2)]
    study = create_study(tmp_path / "held", files, law="bingham").study
    more = held("c_I1p5A", 3)
    assert main(["study", "extend", str(study.folder), str(more)]) == 0
    assert Study(study.folder).settings.runs[2].levels == {"current": 1.5}
    capsys.readouterr()
    unknown = held("day_3", 4)
    before = content(study.folder)
    assert main(["study", "extend", str(study.folder), str(unknown)]) == 2
    assert "no current, which other runs have" in capsys.readouterr().err
    assert content(study.folder) == before
    table = tmp_path / "log.csv"
    table.write_text("file,current [A],role\nday_3.csv,0.5,holdout\n")
    assert main(["study", "extend", str(study.folder), str(unknown), "--runs", str(table)]) == 0
    added = Study(study.folder).settings.runs[3]
    assert (added.levels, added.role) == ({"current": 0.5}, "holdout")


def test_a_full_disk_leaves_the_study_as_it_was(
    rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, study = content(rig), Study(rig)

    def full(path: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device", str(path))

    more = new_run(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("bristle.study.extend.note_addition", lambda *_: full(rig, rig))
        with pytest.raises(StudyError, match="No space left"):
            extend_study(study, [more])
    assert content(rig) == before


def test_a_damaged_list_of_additions_is_told(rig: Path, tmp_path: Path) -> None:
    study = extend_study(identified(rig), [new_run(tmp_path)]).study
    (rig / FILE).write_text('{"schema": 1, "additions": [{"date": 3}]}')
    with pytest.raises(StudyError, match="is damaged"):
        study.runs()
    (rig / FILE).write_text('{"schema": 9}')
    with pytest.raises(StudyError, match="another version"):
        additions(study)


def test_the_command_adds_runs(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    identified(rig)
    new_run(tmp_path / "day", "a"), new_run(tmp_path / "day", "b", 8)
    assert main(["study", "extend", str(rig), str(tmp_path / "day"), "--holdout", "b*"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].endswith("my_rig: 2 runs added.")
    assert said[1].split() == ["data/a.csv", "train"]
    assert said[2].split() == ["data/b.csv", "holdout"]
    assert said[-1].startswith("Next:  bristle identify")
    assert main(["study", "extend", str(rig), "nothing_*.csv"]) == 2
    assert '"nothing_*.csv": no file matches' in capsys.readouterr().err
    assert main(["study", "extend", str(rig), str(tmp_path / "day" / "a.csv"), "--json"]) == 2
    new_run(tmp_path, "c", 9)
    capsys.readouterr()
    assert main(["study", "extend", str(rig), str(tmp_path / "c.csv"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["plan"] is None
    assert [run["file"] for run in answer["added"]] == ["data/c.csv"]

"""The commands that a report prints are run: they make the study again."""

from __future__ import annotations

import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from made import bench_run, write

from bristle.cli import build_parser, main
from bristle.model.model import new_model
from bristle.model.model_file import read_model
from bristle.report.study_page import AGAIN, commands
from bristle.study import Study, create_study


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """Return a study with spaces in its name, a history, and choices that nobody would guess."""
    files = []
    for k in (1, 2, 3):
        columns = bench_run(k, 2.0)
        columns["Ch 3"] = -columns.pop("F [N]")
        files.append(write(tmp_path / "the lab" / f"run {k}.csv", columns))
    monkeypatch.chdir(tmp_path)
    new = ["study", "new", "my rig", "--law", "bingham", "--data", *map(str, files)]
    assert main([*new, "--channel", "force=-Ch 3@N"]) == 0
    study = Study("my rig")
    settings = study.folder / "study.toml"
    settings.write_text(settings.read_text().replace("cut_off = 18.0", "cut_off = 25.0"))
    study = Study("my rig")
    model = study.model().with_effect("stribeck").with_effect("gas_spring")
    study.add_step("add stribeck, gas_spring", "to see", model)
    file = study.folder / "model.toml"
    file.write_text(file.read_text().replace('origin = "assumed"', 'origin = "measured"', 1))
    with study.writing():
        study.history.keep_edit()
    return Study("my rig")


def run(line: str) -> int:
    words = shlex.split(line)
    if words[0] == "cp":
        shutil.copyfile(words[1], words[2])
        return 0
    assert words[0] == "bristle"
    return main(words[1:])


def test_the_commands_make_the_same_study(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    lines = commands(study)
    assert [" ".join(shlex.split(line)[:3]) for line in lines[2:]] == [
        "bristle study check", f"bristle add my rig{AGAIN}", "cp my rig/history/002/model.toml "
        f"my rig{AGAIN}/model.toml", f"bristle compare my rig{AGAIN}",
        f"bristle diagnose my rig{AGAIN}", f"bristle report my rig{AGAIN}",
    ]  # fmt: skip
    for line in lines:
        if line.startswith("bristle"):
            build_parser().parse_args(shlex.split(line)[1:])
        if shlex.split(line)[1] in ("study", "report") or line.startswith("cp"):
            assert run(line) == 0, capsys.readouterr().err
    again = Study(study.folder.with_name(f"my rig{AGAIN}"))
    assert again.settings == study.settings
    assert [r.digest() for r in again.read()] == [r.digest() for r in study.read()]
    assert again.model() == study.model()
    first = again.history.model_file(0)
    assert read_model(first, again.folder) == read_model(study.history.model_file(0))


def test_a_run_that_is_left_out_is_there_again(study: Study) -> None:
    study = study.with_roles({"run 1": "exclude"})
    (study.folder / "data" / "run 1.csv").write_text("no table\n")
    lines = commands(study)
    for line in lines[: [" study check " in line for line in lines].index(True)]:
        assert run(line) == 0, line
    again = Study(study.folder.with_name(f"my rig{AGAIN}"))
    assert again.settings == study.settings


def test_own_laws_and_effects_are_copied_before_anything_needs_them(study: Study) -> None:
    study.laws_folder.mkdir()
    (study.laws_folder / "oil.py").write_text("")
    (study.effects_folder / "seal.py").write_text("")
    assert [shlex.split(line) for line in commands(study)[2:5]] == [
        ["mkdir", "-p", f"my rig{AGAIN}/laws"],
        ["cp", "my rig/laws/oil.py", f"my rig{AGAIN}/laws/oil.py"],
        ["cp", "my rig/effects/seal.py", f"my rig{AGAIN}/effects/seal.py"],
    ]


@pytest.mark.slow  # every command that a report prints
def test_all_of_them_run(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    for line in commands(study):
        assert run(line) == 0, (line, capsys.readouterr().err)


def test_a_history_of_fits_is_repeated_with_its_laws(study: Study) -> None:
    model = study.model()
    study.add_step("identify bingham + stribeck + gas_spring", "", model)
    study.undo()
    lugre = read_model(study.history.model_file(0))
    study.add_step("identify lugre", "", new_model("lugre"))
    study.add_step("identify lugre", "", new_model("lugre"))
    study.add_step("identify the building", "", replace(lugre))
    told = [line for line in commands(study) if " identify " in line]
    name = f"'my rig{AGAIN}'"
    assert told == [
        f"bristle identify {name} --law lugre", f"bristle identify {name}",
        f"bristle identify {name} --structure",
    ]  # fmt: skip


def test_a_fit_with_a_table_of_the_command_is_repeated_by_its_form(study: Study) -> None:
    tabled = new_model("dahl[table 0 0.5 1.5]")
    for _ in range(2):
        study.add_step("identify dahl[table]", "", tabled)
    study.add_step("identify dahl[quadratic]", "", new_model("dahl[quadratic]"))
    study.add_step("identify dahl", "", new_model("dahl"))
    told = [line for line in commands(study) if " identify " in line]
    name = f"'my rig{AGAIN}'"
    assert told == [
        f"bristle identify {name} --law dahl --command table", f"bristle identify {name}",
        f"bristle identify {name} --command quadratic", f"bristle identify {name} --law dahl",
    ]  # fmt: skip


@pytest.mark.slow  # a shell and a process a hint
def test_printed_hints_can_be_pasted(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["report", "my rig"]) == 0
    page = (study.folder / "reports" / "report.html").read_text(encoding="utf-8")
    assert "bristle diagnose &#x27;my rig&#x27;" in page or "bristle diagnose 'my rig'" in page
    assert main(["new", "effect", "rub", "--study", "my rig"]) == 0
    told = capsys.readouterr().out
    hint = shlex.split(told.rpartition("then:  ")[2])
    assert hint == ["bristle", "check", str(Path("my rig", "effects", "rub.py"))]
    assert main(hint[1:]) == 0


def test_pictures_of_another_model_are_set_aside(tmp_path: Path) -> None:
    files = [write(tmp_path / "lab" / f"run_{k}.csv", bench_run(k, 2.0)) for k in (1, 2, 3)]
    study = create_study(tmp_path / "rig", files).study
    for name in ("identify.png", "compare.png", "data_check.png"):
        study.write_report(name, b"of step 0")
    study.add_step("add stribeck", "to see", study.model().with_effect("stribeck"))
    reports, history = study.reports_folder, study.history.folder
    assert [path.name for path in reports.iterdir()] == ["data_check.png"]
    assert (history / "000" / "identify.png").read_bytes() == b"of step 0"
    study.write_report("compare.png", b"of step 1")
    study.undo()
    assert not (reports / "compare.png").exists()
    assert (history / "undone" / "001" / "compare.png").read_bytes() == b"of step 1"
    assert (reports / "data_check.png").is_file()


def test_pictures_of_an_undone_step_stay_when_another_has_its_number(tmp_path: Path) -> None:
    files = [write(tmp_path / "lab" / f"run_{k}.csv", bench_run(k, 2.0)) for k in (1, 2, 3)]
    study = create_study(tmp_path / "rig", files).study
    undone = study.history.folder / "undone"
    for effect in (b"stribeck", b"gas_spring", b"stribeck"):
        study.add_step("add", "to see", study.model().with_effect(effect.decode()))
        study.write_report("compare.png", effect)
        study.undo()
    study.add_step("add", "to see", study.model().with_effect("stribeck"))
    kept = [undone / name / "compare.png" for name in ("001", "001_2", "001_3")]
    assert [file.read_bytes() for file in kept] == [b"stribeck", b"gas_spring", b"stribeck"]

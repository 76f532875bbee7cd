"""A study from another version, another machine, or with other code: one message, nothing lost."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest
from made import write_runs

from bristle import __version__
from bristle.cli import main
from bristle.physics.effect import EFFECTS
from bristle.study import Study, create_study

COMMANDS = ("study check", "identify", "compare", "diagnose", "report", "export", "undo")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab")
    study = create_study(folder / "rig", write_runs(folder / "runs", 3, seconds=2.0)).study
    study.add_step("add stribeck", "to see", study.model().with_effect("stribeck"))
    return study.folder


@pytest.fixture
def rig(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made, tmp_path / "rig")


def digests(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def refused(rig: Path, capsys: pytest.CaptureFixture[str], *lines: str) -> str:
    """Run commands that must refuse in the same few words; return these."""
    before, texts = digests(rig), set()
    for line in lines:
        assert main([*line.split(), str(rig)]) == 2, line
        told = capsys.readouterr()
        assert told.out == ""
        assert "Traceback" not in told.err
        texts.add(told.err)
        assert digests(rig) == before, line
    assert len(texts) == 1, texts
    return texts.pop()


def changed(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_settings_of_another_version(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed(rig / "study.toml", "schema = 1", 'schema = 2\nfuture = "key"')
    text = refused(rig, capsys, *COMMANDS)
    assert len(text.splitlines()) == 1
    assert "study.toml:1: schema is 2, of another version" in text
    assert __version__ in text
    assert "future" not in text


def test_a_model_of_another_version(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed(rig / "model.toml", "schema = 1", 'schema = 3\nkind = "new"')
    text = refused(rig, capsys, "identify", "compare", "diagnose", "report", "export")
    assert len(text.splitlines()) == 1
    assert "model.toml:1: schema is 3" in text
    assert main(["study", "check", str(rig)]) == 0  # the data can be read


def test_a_step_of_another_version(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = rig / "history" / "001" / "step.json"
    file.write_text(json.dumps({"schema": 2, "what": {"added": ["stribeck"]}}))
    text = refused(rig, capsys, "report", "undo")
    assert "step.json: schema is 2" in text


@pytest.mark.parametrize("harm", ["newer", "step gone", "model gone"])
def test_a_step_is_not_taken_back_to_one_that_cannot_be_read(
    harm: str, rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = rig / "history" / "000"
    if harm == "newer":
        (before / "step.json").write_text('{"schema": 5}')
    else:
        (before / ("step.json" if harm == "step gone" else "model.toml")).unlink()
    with (rig / "model.toml").open("a") as model:
        model.write("# edited\n")
    text = refused(rig, capsys, "undo")
    assert str(Path("history") / "000") in text
    assert len(text.splitlines()) == 1


def test_an_effect_that_is_gone_is_told_once(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = rig / "model.toml"
    changed(model, "[effects.stribeck]", "[effects.seal]")
    with model.open("a") as file:
        file.write(
            '\n[correlation]\nparameters = ["seal.a", "seal.b"]\nrows = [[1.0], [0.1, 1.0]]\n'
        )
    text = refused(rig, capsys, "identify", "compare", "report")
    assert len(text.splitlines()) == 1
    assert 'there is no effect "seal"' in text


def test_an_effect_that_this_version_lacks_is_told_with_the_version(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed(rig / "history" / "001" / "step.json", f'"{__version__}"', '"7.5.0"')
    changed(rig / "model.toml", "[effects.stribeck]", "[effects.stribock]")
    text = refused(rig, capsys, "identify", "compare", "diagnose", "export")
    assert "stribock" in text
    assert f"bristle 7.5.0 wrote this model, and this is bristle {__version__}" in text


def test_a_parameter_that_the_law_lacks_now(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed(rig / "model.toml", "[parameters.sigma_a]", "[parameters.sigma_old]")
    text = refused(rig, capsys, "identify", "compare", "diagnose")
    assert "sigma_old" in text
    assert "bristle 7.5.0" not in text


def test_a_study_mailed_without_its_data(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.rmtree(rig / "data")
    text = refused(rig, capsys, "study check", "identify", "compare", "diagnose")
    assert "run_1.csv" in text


def test_a_study_moves_between_machines(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A copy whose change was under way, and that another machine had locked, opens."""
    there = shutil.copytree(rig, tmp_path / "other machine" / "rig")
    (there / ".lock").write_text("")
    (there / "history" / ".pending").write_text('{"add": 1}')
    for file in there.rglob("*.toml"):
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    study = Study(there)
    assert study.model().effects == Study(rig).model().effects
    assert not study.history.pending.exists()
    assert main(["undo", str(there)]) == 0


def test_a_damaged_verdict_or_model_is_one_message(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (rig / "verdict.json").write_text('{"kind": ')
    assert "verdict.json: no JSON" in refused(rig, capsys, "report")
    (rig / "verdict.json").unlink()
    (rig / "model.toml").write_bytes(b"\xff\xfe\x00law")
    assert "model.toml" in refused(rig, capsys, "identify", "compare", "report")


def test_two_studies_with_effects_of_one_name_keep_their_own(rig: Path, tmp_path: Path) -> None:
    assert main(["new", "effect", "seal", "--study", str(rig)]) == 0
    first = Study(rig, trust=True)
    first.add_step("add seal", "to see", first.model().with_effect("seal"))
    other = shutil.copytree(rig, tmp_path / "other")
    changed(other / "effects" / "seal.py", 'Parameter(0.2, "N"', 'Parameter(0.3, "N"')
    second = Study(other, trust=True)
    for study, value in ((first, 0.2), (second, 0.3), (first, 0.2)):
        study.model()
        assert EFFECTS["seal"].parameters["f_s"].value == value

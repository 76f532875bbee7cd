"""Code that came with a study or a scenario runs only after its user's consent."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from made import write_runs

from bristle import trust
from bristle.cli import main
from bristle.errors import PhysicsError, StudyError, TrustError
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from bristle.study import Study, create_study
from bristle.study.steps import add_effects
from bristle.user_code import load
from bristle.user_code.conformance import refused
from bristle.user_code.templates import file_text

Files = dict[str, str]


@pytest.fixture(autouse=True)
def nobody_consented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Begin as a user who has never consented to anything."""
    monkeypatch.delenv(trust.VARIABLE)
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))


def telltale(marker: Path, name: str = "seal") -> str:
    """Return an effect that works, and that writes a file as soon as its text runs."""
    write = f"open({str(marker)!r}, 'w').close()"
    more = f'def said(made):\n    return "{write}"\n\n\n@exec\n@said\nclass Made:\n    """."""\n'
    return f"{file_text('effect', name)}\n\n{more}"


@pytest.fixture
def marker(tmp_path: Path) -> Path:
    return tmp_path / "it_ran"


@pytest.fixture
def mailed(tmp_path: Path, marker: Path) -> Path:
    """Return a study that somebody sent, with an effect of their own in its model."""
    study = create_study(tmp_path / "my rig", write_runs(tmp_path / "lab", seconds=2.0)).study
    study.effects_folder.mkdir(exist_ok=True)
    (study.effects_folder / "seal.py").write_text(telltale(marker), encoding="utf-8")
    file = study.folder / "model.toml"
    file.write_text(
        file.read_text(encoding="utf-8")
        + '\n[effects.seal]\nparameters = { f_s = { value = 0.3, unit = "N", low = 0.0, '
        'high = 9.0, free = true, std = 0.01, origin = "identified" } }\n',
        encoding="utf-8",
    )
    return study.folder


@pytest.fixture
def scenario(tmp_path: Path, mailed: Path) -> Path:
    """Return a scenario that names the file of that effect."""
    file = tmp_path / "quake.toml"
    file.write_text(
        'schema = 1\n[run]\nstop = 0.02\nstep = 0.002\n[components.damper]\nfmu = "LuGreDamper"\n'
        f'effects = ["{(mailed / "effects" / "seal.py").as_posix()}"]\n'
        'parameters = { "seal.on" = true }\n',
        encoding="utf-8",
    )
    return file


RUNNING = (
    "identify", "identify --dry-run", "compare", "diagnose", "diagnose --json", "add {} stribeck",
    "export", "study auto", "list effects seal --study",
)  # fmt: skip
READING = ("undo", "report", "study check", "list effects --study")


def words(line: str, study: Path) -> list[str]:
    if "{}" in line:
        return [str(study) if word == "{}" else word for word in line.split()]
    return [*line.split(), str(study)]


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*.toml")}


@pytest.mark.parametrize("line", RUNNING)
def test_a_command_that_would_run_it_refuses_in_one_line(
    line: str, mailed: Path, marker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(mailed)
    assert main(words(line, mailed)) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert len(told.err.splitlines()) == 1
    assert "seal.py" in told.err
    assert "--trust" in told.err
    assert not marker.exists()
    assert "seal" not in EFFECTS
    assert content(mailed) == before


@pytest.fixture
def law_mailed(tmp_path: Path, marker: Path) -> Path:
    """Return a study that somebody sent, whose model has a law of their own."""
    study = create_study(tmp_path / "my rig", write_runs(tmp_path / "lab", seconds=2.0)).study
    study.laws_folder.mkdir()
    write = f"open({str(marker)!r}, 'w').close()"
    more = f'def said(made):\n    return "{write}"\n\n\n@exec\n@said\nclass Made:\n    """."""\n'
    (study.laws_folder / "oil.py").write_text(
        f"{file_text('law', 'oil')}\n\n{more}", encoding="utf-8"
    )
    (study.folder / "model.toml").write_text(
        'schema = 1\nlaw = "oil"\n[parameters.f_c]\nvalue = 1.5\nunit = "N"\n'
        'origin = "identified"\n',
        encoding="utf-8",
    )
    return study.folder


@pytest.mark.parametrize("line", [*RUNNING[:-1], "identify --law oil", "list laws oil --study"])
def test_a_law_in_the_model_that_waits_for_consent_is_named(
    line: str, law_mailed: Path, marker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(law_mailed)
    assert main([*words(line, law_mailed), "--quiet"][: None if "auto" not in line else -1]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "oil.py: this file's code has not run here before" in told.err.splitlines()[-1]
    assert not marker.exists()
    assert "oil" not in LAWS
    assert content(law_mailed) == before


def test_the_report_shows_such_a_law(law_mailed: Path, marker: Path) -> None:
    assert main(["report", str(law_mailed)]) == 0
    page = (law_mailed / "reports" / "report.html").read_text(encoding="utf-8")
    assert "f_c" in page
    assert "has not run here before" in page
    assert not marker.exists()
    assert Study(law_mailed).model(to_show=True).only_shown == ("oil",)


@pytest.fixture
def beside(mailed: Path) -> Path:
    """Return a study whose model does without the effect that somebody sent along."""
    file = mailed / "model.toml"
    text = file.read_text(encoding="utf-8").partition("[effects.seal]")[0]
    file.write_text(text, encoding="utf-8")
    return mailed


@pytest.mark.parametrize(
    "line",
    [
        "identify --dry-run --starts 1",
        pytest.param("add {} stribeck", marks=pytest.mark.slow),  # 2 s, two fits
        # A diagnosis: it leaves the file out too.
        pytest.param("diagnose --dry-run", marks=pytest.mark.slow),
    ],
)
def test_work_goes_on_without_an_effect_that_the_model_does_without(
    line: str, beside: Path, marker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(line, beside)) == 0
    told = capsys.readouterr().out
    assert not marker.exists()
    assert "seal" not in EFFECTS
    if "add" not in line:
        assert "Left out: " in told
        assert "seal.py: this file's code has not run here before" in told
        assert "--trust" in told


def test_the_effect_itself_is_refused(
    beside: Path, marker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(beside)
    assert main(["add", str(beside), "seal"]) == 2
    assert "seal.py: this file's code has not run here" in capsys.readouterr().err
    assert not marker.exists()
    assert content(beside) == before


def test_a_broken_effect_is_refused_with_its_line(
    beside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (beside / "effects" / "seal.py").write_text("import socket\n", encoding="utf-8")
    assert main(["add", str(beside), "seal", "--trust"]) == 2
    assert "seal.py, line 1: socket is imported" in capsys.readouterr().err


@pytest.mark.parametrize("line", READING)
def test_what_can_be_read_without_it_is(
    line: str, mailed: Path, marker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(words(line, mailed))
    assert code == 0 or "nothing to undo" in capsys.readouterr().err
    assert not marker.exists()
    assert "seal" not in EFFECTS


def test_the_report_shows_the_effects_values_and_says_why_nothing_is_compared(
    mailed: Path, marker: Path
) -> None:
    assert main(["report", str(mailed)]) == 0
    page = (mailed / "reports" / "report.html").read_text(encoding="utf-8")
    assert "seal.f_s" in page
    assert "has not run here before" in page
    assert not marker.exists()
    assert Study(mailed).model(to_show=True).values["seal.f_s"] == 0.3


@pytest.mark.parametrize("line", ["check", "run"])
def test_a_scenarios_effects_are_asked_about(
    line: str, scenario: Path, marker: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main([line, str(scenario)]) == 2
    assert "--trust" in capsys.readouterr().err
    assert not marker.exists()
    assert not (tmp_path / "results").exists()


def test_nor_is_it_built_into_an_fmu(
    mailed: Path, marker: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(mailed / "effects" / "seal.py")
    assert main(["build", "LuGreDamper", "--effect", file, "--out", str(tmp_path)]) == 2
    assert "--trust" in capsys.readouterr().err
    assert not marker.exists()


def test_consent_is_remembered_until_the_text_changes(mailed: Path, marker: Path) -> None:
    assert main(["list", "effects", "seal", "--study", str(mailed), "--trust"]) == 0
    assert marker.exists()
    marker.unlink()
    load.unload_effects()
    moved = mailed.rename(mailed.with_name("elsewhere"))
    assert main(["list", "effects", "seal", "--study", str(moved)]) == 0
    assert marker.exists()
    marker.unlink()
    load.unload_effects()
    file = moved / "effects" / "seal.py"
    file.write_text(file.read_text(encoding="utf-8") + "\n# more\n", encoding="utf-8")
    assert main(["list", "effects", "seal", "--study", str(moved)]) == 2
    assert not marker.exists()


def test_a_text_that_changes_while_it_is_loaded_takes_its_effect_away(mailed: Path) -> None:
    study = Study(mailed, trust=True)
    assert study.model().effects
    file = mailed / "effects" / "seal.py"
    file.write_text(file.read_text(encoding="utf-8") + "\n# more\n", encoding="utf-8")
    with pytest.raises(TrustError):
        study.usable_effects()
    assert "seal" not in EFFECTS


def test_a_file_that_is_gone_is_not_waited_for(mailed: Path) -> None:
    study = Study(mailed)
    (mailed / "effects" / "seal.py").unlink()
    assert study.usable_effects() == []
    with pytest.raises(StudyError, match=r'effect "seal"'):
        study.model()


def test_python_consents_by_an_argument_or_a_context(mailed: Path, marker: Path) -> None:
    study = Study(mailed)
    with pytest.raises(TrustError, match=r"trust\.granted"):
        study.model()
    with pytest.raises(TrustError):
        add_effects(study, ["stribeck"])
    assert not marker.exists()
    assert "seal" in Study(mailed, trust=True).model().effects
    assert marker.exists()


def test_the_environment_consents_for_ci_and_is_not_remembered(
    mailed: Path, marker: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(trust.VARIABLE, "0")
    assert main(["list", "effects", "seal", "--study", str(mailed)]) == 2
    monkeypatch.setenv(trust.VARIABLE, "1")
    assert main(["list", "effects", "seal", "--study", str(mailed)]) == 0
    assert marker.exists()
    marker.unlink()
    load.unload_effects()
    monkeypatch.delenv(trust.VARIABLE)
    assert main(["list", "effects", "seal", "--study", str(mailed)]) == 2
    assert not marker.exists()


def test_a_file_made_here_is_trusted_and_checking_it_is_consent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "effect", "rub"]) == 0
    assert main(["new", "effect", "rub"]) == 2
    assert "is there already" in capsys.readouterr().err
    file = tmp_path / "rub.py"
    assert load.load_file(file).name == "rub"
    file.write_text(file.read_text().replace("Parameter(0.2,", "Parameter(0.4,"))
    with pytest.raises(TrustError):
        load.load_file(file)
    assert main(["check", "rub.py"]) == 0
    said = capsys.readouterr().out
    assert "rub conforms" in said
    assert "FAIL" not in said
    made = load.load_file(file)
    assert made.parameters["f_s"].value == 0.4
    assert refused(made) is None
    other = tmp_path / "sent.py"
    other.write_text(file_text("effect", "sent").replace('"N"', '"Newtonn"'))
    assert main(["check", "sent.py"]) == 2
    assert "sent.py: this file's code has not run here" in capsys.readouterr().err
    assert main(["check", "sent.py", "--trust"]) == 2
    assert "Newtonn" in capsys.readouterr().err  # it ran, as far as that


def test_links_and_odd_files_are_no_way_round(tmp_path: Path, marker: Path) -> None:
    folder = tmp_path / "effects"
    folder.mkdir()
    secret = tmp_path / "elsewhere.py"
    secret.write_text(telltale(marker, "linked"))
    (folder / "linked.py").symlink_to(secret)
    (folder / "folder.py").mkdir()
    os.mkfifo(folder / "pipe.py")
    (folder / "gone.py").symlink_to(tmp_path / "nowhere")
    found = {one.name: one.error for one in load.load(folder)}
    assert set(found) == {"linked", "folder", "pipe", "gone"}
    assert all(found.values())
    assert not marker.exists()
    through = tmp_path / "door"
    through.symlink_to(folder, target_is_directory=True)
    with pytest.raises(TrustError):
        load.load_file(through / ".." / "effects" / "linked.py")
    assert not marker.exists()


def test_a_file_imports_nothing_beside_it(tmp_path: Path, marker: Path) -> None:
    (tmp_path / "helper.py").write_text(f"open({str(marker)!r}, 'w').close()\n")
    for line in ("import helper", "from . import helper", "from .helper import x"):
        file = tmp_path / "rub.py"
        file.write_text(file_text("effect", "rub").replace("from math import tanh", line))
        with pytest.raises(PhysicsError, match=r"is imported"):
            load.load_file(file, trust=True)
    assert not marker.exists()


def test_a_text_in_another_coding_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "rub.py"
    file.write_text("# -*- coding: utf-7 -*-\n" + file_text("effect", "rub"))
    with pytest.raises(PhysicsError, match="utf-8 is right"):
        load.load_file(file, trust=True)


def test_nothing_hides_in_what_is_shown() -> None:
    assert trust.readable("a\tb\n") == "a\tb\n"
    assert trust.readable("x = 1\x1b[2K\rgood \u202e\u200b") == r"x = 1\x1b[2K\rgood \u202e\u200b"


def test_without_consent_nothing_runs(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from bristle.user_code import load as user\n"
        "print(user.load(Path(sys.argv[1]))[0].error)"
    )
    (tmp_path / "rub.py").write_text(file_text("effect", "rub"))
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True,
        env={**os.environ, trust.VARIABLE: ""},
    )  # fmt: skip
    assert "has not run here before" in done.stdout


def test_consent_that_cannot_be_kept_is_said(
    mailed: Path, marker: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "file"))
    assert main(["list", "effects", "seal", "--study", str(mailed), "--trust"]) == 2
    assert "cannot be kept" in capsys.readouterr().err
    assert not marker.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")
@pytest.mark.parametrize(("answer", "ran"), [("y\n", True), ("\n", False), ("no\n", False)])
def test_on_a_terminal_the_text_is_shown_and_asked_about(
    answer: str, ran: bool, mailed: Path, marker: Path
) -> None:
    import pty

    ours, theirs = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-m", "bristle.cli", "list", "effects", "seal", "--study", str(mailed)],
        stdin=theirs, stdout=subprocess.PIPE, stderr=theirs,
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    while b"[y/N]" not in shown:
        shown += os.read(ours, 4096)
    assert not marker.exists()
    os.write(ours, answer.encode())
    child.communicate(timeout=120)
    os.close(ours)
    assert b"class Seal(Effect)" in shown
    assert child.returncode == (0 if ran else 2)
    assert marker.exists() is ran

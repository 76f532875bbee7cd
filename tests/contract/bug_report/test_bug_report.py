"""`bristle bug-report`: texts and shapes, no measurement, and nothing unasked."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.study import Study
from bristle.version import __version__


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a study of two runs, whose measurements no text holds."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))
    t = np.arange(0.0, 4.0, 0.004)
    files = []
    for name, size in (("one", 71.23457), ("two", 63.98765)):
        rows = np.column_stack([t, size * np.cos(9.0 * t), 5.0 * np.sin(9.0 * t)])
        files.append(tmp_path / f"{name}.csv")
        np.savetxt(files[-1], rows, delimiter=",", header="time [s],v [mm/s],F [N]", comments="")
    Study.create(tmp_path / "rig", files)
    (tmp_path / "rig" / "reports").mkdir(exist_ok=True)
    (tmp_path / "rig" / "reports" / "report.html").write_text("71.23457")
    return tmp_path / "rig"


def test_it_shows_what_it_would_pack_and_writes_nothing_unasked(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bug-report", "rig"]) == 0
    said = capsys.readouterr().out
    assert "study/study.toml" in said
    assert f"bristle {__version__}" in said
    assert "1000 samples every 0.004 s" in said
    assert "velocity [m/s], force [N]" in said
    assert "Nothing was written" in said
    assert not Path("bristle_bug_report.zip").exists()


def test_it_packs_texts_and_shapes_and_no_measurement(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (rig / "history" / "large.json").parent.mkdir(exist_ok=True)
    (rig / "history" / "large.json").write_text(" " * 600_000)
    assert main(["bug-report", "rig", "--yes", "--json", "--out", "mine.zip"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["left_out"] == ["history/large.json: larger than 500 kB"]
    with zipfile.ZipFile("mine.zip") as archive:
        assert sorted(archive.namelist()) == sorted(told["members"])
        texts = {name: archive.read(name).decode() for name in archive.namelist()}
    assert {"versions.txt", "shapes.txt", "study/study.toml"} <= texts.keys()
    assert not [name for name in texts if name.endswith((".csv", ".html", ".png"))]
    assert not [name for name, text in texts.items() if "71.23" in text or "63.98" in text]


def test_a_study_that_cannot_be_read_is_what_is_reported(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    next((rig / "data").glob("*.csv")).write_text("time [s],v [mm/s]\n0,x\n")
    assert main(["bug-report", "rig", "--yes"]) == 0
    assert "The runs cannot be read" in capsys.readouterr().out


def test_the_last_traceback_goes_with_it(
    rig: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(*_: object) -> None:
        raise RuntimeError("unforeseen")

    monkeypatch.setattr("bristle.study.study.Study.undo", breaks)
    assert main(["undo", "rig"]) == 1
    assert "bristle bug-report" in capsys.readouterr().err
    assert main(["bug-report", "--yes"]) == 0
    with zipfile.ZipFile("bristle_bug_report.zip") as archive:
        assert archive.namelist() == ["traceback.txt", "versions.txt"]
        assert b"unforeseen" in archive.read("traceback.txt")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["gone"], "gone: no study"),
        (["rig", "--yes", "--out", "gone/file.zip"], "gone/file.zip: cannot be written"),
    ],
)
def test_what_cannot_be_is_one_message(
    rig: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bug-report", *arguments]) == 2
    assert words in capsys.readouterr().err

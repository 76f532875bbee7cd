"""What a page shows of a study is new where a file that it depends on is."""

from __future__ import annotations

from pathlib import Path

import pytest
from made import bench_run, write, write_runs

from bristle.page.view_cache import ViewCache, fingerprint
from bristle.study import create_study


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    files = write_runs(tmp_path / "lab", 2, seconds=2.0)
    return create_study(tmp_path / "rig", files, law="bingham").study.folder


@pytest.mark.parametrize("name", ["effects/rub.py", "laws/own.py", "data/run_1.csv", "house.toml"])
def test_a_stamp_changes_with_every_file_that_a_view_depends_on(folder: Path, name: str) -> None:
    model = folder / "model.toml"
    model.write_text('building = "house.toml"\n' + model.read_text())
    before = fingerprint(folder)
    file = folder / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(file.read_text() + "\n" if file.is_file() else "# new\n")
    assert fingerprint(folder) != before
    before = fingerprint(folder)
    file.unlink()
    assert fingerprint(folder) != before
    assert fingerprint(folder) == fingerprint(folder)


@pytest.mark.parametrize("text", ["", "runs = 3", "[[runs]]\nfile = [1]", "runs = [1]", "no toml"])
def test_a_stamp_needs_no_study_that_is_right(folder: Path, text: str) -> None:
    (folder / "study.toml").write_text(text)
    assert "model.toml:" in fingerprint(folder)
    assert fingerprint(folder / "nowhere") == ""


def test_a_view_follows_data_that_were_changed(folder: Path) -> None:
    answers = ViewCache()
    try:
        first = answers.get("data", folder, {})
        assert answers.get("data", folder, {}) is first
        write(folder / "data" / "run_1.csv", bench_run(1, 3.0))
        assert answers.get("data", folder, {}) != first
    finally:
        answers.close()

"""`bristle ensemble`: tables, a figure, exit codes, one message for what is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from PIL import Image

import bristle
from bristle.campaign import read_ensemble
from bristle.campaign.view import correlations, draw_ensemble, varying_numbers
from bristle.cli import main
from bristle.view.style import look

Write = Callable[..., Path]


def test_tables_and_figure_are_written(
    write: Write,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = write()
    read_ensemble(path).campaign().prepare()  # compiling for the first time is told
    monkeypatch.chdir(tmp_path)
    assert main(["ensemble", str(path)]) == 0
    out, err = capsys.readouterr()
    assert "12 runs done, 0 failed" in out
    assert err == ""  # no progress in a pipe
    folder = tmp_path / "results" / "mine"
    assert len(pd.read_csv(folder / "runs.csv", comment="#")) == 12
    quantiles = pd.read_csv(folder / "quantiles.csv", index_col="output")
    assert (quantiles["5 %"] <= quantiles["95 %"]).all()
    with Image.open(folder / "figure.png") as image:
        assert image.width > 800
    assert main(["ensemble", str(path)]) == 0
    assert "12 of them from before" in capsys.readouterr().out
    assert main(["ensemble", str(path), "--no-figure"]) == 0
    assert (folder / "figure.png").exists(), "of these runs"
    assert main(["ensemble", str(path), "--no-figure", "--runs", "13"]) == 0
    assert not (folder / "figure.png").exists(), "of fewer runs"


def test_json_says_all(write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(("normal = [650.0, 65.0], within = [500.0, 800.0]", "normal = [10.0, 100.0]"))
    command = ["ensemble", str(path), "--out", str(tmp_path / "o"), "--json", "--no-figure"]
    assert main([*command, "--workers", "1"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["runs"] == 12
    assert answer["done"] + answer["failed"] == 12
    assert sum(failure["count"] for failure in answer["failures"]) == answer["failed"] > 0
    assert [row["output"] for row in answer["quantiles"]] == [
        "peak structure.floor2_acceleration_absolute",
        "rms structure.floor2_acceleration_absolute",
        "max damper.force",
    ]
    assert not (tmp_path / "o" / "figure.png").exists()


def test_when_every_run_fails_so_does_the_command(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(("normal = [650.0, 65.0], within = [500.0, 800.0]", "normal = [1.0, 1e5]"))
    for seed in range(100):
        text = path.read_text()
        path.write_text(text.replace("seed = 7", f"seed = {seed}").replace("runs = 12", "runs = 1"))
        if not (bristle.ensemble(path).runs["status"] == "done").any():
            break
        path.write_text(text)
    assert main(["ensemble", str(path), "--out", str(tmp_path / "o"), "--json"]) == 1
    out, err = capsys.readouterr()
    answer = json.loads(out)
    assert answer["failed"] == 1
    assert answer["quantiles"][0]["50 %"] is None
    assert err == "RunError: all 1 runs failed.\n"
    assert (tmp_path / "o" / "runs.csv").exists()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--workers", "0"], "1 or more"),
        (["--runs", "0"], "--runs 0"),
        (["--out", "mine.toml"], "is a file"),
        (["--out", "mine.toml/deep"], "mine.toml"),
    ],
)
def test_bad_input_is_one_message(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str], more: list[str], message: str,
) -> None:  # fmt: skip
    path = write()
    monkeypatch.chdir(tmp_path)
    assert main(["ensemble", str(path), *more]) == 2
    error = capsys.readouterr().err
    assert error.startswith("EnsembleError: ")
    assert message in error
    assert error.count("\n") == 1


def test_correlations_name_what_moves_an_output(write: Write) -> None:
    found = bristle.ensemble(write(("runs = 12", "runs = 40")))
    names = varying_numbers(found.plan, found.runs)
    assert set(names) == {"damper.sigma_a", "voltage.level", "structure.building.masses.2"}
    ranked = correlations(found.runs, "max damper.force", names)
    assert ranked[0][0] == "voltage.level"
    assert ranked[0][1] > 0.8
    assert all(-1.0 <= value <= 1.0 for _, value in ranked)
    same = found.runs.assign(**{"max damper.force": 1.0})
    assert correlations(same, "max damper.force", names) == [(name, 0.0) for name in names]


def test_the_figure_says_how_many_runs_failed(write: Write) -> None:
    path = write(("normal = [650.0, 65.0], within = [500.0, 800.0]", "normal = [10.0, 100.0]"))
    found = bristle.ensemble(path)
    with look():
        page = draw_ensemble(found)
    texts = " ".join(text.get_text() for text in page.figure.texts)
    failed = (found.runs["status"] == "failed").sum()
    assert f"{failed} runs failed" in texts
    assert len(page.figure.axes) == 2 * len(found.plan.outputs)


def test_an_output_that_never_differs_is_drawn(write: Write, tmp_path: Path) -> None:

    path = write(
        ('"damper.sigma_a" = { normal = [650.0, 65.0], within = [500.0, 800.0] }', ""),
        ('"structure.building.masses.2" = { uniform = [1.1, 1.4] }', ""),
        ("each = [0.0, 4.0]", "each = [4.0]"),
    )
    found = bristle.ensemble(path, runs=3)
    draw_ensemble(found).save(tmp_path / "figure.svg", dpi=160)
    assert (tmp_path / "figure.svg").stat().st_size > 1000

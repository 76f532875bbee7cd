"""What views show is what the commands compute."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write, write_runs

from bristle.data.channels import ChannelSpec
from bristle.errors import StudyError
from bristle.model.model import Fact
from bristle.page import (
    data_views,
    study_views,
)
from bristle.page.worker import VIEWS, answer, function_of
from bristle.study import Study, create_study
from bristle.study.data_check import check_data
from bristle.study.steps import before_after, compare_study, predictions
from bristle.view.html import pack, unpack


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("views")
    files = write_runs(folder / "lab", 3, seconds=4.0)
    columns = bench_run(9, seconds=4.0)
    columns["F [N]"] = np.clip(columns["F [N]"], -3.0, 3.0)  # a load cell at the end of its range
    create_study(
        folder / "rig", [*files, write(folder / "lab" / "cut.csv", columns)], law="bingham"
    )
    return folder


def test_every_view_of_the_worker_is_a_module_that_answers(home: Path) -> None:
    for view in ("data", "channels", "check", "fit", "errors", "history", "residual", "verdict"):
        told, body = answer(view, home / "rig", {})
        assert told["ok"], told
        assert unpack(body)
    views = {view for some in VIEWS.values() for view in some}
    assert {"columns", "scenarios", "simulate"} <= views
    assert all(callable(function_of(view)) for view in views)


def test_what_is_wrong_is_told_in_the_words_of_the_commands(home: Path) -> None:
    told, body = answer("data", home / "gone", {})
    assert (told["ok"], told["kind"], body) == (False, "StudyError", b"")
    assert "no study" in told["error"]


def test_view_1_has_the_runs_and_findings_of_the_data_check(home: Path) -> None:
    shown, found = data_views.data_view(home / "rig", {}), check_data(Study(home / "rig"))
    assert {run["name"] for run in shown["runs"]} == {run.name for run in found.runs}
    check = data_views.check_view(home / "rig", {})
    assert check["ok"] == found.ok
    assert {one["text"] for one in check["findings"]} >= {
        f"{one.run}: {one.text}" for one in found.findings if one.kind == "clipping"
    }
    (cut,) = check["clipped"]
    assert (cut["run"], cut["channel"]) == ("cut", "force")
    run = next(one for one in found.runs if one.name == "cut")
    for begin, end in cut["spans"]:
        inside = (run.time >= begin) & (run.time <= end)
        assert np.all(np.abs(run["force"][inside]) == np.abs(run["force"]).max())
    assert cut["spans"]


def test_a_thinned_trace_keeps_every_extreme() -> None:
    generator = np.random.default_rng(1)
    time, y = np.arange(50_000) / 500.0, generator.standard_normal(50_000)
    y[31_234] = 9.0
    rows = data_views.thinned(time, {"y": y})
    assert len(rows) <= data_views.POINTS + 2
    assert y[rows].max() == y.max()
    assert y[rows].min() == y.min()
    assert np.all(np.diff(rows) > 0)


def test_view_3_has_the_samples_of_the_comparison(home: Path) -> None:
    shown = unpack(pack(study_views.errors_view(home / "rig", {"role": "train"})))
    found = compare_study(Study(home / "rig"), role="train")
    assert shown["z"] == pytest.approx(found.z)
    assert shown["sentences"] == list(found.sentences)
    for row, one in zip(shown["runs"], found.predictions, strict=True):
        assert row["normalised"] == pytest.approx(one.normalised, rel=1e-5)
        assert len(row["time"]) == len(row["measured"]) == len(row["normalised"])
        error = row["measured"] - row["predicted"]
        assert error[one.judged] == pytest.approx(one.residual[one.judged], abs=1e-5)
    assert not all(one.judged.all() for one in found.predictions)  # the load cell's range ended


def test_view_3_opens_no_test_run(home: Path) -> None:
    with pytest.raises(StudyError, match="holdout"):
        study_views.errors_view(home / "rig", {"role": "test"})


def test_view_2_has_values_with_half_of_their_intervals(home: Path, tmp_path: Path) -> None:
    shown = study_views.fit_view(home / "rig", {})
    assert not shown["identified"]
    assert {row["how"] for row in shown["parameters"]} == {"assumed"}
    model = Study(home / "rig").model()
    known = model.with_values({"f_c": 1.5}, {"f_c": 0.1})
    assert isinstance(known.facts["f_c"], Fact)
    (row,) = [row for row in study_views.rows_of(known, "voltage", {}) if row["name"] == "f_c"]
    assert (row["value"], row["half"], row["how"]) == (1.5, pytest.approx(0.196), "identified")
    held = study_views.rows_of(known, "voltage", {"parameters": {"f_c": {"how": "not identified"}}})
    assert [row["half"] for row in held if row["name"] == "f_c"] == [None]


def test_view_2_says_that_the_model_is_of_other_data(home: Path, tmp_path: Path) -> None:
    study = Study(shutil.copytree(home / "rig", tmp_path / "rig"))
    study.add_step("identify", "by hand", study.model())
    assert study_views.fit_view(study.folder, {})["other_data"] == ""
    left = study.settings.runs[0].name
    study.with_roles({left: "exclude"})
    assert "no longer those" in study_views.fit_view(study.folder, {})["other_data"]


def test_view_4_says_that_nothing_was_diagnosed(home: Path) -> None:
    assert study_views.verdict_view(home / "rig", {}) == {
        "verdict": None, "learned": [], "plans": [],
    }  # fmt: skip


def test_view_4_has_the_residuals_without_and_with_what_was_found(
    home: Path, tmp_path: Path
) -> None:
    assert study_views.residual_view(home / "rig", {}) == {"effects": []}
    study = Study(shutil.copytree(home / "rig", tmp_path / "rig"))
    study.model()
    refined = {"effects": ["gas_spring"], "values": {"f_c": 1.3, "gas_spring.k": 50.0}}
    study.write_verdict({"schema": 2, "kind": "unknown", "effects": [], "refined": refined})
    shown = unpack(pack(study_views.residual_view(study.folder, {})))
    assert (shown["effects"], shown["step"], shown["kind"]) == (["gas_spring"], None, "unknown")
    found = compare_study(study)
    assert shown["before"] == pytest.approx(found.z)
    pair = before_after(study)
    assert pair is not None
    after = predictions(study, pair).after
    for one, other, row in zip(found.predictions, after, shown["runs"], strict=True):
        assert row["before"]["residual"] == pytest.approx(one.residual, abs=1e-5)
        assert row["after"]["residual"] == pytest.approx(other.residual, abs=1e-5)
        assert not np.allclose(row["before"]["residual"], row["after"]["residual"], atol=0.1)
        assert len(row["time"]) == len(row["displacement"]) == len(row["after"]["normalised"])


def test_view_4_draws_what_was_learned_with_its_interval(home: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(home / "rig", tmp_path / "rig"))
    (folder / "effects" / "learned_1.py").write_text("")
    told = {
        "name": "learned_1", "sentences": ["learned_1 is a curve."], "along": "displacement",
        "unit": "N", "along_unit": "m", "knots": [-0.01, 0.0, 0.01], "values": [-1.0, 0.0, 1.0],
        "std": [0.1, 0.05, 0.1], "forms": [{"formula": "c s", "name": "line"}],
        "nearest": {"along": [-0.01, 0.01], "values": [-1.0, 1.0]},
    }  # fmt: skip
    (folder / "reports").mkdir(exist_ok=True)
    (folder / "reports" / "learned_1.json").write_text(json.dumps(told))
    (folder / "reports" / "gone.json").write_text(json.dumps(told))  # its effect was taken out
    (one,) = unpack(pack(study_views.verdict_view(folder, {})))["learned"]
    assert (one["name"], one["form"]) == ("learned_1", "c s")
    assert one["half"] == pytest.approx([0.196, 0.098, 0.196], rel=1e-6)
    assert one["nearest"]["values"].tolist() == [-1.0, 1.0]
    (folder / "reports" / "learned_1.json").write_text(json.dumps({**told, "forms": []}))
    (one,) = study_views.verdict_view(folder, {})["learned"]
    assert "knots" not in one  # a mode is no curve
    surface = {
        **told, "forms": [], "across": "voltage", "across_unit": "V", "levels": [0.0, 8.0],
        "values": [-1.0, 0.0, 1.0, -2.0, 0.0, 2.0], "std": [0.1] * 6,
    }  # fmt: skip
    (folder / "reports" / "learned_1.json").write_text(json.dumps(surface))
    (one,) = unpack(pack(study_views.verdict_view(folder, {})))["learned"]
    assert [row.tolist() for row in one["rows"]] == [[-1.0, 0.0, 1.0], [-2.0, 0.0, 2.0]]
    assert one["levels"].tolist() == [0.0, 8.0]


def test_view_5_has_the_steps_and_what_can_be_added(home: Path) -> None:
    shown = study_views.history_view(home / "rig", {})
    assert [step["what"] for step in shown["steps"]] == ["begin with bingham"]
    assert "gas_spring" in {one["name"] for one in shown["can_add"]}
    assert any(text.startswith("bristle study new") for text in shown["commands"])


def test_dropped_files_are_told_apart_with_reasons(tmp_path: Path) -> None:
    write(tmp_path / "run.csv", bench_run(1, seconds=2.0))
    (tmp_path / "words.csv").write_text("a,b\nx,y\n")
    shown = data_views.columns_view(tmp_path, {})
    wrong = [one for one in shown["files"] if one["error"]]
    assert [one["name"] for one in wrong] == ["words.csv"]
    assert str(tmp_path) not in wrong[0]["error"]
    force = next(one for one in shown["columns"] if one["channel"] == "force")
    assert (force["text"], force["guessed_unit"], force["sign"]) == ("F [N]", "N", 1)
    assert force["reason"]


def columns(folder: Path) -> Path:
    """Make a study whose force is in kN under a title that says N."""
    lab = folder / "lab"
    for seed in (1, 2, 3):
        run = bench_run(seed, seconds=2.0)
        run["F [N]"] = -1e-3 * run["F [N]"]
        write(lab / f"run_{seed}.csv", run)
    files = sorted(lab.glob("*.csv"))
    given = {"force": ChannelSpec("F [N]", "N")}
    return create_study(folder / "rig", files, law="bingham", channels=given).study.folder


def test_view_1_has_the_columns_of_a_study_and_what_other_channels_would_change(
    tmp_path: Path,
) -> None:
    folder = columns(tmp_path)
    before = (folder / "study.toml").read_bytes()
    shown = data_views.channels_view(folder, {})
    force = next(one for one in shown["columns"] if one["channel"] == "force")
    assert (force["text"], force["guessed_unit"], force["sign"], force["reason"]) == (
        "F [N]", "N", 1, "",
    )  # fmt: skip
    units = next(one["units"] for one in shown["known"] if one["name"] == "force")
    assert {"N", "kN", "lbf"} <= set(units)
    told = data_views.preview_view(
        folder, {"channels": ["force=-F [N]@kN"], "without": ["voltage"]}
    )
    changes = {one["channel"]: one for one in told["changes"]}
    assert changes["force"]["after"] == '"F [N]" in kN, sign turned'
    old, new = changes["force"]["traces"]
    scaled = [one["factor"] * one["values"] for one in (old, new)]
    np.testing.assert_allclose(scaled[1], -1e3 * scaled[0] * new["factor"] / old["factor"])
    assert changes["voltage"]["traces"][1] is None
    assert told["results"] == []
    with pytest.raises(StudyError, match="no unit of this quantity"):
        data_views.preview_view(folder, {"channels": ["force=F [N]@V"]})
    with pytest.raises(StudyError, match="given twice"):
        data_views.preview_view(folder, {"channels": ["force=F [N]@N", "force=F [N]@kN"]})
    with pytest.raises(StudyError, match="list of texts"):
        data_views.preview_view(folder, {"without": "voltage"})
    assert (folder / "study.toml").read_bytes() == before

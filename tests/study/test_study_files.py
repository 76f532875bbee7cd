"""study.toml and model.toml: what they say, and every mistake with its line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import write_runs

from bristle.core.files import read_json, write_json, write_whole
from bristle.data.channels import ChannelSpec
from bristle.study import StudyError, create_study, new_model, read_model, write_model
from bristle.study.study_file import RunFile, Settings, read_settings, write_settings

STUDY = """schema = 1
title = "rig A"
notes = "room at 21 degC"
rig = "bench"

[[runs]]
file = "data/run_1.csv"
role = "train"

[[runs]]
file = "data/run_2.csv"
role = "holdout"

[channels.time]
column = "time [s]"
[channels.displacement]
column = "x [mm]"
[channels.force]
column = "F [N]"
unit = "N"
sign = -1
noise = 0.02
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_runs(tmp_path / "data", 2)
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def test_settings_are_read(folder: Path) -> None:
    settings = read_settings(folder / "study.toml")
    assert settings.title == "rig A"
    assert settings.runs == (
        RunFile("data/run_1.csv", "train"),
        RunFile("data/run_2.csv", "holdout"),
    )
    assert settings.channels["force"] == ChannelSpec("F [N]", "N", -1, 0.02)
    assert settings.cut_off == 18.0


def test_settings_come_back_as_written(folder: Path) -> None:
    channels = {
        "time": ChannelSpec(step=0.002),
        "force": ChannelSpec('load "A"', "kN", -1, 0.5),
        "velocity": ChannelSpec("v", "mm/s"),
    }
    runs = (RunFile("data/run_1.csv", "train"), RunFile("data/run_2.csv", "holdout"))
    comments = {"force": "its name\ndoubtful: so could be another"}
    settings = Settings("a", "bench", runs, channels, "two\nlines", 0.0, comments)
    write_settings(folder / "study.toml", settings)
    assert read_settings(folder / "study.toml") == replace(settings, comments={})
    assert "# doubtful: so could be another" in (folder / "study.toml").read_text()


EXTRA = """
[extra.oil_pressure]
column = "p [bar]"
unit = "bar"
sign = -1
"""


def test_extra_channels_come_back_as_written(folder: Path) -> None:
    text = (folder / "study.toml").read_text(encoding="utf-8")
    (folder / "study.toml").write_text(text + EXTRA, encoding="utf-8")
    settings = read_settings(folder / "study.toml")
    assert settings.extra == {"oil_pressure": ChannelSpec("p [bar]", "bar", -1)}
    write_settings(folder / "study.toml", settings)
    assert read_settings(folder / "study.toml") == settings
    assert "oil_pressure" not in settings.channels


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("oil_pressure", "Oil", 'cannot be called "Oil": small letters'),
        ('[extra.oil_pressure]\ncolumn = "p [bar]"\nunit = "bar"\nsign = -1', "extra = 3", "extra"),
    ],
)
def test_mistakes_of_an_extra_channel_are_told(folder: Path, old: str, new: str, told: str) -> None:
    path = folder / "study.toml"
    text = path.read_text(encoding="utf-8")
    assert old in EXTRA
    path.write_text(text + EXTRA.replace(old, new), encoding="utf-8")
    with pytest.raises(StudyError, match=told):
        read_settings(path)


def test_law_and_schema_suffice(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text('schema = 1\nlaw = "lugre"\n', encoding="utf-8")
    model = read_model(path)
    assert model.values["sigma_a"] == 650.0
    assert "sigma_a" in model.free()
    assert "exponent" not in model.free()


def test_standard_laws_lack_the_exponential(tmp_path: Path) -> None:
    model = new_model("bingham_standard")
    assert model.base_law == "bingham"
    assert model.values["exponent"] == 0.0
    assert model.free() == ["f_c", "f_v", "c_0", "c_v"]


def test_model_keeps_units_and_converts(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(
        'schema = 1\nlaw = "lugre"\n[parameters.sigma_a]\nvalue = 0.7\nunit = "N/mm"\n'
        "[effects.gas_spring]\nparameters = { k = { value = 81.2, std = 3.0, high = 1e3 } }\n",
        encoding="utf-8",
    )
    model = read_model(path)
    assert model.values["sigma_a"] == pytest.approx(700.0)
    assert model.facts["gas_spring.k"].std == 3.0
    fitted = model.with_values({"sigma_a": 650.0, "gas_spring.k": 90.0}, {"sigma_a": 12.0})
    assert fitted.facts["sigma_a"].value == pytest.approx(0.65)
    assert fitted.facts["sigma_a"].std == pytest.approx(0.012)
    assert fitted.facts["sigma_a"].origin == "identified"
    write_model(path, fitted)
    assert read_model(path) == fitted


CORRELATED = (
    'schema = 1\nlaw = "bingham"\n[parameters.f_c]\nvalue = 1.2\nunit = "kN"\nstd = 0.01\n'
    "[parameters.c_0]\nvalue = 40.0\nstd = 2.0\n"
    '[correlation]\nparameters = ["f_c", "c_0"]\nrows = [[1.0], [-0.5, 1.0]]\n'
)


def test_model_keeps_how_errors_go_together(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(CORRELATED, encoding="utf-8")
    model = read_model(path)
    names, covariance = model.covariance()
    assert names == ("f_c", "c_0")
    assert covariance == pytest.approx(np.array([[100.0, -10.0], [-10.0, 4.0]]))
    write_model(path, model)
    assert read_model(path) == model
    other = model.with_values({"c_0": 41.0}, {"c_0": 1.0})
    assert other.covariance()[1] == pytest.approx(np.diag([100.0, 1.0])), "of other values"
    again = other.with_covariance(("f_c", "c_0"), np.array([[100.0, 3.0], [3.0, 1.0]]))
    assert again.covariance()[1] == pytest.approx(np.array([[100.0, 3.0], [3.0, 1.0]]))
    write_model(path, again)
    assert read_model(path) == again
    write_model(path, replace(again, correlation=None))
    assert "correlation" not in path.read_text(encoding="utf-8")
    assert read_model(path).covariance()[1] == pytest.approx(np.diag([100.0, 1.0]))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[-0.5, 1.0]", "[-1.5, 1.0]", ":12: .*row i has i numbers of -1 to 1"),
        ("[-0.5, 1.0]", "[-0.5, 0.9]", "the last one 1"),
        ("[-0.5, 1.0]", "[-0.5]", "row i has i numbers"),
        ("[[1.0], [-0.5, 1.0]]", "5", "rows: expected the lower triangle for 2 parameters"),
        ('["f_c", "c_0"]', '["f_c", "f_c"]', "each once"),
        ('["f_c", "c_0"]', '["f_c", "c_1"]', 'no parameter "c_1"'),
        ('["f_c", "c_0"]', '["f_c", "f_v"]', "f_v has no std"),
        (
            '["f_c", "c_0"]\nrows = [[1.0], [-0.5, 1.0]]',
            '["f_c", "c_0", "f_v"]\nrows = [[1.0], [0.9, 1.0], [0.9, -0.9, 1.0]]',
            "the matrix has the eigenvalue -0.8",
        ),
    ],
)
def test_errors_that_cannot_go_together_are_refused(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    path = tmp_path / "model.toml"
    more = "[parameters.f_v]\nvalue = 1.0\nstd = 0.1\n" if "eigenvalue" in told else ""
    assert old in CORRELATED
    path.write_text(CORRELATED.replace(old, new) + more, encoding="utf-8")
    with pytest.raises(StudyError, match=told):
        read_model(path)


def test_comments_of_a_model_stay(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    write_model(path, new_model("bingham", ("gas_spring",)))
    text = path.read_text(encoding="utf-8").replace("[parameters.f_c]", "# ours\n[parameters.f_c]")
    path.write_text(text, encoding="utf-8")
    model = read_model(path).with_effect("stribeck").with_values({"f_c": 2.5})
    write_model(path, model)
    assert "# ours" in path.read_text(encoding="utf-8")
    assert read_model(path) == model
    plain = model.only(())
    write_model(path, plain)
    assert read_model(path) == plain


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            'schema = 1\nlaw = "lugre"\n[parameters.sigma_a]\nvalue = 1.0\nunit = "N"',
            ':5: sigma_a: "N/m"',
        ),
        (
            'schema = 1\nlaw = "lugre"\n[parameters.sigma_a]\nvalue = 9.0\nhigh = 5.0',
            ":4: sigma_a = 9 is outside 0 to 5",
        ),
        (
            'schema = 1\nlaw = "lugre"\n[parameters.sigma_a]\nlow = -5.0',
            "sigma_a: -5 to .* leaves what is physical",
        ),
        ('schema = 1\nlaw = "lugre"\nbuilding = "b.toml"', ":3: there is no file"),
    ],
)
def test_mistakes_of_a_model(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StudyError, match=told):
        read_model(path)


def test_files_are_written_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "deep" / "a.json"
    write_json(path, {"a": float("nan"), "b": (1, 2)})
    assert read_json(path) == {"a": None, "b": [1, 2]}

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(StudyError, match="No space left"):
        write_whole(path, "new")
    assert [file.name for file in path.parent.iterdir()] == ["a.json"]


def test_json_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "verdict.json"
    path.write_text("{", encoding="utf-8")
    with pytest.raises(StudyError, match="no JSON"):
        read_json(path)
    path.write_text("[1]", encoding="utf-8")
    with pytest.raises(StudyError, match="an object"):
        read_json(path)


def test_a_piece_at_rest_or_too_short_is_left_out_and_said(tmp_path):
    from bristle.study.runs import usable

    t = np.arange(6000) * 0.005
    moving = (t > 4.0) & (t < 29.0)
    x = np.where(moving, 0.01 * np.sin(3.0 * (t - 4.0)), 0.0)
    force = 5.0 * np.tanh(np.gradient(x, 0.005) / 0.001)
    force += 0.01 * np.random.default_rng(0).standard_normal(len(t))
    there = ~(((t > 3.0) & (t < 3.9)) | ((t > 29.1) & (t < 29.5)))
    path = tmp_path / "run.csv"
    rows = np.column_stack([t, x, force])[there]
    np.savetxt(path, rows, "%.9g", ",", header="time [s],displacement [m],force [N]", comments="")
    study = create_study(tmp_path / "rig", [path]).study
    pieces = study.read()
    assert len(pieces) == 3
    runs = study.runs()
    assert len(runs.all) == 2  # the long piece, split in time
    told = " ".join(runs.notes)
    assert "run (1 of 3) is left out: its displacement does not change" in told
    assert "run (3 of 3) is left out: it has" in told
    # A file that holds nothing else is not left out in silence.
    assert usable(pieces[:1]) == (pieces[:1], ())

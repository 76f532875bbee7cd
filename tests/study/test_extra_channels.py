"""A study whose force depends on a pressure: kept, told, learned, exported as an input."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write

from bristle.cli import main
from bristle.comparison.comparison import compare_predictions
from bristle.comparison.predictions import run_predictions
from bristle.errors import RecordError, StudyError
from bristle.fmu.description import read_description
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import new_model
from bristle.prediction.export import export_study
from bristle.study import Study, create_study
from bristle.study.data_check import check_data
from bristle.study.identify import identify_study
from bristle.study.learn import learn_effect
from bristle.study.steps import add_effects
from bristle.view.terminal import text as shown

NAMES = ("train_1", "train_2", "train_3", "valid_1")
SLOPE = 0.12  # N/bar


def lab(folder: Path, seconds: float = 4.0, lacking: str = "") -> list[Path]:
    """Write runs whose force grows with a pressure; return their files."""
    files = []
    for seed, name in enumerate(NAMES):
        columns = bench_run(seed, seconds)
        time = columns["time [s]"]
        pressure = 30.0 + 10.0 * np.sin(1.9 * time + seed)
        columns["F [N]"] = columns["F [N]"] + SLOPE * (pressure - 30.0)
        columns["Oil pressure [bar]"] = np.full_like(time, np.nan) if name == lacking else pressure
        columns["gauge [counts]"] = 400.0 + np.round(40.0 * np.cos(3.0 * time))
        columns["cycle [1]"] = np.arange(len(time)) + 1.0
        files.append(write(folder / f"{name}.csv", columns))
    return files


def test_a_new_study_keeps_the_columns_that_it_does_not_know(tmp_path, capsys):
    files = lab(tmp_path / "lab")
    rig = tmp_path / "rig"
    assert main(["study", "new", str(rig), "--data", *map(str, files), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["extra"] == {
        "oil_pressure": {"column": "Oil pressure [bar]", "unit": "bar"},
        "gauge": {"column": "gauge [counts]", "unit": "counts"},
    }
    assert answer["unused"] == ["cycle [1]"]
    run = Study(rig).read()[0]
    assert {name: one.unit for name, one in run.extra.items()} == {
        "oil_pressure": "Pa", "gauge": "counts",
    }  # fmt: skip
    text = shown(check_data(Study(rig)).view())
    assert "oil_pressure  MPa" in text
    assert "counts" in text
    assert "extra channel" in text


def test_a_channel_that_one_run_lacks_is_told_and_costs_no_run(tmp_path):
    study = create_study(tmp_path / "rig", lab(tmp_path / "lab", lacking="train_2")).study
    look = check_data(study)
    assert look.ok
    text = shown(look.view())
    assert "oil_pressure: left out of this run: it has 0 values" in text
    assert "extra channel (not in 1 run)" in text
    assert len(study.read()) == len(NAMES)


def test_the_error_depends_on_the_pressure(tmp_path):
    study = create_study(tmp_path / "rig", lab(tmp_path / "lab", seconds=8.0)).study
    problem = Problem([prepare(run) for run in study.runs().train])
    plain = new_model("bingham_standard")
    known = {"f_c": 1.3, "f_v": 0.8, "c_0": 20.0, "c_v": 0.0}
    found = compare_predictions(
        run_predictions(problem, replace(plain, values={**plain.values, **known}))
    )
    assert found.first.coordinate == "oil_pressure"
    assert found.first.significant
    assert "The error depends mainly on oil pressure" in found.sentences[1]
    assert "MPa" in found.sentences[1]


def test_a_signal_that_no_run_has_is_refused(tmp_path):
    study = create_study(tmp_path / "rig", lab(tmp_path / "lab")).study
    with pytest.raises(StudyError, match=r"has no humidity; there are .*oil_pressure, gauge"):
        learn_effect(study, along=["humidity"])


@pytest.mark.slow  # a curve is learned and exported
def test_a_curve_along_the_pressure_is_learned_and_the_damper_has_it_as_an_input(tmp_path):
    files = lab(tmp_path / "lab", seconds=6.0)
    study = create_study(tmp_path / "rig", files, law="bingham_standard").study
    identify_study(study)
    found = learn_effect(study, along=["oil_pressure"])
    assert found.found.best is not None
    assert found.found.best.curve.along == "oil_pressure"
    assert "a line, 1.2 N/MPa" in " ".join(found.sentences())
    added = add_effects(study, [found.name]).identified
    assert added.after["z_holdout"] < 0.4 * added.before["z_holdout"]
    made = export_study(study)
    variables = read_description(made.fmu).variables
    assert variables["oil_pressure"].causality == "input"
    assert variables["oil_pressure"].unit == "Pa"
    assert f"{found.name}.signal" not in variables
    assert '"damper.oil_pressure" = "oil_pressure.value"' in made.scenario.read_text()
    assert main(["run", str(made.scenario), "--out", str(tmp_path / "out")]) == 0

    lacking = lab(tmp_path / "lab", seconds=6.0, lacking="valid_1")[-1]
    (study.folder / "data" / "valid_1.csv").write_bytes(lacking.read_bytes())
    with pytest.raises(RecordError, match="follows the channel oil_pressure, which this run does"):
        identify_study(Study(study.folder))


def test_a_column_that_stands_still_in_each_file_is_a_label_of_the_runs(tmp_path, capsys):
    files = []
    for seed, name in enumerate((*NAMES, "more_1")):
        columns = bench_run(seed, 4.0)
        rows = len(columns["time [s]"])
        gauge = np.random.default_rng(seed).normal(40.0 + 5.0 * (seed % 3), 0.01, rows)
        columns |= {
            "Gas [bar]": np.full(rows, 10.0 + 2.5 * (seed % 2)), "RH [%]": gauge,
            "oil": np.full(rows, seed % 2 + 1.0), "test": np.full(rows, 7.0 + seed),
            "gain [V/N]": np.full(rows, 5.0), "f [Hz]": np.full(rows, 1.0 + seed % 2),
            "status": np.full(rows, np.inf if seed % 2 else 1e38),
        }  # fmt: skip
        files.append(write(tmp_path / "lab" / f"{name}.csv", columns))
    rig = tmp_path / "rig"
    assert main(["study", "new", str(rig), "--data", *map(str, files[:-1]), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert 'gas of each run: from the column "Gas [bar]": 10 bar, 12.5 bar' in answer["notes"]
    assert "gas" not in answer["extra"]
    assert "rh" in answer["extra"]  # it moves a little, which a curve may follow
    labels = [run.labels for run in Study(rig).read()]
    assert [one["gas_bar"] for one in labels] == [10.0, 12.5, 10.0, 12.5]
    assert [one["rh"] for one in labels] == pytest.approx([40.0, 45.0, 50.0, 40.0], abs=0.01)
    assert [one["oil"] for one in labels] == [1.0, 2.0, 1.0, 2.0]
    assert {*labels[0]} == {"gas_bar", "rh", "oil"}
    assert main(["study", "extend", str(rig), str(files[-1])]) == 0
    assert Study(rig).read()[-1].labels["gas_bar"] == 10.0

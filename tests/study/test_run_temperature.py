"""A study whose runs have a temperature: the effect joins, and the FMU has it as a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from made import bench_run, write

from bristle.fmu.description import read_description
from bristle.prediction.export import export_study
from bristle.study.run_facts import RunChoices
from bristle.study.steps import add_effects, create_study

WARM = {"train_1": 18.0, "train_2": 26.0, "train_3": 34.0, "valid_1": 30.0}
SHARE = 0.012


@pytest.mark.slow  # fits by temperature, and an export
def test_a_study_takes_the_temperature_of_its_runs(tmp_path):
    files = []
    for seed, (name, warm) in enumerate(WARM.items()):
        columns = bench_run(seed, seconds=5.0)
        columns["F [N]"] = columns["F [N]"] * np.exp(-SHARE * (warm - 26.0))
        columns["T_oil [degC]"] = np.full(len(columns["F [N]"]), warm)
        files.append(write(tmp_path / "lab" / f"{name}.csv", columns))
    created = create_study(tmp_path / "rig", files, law="bingham_standard", runs=RunChoices())
    study = created.study
    assert "temperature" in study.settings.channels
    assert [run.labels["temperature"] for run in study.read()] == list(WARM.values())
    found = add_effects(study, ["measured_temperature"]).identified
    values = found.model.values
    assert values["measured_temperature.T_0"] == pytest.approx(26.0)
    assert values["measured_temperature.c_yield"] == pytest.approx(SHARE, rel=0.2)
    assert found.after["z_holdout"] < 0.8 * found.before["z_holdout"]
    made = export_study(study)
    parameters = read_description(made.fmu).variables
    assert parameters["measured_temperature.T"].unit == "degC"
    assert float(parameters["measured_temperature.T"].start) == pytest.approx(26.0)
    text = made.scenario.read_text(encoding="utf-8")
    assert '"measured_temperature.T" = 30' in text

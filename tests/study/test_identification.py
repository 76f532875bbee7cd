"""Identification of a study: rigs of all sizes, channels missing, bad input, the history."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from bristle.cli import main
from bristle.errors import RecordError, StudyError
from bristle.identification.histories import DamperForces
from bristle.study.api import identify
from bristle.study.identify import identify_study
from bristle.study.steps import create_study
from bristle.study.study import Study

DT, N = 0.004, 2000
T = np.arange(N) * DT


def bench_frame(seed, force=1.0, speed=1.0, length=1.0, volts=None, law="bingham", noise=0.005):
    """Return a frame of a bench run on a rig `force`, `speed`, `length` times that of 10 N."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.5, 4.0, 8) * speed / length
    angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
    size = 0.04 * speed / w
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = 2.5 * (1.0 + np.sin(2.0 * np.pi * (0.7 + 0.2 * seed) * T)) if volts is None else volts
    V = np.zeros(N) + V
    values = {
        "bingham": {
            "f_c": 1.3 * force, "f_v": 0.83 * force, "c_0": 100.0 * force / speed,
            "c_v": 20.0 * force / speed, "v_n": 0.02 * speed,
        },
        "lugre": {
            "sigma_a": 650.0 * force / length, "sigma_0": 415.0 * force / length,
            "sigma_1": 5.0 * force / speed, "sigma_2": 100.0 * force / speed,
            "sigma_b": 20.0 * force / speed, "v_n": 0.02 * speed, "a_0": 500.0 / length,
        },
    }[law]  # fmt: skip
    F = DamperForces(law, []).force(x, v, a, V, DT, values)
    columns = {"displacement": x, "velocity": v, "voltage": V, "force": F}
    noisy = {name: y + noise * np.std(y) * random.standard_normal(N) for name, y in columns.items()}
    return pd.DataFrame({"time": T, **noisy}), values


def study_of(tmp_path, frames, law="bingham", **choices):
    """Return a study's folder of frames, the last one held out if there are more than one."""
    files = []
    for number, frame in enumerate(frames):
        role = "holdout" if number and number == len(frames) - 1 else "train"
        path = tmp_path / f"{role}_{number}.csv"
        units = {"time": "s", "displacement": "m", "velocity": "m/s", "force": "N"}
        units |= {"voltage": "V", "current": "A"}
        frame.rename(columns=lambda c, u=units: f"{c} [{u[c]}]").to_csv(path, index=False)
        files.append(path)
    return create_study(tmp_path / "study", files, law=law, **choices).study


@pytest.mark.parametrize("law", ["bingham", "lugre"])
@pytest.mark.parametrize(
    ("force", "speed", "length"),
    [(1.0, 1.0, 1.0), (200.0, 2.5, 2.5), (1e4, 0.2, 0.2), (1e4, 10.0, 50.0)],
    ids=["10 N", "2 kN", "100 kN, millimetres", "100 kN, a metre"],
)
def test_rigs_of_all_sizes(law, force, speed, length):
    frames, values = [], {}
    for seed in (1, 2, 3):
        frame, values = bench_frame(seed, force, speed, length, law=law)
        frames.append(frame)
    found = identify(frames[:2], law, holdout=frames[2:])
    assert found.unidentified == ()
    for name, value in values.items():
        assert found.fit.model.values[name] == pytest.approx(
            value, abs=5.0 * found.fit.std[name] + 1e-9 * value
        )
        assert found.fit.std[name] < 0.1 * value
    assert found.after["z_holdout"] == pytest.approx(1.0, abs=0.1)
    assert found.after["share_holdout"] < 0.04  # below 18 Hz; a sign law errs where v = 0


@pytest.mark.parametrize("left_out", ["displacement", "velocity"])
def test_either_channel_of_the_motion_will_do(left_out):
    frames = [bench_frame(seed, law="lugre")[0].drop(columns=left_out) for seed in (1, 2)]
    found = identify(frames, "lugre")
    # From displacement alone the velocity is many times less certain; the intervals say so.
    value, std = found.fit.model.values["sigma_2"], found.fit.std["sigma_2"]
    assert abs(value - 100.0) < 4.0 * std
    assert std < 20.0


def test_current_stands_in_for_the_voltage():
    frame, values = bench_frame(1)
    found = identify([frame.rename(columns={"voltage": "current"})], "bingham")
    assert found.fit.model.values["f_v"] == pytest.approx(values["f_v"], rel=0.02)


@pytest.mark.parametrize("volts", [0.0, 4.0, None], ids=["0 V", "4 V", "not measured"])
def test_a_steady_voltage_leaves_its_parameters_unidentified_at_zero(volts):
    frame, values = bench_frame(1, volts=4.0 if volts is None else volts)
    if volts is None:
        frame = frame.drop(columns="voltage")
    found = identify([frame], "bingham")
    # Nothing commands a damper whose voltage is never there: no word of such parameters.
    assert set(found.unidentified) == ({"f_v", "c_v"} if volts else set())
    assert found.model.values["f_v"] == 0.0
    assert found.model.facts["f_v"].std is None
    at = values["f_c"] + (4.0 if volts is None else volts) * values["f_v"]
    assert found.fit.model.values["f_c"] == pytest.approx(at, rel=0.02)
    assert "f_v" not in found.fit.std


def test_a_single_run_is_split_and_says_so(tmp_path):
    found = identify_study(study_of(tmp_path, [bench_frame(1)[0]]))
    assert any("one run" in note for note in found.notes)
    assert found.after["z_holdout"] == pytest.approx(1.0, abs=0.15)


def test_held_parameters_and_bounds_of_the_user_are_kept(tmp_path):
    study = study_of(tmp_path, [bench_frame(seed)[0] for seed in (1, 2, 3)])
    path = study.folder / "model.toml"
    path.write_text(
        'schema = 1\nlaw = "bingham"\n'
        "[parameters.v_n]\nvalue = 0.03\nfree = false\n"
        "[parameters.f_c]\nvalue = 1.1\nhigh = 1.2\n"
        '[parameters.c_0]\nvalue = 90.0e-3\nunit = "kN.s/m"\n'
    )
    found = identify_study(Study(study.folder))
    model = Study(study.folder).model()
    assert model.values["v_n"] == 0.03
    assert model.facts["v_n"].origin == "assumed"
    assert model.values["f_c"] <= 1.2
    assert model.facts["c_0"].unit == "kN.s/m"
    assert model.values["c_0"] == pytest.approx(found.fit.model.values["c_0"])
    assert "v_n" not in found.fit.std


def test_the_step_holds_the_errors_before_and_after_and_can_be_undone(tmp_path, capsys):
    study = study_of(tmp_path, [bench_frame(seed)[0] for seed in (1, 2, 3)])
    assert main(["identify", str(study.folder), "--starts", "2", "--details"]) == 0
    out = capsys.readouterr().out
    assert "95 % interval" in out
    assert "The force consists of" in out
    step = Study(study.folder).steps()[-1]
    assert step.what == "identify bingham"
    told = {"z_train", "z_holdout", "error_train", "error_share_holdout", "rms_train", "cut_off"}
    assert told <= set(step.after)
    assert step.before == {}  # the start of a first fit is nobody's model
    assert "before" not in out
    assert step.after["z_holdout"] == pytest.approx(1.0, abs=0.1)
    model = Study(study.folder).model()
    assert model.facts["f_c"].origin == "identified"
    assert model.facts["f_c"].std is not None
    reports = study.folder / "reports"
    assert (reports / "identify.png").stat().st_size > 10_000
    answer = json.loads((reports / "identify.json").read_text())
    assert answer["step"] == step.number
    Study(study.folder).undo()
    assert Study(study.folder).model().facts["f_c"].std is None


def test_errors_before_another_law_are_those_of_the_model_that_the_study_had(tmp_path):
    study = study_of(tmp_path, [bench_frame(seed)[0] for seed in (1, 2)])
    first = identify_study(study, starts=1)
    other = identify_study(study, law="bingham_standard", starts=1)
    assert other.before == pytest.approx(first.after, rel=1e-6)


def test_a_fit_on_other_data_does_not_ask_to_be_repeated(tmp_path):
    study = study_of(tmp_path, [bench_frame(seed)[0] for seed in (1, 2, 3)])
    identify_study(study, starts=1)
    study = study.with_roles({"train_1": "exclude"})
    assert "Identify it again" in str(study.runs().notes)
    assert "Identify it again" not in str(identify_study(study, starts=1).notes)
    assert "Identify it again" not in str(study.runs().notes)


def test_json_and_a_dry_run_that_writes_nothing(tmp_path, capsys):
    study = study_of(tmp_path, [bench_frame(seed)[0] for seed in (1, 2, 3)])
    before = sorted(path.name for path in study.folder.rglob("*"))
    command = ["identify", str(study.folder), "--dry-run", "--json"]
    assert main([*command, "--law", "bingham_standard"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["law"] == "bingham_standard"
    assert answer["step"] is None
    assert answer["parameters"]["v_n"]["how"] == "held"
    assert sorted(path.name for path in study.folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        (lambda f: f.iloc[:150], RecordError, "200 or more"),
        (lambda f: f.assign(force=f.force.clip(-1.0, 1.0)), StudyError, "saturated"),
        (lambda f: f.assign(force=0.0), RecordError, "throughout"),
        (lambda f: f.assign(displacement=0.0, velocity=0.0), RecordError, "throughout"),
        (lambda f: f.drop(columns="force"), RecordError, "no force"),
        (lambda f: f.drop(columns=["displacement", "velocity"]), RecordError, "neither"),
    ],
)
def test_data_that_carry_no_identification_are_refused(change, error, text):
    with pytest.raises(error, match=text):
        identify([change(bench_frame(1)[0])], "bingham")


def test_missing_samples_have_no_say():
    frame, values = bench_frame(1)
    clean = identify([frame], "bingham")
    holed = frame.copy()
    for start in range(50, N - 50, 97):
        holed.loc[start : start + 2, ["force", "velocity"]] = np.nan
    found = identify([holed], "bingham")
    for name in values:
        assert found.fit.model.values[name] == pytest.approx(
            clean.fit.model.values[name], abs=4.0 * clean.fit.std[name]
        )


def test_wrong_choices_are_refused(tmp_path):
    study = study_of(tmp_path, [bench_frame(1)[0]])
    with pytest.raises(StudyError, match="starts"):
        identify_study(study, starts=0)
    with pytest.raises(StudyError, match="cut-off -5 Hz"):
        identify_study(study, cutoff=-5.0)
    with pytest.raises(StudyError, match="there are"):
        identify_study(study, law="coulomb")

"""The form of the command of a study: identified, stored, judged, refused, exported."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bristle
from bristle.cli import main
from bristle.errors import StudyError
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.model.model import new_model
from bristle.model.model_file import read_model
from bristle.physics.damper import DamperModel
from bristle.prediction.export import export_study
from bristle.prediction.model_system import AGREEMENT, prediction
from bristle.study.forms import forms_asked, in_form, knots_of
from bristle.study.inputs import measurements
from bristle.study.study import Study

DT, N = 0.004, 1500
T = np.arange(N) * DT
TRUTH = {
    "f_c": 1.5, "f_v": 2.0, "yield_force_bend": -0.2, "c_0": 60.0, "c_v": 20.0,
    "viscosity_bend": -2.0, "v_n": 0.03,
}  # fmt: skip
LAW = "bingham[quadratic]"


def frame(seed: int, volts: float | np.ndarray, law: str = LAW) -> pd.DataFrame:
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.5, 4.0, 8)
    angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
    size = 0.04 / w
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = np.zeros(N) + volts
    force = DamperForces(law, []).force(x, v, a, V, DT, TRUTH)
    columns = {"displacement [m]": x, "velocity [m/s]": v, "force [N]": force}
    noisy = {n: y + 5e-3 * np.std(y) * random.standard_normal(N) for n, y in columns.items()}
    return pd.DataFrame({"time [s]": T, "voltage [V]": V, **noisy})


def campaign(*levels: float, first: int = 0) -> list[pd.DataFrame]:
    return [frame(first + k, level) for k, level in enumerate(levels)]


@pytest.fixture(scope="module")
def rig() -> tuple[list[pd.DataFrame], list[pd.DataFrame]]:
    return campaign(0.0, 1.0, 2.5, 5.0), campaign(1.7, 4.0, first=10)


@pytest.fixture
def study(tmp_path: Path, rig: tuple[list[pd.DataFrame], list[pd.DataFrame]]) -> Study:
    for role, frames in zip(("train", "holdout"), rig, strict=True):
        for k, one in enumerate(frames):
            one.to_csv(tmp_path / f"{role}_{k}.csv", index=False)
    files = sorted(tmp_path.glob("*.csv"))
    return Study.create(tmp_path / "rig", files, law="bingham")


def test_the_rigs_form_is_found_with_intervals_that_hold(
    rig: tuple[list[pd.DataFrame], list[pd.DataFrame]],
) -> None:
    found = bristle.identify(rig[0], "bingham", holdout=rig[1], command="all")
    assert [row.form for row in found.forms] == ["linear", "quadratic", "table"]
    judged = {row.form: row.judged for row in found.forms}
    assert all(f">{form}</td>" in found._repr_html_() for form in judged)
    assert found.model.law == "bingham"
    # All hold the velocity's noise about the turns of a sign law; what a form adds tells them.
    noise, table, linear = (judged[n] ** 2 for n in ("quadratic", "table", "linear"))
    assert 0.0 < table - noise < 0.21 * (linear - noise)
    bent = bristle.identify(rig[0], "bingham", holdout=rig[1], command="quadratic")
    assert bent.after["z_holdout"] < 1.15
    assert not bent.unidentified
    for row in bent.parameters():
        if row["name"] in TRUTH:
            assert abs(row["value"] - TRUTH[row["name"]]) < 2.0 * row["interval95"], row["name"]
    values = {row.form: row.model.values for row in found.forms}["table"]
    table = [values[f"yield_force[{k}]"] for k in (1, 2, 3, 4)]
    right = [1.5 + 2.0 * V - 0.2 * V * V for V in (0.0, 1.0, 2.5, 5.0)]
    assert np.cumsum(table) == pytest.approx(right, rel=0.05)
    assert min(table) >= 0.0


@pytest.mark.slow  # each form is fitted and exported
def test_the_form_is_stored_and_everything_follows_it(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(study.folder)
    plain = (study.folder / "model.toml").read_text()
    assert "command" not in plain  # files of models without a chosen form stay what they are
    assert main(["identify", folder, "--command", "table", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["command"] == "table"
    assert told["command_knots"] == [0.0, 1.0, 2.5, 5.0]
    text = (study.folder / "model.toml").read_text()
    assert 'law = "bingham"\n' in text
    assert 'command = "table"\ncommand_knots = [0.0, 1.0, 2.5, 5.0]\n' in text
    model = Study(study.folder).model()
    assert model.law == "bingham[table 0 1 2.5 5]"
    assert model.values == pytest.approx(
        {name: row["value"] for name, row in told["parameters"].items()}
    )
    assert main(["identify", folder, "--json"]) == 0  # the form stays
    assert json.loads(capsys.readouterr().out)["command"] == "table"
    assert main(["compare", folder]) == 0
    assert main(["add", folder, "gas_spring"]) == 0
    assert Study(study.folder).model().law == model.law
    assert main(["identify", folder, "--command", "linear", "--json"]) == 0
    assert (study.folder / "model.toml").read_text().count("command") == 0
    capsys.readouterr()


def test_the_forms_are_compared_and_the_better_one_is_named(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    order = ["identify", str(study.folder), "--dry-run"]
    assert main([*order, "--command", "linear,quadratic"]) == 0
    said = capsys.readouterr().out
    assert "quadratic errs" in said
    assert "less than linear." in said
    assert "--command quadratic" in said
    assert "table" not in said


@pytest.mark.slow  # a diagnosis with a bent command
def test_a_diagnosis_keeps_the_form(rig: tuple[list[pd.DataFrame], list[pd.DataFrame]]) -> None:
    bent = bristle.identify(rig[0], "bingham", holdout=rig[1], command="quadratic")
    verdict = bristle.diagnose(rig[0], bent, holdout=rig[1])
    assert verdict.kind == "none"


@pytest.mark.parametrize("levels", [(2.0, 2.0), (0.0, 3.0)])
def test_runs_at_too_few_levels_are_refused(levels: tuple[float, ...]) -> None:
    with pytest.raises(StudyError, match="Runs at 3 levels or more") as refused:
        bristle.identify(campaign(*levels), "bingham", command="quadratic")
    assert "\n" not in str(refused.value)
    assert f"{levels[0]:g} V" in str(refused.value)


def test_a_command_that_was_not_measured_carries_no_form() -> None:
    runs = [one.drop(columns="voltage [V]") for one in campaign(1.0, 2.0)]
    with pytest.raises(StudyError, match="no command was measured"):
        bristle.identify(runs, "bingham", command="table")


def test_knots_follow_the_levels_or_the_range() -> None:
    def knots(frames: list[pd.DataFrame]) -> tuple[float, ...]:
        return knots_of([one for k in frames for one in measurements(k)])

    assert knots(campaign(0.0, 1.998, 2.002, 4.0)) == (0.0, 2.0, 4.0)
    many = knots(campaign(*np.arange(9.0)))
    assert (len(many), many[0], many[-1]) == (6, 0.0, 8.0)
    moving = knots([frame(1, 3.0 + 3.0 * np.sin(2.0 * T))])
    assert np.allclose(moving, np.linspace(0.0, 6.0, 5), atol=0.01)


def test_words_for_forms() -> None:
    assert forms_asked("all") == ("linear", "quadratic", "table")
    assert forms_asked("table, linear") == ("table", "linear")
    assert forms_asked(["quadratic"]) == ("quadratic",)
    for wrong in ("cubic", "", []):
        with pytest.raises(StudyError, match="linear"):
            forms_asked(wrong)


def test_an_effect_that_bends_the_command_stands_in_the_way() -> None:
    runs = [one for k in campaign(0.0, 1.0, 2.0) for one in measurements(k)]
    with pytest.raises(StudyError, match="saturation bends the command already"):
        in_form(new_model("bingham", ("saturation",)), "table", runs)


def test_from_form_to_form_the_quantities_stay() -> None:
    runs = [one for k in campaign(0.0, 1.0, 2.0) for one in measurements(k)]
    line = new_model("lugre")
    table = in_form(line, "table", runs)
    back = in_form(table, "linear", runs)
    assert back.values == pytest.approx(line.values)
    bent = in_form(table, "quadratic", runs)
    assert bent.values == pytest.approx(
        {**line.values, "stiffness_bend": 0.0, "viscosity_bend": 0.0}
    )


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ('command = "cubic"', "no command .cubic"),
        ('command = "table"', "2 to 6 knots"),
        ('command = "table"\ncommand_knots = [0.0, 2.0, 1.0]', "ascending"),
        ('command = "table"\ncommand_knots = [0.0, "a"]', "a list of numbers"),
        ('command = "quadratic"\ncommand_knots = [0.0, 1.0]', "beside them"),
        ("command_knots = [0.0, 1.0]", "beside them"),
        ("command = 3", "command"),
    ],
)
def test_a_wrong_form_in_a_file_is_said(tmp_path: Path, lines: str, text: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(f'schema = 1\nlaw = "bingham"\n{lines}\n')
    with pytest.raises(StudyError, match=text):
        read_model(path)


@pytest.mark.slow  # 5 s, an export: by default one of a linear command is proven
def test_the_fmu_carries_the_form_to_the_last_bit(study: Study) -> None:
    law = "bingham[table 0 1 2.5 5]"
    runs = study.runs()
    model = in_form(study.model(), "table", runs.train)
    assert model.law == law
    model = model.with_values({"yield_force[2]": 4.0, "yield_force[3]": 0.5, "viscosity[4]": 99.0})
    study.add_step("choose", "a test", model)
    found = export_study(study)
    shown = bristle.run(found.scenario)
    damper = DamperModel(law, model.values)
    rod, drive = shown["rod.displacement"].to_numpy(), shown["drive.value"].to_numpy()
    v, dt = shown["rod.velocity"].to_numpy(), float(shown.index[1] - shown.index[0])
    own = [
        damper.step(x, v, 0.0, V, dt, 0.0, 0.0, False)
        for x, v, V in zip(rod[1:400], v[1:400], drive[1:400], strict=True)
    ]
    assert own == shown["damper.force"].to_numpy()[1:400].tolist()
    run = prepare(next(one for one in runs.all if one.name == found.run))
    expected = prediction(study.model(), run)
    times = run.dt * np.arange(len(run.x))
    force = np.interp(times, shown.index.to_numpy(), shown["damper.force"])
    rest = np.abs(run.v) > 2e-3  # a sign jumps between samples
    assert np.std((force - expected)[rest]) < 2.0 * AGREEMENT * np.std(expected)

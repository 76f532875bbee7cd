"""Building and damper under a ground motion alone: right where the model is, else wrong by as much.

The runs are those of an exact linear step with a viscous damper, which no engine of the package
has computed.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import write_runs
from shaken import building, shake
from studies import house_study

from bristle.cli import main
from bristle.errors import StudyError
from bristle.model.draws import drawn_models
from bristle.model.model import Model, new_model
from bristle.physics.building import paper_building
from bristle.physics.drive import drive_named
from bristle.physics.effect import EFFECTS
from bristle.physics.forms import joined_form
from bristle.prediction.closed_loop import closed_loop, closed_loop_in
from bristle.prediction.closed_loop_result import ClosedLoop, Predicted
from bristle.prediction.excitation import PredictedRun, house_of, trials_in
from bristle.prediction.model_system import BuildingWithFile, Excitation
from bristle.prediction.monte_carlo import Figures, Simulator
from bristle.study import Study, create_study
from bristle.study.steps import uses_of_test_set
from bristle.view.blocks import Table

DRAG = 8.0  # N s/m


def viscous(x, v):
    return DRAG * v


def damper(model: Model, drag: float, spread: float = 0.05) -> Model:
    """Return a bingham model that is a dashpot, its drag known within a share."""
    values = {"f_c": 0.0, "f_v": 0.0, "c_v": 0.0, "exponent": 0.0, "v_n": 0.02}
    model = model.with_values(values, origin="assumed")
    model = model.with_values({"c_0": drag}, {"c_0": spread * drag})
    return model.with_covariance(["c_0"], np.array([[(spread * drag) ** 2]]))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study whose model was wrong in step 1 and is right in step 2."""
    study = house_study(tmp_path_factory.mktemp("house"), viscous, None)
    study.add_step("identify bingham", "to see", damper(study.model(), 2.0 * DRAG))
    study.add_step("identify again", "to see", damper(study.model(), DRAG))
    return study.folder


@pytest.fixture(scope="module")
def found(made: Path) -> ClosedLoop:
    return closed_loop(Study(made), draws=12)


def row(found: ClosedLoop, response: str, kind: str = "rms") -> Predicted:
    return next(one for one in found.rows if (one.response, one.kind) == (response, kind))


def test_the_right_model_predicts_what_was_measured(found: ClosedLoop) -> None:
    assert {one.response for one in found.rows} == {
        "base_displacement", "base_acceleration_absolute", "floor1_displacement",
        "floor1_acceleration_absolute", "drift1", "force",
    }  # fmt: skip
    for one in found.rows:
        assert one.error is not None
        assert abs(one.error) < 0.03, one
    assert sum(bool(one.inside) for one in found.rows) >= 10
    assert "12 of 12" in found.sentences()[1] or "of 12 measured figures" in found.sentences()[1]


def test_the_model_before_the_last_step_stands_beside_it(found: ClosedLoop) -> None:
    one = row(found, "base_displacement")
    assert found.step == "identify again"
    assert one.error_before is not None
    assert one.error is not None
    own = building(1, True, 6)  # that of the study, with its third ground motion
    right, twice = (
        np.std(shake(own, 22, lambda x, v, drag=drag: drag * v, samples=2500)["base_displacement"])
        for drag in (DRAG, 2.0 * DRAG)
    )
    assert one.error_before == pytest.approx(twice / right - 1.0, abs=0.01)
    assert abs(one.error) < 0.2 * abs(one.error_before)
    header = next(found.view().every(Table)).header
    assert header[-2:] == ["error", "error before"]


def test_the_band_is_that_of_the_drag(made: Path, found: ClosedLoop) -> None:
    study = Study(made)
    wide = study.model()
    errors = {"z_holdout": 3.5, "error_share_holdout": 0.01}
    study.add_step("less sure", "to see", damper(wide, DRAG, spread=0.2), after=errors)
    try:
        other = closed_loop(study, draws=12)
    finally:
        study.undo()
    assert not found.notes
    assert "3.50 times the noise; what it misses, 1.0 % of the force, widens" in other.notes[0]
    one, two = (row(each, "base_displacement").band for each in (found, other))
    assert one is not None
    assert two is not None
    assert 2.0 < (two[1] - two[0]) / (one[1] - one[0]) < 7.0


def test_what_a_model_misses_of_the_force_widens_the_band() -> None:
    key = ("base_displacement", "rms")
    drawn = {key: np.array([0.99, 1.01, 1.0, 0.98, 1.02])}
    plain, wide = (Figures({key: 1.0}, drawn, 0.0, 0, missed).band(key) for missed in (0.0, 0.2))
    assert plain is not None
    assert wide is not None
    half, more = 0.5 * (plain[1] - plain[0]), 0.5 * (wide[1] - wide[0])
    assert more == pytest.approx(np.hypot(half, 1.96 * 0.2))


def test_no_draws_no_band(made: Path) -> None:
    found = closed_loop(Study(made), draws=0)
    assert all(one.band is None and one.inside is None for one in found.rows)
    assert found.as_dict()["rows"][0]["unit"] == "m"


def test_the_command_tells_it_in_tables_and_json(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["predict", str(made), "--draws", "5"]
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert "From the ground motion of holdout_2 alone, the model predicts the peaks" in said
    assert "Peaks of holdout_2" in said
    assert main([*asked, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["role"] == "holdout"
    assert {one["kind"] for one in answer["rows"]} == {"peak", "rms"}
    assert answer["rows"][0]["band"][0] < answer["rows"][0]["band"][1]


def test_test_runs_are_counted_here_too(tmp_path: Path) -> None:
    study = house_study(tmp_path, viscous, None)
    toml = study.folder / "study.toml"
    toml.write_text(toml.read_text().replace('role = "train"', 'role = "test"', 1))
    study = Study(study.folder)
    study.add_step("identify bingham", "to see", damper(study.model(), DRAG))
    found = closed_loop(study, role="test", draws=0)
    assert {one.run for one in found.rows} == {"train_0"}
    assert found.notes[-1].endswith("opened for the first time.")
    assert len(uses_of_test_set(study)) == 1
    assert not found.step  # step 0 is nobody's guess


def house(made: Path) -> Path:
    """Return the building's file of a study."""
    return made / Study(made).model().building


def rows_of(folder: Path, name: str) -> tuple[str, np.ndarray]:
    file = folder / "data" / f"{name}.csv"
    return file.read_text().splitlines()[0], np.loadtxt(file, delimiter=",", skiprows=1)


def test_a_run_cut_out_of_a_longer_one_is_refused(made: Path, tmp_path: Path) -> None:
    header, rows = rows_of(made, "holdout_2")
    moving = int(np.argmax(np.abs(rows[:, 2])))
    for role, part in (("train", rows), ("holdout", rows[moving:])):
        name = tmp_path / f"{role}_2.csv"
        np.savetxt(name, part, "%.9g", ",", header=header, comments="")
    study = create_study(
        tmp_path / "rig", sorted(tmp_path.glob("*.csv"))[::-1], rig="structure", law="bingham",
        building=house(made),
    ).study  # fmt: skip
    study.add_step("identify bingham", "to see", damper(study.model(), DRAG))
    with pytest.raises(StudyError, match=r"holdout_2 is left out: .*_displacement is not at rest"):
        closed_loop(study)


def test_a_single_run_is_simulated_whole_and_judged_on_its_end(made: Path, tmp_path: Path) -> None:
    study = create_study(
        tmp_path / "rig", [made / "data" / "holdout_2.csv"], rig="structure", law="bingham",
        building=house(made),
    ).study  # fmt: skip
    study.add_step("identify bingham", "to see", damper(study.model(), DRAG))
    one = row(closed_loop(study, draws=0), "base_displacement")
    _, rows = rows_of(made, "holdout_2")
    assert one.measured == pytest.approx(np.sqrt(np.mean(rows[1750:, 2] ** 2)))
    assert one.error is not None
    assert abs(one.error) < 0.03


def test_what_cannot_be_is_refused(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = house_study(tmp_path, viscous, None)
    with pytest.raises(StudyError, match=r"model\.toml: no covariance .* bristle identify"):
        closed_loop(study)
    assert len(closed_loop(study, draws=0).rows) == 12
    toml = study.folder / "study.toml"
    text = toml.read_text()
    begin = text.index("[channels.ground_acceleration]")
    toml.write_text(text[:begin] + text[text.index("[channels.", begin + 5) :])
    with pytest.raises(StudyError, match="no ground_acceleration was measured"):
        closed_loop(Study(study.folder), draws=0)
    for options, told in (
        (["--level", "3"], "--level needs --building"),
        (["--draws", "-1"], "0 or a positive whole number"),
        (["--building", "house.toml", "--role", "test"], "does not go with --building"),
        (["--building", "house.toml", "--level", "nan"], "expected a finite number"),
        (["--building", str(house(made)), "--record", "el_centro_1940_ns"],
         "in a building of its own"),
    ):  # fmt: skip
        assert main(["predict", str(made), *options]) == 2
        assert told in capsys.readouterr().err


# -- a damper from a bench in a building


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("bench")
    study = create_study(folder / "rig", write_runs(folder, 2, seconds=2.0), law="bingham").study
    study.add_step("identify bingham", "to see", damper(study.model(), DRAG))
    return study


def test_a_damper_from_a_bench_is_put_into_the_building_that_was_measured(
    made: Path, bench: Study
) -> None:
    annex = house_of(house(made))
    trials = trials_in(annex, made / "data" / "holdout_2.csv", None, None)
    found = closed_loop_in(bench, annex, trials, draws=5)
    assert abs(row(found, "base_displacement").error or 1.0) < 0.03
    assert found.strokes[0] == pytest.approx(
        row(found, "base_displacement", "peak").predicted, 0.02
    )


def test_a_record_alone_gives_a_prediction_with_its_band(
    made: Path, bench: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [
        "predict", str(bench.folder), "--building", str(house(made)),
        "--draws", "5",
    ]  # fmt: skip
    assert main([*asked, "--record", "el_centro_1940_ns", "--level", "2", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["role"] is None
    assert all(one["measured"] is None and one["band"] for one in answer["rows"])
    assert "nothing was measured" in answer["sentences"][0]
    assert answer["strokes"][0] > 0.012  # the training runs move by 10 mm
    said = [note for note in answer["notes"] if "beyond the data that its model is from" in note]
    assert len(said) == 1
    assert said[0].startswith("in el_centro_1940_ns the damper has ")
    for options, told in (
        ([], "--building needs the ground motion"),
        (
            ["--record", "el_centro_1940_ns", "--data", "a.csv"],
            "--building needs the ground motion",
        ),
        (["--record", "nowhere.at2"], "nowhere.at2"),
    ):
        assert main([*asked, *options]) == 2
        assert told in capsys.readouterr().err
    assert main(["predict", str(bench.folder)]) == 2
    assert "--building house.toml" in capsys.readouterr().err


def test_a_command_in_another_unit_than_that_of_the_damper_is_refused(
    made: Path, bench: Study
) -> None:
    time = 0.01 * np.arange(101)
    shaking = Excitation("pulse", time, np.sin(time), 2.0 * time, drive=drive_named("current"))
    trial = PredictedRun(shaking, {}, np.ones(101, dtype=bool), (0.0, 0.0))
    with pytest.raises(StudyError, match=r"command is a current, .* identified with a voltage"):
        closed_loop_in(bench, house_of(house(made)), [trial], draws=0)


# -- draws and scenarios


def test_draws_have_the_joint_covariance_within_the_bounds() -> None:
    covariance = np.array([[0.04, -0.9 * 0.2 * 3.0], [-0.9 * 0.2 * 3.0, 9.0]])
    model = new_model("bingham")
    model = model.with_values({"f_c": 2.0, "c_0": 60.0}, {"f_c": 0.2, "c_0": 3.0})
    model = model.with_covariance(["f_c", "c_0"], covariance)
    drawn = drawn_models(model, 2000, np.random.default_rng(3))
    values = np.array([[one.values[name] for name in ("f_c", "c_0")] for one in drawn])
    np.testing.assert_allclose(np.cov(values.T), covariance, rtol=0.15)
    unsure = model.with_values({"f_c": 0.1}, {"f_c": 5.0}).with_covariance(["f_c"], np.eye(1) * 25)
    drawn = drawn_models(unsure, 50, np.random.default_rng(3))
    assert min(one.values["f_c"] for one in drawn) == 0.0


def test_law_form_effects_and_limits_are_in_the_scenario() -> None:
    model = new_model(joined_form("bingham", "table", (0.0, 4.0, 10.0)), ("gas_spring", "duffing"))
    time = 0.01 * np.arange(101)
    shaking = Excitation("pulse", time, np.sin(time), np.full(101, 9.0))
    paper = BuildingWithFile(paper_building())
    scenario = Simulator(model, paper, False, shaking).campaign.system
    law = scenario.components["damper"].law
    assert law is not None
    assert law.name == model.law
    assert scenario.components["damper"].values["gas_spring.on"] is True
    assert scenario.components["damper"].values["v_max"] == 10.0
    assert scenario.components["structure"].values["duffing.on"] is True
    assert scenario.step == pytest.approx(2e-3)
    still = replace(shaking, command=None, level=3.0)
    other = Simulator(model, paper, False, still).campaign.system
    assert other.components["damper"].values["voltage"] == 3.0


def test_a_mass_that_is_drawn_as_zero_is_attached_to_nothing() -> None:
    mass = f"fluid_inertia.{EFFECTS['fluid_inertia'].mass}"
    model = new_model("bingham", ("fluid_inertia",)).with_values({mass: 0.4})
    shaking = Excitation("pulse", 0.01 * np.arange(101), np.zeros(101))
    simulator = Simulator(model, BuildingWithFile(paper_building()), True, shaking)
    for drawn in (0.3, 0.0):
        other = simulator.campaign.varied(simulator.values(model.with_values({mass: drawn})))
        assert other.components["structure"].values["attached_mass"] == drawn
        assert other.components["damper"].values[mass] == 0.0


def test_a_command_of_another_kind_is_played_as_it_is() -> None:
    time = 0.01 * np.arange(101)
    model = new_model("bingham").with_drive("current")
    shaking = Excitation("pulse", time, np.sin(time), 2.0 * time, drive=drive_named("current"))
    simulator = Simulator(model, BuildingWithFile(paper_building()), False, shaking)
    as_current = simulator.response({})["damper.force"]
    volts = replace(shaking, drive=drive_named("voltage"))
    other = replace(simulator, model=new_model("bingham"), shaking=volts)
    np.testing.assert_array_equal(as_current, other.response({})["damper.force"])


def test_a_prediction_says_that_its_model_is_of_other_data(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = Study(shutil.copytree(made, tmp_path / "rig"))
    first = study.files("holdout")[0]
    first.write_text("\n".join(first.read_text().split("\n")[:-50]) + "\n")
    assert main(["predict", str(study.folder), "--draws", "0"]) == 0
    told = capsys.readouterr().out
    assert f"  bristle identify {study.folder}\n" in told

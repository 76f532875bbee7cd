"""A plan shows more than the runs at hand, keeps its limits, and says what it cannot settle."""

from __future__ import annotations

import shutil
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

import bristle
from bristle.cli import main
from bristle.core.text import quantity
from bristle.diagnosis.rig_runs import BenchRuns
from bristle.diagnosis.rule import BENCH
from bristle.errors import StudyError
from bristle.examples.make import Choice, make_bench
from bristle.identification.fit import intervals_of
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model
from bristle.planning.folder import read_plan
from bristle.planning.information import (
    Evidence,
    Goal,
    Information,
    JudgedTest,
    PreparedQuestion,
    Question,
    Rival,
    roles_of,
)
from bristle.planning.limits import RigLimits, Test
from bristle.planning.plan import Outcome, outcomes
from bristle.planning.questions import (
    LEAST,
    AskedFigure,
    PlanRequest,
    Purposes,
    RunsAtHand,
    cost_of,
    notes_of_change,
    open_parts,
    requests_of,
    seen,
    sized_rival,
    stated,
)
from bristle.planning.search import Planner
from bristle.planning.waveforms import Command, Waveform
from bristle.study.extend import extend_study

SHEET = """schema = 1
[damper]
law = "bingham"
max_force = "2 kN"
[limits]
stroke = "20 mm"
speed = "250 mm/s"
command = ["0 V", "5 V"]
rate = "100 Hz"
duration = "5 s"
runs = 2
"""


@pytest.fixture(scope="module")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("sheet") / "rig.toml"
    file.write_text(SHEET)
    return file


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> bristle.Study:
    folder = tmp_path_factory.mktemp("rigs") / "rig"
    make_bench(folder, Choice(nothing=True, law="bingham", seed=4))
    study = bristle.Study(folder)
    bristle.identify(study)
    return study


def a_run(x_of: float = 0.01, noise: float = 0.1) -> Run:
    t = np.arange(1000) * 0.005
    x = x_of * np.sin(6.0 * t)
    v, a = 6.0 * x_of * np.cos(6.0 * t), -36.0 * x
    force = 10.0 * np.sign(v)
    draws = np.zeros((2, len(t), 4))
    return Run("run", 0.005, x, v, a, np.zeros_like(t), force, noise, draws)


# At 0 V, with a viscous part that does not fall: f_c sign(v) + c_0 v.
PLAIN = Model(
    "bingham", values={"f_c": 5.0, "c_0": 20.0, "v_n": 100.0}, fixed=("f_v", "c_v", "v_n")
)


def test_deviations_and_distances_are_those_of_least_squares() -> None:
    run = a_run()
    more = Model("bingham", values={**PLAIN.values, "c_0": 23.0}, fixed=PLAIN.fixed)
    question = Question(PLAIN, (Rival("thicker", more, PLAIN),))
    asked = PreparedQuestion(question, Problem([run]))
    known = Information(question, asked.evidence([run]))
    J = np.stack([np.sign(run.v), run.v], axis=1)[run.skip :] / run.noise
    exact = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    for name, std in zip(("f_c", "c_0"), exact, strict=True):
        assert known.deviations()[name] * asked.spread(name)[0] == pytest.approx(std, rel=0.01)
    # A dashpot of its own takes the thicker oil up whole; the model as it is does not.
    assert known.raw()["thicker"] == pytest.approx(3.0 * np.linalg.norm(J[:, 1]), rel=1e-3)
    doubled = PreparedQuestion(question, Problem([run]), z=2.0).evidence([run])
    told = Information(question, doubled).raw()["thicker"]  # an error of twice the noise
    assert told == pytest.approx(0.5 * known.raw()["thicker"], rel=1e-9)
    assert known.distances()["thicker"] < 0.02 * known.raw()["thicker"]


def test_what_a_parameter_takes_up_whole_is_not_seen_on_short_runs_either() -> None:
    run = a_run(noise=1.0)
    more = Model("bingham", values={**PLAIN.values, "c_0": 23.0}, fixed=PLAIN.fixed)
    asked = PreparedQuestion(Question(PLAIN, (Rival("thicker", more, PLAIN),)), Problem([run]))
    known = Information(asked.question, asked.evidence([run]) + asked.evidence([run]).judging())
    # What is known of the dashpot beforehand would tell of thicker oil.
    assert known.distances()["thicker"] > LEAST * known.raw()["thicker"] > 0.0
    assert known.kept()["thicker"] < LEAST
    assert seen(known)[0].value == np.inf


def test_runs_add_up_and_never_tell_less() -> None:
    runs = [a_run(0.01), a_run(0.004)]
    asked = PreparedQuestion(Question(PLAIN), Problem(runs))
    first, second = (asked.evidence([run]) for run in runs)
    assert asked.evidence(runs).normal == pytest.approx((first + second).normal)
    one = Information(asked.question, first)
    more = one.with_runs([second])
    assert all(more.deviations()[name] < one.deviations()[name] for name in ("f_c", "c_0"))


def test_the_deviations_are_the_intervals_that_a_fit_would_give() -> None:
    run = a_run()
    generator = np.random.default_rng(4)
    # An error of the velocity that lasts some 0.1 s: far worse than as much white noise.
    lasting = uniform_filter1d(generator.normal(0.0, 0.01, (24, len(run.x))), 20, axis=1)
    draws = np.zeros((24, len(run.x), 4))
    draws[:, :, 1] = lasting
    run = replace(run, draws=draws)
    white = generator.normal(0.0, run.noise, len(run.x))
    run = replace(run, force=Problem([run]).predict(PLAIN, run) + white)
    problem = Problem([run])
    asked = PreparedQuestion(Question(PLAIN), problem)
    known = Information(asked.question, asked.evidence([run], draws=24))
    std = intervals_of(problem, PLAIN).std
    for name, found in known.deviations().items():
        assert found * asked.spread(name)[0] == pytest.approx(std[name], rel=0.1)
    short = replace(known.told, scatter=known.told.fitted)
    assert replace(known, told=short).deviations()["c_0"] < 0.7 * known.deviations()["c_0"]


def test_the_mean_variance_of_the_force_on_the_runs_of_the_fit_is_that_of_the_parameters() -> None:
    run = a_run()
    asked = PreparedQuestion(Question(PLAIN), Problem([run]))
    told = asked.evidence([run])
    known = Information(asked.question, told, told.normal / told.samples)
    assert known.of_force() == pytest.approx(np.sqrt(2.0 / told.samples), rel=1e-3)


def test_a_force_that_turns_within_samples_is_taken_for_noise_in_part() -> None:
    run = a_run()
    asked = PreparedQuestion(Question(PLAIN), Problem([run]))
    own = RigLimits(stroke=0.02, speed=0.25, rate=1.0 / run.dt)
    planner = Planner(Goal((asked,), (), 1, cost=len), own, run.noise, run.draws, 1.0 / run.dt)
    t = np.arange(len(run.x)) * run.dt
    slow, fast = (
        planner._recorded(asked, replace(run, v=0.1 * np.cos(2.0 * np.pi * f * t))).noise
        for f in (0.5, 20.0)
    )
    assert slow == pytest.approx(run.noise, rel=0.15)
    assert fast > 3.0 * run.noise


def test_a_run_that_is_held_out_decides_and_is_not_fitted_to() -> None:
    run = a_run()
    asked = PreparedQuestion(Question(PLAIN), Problem([run]))
    one = Information(asked.question, asked.evidence([run]))
    more = one.with_runs([asked.evidence([run]).judging()])
    assert more.deviations() == one.deviations()
    assert (more.told.held_out, more.told.samples) == (one.told.samples, 2 * one.told.samples)


def test_a_question_that_no_test_tells_of_has_no_typical_test() -> None:
    asked = PreparedQuestion(Question(PLAIN), Problem([a_run()]))
    nothing = asked.evidence([])
    signals = Test(Waveform("sine", 0.3, 1.0), Command("held", 0.0, 0.0)).signals(
        RigLimits(stroke=0.02, speed=0.25)
    )
    still = JudgedTest(
        Test(Waveform("sine", 0.3, 1.0), Command("held", 0.0, 0.0)), signals, (nothing,)
    )
    goal = Goal((asked,), (Information(asked.question, nothing),), 1, cost=len).among([still])
    assert goal.known[0].typical is None


def test_a_verdict_needs_half_of_the_tests_and_parameters_a_quarter() -> None:
    assert roles_of(4, judged=True) == [False, True, False, True]
    assert roles_of(8, judged=False) == [False, True, False, False] * 2
    assert roles_of(2, judged=False) == [False, True]
    assert roles_of(1, judged=True) == [False]


def test_a_figure_costs_nothing_below_what_is_enough() -> None:
    assert AskedFigure("see", "gas_spring", 0.1, 0.2).cost == 0.0
    assert cost_of([AskedFigure("see", "a", 0.4, 0.2), AskedFigure("sharpen", "b", 0.2, 0.2)]) > 0.0


def test_a_plan_of_a_new_rig_keeps_its_limits_and_sees_what_it_is_for(sheet: Path) -> None:
    found = bristle.plan(sheet, see="coil_lag")
    (row,) = [one for one in found.outcomes if one.purpose == "see"]
    assert row.name == "coil_lag"
    assert 0.0 < row.then < 0.02  # s; nothing measured tells before
    assert not np.isfinite(row.now)
    # A coil that lags shows where its command changes.
    assert all(np.ptp(one.V) > 1.0 for one in found.signals)
    for one in found.signals:
        assert np.max(np.abs(one.x)) <= 0.9 * 20e-3 * (1.0 + 1e-9)
        assert np.max(np.abs(one.v)) <= 0.9 * 0.25 * (1.0 + 1e-9)


def test_force_and_heat_are_kept_by_the_model_or_the_plan_is_refused(sheet: Path) -> None:
    found = bristle.plan(sheet, sharpen=True, heat="200 J", force="1.5 kN", motions=["sine"])
    for run, one in zip(found.runs(), found.signals, strict=True):
        assert run.signals["voltage"].max() < 0.75 * 5.0  # at 5 V the data sheet has 2 kN
        assert np.sum(np.abs(one.v)) * one.dt < 0.5  # m of travel: 200 J at 400 N
    with pytest.raises(StudyError, match="no test stays within the limits"):
        bristle.plan(sheet, sharpen=True, force="1 N")


def test_a_refusal_names_the_limits_that_allow_no_motion(sheet: Path) -> None:
    with pytest.raises(StudyError, match=r"acceleration of 0.001 m/s2 allow .* of 20 mm") as told:
        bristle.plan(sheet, sharpen=True, acceleration="1 mm/s2")
    assert "heat" not in str(told.value)


def test_a_sheet_that_is_not_there_is_no_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "--new", str(tmp_path / "rig.toml")]) == 2
    assert "rig.toml: there is no such file." in capsys.readouterr().err


@pytest.mark.slow  # a plan with every law as a rival
def test_laws_are_told_apart_before_the_first_measurement(sheet: Path) -> None:
    few = {"motions": ["sine"], "commands": ["stairs"]}
    found = bristle.plan(sheet, separate=["bingham", "lugre", "none"], **few)
    then = {one.name: one.then for one in found.outcomes}
    assert then["bingham or none"] == 0.0  # the data sheet's law is the model as it is
    assert then["bingham or lugre"] == then["lugre or none"] > BENCH.separating_sigma
    with pytest.raises(StudyError, match=r'no effect or law "lugree"\. Did you mean "lugre"'):
        bristle.plan(sheet, separate=["lugree", "none"])


def test_what_is_no_law_of_a_damper_is_no_rival(rig: bristle.Study) -> None:
    with pytest.raises(StudyError, match='no effect or law "linear_layer"'):
        bristle.plan(rig, separate=["linear_layer", "none"])


@pytest.mark.slow  # one more plan
def test_a_plan_in_ampere_tells_no_volts(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    text = SHEET.replace("max_force", 'command = "current"\nmax_force')
    file.write_text(text.replace('["0 V", "5 V"]', '["0 A", "2 A"]'))
    found = bristle.plan(file, see=["saturation"], sharpen=["f_c", "f_v"])
    learned = bristle.plan(file, learn=["current", "recent_current"])
    assert [one.name for one in learned.outcomes] == ["along current", "along recent_current"]
    units = {one.name: one.unit for one in found.outcomes}
    assert units["saturation"] == "A"
    assert "V" not in "".join(units.values())


@pytest.mark.slow  # a diagnosis and what it could name
def test_what_the_runs_at_hand_allow_of_an_effect_is_what_the_verdict_says(
    rig: bristle.Study,
) -> None:
    names = ["fluid_inertia", "saturation"]
    told = {one.effect: one for one in bristle.diagnose(rig, write=False).limits["damper"]}
    few = {"runs": 2, "duration": "6 s", "motions": ["sine"], "commands": ["stairs"]}
    found = {one.name: one for one in bristle.plan(rig, see=names, **few).outcomes}
    for name in names:
        assert found[name].now == pytest.approx(told[name].largest, rel=1e-6)
    assert found["fluid_inertia"].then < found["fluid_inertia"].now
    assert found["saturation"].then > found["saturation"].now  # V_s falls as the effect grows


@pytest.mark.slow  # a diagnosis and what it could name
def test_the_size_from_which_an_effect_is_named_is_the_verdicts(rig: bristle.Study) -> None:
    told = {one.effect: one for one in bristle.diagnose(rig, write=False).limits["damper"]}
    runs, model = rig.runs(), rig.model()
    opened = BenchRuns(runs.train, runs.holdout, model, identified=True).prepare("damper")
    names = ["delay", "stribeck", "saturation"]
    fitted = opened.known(opened.before.model)
    purposes = Purposes(fitted.model, tuple(sized_rival(name, fitted) for name in names))
    measured = RunsAtHand(opened.problem.runs, opened.held_out.runs)
    found = stated(purposes, opened.searched, measured, 1.0, seed=1)
    rows = outcomes(purposes, found.asked, found.known, found.known)  # no further test
    for row, one in zip(rows, purposes.effects, strict=True):
        assert one.limit is not None
        assert one.limit.named == pytest.approx(told[row.name].named, rel=1e-6)
        assert quantity(told[row.name].named, one.sized.unit, 2, fine=True) in row.needs
    stribeck = purposes.effects[1]
    assert stribeck.limit is not None
    assert stribeck.limit.named is not None
    allowed = 3.0 * stribeck.limit.named  # as where the model errs
    erring = replace(stribeck, limit=replace(stribeck.limit, largest=allowed))
    others = replace(purposes, effects=(purposes.effects[0], erring, purposes.effects[2]))
    row = outcomes(others, found.asked, found.known, found.known)[1]
    assert row.needs == f"above {quantity(allowed, '1', 2, fine=True)}"


def test_a_plan_sharpens_and_is_written_as_a_controller_takes_it(
    rig: bristle.Study, tmp_path: Path
) -> None:
    found = bristle.plan(rig, sharpen=["f_v"], runs=2, duration="6 s", pause="30 s")
    (row,) = found.outcomes
    assert row.name == "f_v"
    assert row.then < 0.9 * row.now
    assert found.worth
    folder = found.write(tmp_path / "plan")
    read = read_plan(folder)
    assert [run.role for run in read.runs] == ["train", "holdout"]
    assert read.study == rig.name
    for name in ("plan.md", "plan_1.png", "plan_2.csv"):
        assert (folder / name).is_file()
    said = (folder / "plan.md").read_text()
    assert "f_v" in said
    assert "rests for 30 s between" in said
    with pytest.raises(StudyError):
        found.write(tmp_path / "plan")


@pytest.mark.slow  # two plans
def test_tests_after_those_that_are_measured_have_the_next_numbers(
    rig: bristle.Study, tmp_path: Path
) -> None:
    folder = shutil.copytree(rig.folder, tmp_path / "rig")
    measured = [tmp_path / f"plan_{number}.csv" for number in (1, 12)]
    lines = rig.files("train")[0].read_text().split("\n")
    for file, count in zip(measured, (1500, 2000), strict=True):
        file.write_text("\n".join(lines[:count]) + "\n")
    roles = {file.name: "train" for file in measured}
    study = extend_study(bristle.Study(folder), measured, roles=roles).study
    again = bristle.plan(study, sharpen=["f_v"], runs=2, duration="4 s")
    assert [run.name for run in again.runs()] == ["plan_13", "plan_14"]
    assert (again.write(tmp_path / "plan") / "plan_14.png").is_file()


@pytest.mark.slow  # a plan, twice
def test_the_same_seed_gives_the_same_plan(sheet: Path) -> None:
    few = {"runs": 1, "duration": "4 s", "seed": 5}
    first, again = (bristle.plan(sheet, sharpen="f_c", **few).runs() for _ in range(2))
    assert [run.about for run in first] == [run.about for run in again]


def test_what_is_at_the_resolution_of_the_integration_gains_nothing() -> None:
    question = Question(PLAIN, (Rival("lag", PLAIN, PLAIN),))
    normal = 4e4 * np.eye(question.width)
    known = Information(question, Evidence(normal, normal, normal, 1000, 500))
    coarse, fine = (seen(known, least={"lag": least})[0].cost for least in (1.0, 1e-6))
    assert coarse == 0.0 < fine


@pytest.mark.slow  # one more plan
def test_rivals_that_no_test_tells_apart_are_said_to_be_so(rig: bristle.Study) -> None:
    few = {"runs": 1, "duration": "3 s", "motions": ["sine"], "commands": ["held"]}
    found = bristle.plan(rig, separate=["gas_spring", "duffing"], **few)
    assert not found.worth  # on this rig neither has a size
    assert "no test within these limits tells them apart" in found.sentences()[0]
    assert "Nothing is left to gain" in found.sentences()[-1]


@pytest.mark.slow  # one more plan
def test_a_command_that_does_not_move_shows_no_lag_and_is_said_to(sheet: Path) -> None:
    held = ("2 V", "2 V")
    found = bristle.plan(sheet, see="coil_lag", command=held)
    why = "coil_lag: no test within these limits shows it: the command does not move."
    assert found.sentences()[0] == why
    few = {"command": held, "runs": 1, "duration": "4 s", "motions": ["sine"]}
    apart = bristle.plan(sheet, separate=["coil_lag", "none"], **few)
    assert "differ by 0 standard deviations" in apart.sentences()[0]
    assert apart.outcomes[0].cells()[-1] == "0 std"


def test_a_folder_that_is_there_is_refused_before_the_search(
    sheet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    public = import_module("bristle.planning.api")
    monkeypatch.setattr(public, "plan", lambda *_, **__: pytest.fail("searched"))
    assert main(["plan", "--new", str(sheet), "-o", str(tmp_path)]) == 2
    assert "is there already" in capsys.readouterr().err


@pytest.mark.slow  # one more plan
def test_parts_without_a_form_are_covered_along_their_coordinates(sheet: Path) -> None:
    found = bristle.plan(sheet, learn=["displacement"])
    (row,) = found.outcomes
    assert row.name == "along displacement"
    assert row.then < 0.5 * row.now
    assert max(np.max(np.abs(one.x)) for one in found.signals) > 0.7 * 0.9 * 20e-3


@pytest.mark.parametrize(
    ("drive", "name", "held"),
    [
        ("voltage", "voltage", "the voltage does not move, it is 2 V throughout"),
        ("current", "recent_current", "the current does not move, it is 2 A throughout"),
    ],
)
def test_a_command_that_is_held_is_no_unknown_coordinate(drive: str, name: str, held: str) -> None:
    limits = RigLimits(0.02, 0.2, 10.0, command=(2.0, 2.0))
    with pytest.raises(StudyError, match=f"nothing can be learned along {name}: {held}"):
        open_parts(Model("bingham", {}), limits, [name], drive)
    with pytest.raises(StudyError, match=r'no coordinate "colour".*displacement'):
        open_parts(Model("bingham", {}), limits, ["colour"], drive)
    moving = replace(limits, command=(0.0, 2.0))
    (along,) = open_parts(Model("bingham", {}), moving, [name], drive).bases
    assert along.name == name.replace(drive, "voltage")


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"see": "gas_sprin"}, "gas_spring"), ({"separate": "gas_spring"}, "two or more"),
        ({"sharpen": "nothing"}, "parameter"), ({"learn": "colour"}, "displacement"),
        ({"stroke": "3 kg"}, "stroke"), ({"strok": 1.0}, "stroke"), ({"runs": 0}, "1 or more"),
        ({"seed": -1}, "0 or a positive"), ({"drift": "5 mm"}, "drift is for a building"),
        ({"record": "el_centro_1940_ns"}, "record is for a building"),
    ],
)  # fmt: skip
def test_what_cannot_be_planned_is_refused(
    sheet: Path, wrong: dict[str, object], told: str
) -> None:
    with pytest.raises(StudyError, match=told):
        bristle.plan(sheet, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("verdict", "wanted"),
    [
        ({"kind": "ambiguous", "effects": ["gas_spring", "duffing"]},
         PlanRequest(separate=("gas_spring", "duffing"))),
        ({"kind": "unknown", "effects": []}, PlanRequest(learn=())),
        ({"kind": "none", "effects": []}, PlanRequest(see=(), sharpen=())),
        (None, PlanRequest(see=(), sharpen=())),
    ],
)  # fmt: skip
def test_without_a_purpose_the_verdict_says_what_for(
    rig: bristle.Study, monkeypatch: pytest.MonkeyPatch, verdict: object, wanted: PlanRequest
) -> None:
    monkeypatch.setattr(type(rig), "verdict", lambda _self: verdict)
    (found,) = requests_of(None, rig)
    assert found.request == wanted


def test_a_plan_says_that_its_model_or_verdict_is_of_other_data(
    rig: bristle.Study, tmp_path: Path
) -> None:
    study = bristle.Study(shutil.copytree(rig.folder, tmp_path / "rig"))
    study.write_verdict({"schema": 2, "kind": "none", "effects": []})
    assert notes_of_change(study) == ()
    opened = bristle.Study(study.folder)
    file = study.files("train")[0]
    file.write_text("\n".join(file.read_text().split("\n")[:-500]) + "\n")
    model, verdict = notes_of_change(bristle.Study(study.folder))
    assert "present model was identified with. Identify it again:" in model
    assert "no longer those of this verdict. Diagnose again:" in verdict
    bristle.Study(study.folder).with_roles({study.files("train")[1].stem: "exclude"})
    with pytest.raises(StudyError, match="have been changed meanwhile"):
        bristle.plan(opened, see="coil_lag")


@pytest.mark.parametrize(
    ("value", "told"), [(0.1, "10 %"), (9.0, "900 %"), (2.8e9, "not identified")]
)
def test_a_parameter_that_no_run_tells_has_no_number(value: float, told: str) -> None:
    one = Outcome("sharpen", "c_1v", "standard deviation", "%", value, 0.01)
    assert one.cells()[-2:] == [told, "1 %"]

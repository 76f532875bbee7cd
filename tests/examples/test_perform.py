"""An example's true rig performs a plan: as it did before, within its limits, with fresh noise."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.measurement import read_measurement
from bristle.errors import StudyError
from bristle.examples import rigs
from bristle.examples.hidden import seal, unseal
from bristle.examples.make import (
    Choice,
    ground_of,
    make_bench,
    motion_of,
    perform_plan,
    programme_of,
    seconds_of,
)
from bristle.examples.rigs import Damper, in_library_names, instruments, write_csv
from bristle.planning.folder import PlanFolder, PlannedRun, write_plan
from bristle.study.steps import create_study
from bristle.study.study import Study

T = np.arange(1001) / 500.0
RAMP = np.sin(np.pi * T / T[-1]) ** 2
SINE = 0.012 * np.sin(6.0 * T) * RAMP
STEPS = np.where(T >= 0.8, 8.0, 1.0)


def planned(name: str = "plan_1", x: np.ndarray = SINE, volts: np.ndarray = STEPS) -> PlannedRun:
    return PlannedRun(name, "train", "", T, {"displacement": x, "voltage": volts})


def a_plan(folder: Path, *runs: PlannedRun, study: str = "my_rig", rig: str = "bench") -> Path:
    write_plan(PlanFolder(rig, study, 500.0, runs or (planned(),)), folder)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("example") / "my_rig"
    make_bench(folder, Choice(effects=("coil_lag",), noise=0.0))
    return folder


@pytest.fixture
def rig(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "my_rig"))


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_the_rig_is_the_one_that_the_first_runs_were_measured_on(rig: Path, tmp_path: Path) -> None:
    first = read_measurement(rig / "data" / "train_1.csv")
    signals = {name: first[name] for name in ("displacement", "voltage")}
    run = PlannedRun("again", "holdout", "", first.time, signals)
    (added,) = perform_plan(rig, a_plan(tmp_path / "plan", run)).runs
    assert (added.file, added.role) == ("data/again.csv", "holdout")
    again = read_measurement(rig / "data" / "again.csv")
    assert list(again.channels) == list(first.channels)
    error = again["force"] - first["force"]
    assert np.sqrt(np.mean(error**2)) < 1e-3 * np.sqrt(np.mean(first["force"] ** 2))


def test_instruments_have_the_noise_of_before_and_fresh_draws(tmp_path: Path) -> None:
    folder = tmp_path / "my_rig"
    make_bench(folder, Choice(nothing=True, noise=0.02))
    plan = a_plan(tmp_path / "plan")
    perform_plan(folder, plan)
    perform_plan(folder, plan, name="more")
    shown = [read_measurement(folder / "data" / f"{one}.csv") for one in ("plan_1", "more_1")]
    for channel, std in unseal(folder)["instruments"].items():
        difference = shown[0][channel] - shown[1][channel]
        assert np.std(difference) == pytest.approx(np.sqrt(2.0) * std, rel=0.1)


def test_what_is_there_already_is_not_performed_again(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = a_plan(tmp_path / "plan", planned(), planned("plan_2", 0.5 * SINE))
    assert main(["example", "perform", str(rig), str(plan)]) == 0
    said = capsys.readouterr().out
    assert "2 runs added" in said
    before = content(rig)
    assert main(["example", "perform", str(rig), str(plan)]) == 2
    assert "plan_1, plan_2 are performed already" in capsys.readouterr().err
    assert content(rig) == before
    more = a_plan(tmp_path / "more", planned(x=0.7 * SINE), planned("plan_2", 0.3 * SINE))
    assert main(["example", "perform", str(rig), str(more), "--as-runs", "more", "--json"]) == 0
    added = json.loads(capsys.readouterr().out)["added"]
    assert [run["file"] for run in added] == ["data/more_1.csv", "data/more_2.csv"]
    assert len(Study(rig).settings.runs) == 9


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (planned(x=2.0 * SINE), "asks for 21.7 mm to one side; this rig's stroke is 20 mm"),
        (planned(volts=1.5 * STEPS), "from 1.5 to 12 V; this rig's amplifier gives 0 to 8 V"),
        (planned(volts=STEPS - 2.0), "from -1 to 6 V"),
        (planned(x=SINE + 0.005), "displacement does not begin at zero"),
        (planned(x=0.012 * np.sin(6.0 * T)), "velocity does not begin at zero"),
    ],
)
def test_what_the_rig_cannot_do_is_refused(
    rig: Path, tmp_path: Path, run: PlannedRun, words: str
) -> None:
    before = content(rig)
    plan = a_plan(tmp_path / "plan", planned("first"), replace(run, name="second"))
    with pytest.raises(StudyError, match=words):
        perform_plan(rig, plan)
    assert content(rig) == before


def test_a_plan_for_another_rig_or_study_is_refused(rig: Path, tmp_path: Path) -> None:
    shaken = PlannedRun("quake", "train", "", T, {"ground_acceleration": 90.0 * SINE})
    other = a_plan(tmp_path / "other", shaken, rig="structure")
    with pytest.raises(StudyError, match=r'for a rig "structure", and .* is a "bench"'):
        perform_plan(rig, other)
    foreign = a_plan(tmp_path / "foreign", study="your_rig")
    with pytest.raises(StudyError, match="for the study your_rig, and this one is my_rig"):
        perform_plan(rig, foreign)
    driven = replace(planned(), signals={"displacement": SINE, "current": STEPS})
    with pytest.raises(StudyError, match="commands a current"):
        perform_plan(rig, a_plan(tmp_path / "driven", driven))
    assert len(perform_plan(rig, foreign, insist=True).runs) == 1
    with pytest.raises(StudyError, match="letters and digits"):
        perform_plan(rig, foreign, name="../x", insist=True)


def test_an_answer_that_tells_too_little_is_refused(rig: Path, tmp_path: Path) -> None:
    plan, answer = a_plan(tmp_path / "plan"), unseal(rig)
    seal(rig, {key: value for key, value in answer.items() if key != "instruments"})
    with pytest.raises(StudyError, match="older version"):
        perform_plan(rig, plan)
    seal(rig, answer | {"base": {**answer["base"], "c_0": 7.0}})
    with pytest.raises(StudyError, match="drew other rigs"):
        perform_plan(rig, plan)
    with pytest.raises(StudyError, match="there is no sealed"):
        perform_plan(tmp_path, plan)


def test_a_command_is_held_before_a_jump_and_straight_elsewhere() -> None:
    t = np.arange(6) / 100.0  # coarser than the recorder
    volts = programme_of(t, np.array([0.0, 0.0, 4.0, 4.0, 4.5, 5.0]))
    assert volts.jumps == (0.02,)
    shown = [volts.value(now) for now in (0.0, 0.0199, 0.02, 0.03, 0.035, 0.05)]
    assert shown == pytest.approx([0.0, 0.0, 4.0, 4.0, 4.25, 5.0])


def test_slow_ramps_of_a_command_that_begins_at_zero_reach_the_coil() -> None:
    t = np.arange(4001) / 500.0
    ramps = np.clip(20.0 * np.abs((t + 0.5) % 1.0 - 0.5) - 4.5, 0.0, 5.0)
    volts = programme_of(t, ramps)
    assert not volts.jumps
    damper = Damper("bingham", rigs.CENTRE["bingham"], {"coil_tau": 0.03})
    slide = rigs.Motion(t, lambda q: (0.02 * q, 0.02, 0.0))
    run = rigs.perform(damper, slide, volts, rigs.scales_of("bench", "bingham"))
    yields = damper.values["Y_1"] * 5.0  # what the largest command adds
    assert np.ptp(run["force"]) > 0.7 * yields


def test_a_motion_goes_through_its_samples() -> None:
    motion = motion_of(T + 3.0, SINE)
    assert motion.time.size == T.size
    assert seconds_of(T + 3.0) == pytest.approx(2.0)
    x, v, _ = motion.at(1.0)
    assert x == pytest.approx(SINE[500], abs=1e-9)
    assert v == pytest.approx((SINE[501] - SINE[499]) / 0.004, rel=1e-3)


def a_tower(folder: Path) -> tuple[Path, rigs.Tower]:
    """Return a short example of a building, sealed as `make_building` seals it, and its rig."""
    draw = rigs.streams(4)[0]
    values, frame = rigs.draw_damper("lugre", draw), rigs.draw_frame(draw)
    rig = rigs.tower_of(frame, "lugre", values, {"rub": 0.8})
    ground = 2.0 * np.sin(9.0 * T) * RAMP
    runs = {}
    for k, name in enumerate(("train_1", "holdout_1"), 1):
        runs[name] = rig.perform(k * ground_of(T, ground), programme_of(T, STEPS))
    files = []
    for name, run in runs.items():
        files.append(folder / f"{name}.csv")
        write_csv(files[-1], run)
    drawing = folder / "building.toml"
    drawing.write_text(
        'schema = 1\nname = "tower"\nbase = "isolated"\n'
        f"masses = {list(frame.masses)}\nstiffnesses = {list(frame.stiffnesses)}\n"
        "rayleigh = { ratio = 0.01, modes = [1, 3] }\n"
    )
    create_study(folder / "tower", files, rig="structure", building=drawing, law="lugre")
    answer = {
        "rig": "building", "law": "lugre", "seed": 4, "hidden": ["base_friction"],
        "base": in_library_names("lugre", values), "values": {"rub": (0.8, "N")},
        "instruments": instruments(runs, 0.0),
    }  # fmt: skip
    seal(folder / "tower", answer)
    return folder / "tower", rig


def test_a_building_is_shaken_as_planned(tmp_path: Path) -> None:
    folder, rig = a_tower(tmp_path)
    ground = 3.0 * np.sin(7.0 * T) * RAMP

    def quake(size: float) -> PlannedRun:
        signals = {"ground_acceleration": size * ground, "voltage": STEPS}
        return PlannedRun("quake", "train", "", T, signals)

    plan = a_plan(tmp_path / "plan", quake(1.0), study="tower", rig="structure")
    perform_plan(folder, plan)
    shown = next(run for run in Study(folder).read() if run.name == "quake")
    expected = rig.perform(ground, programme_of(T, STEPS))
    for name in ("force", "base_displacement", "floor2_acceleration_absolute"):
        size = np.max(np.abs(expected[name]))
        np.testing.assert_allclose(shown[name], expected[name], atol=1e-4 * size)
    strong = a_plan(tmp_path / "strong", quake(20.0), study="tower", rig="structure")
    with pytest.raises(StudyError, match=r"moves the base by \d+(\.\d)? mm to one side"):
        perform_plan(folder, strong, name="strong")

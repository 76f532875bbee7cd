"""Measured runs against their plan: what differs is told with its share, what does not is not."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import write
from numpy.typing import NDArray

from bristle.cli import main
from bristle.data.measurement import Measurement, measurements_of
from bristle.data.table import from_arrays
from bristle.errors import StudyError
from bristle.planning.folder import (
    PlanFolder,
    PlannedRun,
    compared,
    performed,
    planned_for,
    write_plan,
)
from bristle.study.steps import create_study
from bristle.study.study import Study

Array = NDArray[np.float64]
RATE = 500.0
T = np.arange(2501) / RATE
RAMP = np.sin(np.pi * T / T[-1]) ** 2


def planned(name: str = "plan_1", f: float = 0.8, role: str = "train") -> PlannedRun:
    x = 0.012 * np.sin(2.0 * np.pi * f * T) * np.minimum(1.0, 4.0 * RAMP)
    volts = np.select([T < 1.0, T < 2.2, T < 3.1], [0.0, 8.0, 3.0], 6.0)
    return PlannedRun(name, role, "", T, {"displacement": x, "voltage": volts})


def measured(run: PlannedRun, name: str = "", rest: float = 0.0, **changed: Array) -> Measurement:
    """Return a run as it was measured, with 1 % noise, `rest` s before it and after it."""
    rng, many = np.random.default_rng(3), round(rest * RATE)
    signals = run.signals | changed
    x, volts = (np.pad(signals[name], many) for name in ("displacement", "voltage"))
    x = x + 0.01 * np.std(x) * rng.standard_normal(x.size)
    v = np.gradient(x, 1.0 / RATE)
    table = {
        "time [s]": np.arange(x.size) / RATE, "displacement [mm]": 1e3 * x,
        "voltage [V]": volts + 0.02 * rng.standard_normal(x.size),
        "force [N]": 5.0 * np.tanh(v / 0.01) + 20.0 * v,
    }  # fmt: skip
    (found,) = measurements_of(from_arrays(table, f"{name or run.name}.csv"))
    return found


def differences(run: Measurement, plan: PlannedRun | None = None) -> list[str]:
    return list(compared(run, plan or planned(), "displacement").differences)


def test_nothing_is_said_of_a_run_as_planned() -> None:
    assert differences(measured(planned())) == []
    assert differences(measured(planned(), rest=1.5)) == []  # the recorder ran longer
    x = planned().signals["displacement"]
    assert differences(measured(planned(), displacement=0.97 * x + 0.002)) == []


def test_an_amplitude_that_was_not_reached_is_told_with_its_share() -> None:
    x = planned().signals["displacement"]
    assert differences(measured(planned(), displacement=0.81 * x)) == [
        "plan_1: the displacement reached 81 % of what was planned"
    ]
    assert differences(measured(planned(), displacement=np.clip(x, -0.009, 0.009))) == [
        "plan_1: the displacement reached 76 % of what was planned"
    ]
    assert differences(measured(planned(), displacement=1.2 * x)) == [
        "plan_1: the displacement reached 120 % of what was planned"
    ]


def test_a_command_that_was_clipped_or_weaker_is_told() -> None:
    volts = planned().signals["voltage"]
    (clipped,) = differences(measured(planned(), voltage=np.minimum(volts, 5.0)))
    assert clipped == "plan_1: the voltage reached 62 % of what was planned"
    (weaker,) = differences(measured(planned(), voltage=0.7 * volts))
    assert weaker == "plan_1: the voltage reached 70 % of what was planned"


def test_a_command_that_came_late_is_told() -> None:
    volts = planned().signals["voltage"]
    (late,) = differences(measured(planned(), voltage=np.roll(volts, 60)))
    assert late.startswith("plan_1: the voltage was another one than planned for ")
    assert differences(measured(planned(), voltage=np.roll(volts, 5))) == []  # 10 ms: 0.8 %
    (other,) = differences(measured(planned(), voltage=volts[::-1]))
    assert other == "plan_1: the voltage was another one than planned for 88 % of the run"


def test_a_recording_that_ends_early_is_told() -> None:
    run = measured(planned()).part(0, 1500, "plan_1")
    assert differences(run)[-1] == "plan_1: the recording covers 60 % of the 5 s that were planned"


def test_another_motion_is_told() -> None:
    (text,) = differences(measured(planned(f=2.3)), planned(f=0.8))
    assert text.startswith("plan_1: its displacement is another one than that of plan_1")


def test_a_velocity_stands_for_the_displacement() -> None:
    run = measured(planned())
    v = 0.81 * np.gradient(planned().signals["displacement"], 1.0 / RATE)
    moved = replace(run, channels={"velocity": v, "voltage": run["voltage"], "force": run["force"]})
    assert differences(moved) == ["plan_1: the velocity reached 81 % of what was planned"]
    without = replace(run, channels={"displacement": run["displacement"], "force": run["force"]})
    assert differences(without) == ["plan_1: the voltage was not measured"]


def test_runs_are_paired_by_name_then_by_motion() -> None:
    plan = PlanFolder(
        "bench", "", RATE, tuple(planned(f"plan_{k}", f) for k, f in enumerate((0.8, 1.3, 2.1), 1))
    )
    one, two, three = plan.runs

    def pairs(*runs: Measurement) -> list[str]:
        return [run.name if run else "" for run in planned_for(runs, plan)]

    assert pairs(measured(two, "day2_plan_2_ok"), measured(one, "PLAN_1")) == ["plan_2", "plan_1"]
    assert pairs(measured(one, "a"), measured(three, "b")) == ["plan_1", "plan_3"]
    assert pairs(measured(two, "plan_2"), measured(three, "b")) == ["plan_2", "plan_3"]
    many = pairs(measured(one, "a"), measured(planned(f=3.7), "b"), measured(two, "c"),
                 measured(three, "d"))  # fmt: skip
    assert many == ["plan_1", "", "plan_2", "plan_3"]
    assert pairs(measured(one, "plan_12")) == ["plan_1"]  # by its motion, not by its name


def written(path: Path, run: Measurement) -> Path:
    columns = {"displacement": (1e3, "mm"), "voltage": (1.0, "V"), "force": (1.0, "N")}
    rows = {f"{name} [{unit}]": factor * run[name] for name, (factor, unit) in columns.items()}
    return write(path, {"time [s]": run.time, **rows})


@pytest.fixture
def lab(tmp_path: Path) -> tuple[Path, Path]:
    """Return a study of two runs, and a plan for it."""
    first = [planned("run_1", 1.0), planned("run_2", 1.7)]
    files = [written(tmp_path / f"{run.name}.csv", measured(run)) for run in first]
    create_study(tmp_path / "my_rig", files, law="bingham")
    plan = PlanFolder("bench", "my_rig", RATE, (planned(), planned("plan_2", 1.3, "holdout")))
    write_plan(plan, tmp_path / "plan")
    return tmp_path / "my_rig", tmp_path / "plan"


def test_the_command_takes_roles_from_the_plan_and_warns(
    lab: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, plan = lab
    second = planned("plan_2", 1.3)
    weak = measured(second, displacement=0.81 * second.signals["displacement"])
    files = [written(tmp_path / "second.csv", weak)]
    assert main(["study", "extend", str(rig), str(files[0]), "--plan", str(plan)]) == 0
    said = capsys.readouterr().out
    assert "data/second.csv" in said
    assert [run.role for run in Study(rig).settings.runs] == ["train", "holdout", "holdout"]
    assert "Planned, and not among the files: plan_1." in said
    assert "Warning: second: the displacement reached 81 % of what was planned." in said
    first = written(tmp_path / "plan_1.csv", measured(planned()))
    assert main(["study", "extend", str(rig), str(first), "--plan", str(plan), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["plan"] == [{"measured": "plan_1", "planned": "plan_1", "differences": []}]


def test_what_cannot_be_held_against_a_plan_is_refused(
    lab: tuple[Path, Path], tmp_path: Path
) -> None:
    study = Study(lab[0])
    shaken = PlannedRun("quake", "train", "", T, {"ground_acceleration": RAMP})
    with pytest.raises(StudyError, match='for a rig "structure"'):
        performed(study, [], PlanFolder("structure", "", RATE, (shaken,)))
    study.settings = replace(study.settings, split="restart")
    with pytest.raises(StudyError, match="files of one run"):
        performed(study, [], PlanFolder("bench", "", RATE, (planned(),)))


def test_a_plan_of_another_study_is_told(lab: tuple[Path, Path], tmp_path: Path) -> None:
    study, file = Study(lab[0]), written(tmp_path / "plan_1.csv", measured(planned()))
    notes = {
        name: performed(study, [file], PlanFolder("bench", name, RATE, (planned(),))).notes
        for name in ("", study.name, "rig_b")
    }
    assert notes == {
        "": (), study.name: (),
        "rig_b": (f"the plan was made for the study rig_b, and this one is {study.name}",),
    }  # fmt: skip

"""The folder of a plan is read as it was written; what is wrong is told with file and line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bristle.errors import BristleError, StudyError
from bristle.planning.folder import PlanFolder, PlannedRun, read_plan, write_plan

T = np.arange(1001) / 500.0
SINE = 0.012 * np.sin(2.0 * np.pi * T) * np.sin(np.pi * T / T[-1]) ** 2
STEPS = np.where(T > 1.0, 8.0, 0.0)


def planned(name: str = "plan_1", role: str = "train") -> PlannedRun:
    about = "a sine of 12 mm at 1 Hz, voltage switched between 0 and 8 V"
    return PlannedRun(name, role, about, T, {"displacement": SINE, "voltage": STEPS})


def bench(*runs: PlannedRun) -> PlanFolder:
    return PlanFolder("bench", "my_rig", 500.0, runs or (planned(), planned("plan_2", "holdout")))


def test_a_plan_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_plan(bench(), tmp_path / "plan", {"plan_1.png": b"picture"})
    found = read_plan(tmp_path / "plan")
    assert (found.rig, found.study, found.rate) == ("bench", "my_rig", 500.0)
    assert (found.motion, found.command) == ("displacement", "voltage")
    assert [(run.name, run.role) for run in found.runs] == [
        ("plan_1", "train"), ("plan_2", "holdout")
    ]  # fmt: skip
    run = found.runs[0]
    assert run.about.startswith("a sine of 12 mm")
    assert run.duration == pytest.approx(2.0)
    np.testing.assert_allclose(run.time, T, atol=1e-12)
    np.testing.assert_allclose(run.signals["displacement"], SINE, atol=1e-11)
    np.testing.assert_allclose(run.signals["voltage"], STEPS)
    head = (tmp_path / "plan" / "plan_1.csv").read_text().splitlines()[0]
    assert head == "time [s],displacement [mm],voltage [V]"
    assert (tmp_path / "plan" / "plan_1.png").read_bytes() == b"picture"


def test_a_building_without_a_command(tmp_path: Path) -> None:
    shaken = PlannedRun("quake", "train", "", T, {"ground_acceleration": 100.0 * SINE})
    write_plan(PlanFolder("structure", "", 500.0, (shaken,)), tmp_path / "plan")
    found = read_plan(tmp_path / "plan")
    assert (found.motion, found.command, found.study) == ("ground_acceleration", "", "")
    np.testing.assert_allclose(found.runs[0].signals["ground_acceleration"], 100.0 * SINE)
    head = (tmp_path / "plan" / "quake.csv").read_text().splitlines()[0]
    assert head == "time [s],ground_acceleration [m/s2]"


def test_a_folder_that_is_there_is_kept(tmp_path: Path) -> None:
    (tmp_path / "plan").mkdir()
    with pytest.raises(StudyError, match="is there already"):
        write_plan(bench(), tmp_path / "plan")
    assert not list((tmp_path / "plan").iterdir())


def test_nothing_is_left_of_a_plan_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(StudyError, match=r"plan: cannot be written \(No space left"):
        write_plan(bench(), tmp_path / "plan")
    assert not list(tmp_path.iterdir())


def test_no_plan(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"there is no plan\.toml"):
        read_plan(tmp_path / "nothing")


def test_a_rate_that_is_not_that_of_the_files_is_refused(tmp_path: Path) -> None:
    write_plan(bench(), tmp_path / "plan")
    path = tmp_path / "plan" / "plan.toml"
    path.write_text(path.read_text().replace("rate = 500.0", "rate = 250.0"))
    with pytest.raises(BristleError, match="500 samples per second, and 250"):
        read_plan(tmp_path / "plan")


def _later(lines: list[str]) -> list[str]:
    return [*lines[:500], *(f"{float(one.split(',')[0]) + 0.0013},0,0" for one in lines[500:])]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda lines: ["time [s],position [mm],voltage [V]", *lines[1:]], "displacement, voltage"),
        (lambda lines: ["time [s],displacement,voltage [V]", *lines[1:]], "has no unit"),
        (lambda lines: [*lines[:9], "0.016,,0", *lines[10:]], "line 10: .* no finite number"),
        (lambda lines: [*lines[:9], "0.016,fast,0", *lines[10:]], "line 10: .* no finite"),
        (lambda lines: [*lines[:9], lines[8], *lines[9:]], "line 10: the time does not rise"),
        (lambda lines: [*lines[:300], *lines[330:]], "not evenly spaced"),
        (_later, "evenly spaced"),
        (lambda lines: lines[:3], "sample"),
    ],
)
def test_a_wrong_file_of_a_run(
    tmp_path: Path, change: Callable[[list[str]], list[str]], said: str
) -> None:
    write_plan(bench(), tmp_path / "plan")
    path = tmp_path / "plan" / "plan_2.csv"
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
    with pytest.raises(BristleError, match=said) as caught:
        read_plan(tmp_path / "plan")
    assert "plan_2.csv" in str(caught.value)

"""`bristle run` and `bristle.run`: what they write, and what is left when a run is cut short."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from toys import Maker

import bristle
from bristle.cli import main
from bristle.engine import cosimulation
from bristle.engine.results import load_results
from bristle.engine.run import RunInterrupted, run
from bristle.errors import RunError
from bristle.system.scenario import load_scenario, stock_scenarios
from bristle.system.toml import save, scenario_text

PACKAGE = Path(bristle.__file__).resolve().parent.parent
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(PACKAGE)}
COMMAND = [sys.executable, "-m", "bristle.cli", "run"]


def apart(*arguments: object, cwd: Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run `bristle run` in a process of its own."""
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True, timeout=60, **options,
    )  # fmt: skip


Command = Callable[..., SimpleNamespace]


@pytest.fixture
def command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Command:
    """Return a function that runs `bristle run` in the test's folder."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> SimpleNamespace:
        code = main(["run", *map(str, arguments)])
        said, errors = capsys.readouterr()
        return SimpleNamespace(returncode=code, stdout=said, stderr=errors)

    return call


def rows(folder: Path) -> int:
    """Return how many rows a run has written so far."""
    file = folder / "results" / "toys" / "results.csv"
    lines = file.read_text().splitlines() if file.exists() else []
    return sum(not line.startswith("#") for line in lines) - 1


def wait_until(what: Callable[[], object], process: subprocess.Popen[str]) -> None:
    """Wait for what a process does."""
    until = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < until
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)


def started(*arguments: object, cwd: Path) -> subprocess.Popen[str]:
    """Start `bristle run` and wait until its results file is there."""
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    wait_until((cwd / "results" / "toys" / "results.csv").exists, process)
    return process


@pytest.fixture
def fine(scenario_of: Maker) -> Path:
    return scenario_of({"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"})


def slow(scenario_of: Maker, how: str, at: float) -> Path:
    """Return a scenario that takes 10 ms per step (stop after 100 s) until it fails."""
    return scenario_of(
        {"ramp": "Ramp", "bad": "Failing", "brake": "Failing"},
        {"bad.u": "ramp.value"},
        parameters={
            "bad": {"how": how, "at": at},
            "brake": {"how": "slow", "at": 0.05, "u": 0.0},
        },
        stop=1000.0,
    )


# -- what a run gives


def test_folder_holds_results_figure_and_log_and_nothing_else(
    fine: Path, tmp_path: Path, command: Command
) -> None:
    done = command(fine, "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    folder = tmp_path / "results" / "toys"
    assert sorted(p.name for p in folder.iterdir()) == ["figure.png", "log", "results.csv"]
    assert "from 0 to 1 s" in done.stdout
    for name in ("results.csv", "figure.png", "log"):
        assert f"results/toys/{name}" in done.stdout
    frame = load_results(folder)
    assert frame.attrs["complete"] is True
    assert frame.equals(run(fine))


def test_older_files_of_the_folder_are_replaced(
    fine: Path, tmp_path: Path, command: Command
) -> None:
    command(fine, "--out", "out", "--no-figure")
    command(fine, "--out", "out", "--no-figure", "--format", "parquet")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["log", "results.parquet"]
    assert load_results(tmp_path / "out").equals(run(fine))


def test_a_run_with_another_value_has_a_title_and_a_folder_of_its_own(
    fine: Path, tmp_path: Path, command: Command
) -> None:
    command(fine, "--no-figure")
    done = command(fine, "--no-figure", "--set", "sum.gain=3")
    plain, changed = (tmp_path / "results" / name for name in ("toys", "toys_sum.gain=3"))
    assert load_results(plain).equals(run(fine))
    frame = load_results(changed)
    assert frame.equals(run(fine, {"sum.gain": 3}))
    assert "gain = 3" in frame.attrs["made"]["title"]
    assert frame.attrs["made"]["title"] in done.stdout.replace("\n", " ")


NOTED = """
schema = 1
[run]
stop = 0.1
step = 0.01
[components.signal]
fmu = "SignalSource"
[components.motion]
fmu = "PrescribedMotion"
[components.damper]
fmu = "LuGreDamper"
[connections]
"damper.displacement" = "motion.displacement"
"damper.velocity" = "motion.velocity"
"damper.voltage" = "signal.value"
"""


def test_notes_on_units_that_check_shows_are_shown_and_logged(
    tmp_path: Path, command: Command
) -> None:
    (tmp_path / "bench.toml").write_text(NOTED)
    done = command("bench.toml", "--no-figure")
    note = (
        'note: bench.toml:15: "signal.value" has no unit; "damper.voltage" takes its values as [V].'
    )
    assert (done.returncode, done.stderr) == (0, f"{note}\n")
    assert note in (tmp_path / "results" / "bench" / "log").read_text().splitlines()
    for name in ("signal.value", "motion.displacement", "damper.force"):
        assert name in done.stdout


@pytest.mark.parametrize("more", ["factor = 1.0", "factor = 2.0", "offset = 0.5"])
def test_a_run_with_a_scaled_connection_draws_its_figure(
    tmp_path: Path, command: Command, more: str
) -> None:
    scaled = f'{{ from = "signal.value", {more} }}'
    (tmp_path / "bench.toml").write_text(NOTED.replace('"signal.value"', scaled))
    done = command("bench.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "results" / "bench" / "figure.png").stat().st_size > 10_000


def test_json_gives_peaks_and_rms_with_units(fine: Path, tmp_path: Path, command: Command) -> None:
    done = command(fine, "--json", "--no-figure", "--set", "sum.gain=3")
    answer = json.loads(done.stdout)
    frame = run(fine, {"sum.gain": 3})
    assert (answer["complete"], answer["rows"], answer["window"]) == (True, 11, [0.0, 1.0])
    outputs = {entry["name"]: entry for entry in answer["outputs"]}
    values = frame["sum.y"].to_numpy()
    assert outputs["sum.y"]["peak"] == np.abs(values).max()
    assert outputs["sum.y"]["rms"] == pytest.approx(np.sqrt(np.mean(values**2)))
    assert outputs["sum.y"]["time_of_peak"] == 1.0


def test_nothing_is_written_from_python_without_out(
    fine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    run(fine)
    assert sorted(tmp_path.rglob("*")) == before


def test_results_say_how_they_were_made(fine: Path, tmp_path: Path) -> None:
    frame = run(fine, {"sum.gain": 3.0}, out=tmp_path / "out")
    made = load_results(tmp_path / "out").attrs["made"]
    assert made == frame.attrs["made"]
    assert made["overrides"] == {"sum.gain": 3.0}
    assert (made["step"], made["algorithm"], made["engine"]) == (0.1, "gauss-seidel", "fmu")
    assert made["version"] == bristle.__version__
    assert made["fmus"]["ramp"].startswith("Ramp ")
    assert 0 < made["wall_time"] < 60
    again = tmp_path / "again.toml"
    again.write_text(made["scenario"])
    assert run(again).equals(frame)


@pytest.mark.parametrize("file", stock_scenarios(), ids=lambda file: file.stem)
def test_text_of_a_scenario_is_the_scenario(file: Path, tmp_path: Path) -> None:
    scenario = load_scenario(file)
    copy = tmp_path / file.name
    copy.write_text(scenario_text(scenario))
    again = load_scenario(copy)
    assert again == scenario
    assert list(again.components) == list(scenario.components)
    save(scenario, tmp_path / "saved" / file.name)
    assert load_scenario(tmp_path / "saved" / file.name) == scenario


def test_text_of_a_scenario_takes_awkward_texts(fine: Path) -> None:
    text = fine.read_text().replace('"toys"', r'"a \"b\" \\ µ 😀 \u007f \n c"')
    fine.write_text(text)
    scenario = load_scenario(fine)
    assert tomllib.loads(scenario_text(scenario))["title"] == scenario.title


def test_loaded_scenario_runs_with_and_without_overrides(fine: Path) -> None:
    scenario = load_scenario(fine, {"sum.gain": 3.0})
    assert run(scenario)["sum.y"].iloc[-1] == pytest.approx(0.55 + 3.0)
    assert run(scenario, {"sum.gain": 4.0})["sum.y"].iloc[-1] == pytest.approx(0.55 + 4.0)
    longer = run(scenario, {"run.stop": 2.0})
    assert longer["sum.y"].iloc[10] == pytest.approx(0.55 + 3.0)
    assert longer.attrs["made"]["overrides"] == {"sum.gain": 3.0, "run.stop": 2.0}


def test_overrides_of_numpy_and_paths_are_written(fine: Path, tmp_path: Path) -> None:
    overrides = {
        "sum.gain": np.int64(3),
        "sum.fmu": Path(load_scenario(fine).components["sum"].path),
    }
    frame = run(fine, overrides, out=tmp_path / "out")
    made = load_results(tmp_path / "out").attrs["made"]
    assert made["overrides"] == {"sum.gain": 3, "sum.fmu": str(overrides["sum.fmu"])}
    assert load_results(tmp_path / "out").equals(frame)


def test_fmu_path_imports_neither_numba_nor_scipy(fine: Path) -> None:
    code = (
        "import bristle, sys; bristle.run(sys.argv[1]); print({'numba', 'scipy'} & {*sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(fine)],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.stdout == "set()\n", done.stderr


def test_run_in_a_thread(fine: Path) -> None:
    found: list[pd.DataFrame] = []
    thread = threading.Thread(target=lambda: found.append(run(fine)))
    thread.start()
    thread.join()
    assert found[0].equals(run(fine))


# -- what is wrong before the run: exit 2, nothing left behind


def test_bad_input_leaves_nothing_behind(fine: Path, tmp_path: Path, command: Command) -> None:
    fine.write_text(fine.read_text().replace("ramp.value", "ramp.valeu"))
    done = command(fine)
    assert done.returncode == 2
    assert "valeu" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_out_that_is_a_file_is_refused(
    fine: Path, tmp_path: Path, out: str, command: Command
) -> None:
    (tmp_path / "file").write_text("mine")
    done = command(fine, "--out", out)
    assert done.returncode == 2
    assert out in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize(("name", "code"), [("figure.png", 2), ("results.csv", 2), ("log", 1)])
def test_file_that_cannot_be_replaced_is_named(
    fine: Path, tmp_path: Path, name: str, code: int, command: Command
) -> None:
    (tmp_path / "out" / name / "in the way").mkdir(parents=True)
    done = command(fine, "--out", "out", "--no-figure")
    assert done.returncode == code
    assert f"out/{name}: cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    if name == "log":  # found when the run is over: nothing of it is lost
        assert load_results(tmp_path / "out").equals(run(fine))


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_out_without_permission_is_refused(fine: Path, tmp_path: Path, command: Command) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    done = command(fine, "--out", "locked")
    assert done.returncode == 2
    assert "Permission denied" in done.stderr


@pytest.mark.parametrize("wrong", [{"engine": "magic"}, {"format": "xlsx"}])
def test_unknown_choices_are_refused(fine: Path, wrong: dict[str, str]) -> None:
    with pytest.raises(RunError, match="is not known; there are: ") as caught:
        run(fine, **wrong)  # type: ignore[arg-type]
    assert caught.value.exit_code == 2


# -- what is left of a run that is cut short


def left(tmp_path: Path) -> pd.DataFrame:
    """Return what a run left, after checking that it says so and that its rows are right."""
    frame = load_results(tmp_path / "results" / "toys")
    assert frame.attrs["complete"] is False
    assert frame["ramp.value"].to_numpy() == pytest.approx(np.arange(len(frame)) / 10)
    return frame


def test_component_that_fails_costs_exit_1_and_keeps_the_rows(
    scenario_of: Maker, tmp_path: Path, command: Command
) -> None:
    done = command(slow(scenario_of, "discard", 2.0))
    assert done.returncode == 1
    assert "RunError: bad in the step from t = 1.9 s" in done.stderr
    assert "Rows up to t = 1.9 s are kept in results/toys/results.csv" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(left(tmp_path)) == 20
    assert (tmp_path / "results" / "toys" / "figure.png").exists()


def test_killed_run_leaves_a_readable_file(scenario_of: Maker, tmp_path: Path) -> None:
    process = started(slow(scenario_of, "discard", 1e9), cwd=tmp_path)
    wait_until(lambda: rows(tmp_path) > 50, process)
    process.kill()
    process.communicate()
    assert len(left(tmp_path)) > 50
    assert {p.name for p in (tmp_path / "results" / "toys").iterdir()} <= {"results.csv", "log"}


def test_foreign_fmu_that_ends_the_process_leaves_a_readable_file(
    scenario_of: Maker, tmp_path: Path
) -> None:
    done = apart(slow(scenario_of, "abort", 20.0), cwd=tmp_path)
    assert done.returncode == -signal.SIGABRT
    assert 0 < len(left(tmp_path)) < 200


def test_ctrl_c_stops_between_two_steps(scenario_of: Maker, tmp_path: Path) -> None:
    process = started(slow(scenario_of, "discard", 1e9), cwd=tmp_path)
    wait_until(lambda: rows(tmp_path) > 10, process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    *_progress, last = errors.splitlines()  # a slow machine tells how far it is
    assert last.startswith("interrupted. Rows up to t = ")
    assert len(left(tmp_path)) > 10


def test_ctrl_c_ends_a_component_that_hangs(scenario_of: Maker, tmp_path: Path) -> None:
    hangs = tmp_path / "hangs"
    process = started(slow(scenario_of, f"hang {hangs}", 3.0), cwd=tmp_path)
    wait_until(hangs.exists, process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "a component does not end its step. Rows up to t = 2.9 s are kept" in errors
    assert len(left(tmp_path)) == 30


def test_ctrl_c_in_the_last_block_of_steps_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The run is whole, and a caller's loop of runs ends all the same."""
    advance = cosimulation.Master.advance

    def last(self: cosimulation.Master, count: int) -> None:
        advance(self, count)
        if self.rows > self.steps:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(cosimulation.Master, "advance", last)
    with pytest.raises(RunInterrupted, match="after the last step") as caught:
        run("bench_sine_bingham", {"run.stop": 0.05})
    assert len(caught.value.frame) == 101
    assert caught.value.frame.attrs["complete"]


def test_ctrl_c_in_python_gives_the_rows(
    scenario_of: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = signal.getsignal(signal.SIGINT)
    advance = cosimulation.Master.advance

    def interrupted(self: cosimulation.Master, count: int) -> None:
        advance(self, count)
        if self.rows > 5:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(cosimulation.Master, "advance", interrupted)
    with pytest.raises(RunInterrupted, match="Rows up to t = ") as caught:
        run(slow(scenario_of, "discard", 1e9))
    assert signal.getsignal(signal.SIGINT) is before
    frame = caught.value.frame
    assert frame.attrs["complete"] is False
    assert 2 < len(frame) < 10_000


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits on file sizes")
def test_disk_that_fills_up_leaves_whole_lines(scenario_of: Maker, tmp_path: Path) -> None:
    import resource

    file = scenario_of({"ramp": "Ramp"}, stop=20_000.0)
    done = apart(
        file,
        "--no-figure",
        cwd=tmp_path,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1_500_000, 1_500_000)),
    )
    assert done.returncode == 1
    assert "results.csv: cannot be written on: File too large" in done.stderr
    assert "Traceback" not in done.stderr
    left(tmp_path)


# -- with the built-in components


@pytest.fixture(scope="module")
def pulse() -> pd.DataFrame:
    return run("half_sine_pulse", {"run.stop": 1.0})


def test_half_sine_pulse_stays_near_its_reference(pulse: pd.DataFrame) -> None:
    # physics of the half-sine table: LuGre, 4 V, exact peaks; the coupling at 2 ms costs < 2 %.
    peaks = pulse.abs().max()
    assert peaks["structure.base_displacement"] == pytest.approx(0.005340066, rel=0.02)
    assert peaks["structure.floor2_acceleration_absolute"] == pytest.approx(3.3272810, rel=0.02)
    assert peaks["damper.force"] == pytest.approx(5.8066298, rel=0.02)
    assert pulse.attrs["units"]["damper.force"] == "N"


def test_rows_of_structure_and_damper_are_of_one_time(pulse: pd.DataFrame) -> None:
    """Base equilibrium holds in every row: the acceleration is that under the force shown."""
    m_b, c11, c12, k_b, k = (
        1.96935633694460,
        1.116350092135,
        -0.391859683153,
        1057.0,
        1366.48048703339,
    )
    s = pulse.filter(like="structure.").rename(columns=lambda name: name.split(".")[1])
    force = -(
        m_b * s.base_acceleration_absolute
        + c11 * s.base_velocity
        + c12 * s.floor1_velocity
        + (k_b + k) * s.base_displacement
        - k * s.floor1_displacement
    )
    assert force.to_numpy() == pytest.approx(pulse["damper.force"].to_numpy(), abs=1e-9)


def test_leaving_the_stroke_is_said_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run("half_sine_pulse", {"run.stop": 0.5, "damper.stroke": 0.004}, out=tmp_path)
    said = [r.getMessage() for r in caplog.records if "stroke" in r.getMessage()]
    assert len(said) == 1
    assert said[0].startswith("damper: the displacement leaves the stroke: stroke_ratio is above 1")
    assert said[0] in (tmp_path / "log").read_text()


def test_voltage_out_of_range_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    run("half_sine_pulse", {"run.stop": 0.1, "voltage.level": 9.0})
    assert sum("V" in r.getMessage() for r in caplog.records) == 1

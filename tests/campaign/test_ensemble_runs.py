"""Ensembles as they run: the same on any number of processes, resumable, failures counted."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bristle
from bristle.campaign import EnsemblePlan, read_ensemble
from bristle.campaign.campaign import Campaign, RunOutcome, Statistic
from bristle.campaign.table import LEVELS, RunsTable, failures
from bristle.core import files
from bristle.engine.coupled import Coupled
from bristle.engine.results import RunTable
from bristle.errors import EnsembleError, RunError, ScenarioError
from bristle.system.model import System

Write = Callable[..., Path]
ROOT = Path(__file__).parents[2]
PEAK = "peak structure.floor2_acceleration_absolute"


def test_a_run_is_the_scenario_with_its_values(write: Write, tmp_path: Path) -> None:
    path = write(('"structure.building.masses.2" = { uniform = [1.1, 1.4] }\n', ""))
    found = bristle.ensemble(path, runs=3)
    for run, row in found.runs.iterrows():
        overrides = {name: row[name] for name in ("damper.sigma_a", "voltage.level")}
        frame = bristle.run("half_sine_pulse", {"run.stop": 0.5, **overrides}, engine="compiled")
        y = frame["structure.floor2_acceleration_absolute"]
        assert row[PEAK] == y.abs().max(), run
        assert row[PEAK.replace("peak", "rms")] == pytest.approx(np.sqrt((y**2).mean()), rel=1e-12)
        assert row["max damper.force"] == frame["damper.force"].max()


def test_a_varied_building_is_the_building_of_that_file(write: Write, tmp_path: Path) -> None:
    row = bristle.ensemble(write(), runs=2).runs.loc[1]
    building = tmp_path / "b.toml"
    building.write_text(
        f"""schema = 1
        masses = [1.96935633694460, 1.23224427177553, {float(row["structure.building.masses.2"])}]
        stiffnesses = [1057.0, 1366.48048703339, 1366.48048703339]
        rayleigh = {{ alpha = 0.213967932082332, beta = 2.86765663228640e-4 }}
        """
    )
    overrides = {name: row[name] for name in ("damper.sigma_a", "voltage.level")}
    overrides |= {"structure.building": str(building), "run.stop": 0.5}
    frame = bristle.run("half_sine_pulse", overrides, engine="compiled")
    assert row[PEAK] == frame["structure.floor2_acceleration_absolute"].abs().max()


def test_a_scenario_that_changed_is_read_again_in_the_same_process(
    write: Write, tmp_path: Path
) -> None:
    mine = tmp_path / "mine_scenario.toml"
    stock = (files.scenarios_folder() / "half_sine_pulse.toml").read_text()
    mine.write_text(stock)
    path = write(
        ("half_sine_pulse", mine.name),
        ('[set]\n"run.stop" = 0.5\n', ""),
        ('"structure.building.masses.2" = { uniform = [1.1, 1.4] }\n', ""),
    )
    before = read_ensemble(path)
    assert before.campaign().varied(before.values(0)).stop == 10.0
    mine.write_text(re.sub(r"(?m)^stop = .*$", "stop = 1.0", stock))
    after = read_ensemble(path)
    assert after.digest() != before.digest()
    assert after.campaign().varied(after.values(0)).stop == 1.0


def test_records_steps_and_components_may_vary(write: Write, tmp_path: Path) -> None:
    record = tmp_path / "shake.csv"
    record.write_text("time [s],acceleration [m/s2]\n0.0,0.0\n0.1,1.5\n0.2,0.0\n")
    path = write(
        ("half_sine_pulse", "el_centro_0p6g_constant_voltage"),
        ("each = [0.0, 4.0]", "uniform = [0.0, 4.0]"),
        (
            "[vary]",
            """[vary]
            "ground.record" = { each = ["el_centro_1940_ns", "shake.csv"] }
            "run.step" = { each = [0.002, 0.005] }
            "damper.fmu" = { choice = ["LuGreDamper"] }""",
        ),
    )
    runs = bristle.ensemble(path, runs=4).runs
    assert (runs["status"] == "done").all()
    assert runs["run.step"].tolist() == [0.002, 0.005, 0.002, 0.005]
    assert runs["ground.record"].tolist() == ["el_centro_1940_ns"] * 2 + [str(record)] * 2
    assert runs[PEAK].nunique() == 4


def test_runs_are_the_same_on_one_process_and_on_two(write: Write, tmp_path: Path) -> None:
    files = []
    for workers in (1, 2):
        found = bristle.ensemble(write(), out=tmp_path / str(workers), workers=workers)
        assert len(found.runs) == 12
        files.append((tmp_path / str(workers) / "runs.csv").read_bytes())
    assert files[0] == files[1]
    again = found.plan.campaign().outcome(7)
    assert again.numbers == tuple(found.runs.loc[7, [o.name for o in found.plan.outputs]])


def test_an_ensemble_goes_on_where_it_was(write: Write, tmp_path: Path) -> None:
    whole = bristle.ensemble(write(), out=tmp_path / "whole")
    assert bristle.ensemble(write(), out=tmp_path / "parts", runs=5).continued == 0
    found = bristle.ensemble(write(), out=tmp_path / "parts")
    assert found.continued == 5
    pd.testing.assert_frame_equal(found.runs, whole.runs)
    assert bristle.ensemble(write(), out=tmp_path / "parts").continued == 12
    assert len(bristle.ensemble(write(), out=tmp_path / "parts", runs=4).runs) == 4
    assert bristle.ensemble(write(), out=tmp_path / "parts", fresh=True).continued == 0


def test_a_line_cut_short_is_run_again(write: Write, tmp_path: Path) -> None:
    whole = bristle.ensemble(write(), out=tmp_path / "a").runs
    path = tmp_path / "a" / "runs.csv"
    for size in range(len(path.read_bytes()) - 150, len(path.read_bytes()), 37):
        data = path.read_bytes()
        path.write_bytes(data[:size])
        found = bristle.ensemble(write(), out=tmp_path / "a")
        assert found.continued < 12
        pd.testing.assert_frame_equal(found.runs, whole)
        assert path.read_bytes() == data


def test_runs_of_a_changed_file_are_refused(write: Write, tmp_path: Path) -> None:
    bristle.ensemble(write(), out=tmp_path / "a", runs=2)
    changed = write(("65.0", "66.0"))
    with pytest.raises(EnsembleError, match=r"another ensemble.*--fresh"):
        bristle.ensemble(changed, out=tmp_path / "a")
    assert bristle.ensemble(changed, out=tmp_path / "a", fresh=True).continued == 0


@pytest.mark.parametrize("content", ["x", "a,b\n1,2\n", "# bristle ensemble\n"])
def test_a_file_that_is_no_runs_table_is_not_touched(
    write: Write, tmp_path: Path, content: str
) -> None:
    (tmp_path / "runs.csv").write_text(content)
    with pytest.raises(EnsembleError, match="no runs table"):
        bristle.ensemble(write(), out=tmp_path, runs=2)
    assert (tmp_path / "runs.csv").read_text() == content


def test_failures_are_counted_with_their_reasons(write: Write, tmp_path: Path) -> None:
    path = write(
        ("normal = [650.0, 65.0], within = [500.0, 800.0]", "normal = [10.0, 100.0]"),
    )
    found = bristle.ensemble(path, out=tmp_path / "a")
    failed = found.runs[found.runs["status"] == "failed"]
    assert 0 < len(failed) < 12
    assert failed[PEAK].isna().all()
    assert (found.quantiles["done"] + found.quantiles["failed"] == 12).all()
    assert sum(failure.count for failure in found.failures) == len(failed)
    assert found.failures[0].run == failed.index[0]
    assert "damper.sigma_a" in found.failures[0].reason
    assert "lies below 0" in found.failures[0].reason
    again = bristle.ensemble(path, out=tmp_path / "a")
    assert again.continued == 12
    assert again.failures == found.failures
    retried = bristle.ensemble(path, out=tmp_path / "a", retry=True)
    assert retried.continued == 12 - len(failed)
    pd.testing.assert_frame_equal(retried.runs, found.runs)


def test_reasons_that_differ_in_numbers_are_one() -> None:
    outcomes = [
        RunOutcome(4, reason="at 2.5 s"),
        RunOutcome(1, reason="at 3e-2 s"),
        RunOutcome(2, (1.0,)),
    ]
    assert [(f.count, f.run, f.reason) for f in failures(outcomes)] == [(2, 1, "at 3e-2 s")]


def test_what_a_component_raises_is_a_failed_run(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: Coupled, system: System) -> RunTable:
        raise ZeroDivisionError("somebody's effect")

    def lost(self: Coupled, system: System) -> RunTable:
        table = made(self, system)
        table["structure.floor2_acceleration_absolute"][-1] = float("nan")
        return table

    plan, made = read_ensemble(write()), Coupled.run
    monkeypatch.setattr(Coupled, "run", broken)
    assert plan.campaign().outcome(3).reason == "ZeroDivisionError: somebody's effect"
    monkeypatch.setattr(Coupled, "run", lost)
    reason = plan.campaign().outcome(3).reason
    assert reason == "RunError: peak structure.floor2_acceleration_absolute is not finite."


def test_quantiles_are_those_of_the_runs(write: Write) -> None:
    found = bristle.ensemble(write())
    for output in found.plan.outputs:
        expected = np.quantile(found.runs[output.name], LEVELS)
        row = found.quantiles.loc[output.name, ["5 %", "25 %", "50 %", "75 %", "95 %"]]
        assert row.tolist() == pytest.approx(expected.tolist())
    assert found.quantiles.loc[PEAK, "unit"] == "m/s2"


@pytest.mark.parametrize(
    ("how", "number"),
    [("peak", 3.0), ("rms", 14.0**0.5 / 3.0**0.5), ("max", 2.0), ("min", -3.0), ("mean", 0.0),
     ("last", 1.0)],
)  # fmt: skip
def test_statistics(how: str, number: float) -> None:
    values = np.array([2.0, -3.0, 1.0])
    assert Statistic("a.b", how).of(values) == pytest.approx(number)


def _dies(campaign: Campaign, run: int) -> RunOutcome:
    """Kill the process at run 3 always, at run 6 the first time."""
    assert isinstance(campaign.draws, EnsemblePlan)
    marker = campaign.draws.file.parent / "died_at_6"
    if run == 3 or (run == 6 and not marker.exists()):
        if run == 6:
            marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return RunOutcome(run, (float(run), 0.0, 0.0))


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")
def test_a_process_that_dies_costs_no_finished_run(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Campaign, "outcome", _dies)
    found = bristle.ensemble(write(), workers=2)
    assert len(found.runs) == 12
    assert found.runs.index[found.runs["status"] == "failed"].tolist() == [3]
    assert "ended by signal 9, 2 times" in found.runs.loc[3, "reason"]
    assert found.runs[PEAK].drop(3).tolist() == [i for i in range(12) if i != 3]


def _command(path: Path, out: Path, *more: str) -> list[str]:
    code = "import sys; from bristle.cli import main; sys.exit(main())"
    return [sys.executable, "-c", code, "ensemble", str(path), "--out", str(out), *more]


def _many(write: Write) -> Path:
    return write(("runs = 12", "runs = 5000"), ('"run.stop" = 0.5', '"run.stop" = 2.0'))


def _started(path: Path, out: Path) -> subprocess.Popen[str]:
    """Start an ensemble in a session of its own and wait for its first runs."""
    process = subprocess.Popen(
        _command(path, out), cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True,
        # A shell's background job ignores it, and so would all that it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    file, until = out / "runs.csv", time.monotonic() + 120.0
    while not file.exists() or file.read_bytes().count(b"\n") < 10:
        assert time.monotonic() < until
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.02)
    return process


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_kill_leaves_what_there_was_and_no_process(write: Write, tmp_path: Path) -> None:
    path, out = _many(write), tmp_path / "out"
    process = _started(path, out)
    process.kill()
    process.communicate()
    until = time.monotonic() + 20.0
    while _alive_in_session(process.pid):
        assert time.monotonic() < until, "workers outlive their parent"
        time.sleep(0.05)
    table = RunsTable(read_ensemble(path), out / "runs.csv")
    assert len(table.outcomes) >= 5
    run, outcome = next(iter(table.outcomes.items()))
    assert table.plan.campaign().outcome(run) == outcome
    table.close(complete=False)


def _alive_in_session(session: int) -> bool:
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            return True
    return False


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_keeps_runs_and_says_where(write: Write, tmp_path: Path) -> None:
    path, out = _many(write), tmp_path / "out"
    process = _started(path, out)
    os.killpg(process.pid, signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in error
    assert "of 5000 runs are kept in" in error
    kept = int(error.split("interrupted. ")[1].split()[0])
    assert bristle.ensemble(path, out=out, runs=kept + 2).continued >= kept - 4


def test_two_ensembles_do_not_write_into_one_folder(write: Write, tmp_path: Path) -> None:
    from filelock import FileLock

    with FileLock(tmp_path / ".lock"), pytest.raises(EnsembleError, match="another process"):
        bristle.ensemble(write(), out=tmp_path)


def test_a_full_disk_keeps_what_was_written(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = os.write

    def full(file: int, data: bytes) -> int:
        if b"\n3," in bytes(data) or bytes(data).startswith(b"3,"):
            written(file, bytes(data)[:5])
            raise OSError(28, "No space left on device")
        return written(file, data)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(RunError, match=r"No space left.*are kept in") as caught:
        bristle.ensemble(write(), out=tmp_path / "a", workers=1)
    assert caught.value.exit_code == 1
    monkeypatch.undo()
    assert bristle.ensemble(write(), out=tmp_path / "a").continued == 3


@pytest.mark.parametrize("workers", [0, -2])
def test_a_wrong_number_of_workers_is_named(write: Write, workers: int) -> None:
    with pytest.raises(EnsembleError, match="1 or more"):
        bristle.ensemble(write(), workers=workers)


def test_a_scenario_that_cannot_be_compiled_is_refused_at_once(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Coupled, "refuses", lambda self, system: "cannot be compiled")
    with pytest.raises(ScenarioError, match="cannot be compiled"):
        bristle.ensemble(write(), out=tmp_path / "a")


def test_fmus_give_nearly_the_same(write: Write) -> None:
    replaced = (
        ('"structure.building.masses.2" = { uniform = [1.1, 1.4] }\n', ""),
        ("[vary]", '"run.step" = 0.0005\n[vary]'),
    )
    compiled = bristle.ensemble(write(*replaced), runs=2).runs
    stepped = bristle.ensemble(
        write(*replaced, ("seed = 7", 'seed = 7\nengine = "fmu"')), runs=2, workers=1
    ).runs
    assert stepped[PEAK].tolist() == pytest.approx(compiled[PEAK].tolist(), rel=0.01)
    assert stepped[PEAK].tolist() != compiled[PEAK].tolist()

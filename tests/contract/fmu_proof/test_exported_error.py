"""The error that is printed is the one that the exported FMU has in plain FMPy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from scipy import signal

from bristle.cli import main


def record(path: Path, rate: float, phase: float, switched: bool, filtered: bool = False) -> None:
    """Write a damper with Coulomb friction, a dashpot and a command that switches or sweeps.

    A recorder may show the force behind two equal lags of 10 ms.
    """
    t = np.arange(0.0, 3.0, 1.0 / rate)
    w = 2.0 * np.pi
    x = 4e-3 * np.sin(1.3 * w * t + phase) + 1.5e-3 * np.sin(3.1 * w * t)
    v = 4e-3 * 1.3 * w * np.cos(1.3 * w * t + phase) + 1.5e-3 * 3.1 * w * np.cos(3.1 * w * t)
    V = np.where(t % 1.0 < 0.45, 3.0, 0.5) if switched else 2.0 + np.sin(2.0 * w * t / 3.0)
    force = (1.3 + 0.8 * V) * np.tanh(v / 0.004) + (25.0 + 5.0 * V) * v + 90.0 * x
    if filtered:
        lag = signal.bilinear([1.0], [1e-4, 2e-2, 1.0], rate)
        force = signal.lfilter(*lag, force)
    rng = np.random.default_rng(int(10 * phase))
    noisy = [x + 2e-6 * rng.standard_normal(len(t)), force + 0.02 * rng.standard_normal(len(t))]
    header = "time [s],displacement [m],force [N],voltage [V]"
    np.savetxt(path, np.column_stack([t, *noisy, V]), delimiter=",", header=header, comments="")


def checked(rig: Path) -> tuple[float, float]:
    """Return the error [N] of the exported FMU as check.py finds it, and the one that is told."""
    said = subprocess.run(
        [sys.executable, rig / "export" / "held_out" / "check.py"],
        capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    fmu, told = (float(line.split(": ")[1].split(" N")[0]) for line in said[-2:])
    return fmu, told


@pytest.mark.parametrize(
    ("rates", "law", "switched"),
    [
        ((500.0, 200.0, 500.0, 500.0), "bingham", False),
        # 4 s each: a law with a state, and the FMU stepped at 3 kHz.
        pytest.param((500.0,) * 3, "dahl", True, marks=pytest.mark.slow),
        pytest.param((3000.0,) * 3, "bingham", True, marks=pytest.mark.slow),
    ],
)
def test_the_fmu_has_the_error_that_compare_prints(
    rates: tuple[float, ...], law: str, switched: bool, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for k, rate in enumerate(rates):
        record(tmp_path / f"run_{k}.csv", rate, 0.3 + 0.8 * k, switched)
    assert main(["study", "new", "rig", "--data", "run_*.csv", "--law", law]) == 0
    assert main(["identify", "rig"]) == 0
    capfd.readouterr()
    assert main(["compare", "rig", "--json"]) == 0
    compared = json.loads(capfd.readouterr().out)
    assert main(["export", "rig", "--json"]) == 0
    exported = json.loads(capfd.readouterr().out)
    proof = exported["proof"]
    assert proof["agrees"]
    assert proof["error_told"]["rms"] == compared["total"]["error"]["rms"]
    asked = fmpy.read_model_description(exported["fmu"]).defaultExperiment
    assert float(asked.stepSize) == proof["step"]
    fmu, told = checked(Path("rig"))
    force = proof["error_told"]["signal_counted"]
    assert abs(fmu - told) <= max(0.01 * told, 0.002 * force)
    # With the columns as measured, whose velocity is a difference, it is another one: told as well.
    assert proof["error_raw"]["rms"] > 0.0


@pytest.mark.slow  # an export: its check with a recorder's lag
def test_the_check_has_the_recorder_of_the_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for k, phase in enumerate((0.3, 1.1, 2.0)):
        record(tmp_path / f"run_{k}.csv", 500.0, phase, False, filtered=True)
    assert main(["study", "new", "rig", "--data", "run_*.csv", "--law", "bingham"]) == 0
    assert main(["add", "rig", "delay"]) == 0
    capfd.readouterr()
    assert main(["export", "rig", "--json"]) == 0
    proof = json.loads(capfd.readouterr().out)["proof"]
    assert proof["agrees"]
    fmu, told = checked(Path("rig"))
    force = proof["error_told"]["signal_counted"]
    assert abs(fmu - told) <= max(0.01 * told, 0.002 * force)
    kept = json.loads(Path("rig/export/held_out/proof.json").read_text())
    assert kept["not_applied"] == []
    # Without the recorder it would be another error.
    assert all(len(one) > 5 for one in kept["pulse_response"].values())


def test_without_a_proof_the_reason_is_told(tmp_path: Path) -> None:
    from bristle.identification.error import error_of
    from bristle.prediction.export import Proof

    told = error_of(np.ones(50), np.zeros(50), {})
    lines = Proof(told, 5e-4, why="no library for this platform.").lines(tmp_path)
    assert lines[-1] == "The FMU was not run to confirm it: no library for this platform."


def test_a_proof_names_the_step_that_fmpy_does_not_take_by_itself_and_what_it_is_over(
    tmp_path: Path,
) -> None:
    from bristle.identification.error import error_of
    from bristle.prediction.export import Proof

    told = error_of(np.ones(50), np.zeros(50), {})
    said = "\n".join(Proof(told, 3.125e-05, told, told, told, 0.5).lines(tmp_path))
    assert "output_interval=3.125e-05:" in said
    assert "the first 50 % of each run" in said
    assert "columns, noise and all, over the same part:" in said

"""`conform` waits for a slow FMU, ends one that hangs, and allows a solver its tolerance."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from bristle.cli import main

SLAVE = '''
import random
import time

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Plant(Fmi2Slave):
    """A lag by a solver that takes other steps in each run."""

    pause = 0.0
    hangs_at = 1e9
    noise = 0.0

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y = 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        time.sleep(self.pause)
        while t >= self.hangs_at:
            time.sleep(0.01)
        self.y += h * (self.u + 1.0 - self.y) + self.noise * (random.random() - 0.5)
        return True
'''
EXPERIMENT = '<DefaultExperiment startTime="0" stopTime="1" stepSize="0.1"{}/>'
BEFORE = b"<ModelVariables>"


@pytest.fixture(scope="session")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plant")
    (folder / "plant.py").write_text(SLAVE)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", folder / "plant.py", "-d", folder]
    options = ["--no-external-tool", "--handle-state"]
    subprocess.run([*command, *options], check=True, capture_output=True, cwd=folder)
    return folder / "Plant.fmu"


Changed = Callable[..., Path]


@pytest.fixture
def changed(plant: Path, tmp_path: Path) -> Changed:
    """Return a function that writes the FMU with other values, and with a tolerance."""

    def write(tolerance: str = "", **values: float) -> Path:
        path = tmp_path / "Changed.fmu"
        with zipfile.ZipFile(plant) as source, zipfile.ZipFile(path, "w") as sink:
            for info in source.infolist():
                text = source.read(info)
                if info.filename.endswith("plant.py"):
                    for name, value in values.items():
                        known = next(x for x in SLAVE.splitlines() if x.startswith(f"    {name} ="))
                        text = text.replace(known.encode(), f"    {name} = {value}".encode())
                if info.filename == "modelDescription.xml":
                    told = f' tolerance="{tolerance}"' if tolerance else ""
                    text = text.replace(BEFORE, EXPERIMENT.format(told).encode() + BEFORE)
                sink.writestr(info, text)
        return path

    return write


def verdicts(
    capsys: pytest.CaptureFixture[str], fmu: Path, *probes: str, timeout: float = 20.0
) -> dict[str, tuple[str, str]]:
    only = [word for probe in probes for word in ("--only", probe)]
    main(["conform", str(fmu), "--json", "--timeout", str(timeout), *only])
    rows = json.loads(capsys.readouterr().out)["rows"]
    return {row["probe"]: (row["verdict"], row["seen"]) for row in rows}


def test_a_slow_fmu_is_not_hung_though_a_probe_takes_longer_than_the_limit(
    changed: Changed, capsys: pytest.CaptureFixture[str]
) -> None:
    began = time.monotonic()
    found = verdicts(capsys, changed(pause=0.15), "reset", "variable steps", timeout=2.0)
    assert time.monotonic() - began > 3.0  # two probes beside the first runs: more than one limit
    assert found["reset"][0] == "pass"
    assert not any("hung" in seen for _, seen in found.values())


def test_an_fmu_that_hangs_is_ended_after_the_time_of_one_call(
    changed: Changed, capsys: pytest.CaptureFixture[str]
) -> None:
    began = time.monotonic()
    found = verdicts(capsys, changed(pause=0.1, hangs_at=0.05), "legal run", timeout=1.0)
    assert found["legal run"] == ("fail", "hung in fmi2DoStep: no answer within 1 s")
    assert time.monotonic() - began < 10.0


RUNS = ("repeatable", "reset", "state replay")


def test_runs_are_equal_within_the_tolerance_that_the_fmu_states(
    changed: Changed, capsys: pytest.CaptureFixture[str]
) -> None:
    found = verdicts(capsys, changed("1e-4", noise=1e-6), *RUNS)
    assert {probe: verdict for probe, (verdict, _) in found.items()} == dict.fromkeys(RUNS, "pass")
    assert found["repeatable"][1] == "equal within the tolerance of 0.0001"


@pytest.mark.parametrize("tolerance", ["", "1e-9", "0", "nan", "7"])
def test_beyond_it_or_without_one_they_are_not(
    changed: Changed, capsys: pytest.CaptureFixture[str], tolerance: str
) -> None:
    found = verdicts(capsys, changed(tolerance, noise=1e-6), *RUNS)
    assert found["repeatable"][0] == "note"
    assert found["state replay"][0] == "fail"


def test_a_solver_without_noise_is_told_to_be_equal_bit_by_bit(
    changed: Changed, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verdicts(capsys, changed(), "repeatable")["repeatable"] == ("pass", "equal bit by bit")

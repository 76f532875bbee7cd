"""The C in a native FMU: another compiler makes the same FMU of it."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

from bristle.cli import main
from bristle.errors import BuildError
from bristle.fmu.build import plan
from bristle.native.build import build
from bristle.native.zig import here

pytest.importorskip("ziglang")
needs_compiler = pytest.mark.skipif(
    not (shutil.which("cc") and shutil.which("cmake")), reason="there is no cc or no cmake"
)


def compiled_again(fmu: Path, folder: Path) -> Path:
    """Return the folder of an FMU whose library this machine's own compiler has made."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    shutil.rmtree(folder / "binaries")
    made = folder / "made"
    made.mkdir()
    build_platform_binary(folder, made)
    return folder


def same(fmu: Path, again: Path, **given: Any) -> bool:
    rows = [
        simulate_fmu(str(one), stop_time=1.0, output_interval=0.01, **given) for one in (fmu, again)
    ]
    return all(np.array_equal(rows[0][name], rows[1][name]) for name in rows[0].dtype.names)


@needs_compiler
# Another compiler: FMI 3.0 beside 2.0.
@pytest.mark.parametrize("fmi", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_another_compiler_makes_the_same_fmu(fmi: int, tmp_path: Path) -> None:
    fmu = build(plan("SignalSource"), tmp_path, [here()], fmi, sources=True)
    assert validate_fmu(str(fmu)) == []
    again = compiled_again(fmu, tmp_path / "again")
    assert same(fmu, again, start_values={"kind": "sine", "amplitude": 2.0, "frequency": 1.3})


@pytest.mark.slow  # a damper is compiled by another compiler
@needs_compiler
def test_a_damper_too(tmp_path: Path) -> None:
    fmu = build(plan("LuGreDamper"), tmp_path, [here()], sources=True)
    again = compiled_again(fmu, tmp_path / "again")
    time = np.linspace(0.0, 1.0, 1001)
    motion = np.zeros(1001, [("time", float), ("displacement", float), ("velocity", float)])
    motion["time"], motion["displacement"] = time, 0.01 * np.sin(9.0 * time)
    motion["velocity"] = 0.09 * np.cos(9.0 * time)
    given = {"voltage": 3.0, "stribeck.on": True, "coil_lag.on": True, "gas_spring.on": True}
    assert same(fmu, again, start_values=given, input=motion)


def test_with_sources_or_without_are_two_archives(tmp_path: Path) -> None:
    for sources in (True, False):
        fmu = build(plan("ConstantVoltage"), tmp_path, [here()], sources=sources)
        with zipfile.ZipFile(fmu) as archive:
            held = {name for name in archive.namelist() if name.startswith("sources/")}
        assert bool(held) == sources
        first = fmu.read_bytes()
        assert (
            build(plan("ConstantVoltage"), tmp_path, [here()], sources=sources).read_bytes()
            == first
        )


def test_sources_go_with_native(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["build", "ConstantVoltage", "--sources", "--out", str(tmp_path)]
    assert main(given) == BuildError.exit_code
    assert "--sources goes with --native" in capsys.readouterr().err

"""Native FMUs of FMI 3.0 in a host in C, without Python: here, checked, and on other platforms."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
import pytest
from both_forms import folder, needs_zig
from test_native_hosts import COMPILER, MOTION, VALGRIND
from test_native_platforms import ARM, FAR, QEMU, WINE

from bristle.fmu import catalogue
from bristle.fmu.archive import extract
from bristle.fmu.build import plan
from bristle.fmu.description import read_description
from bristle.native.build import build
from bristle.native.zig import PLATFORMS, Platform, here

pytestmark = [
    needs_zig,
    pytest.mark.skipif(sys.platform != "linux", reason="hosts are run as on Linux"),
]

SOURCE = Path(__file__).with_name("fmi3_host.c")
LIGHT = ["ClippedOptimal", "GroundMotion"]


@cache
def host(platform: Platform) -> Path:
    """Return the host, compiled for a platform."""
    program = folder() / f"fmi3_host_{platform.name}{'.exe' if platform.name == 'win64' else ''}"
    headers = Path(fmpy.__file__).parent / "c-code"
    command = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target]
    if platform == here() and COMPILER:
        command = [COMPILER]  # faster
    libraries = ["-lm", *([] if platform.name == "win64" else ["-ldl"])]
    done = subprocess.run(
        [*command, "-g", "-O1", f"-I{headers}", str(SOURCE), "-o", str(program), *libraries],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return program


def rows(component: str, platform: Platform, *before: str) -> np.ndarray:
    """Return what the host prints of a component, steps by outputs."""
    path = build(plan(component), folder() / f"fmi3_{platform.name}", [platform], fmi=3)
    unpacked = extract(path, folder() / f"fmi3_{platform.name}" / component)
    about = read_description(path, any_platform=True)
    inputs = [v for v in about.of("input") if not v.optional]
    root = "Z:" if platform.name == "win64" else ""  # Wine shows this machine's root as drive Z
    arguments = [
        str(unpacked / platform.place(component, 3)), about.guid, f"{root}{unpacked}/resources/",
        ",".join("{}:{!r}:{!r}".format(v.reference, *MOTION[v.unit or ""]) for v in inputs) or "-",
        ",".join(str(v.reference) for v in about.of("output") if v.kind == "Real"),
    ]  # fmt: skip
    wine = {"WINEPREFIX": str(folder() / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    environment = {**os.environ, **wine} if before == (WINE,) else {}
    done = subprocess.run(
        [*before, str(host(platform)), *arguments],
        capture_output=True, text=True, timeout=600.0, env=environment,
    )  # fmt: skip
    said = [line for line in done.stderr.splitlines() if not line.startswith("wine: ")]
    assert (done.returncode, said) == (0, [])
    found = np.array(
        [[float(value) for value in line.split()] for line in done.stdout.splitlines()]
    )
    assert len(found) == 40
    return found


@pytest.mark.parametrize("component", LIGHT)
def test_a_host_without_python_runs_them_in_fmi_3(component: str) -> None:
    found = rows(component, here())
    assert np.isfinite(found).all()
    assert np.ptp(found, axis=0).max() > 0.0


@pytest.mark.slow  # valgrind, fifty times slower
@pytest.mark.skipif(VALGRIND is None, reason="valgrind checks memory, not there")
@pytest.mark.parametrize("component", catalogue.component_names())
def test_a_memory_checker_finds_nothing_in_fmi_3(component: str) -> None:
    leaks = "--errors-for-leak-kinds=definite,indirect,possible"  # the loader keeps a little
    rows(component, here(), str(VALGRIND), "-q", "--leak-check=full", leaks, "--error-exitcode=9")


@pytest.mark.slow  # libraries of other platforms, emulated
@pytest.mark.parametrize("platform", FAR)
@pytest.mark.parametrize("component", [*LIGHT, "Structure"])
def test_other_platforms_give_the_same_rows_in_fmi_3(component: str, platform: str) -> None:
    before = {"win64": (str(WINE),), "aarch64-linux": (str(QEMU), "-L", str(ARM))}[platform]
    near, far = rows(component, here()), rows(component, PLATFORMS[platform], *before)
    peaks = np.maximum(abs(near).max(axis=0), 1e-300)
    assert (abs(near - far) / peaks).max() <= 1e-9

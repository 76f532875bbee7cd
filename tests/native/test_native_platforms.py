"""Native FMUs on other platforms: under Wine and QEMU, and by what their libraries export."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path

import fmpy
import pytest
from both_forms import folder, needs_zig

from bristle.export.composite import plan_of
from bristle.fmu import catalogue
from bristle.fmu.archive import extract
from bristle.fmu.build import plan
from bristle.fmu.description import read_description
from bristle.native.build import build, universal
from bristle.native.zig import PLATFORMS, Platform, here

SOURCE = Path(__file__).with_name("far_host.c")
MOTION = {"V": (4.0, 3.0), "m": (0.0, 5e-3), "m/s": (0.0, 0.1), "m/s2": (0.0, 2.0), "N": (0.0, 1.0)}
WINE = shutil.which("wine64") or next(iter(map(str, Path("/usr/lib/wine").glob("wine64"))), None)
QEMU = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
ARM = Path("/usr/aarch64-linux-gnu")
FAR = [
    pytest.param(
        "win64", marks=pytest.mark.skipif(WINE is None, reason="Wine runs Windows, not there")
    ),
    pytest.param(
        "aarch64-linux",
        marks=pytest.mark.skipif(
            QEMU is None or not ARM.is_dir(),
            reason="QEMU and the C library of 64-bit ARM (libc6-arm64-cross) run it, not there",
        ),
    ),
]
CASES = [(name, False) for name in catalogue.component_names()]
CASES += [(name, True) for name in ("LuGreDamper", "BinghamDamper", "Structure")]
CASES += [("el_centro_0p6g_lpv_sensors", False)]  # a whole scenario

pytestmark = [needs_zig, pytest.mark.slow]


@cache
def unpacked(name: str) -> Path:
    """Return the FMU of a component, or of a whole scenario, for all platforms, unpacked."""
    what = plan(name) if name in catalogue.component_names() else plan_of(name)
    path = build(what, folder() / "all", list(PLATFORMS.values()))
    return extract(path, folder() / "all" / name)


@cache
def host(platform: Platform) -> Path:
    """Return the host, compiled for a platform."""
    program = folder() / ("far_host.exe" if platform.suffix == ".dll" else f"far_{platform.name}")
    headers = Path(fmpy.__file__).parent / "c-code"
    command = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target, "-O1"]
    done = subprocess.run(
        [*command, f"-I{headers}", str(SOURCE), "-o", str(program), "-lm"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return program


def command_of(platform: Platform) -> list[str]:
    """Return what runs the host of a platform."""
    if platform.name == "win64":
        return [str(WINE), str(host(platform))]
    if platform.name == "aarch64-linux":
        return [str(QEMU), "-L", str(ARM), str(host(platform))]
    return [str(host(platform))]


def rows(name: str, platform: Platform, effects: bool, state: Path, turn: str) -> list[list[float]]:
    """Return what the host prints of a component."""
    unpacked_to = unpacked(name)
    about = read_description(folder() / "all" / f"{name}.fmu")
    library = unpacked_to / f"binaries/{platform.folder}/{name}{platform.suffix}"
    switches = [v for v in about.of("parameter") if v.name.endswith(".on")] if effects else []
    inputs = [v for v in about.of("input") if not v.optional]
    resources = (unpacked_to / "resources").as_uri()
    if platform.name == "win64":  # Wine shows this machine's root as drive Z
        resources = resources.replace("file:///", "file:///Z:/")
    arguments = [
        str(library), about.guid, resources,
        ",".join(str(v.reference) for v in switches if v.name not in {"backlash.on"}) or "-",
        ",".join("{}:{!r}:{!r}".format(v.reference, *MOTION[v.unit or ""]) for v in inputs) or "-",
        ",".join(str(v.reference) for v in about.of("output") if v.kind == "Real"),
        str(state), turn,
    ]  # fmt: skip
    environment = {
        **os.environ, "WINEPREFIX": str(folder() / "wine"), "WINEDEBUG": "-all", "DISPLAY": "",
    }  # fmt: skip
    done = subprocess.run(
        [*command_of(platform), *arguments],
        capture_output=True, text=True, timeout=600.0, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [[float(value) for value in line.split()] for line in done.stdout.splitlines()]


def difference(one: list[list[float]], other: list[list[float]]) -> float:
    """Return the largest difference of a column, as a share of its peak."""
    assert len(one) == len(other) == 100
    worst = 0.0
    for a, b in zip(zip(*one, strict=True), zip(*other, strict=True), strict=True):
        peak = max(map(abs, a)) or 1.0
        worst = max(worst, max(abs(x - y) for x, y in zip(a, b, strict=True)) / peak)
    return worst


@pytest.mark.parametrize("platform", FAR)
@pytest.mark.parametrize(("name", "effects"), CASES)
def test_other_platforms_give_the_same_rows_and_take_the_same_states(
    name: str, effects: bool, platform: str, tmp_path: Path
) -> None:
    far = PLATFORMS[platform]
    wanted = rows(name, here(), effects, tmp_path / "here", "save")
    assert difference(wanted, rows(name, far, effects, tmp_path / "far", "save")) <= 1e-9
    assert difference(wanted, rows(name, far, effects, tmp_path / "here", "load")) <= 1e-9
    assert difference(wanted, rows(name, here(), effects, tmp_path / "far", "load")) <= 1e-9


MACHINES = {0x01000007: "darwin64", 0x0100000C: "aarch64-darwin"}


def test_the_library_for_macos_serves_both_processors_and_exports_fmi() -> None:
    library = (unpacked("GroundMotion") / "binaries/darwin64/GroundMotion.dylib").read_bytes()
    magic, count = struct.unpack(">2I", library[:8])
    assert (magic, count) == (0xCAFEBABE, 2)
    found = []
    for k in range(count):
        machine, _, at, size, align = struct.unpack(">5I", library[8 + 20 * k : 28 + 20 * k])
        own = library[at : at + size]
        thin, inside, _, kind = struct.unpack("<4I", own[:16])
        assert (thin, inside, kind) == (0xFEEDFACF, machine, 6)  # a dynamic library of 64 bits
        assert at % (1 << align) == 0
        for function in ("Instantiate", "DoStep", "GetReal", "SetFMUstate", "FreeInstance"):
            assert f"_fmi2{function}".encode() in own
        found.append(MACHINES[machine])
    assert sorted(found) == ["aarch64-darwin", "darwin64"]
    assert universal([b"alone"]) == b"alone"
    with pytest.raises(ValueError, match="no library of 64 bits"):
        universal([b"no library at all", b"nor is this one"])

"""A step of a native FMU asks for no memory and for no lock, whatever effects are on."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest
from both_forms import native, needs_zig

from bristle.fmu import catalogue
from bristle.fmu.archive import library_member
from bristle.physics.effect import EFFECTS

SOURCE = Path(__file__).with_name("counting_host.c")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
NM = shutil.which("nm")
LIGHT = ["ConstantVoltage", "GroundMotion", "SignalSource", "ClippedOptimal", "HinfInverse"]
SIZES = {"m": 5e-3, "m/s": 0.1, "m/s2": 2.0, "N": 1.0, "V": 3.0}
LOCKS = ("pthread_", "sem_", "mtx_", "flockfile", "futex", "syscall")
"""How the functions begin by which C waits for others."""

pytestmark = [
    needs_zig,
    pytest.mark.skipif(sys.platform != "linux", reason="the host counts by names of glibc"),
    pytest.mark.skipif(COMPILER is None, reason="no C compiler on the path, so no host in C"),
]


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("counting") / "host"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-O1", "-rdynamic", "-fno-builtin", f"-I{headers}"]
    command = [str(COMPILER), *flags, str(SOURCE), "-o", str(program), "-ldl", "-lm", "-lpthread"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def counted(host: Path, name: str, switches: list[str]) -> list[int]:
    """Return the calls until the first step, and in 400 steps with inputs that move."""
    form = native(name)
    variables = form.about.variables
    inputs = [v for v in form.about.of("input") if not v.optional]
    moved = ",".join(f"{v.reference}:{v.start!r}:{SIZES.get(v.unit or '', 1.0)!r}" for v in inputs)
    read = ",".join(str(v.reference) for v in form.about.of("output") if v.kind == "Real")
    on = ",".join(str(variables[switch].reference) for switch in switches)
    library = form.folder / library_member(form.about.identifier)
    resources = (form.folder / "resources").as_uri()
    command = [str(host), str(library), form.about.guid, resources, on or "-", moved or "-", read]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0)
    assert (done.returncode, done.stderr) == (0, "")
    return [int(count) for count in done.stdout.split()]


def together(name: str) -> list[str]:
    """Return switches of a component's effects that exclude no other of them."""
    chosen: list[str] = []
    for variable in native(name).about.of("parameter"):
        effect, _, key = variable.name.partition(".")
        if key != "on" or effect not in EFFECTS:
            continue
        others = {*EFFECTS[effect].excludes, *(o for o in chosen if effect in EFFECTS[o].excludes)}
        if not others.intersection(chosen):
            chosen.append(effect)
    return [f"{effect}.on" for effect in chosen]


@pytest.mark.parametrize("name", LIGHT)
def test_a_step_asks_for_nothing(name: str, host: Path) -> None:
    before, during = counted(host, name, [])
    assert before > 5  # it does count
    assert during == 0


@pytest.mark.slow  # a damper with all effects is compiled
@pytest.mark.parametrize("name", catalogue.component_names())
def test_nor_does_one_with_all_effects_that_go_together(name: str, host: Path) -> None:
    assert counted(host, name, [])[1] == 0
    assert counted(host, name, together(name))[1] == 0


@pytest.mark.skipif(NM is None, reason="nm lists what a library needs, not there")
def test_the_library_knows_no_lock() -> None:
    form = native("ClippedOptimal")
    file = form.folder / library_member(form.about.identifier)
    command = [str(NM), "-D", "--undefined-only", str(file)]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    names = [line.split()[-1].partition("@")[0] for line in listed.splitlines()]
    assert "malloc" in names
    assert not [name for name in names if name.lstrip("_").startswith(LOCKS)]

"""Native FMUs in hosts: one in C without Python, a memory checker, threads, many instances."""

from __future__ import annotations

import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import pytest
from both_forms import both, native, needs_zig

from benchmarks import _hosts
from benchmarks.native import timer
from bristle.fmu import catalogue
from bristle.fmu.archive import library_member

SOURCE = Path(__file__).parents[1] / "fmu" / "host.c"
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
VALGRIND = shutil.which("valgrind")
MOTION = {"V": (4.0, 3.0), "m": (0.0, 5e-3), "m/s": (0.0, 0.1), "m/s2": (0.0, 2.0), "N": (0.0, 1.0)}
LIGHT = ["ConstantVoltage", "GroundMotion", "SignalSource", "HinfInverse", "Skyhook"]

pytestmark = [
    needs_zig,
    pytest.mark.skipif(sys.platform != "linux", reason="the host loads libraries as on Linux"),
    pytest.mark.skipif(COMPILER is None, reason="no C compiler on the path, so no host in C"),
]


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("host") / "host"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-g", "-O1", f"-I{headers}"]
    command = [str(COMPILER), *flags, str(SOURCE), "-o", str(program), "-ldl", "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def run(name: str, host: Path, tmp_path: Path, *before: str) -> subprocess.CompletedProcess[str]:
    """Run a component's FMU in the host: two copies, in turn, with a reset and a state replayed."""
    form = native(name)
    copy = shutil.copytree(form.folder, tmp_path / "copy")
    places = [
        text
        for folder in (form.folder, copy)
        for text in (
            str(folder / library_member(form.about.identifier)),
            (folder / "resources").as_uri(),
        )
    ]
    inputs = [v for v in form.about.of("input") if not v.optional]
    motion = ",".join("{}:{!r}:{!r}".format(v.reference, *MOTION[v.unit or ""]) for v in inputs)
    outputs = ",".join(str(v.reference) for v in form.about.of("output") if v.kind == "Real")
    command = [*before, str(host), "-", form.about.guid, *places, motion, outputs]
    return subprocess.run(command, capture_output=True, text=True, timeout=300.0, env={})


@pytest.mark.parametrize("name", LIGHT)
def test_a_host_without_python_runs_them(name: str, host: Path, tmp_path: Path) -> None:
    done = run(name, host, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(abs(float(line)) < 1e6 for line in done.stdout.split())


def test_a_host_in_c_times_steps(tmp_path: Path) -> None:
    program = timer(tmp_path)
    assert program is not None
    path = native("GroundMotion").path
    median, worst, seen, clock = _hosts.times_of_steps(program, path, [], steps=200, passes=2)
    assert 0 < median <= seen
    assert 0 < worst <= seen
    assert 0 <= clock <= median
    with pytest.raises(_hosts.HostError, match="no steps"):
        _hosts.times_of_steps(program, path, [], steps=0, passes=2)


@pytest.mark.slow  # valgrind, fifty times slower
@pytest.mark.skipif(VALGRIND is None, reason="valgrind checks memory, not there")
@pytest.mark.parametrize("name", catalogue.component_names())
def test_a_memory_checker_finds_nothing(name: str, host: Path, tmp_path: Path) -> None:
    leaks = "--errors-for-leak-kinds=definite,indirect,possible"  # the loader keeps a little
    check = [str(VALGRIND), "-q", "--leak-check=full", leaks]
    done = run(name, host, tmp_path, *check, "--error-exitcode=9")
    assert (done.returncode, done.stderr) == (0, "")


def test_instances_in_threads_do_not_disturb_each_other() -> None:
    def values(_: int) -> list[list[float]]:
        pair = both("HinfInverse", anti_windup=50.0)
        pair.begin()
        assert pair.largest_difference(steps=60) == 0.0
        shown = pair.shown()[1]
        pair.end()
        return [shown]

    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(values, range(12)))
    assert all(one == runs[0] for one in runs)

"""A host in C runs every built-in FMU: twice in one process, with reset, replay and a clean end."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave

from bristle.fmu import build, catalogue
from bristle.fmu.archive import extract, library_member
from bristle.fmu.description import Description, read_description

SOURCE = Path(__file__).with_name("host.c")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
STEPS, STEP = 40, 0.002
BY_DEFAULT = ("LuGreDamper", "Skyhook")
MOTION = {"V": (4.0, 3.0), "m": (0.0, 5e-3), "m/s": (0.0, 0.1), "m/s2": (0.0, 2.0), "N": (0.0, 1.0)}


def libpython() -> Path | None:
    """Return the shared library of the running interpreter, None if it has none."""
    folder, name = sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("INSTSONAME")
    if not sysconfig.get_config_var("Py_ENABLE_SHARED") or not folder or not name:
        return None
    path = Path(folder) / name
    return path if path.is_file() else None


pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the host loads libraries as on Linux"),
    pytest.mark.skipif(
        COMPILER is None, reason="no C compiler on the path (cc, gcc or clang), so no host in C"
    ),
    pytest.mark.skipif(
        libpython() is None,
        reason="this Python has no shared libpython (Py_ENABLE_SHARED is 0): a host that is not "
        "Python cannot give the FMU an interpreter. Python FMUs run in Python hosts here, and "
        "with a Python built with --enable-shared (Debian: libpython3.x) in others as well.",
    ),
]


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("host") / "host"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-O1", "-Wall", "-Wextra", "-Werror", f"-I{headers}"]
    command = [str(COMPILER), *flags, str(SOURCE), "-o", str(program), "-ldl", "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def _environment() -> dict[str, str]:
    """Return an environment in which the embedded interpreter finds its standard library."""
    kept = {
        k: v for k, v in os.environ.items() if not k.startswith("PYTHON") and k != "VIRTUAL_ENV"
    }
    # It looks for its folder by the first python3 on the path; a virtual environment's has none.
    return {**kept, "PATH": f"{sys.base_prefix}/bin:{kept.get('PATH', '')}"}


def _ports(about: Description) -> tuple[list[tuple[int, float, float]], list[int]]:
    moved = [
        (v.reference, *MOTION[v.unit or ""])
        for v in about.of("input")
        if not v.optional  # these change what the component does, and stay unset
    ]
    return moved, [v.reference for v in about.of("output") if v.kind == "Real"]


def _in_python(about: Description, folder: Path) -> list[float]:
    """Return the last outputs of the same run in this process, through fmpy."""
    moved, outputs = _ports(about)
    slave = FMU2Slave(guid=about.guid, unzipDirectory=str(folder), modelIdentifier=about.identifier)
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    for k in range(-1, STEPS):
        values = [c + a * math.sin(0.3 * max(k, 0) + 0.7 * i) for i, (_, c, a) in enumerate(moved)]
        slave.setReal([reference for reference, *_ in moved], values)
        if k < 0:
            slave.exitInitializationMode()
        else:
            slave.doStep(k * STEP, STEP)
    last: list[float] = slave.getReal(outputs)
    slave.terminate()
    slave.freeInstance()
    return last


@pytest.mark.parametrize(
    ("name", "count"),
    [
        # Two seconds each: all components, and 20 times over.
        pytest.param(n, c, marks=() if c == 8 and n in BY_DEFAULT else pytest.mark.slow)
        for n in catalogue.component_names()
        for c in (8, 20)
    ],
)
def test_c_host_runs_the_fmu_and_ends_cleanly_every_time(
    name: str, count: int, host: Path, tmp_path: Path
) -> None:
    path = build.ensure(name)
    about = read_description(path)
    moved, outputs = _ports(about)
    copies = [extract(path, tmp_path / folder) for folder in ("one", "two")]
    places = [
        text
        for copy in copies
        for text in (str(copy / library_member(about.identifier)), (copy / "resources").as_uri())
    ]
    motion = ",".join(f"{r}:{c!r}:{a!r}" for r, c, a in moved)
    command = [
        str(host),
        str(libpython()),
        about.guid,
        *places,
        motion,
        ",".join(map(str, outputs)),
    ]

    def run(_: int) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, capture_output=True, text=True, timeout=60.0, env=_environment(), cwd=tmp_path
        )

    with ThreadPoolExecutor(2) as pool:
        runs = list(pool.map(run, range(count)))
    assert [(done.returncode, done.stderr) for done in runs] == [(0, "")] * count
    assert len({done.stdout for done in runs}) == 1
    assert [float(line) for line in runs[0].stdout.split()] == pytest.approx(
        _in_python(about, copies[0]), rel=1e-12, abs=1e-300
    )


@pytest.mark.parametrize(
    ("trait", "code", "words"),
    [("HEALTHY", 0, ""), ("EMPTY_STATE", 1, "the copy that got the bytes differs at step 20")],
)
def test_host_tells_a_sound_fmu_from_one_that_loses_its_state(
    host: Path, tmp_path: Path, trait: str, code: int, words: str
) -> None:
    library = tmp_path / "toy.so"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-shared", "-fPIC", f"-DTRAIT={trait}", f"-I{headers}"]
    source = SOURCE.parents[1] / "conformance" / "toy.c"
    subprocess.run([str(COMPILER), *flags, str(source), "-o", str(library)], check=True)
    copy = shutil.copy(library, tmp_path / "copy.so")
    command = [str(host), "-", "strict", str(library), "x", str(copy), "x", "0:0:1", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0)
    assert (done.returncode, done.stderr.strip()) == (code, words)


def test_without_libpython_a_python_fmu_cannot_be_loaded(host: Path, tmp_path: Path) -> None:
    path = build.ensure("ConstantVoltage")
    about = read_description(path)
    library = extract(path, tmp_path / "one") / library_member(about.identifier)
    command = [str(host), "-", about.guid, str(library), "x", str(library), "x", "", "0"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 1
    assert "undefined symbol: " in done.stderr

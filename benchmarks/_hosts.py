"""Hosts that step one FMU with its inputs held, each in a process of its own: `play` starts one.

A job has the FMU's `path`, `inputs` (name to value), `outputs` (names of Reals), `steps` and `step`
[s]. A host returns one row per step, the outputs after it.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy

from bristle.fmu.archive import extract, library_member
from bristle.fmu.description import Description, read_description

ROOT = Path(__file__).resolve().parent.parent
LIMIT = 120.0
"""Seconds after which a host counts as hung."""
TURNS = 40
"""Steps of the C host, each of `TURN` s."""
TURN = 0.002
SWING = {"V": (4.0, 3.0), "m": (0.0, 5e-3), "m/s": (0.0, 0.1), "m/s2": (0.0, 2.0), "N": (0.0, 1.0)}
"""Centre and amplitude of the inputs that the C host moves, by unit."""

Job = dict[str, Any]
Rows = list[list[float]]


class HostError(Exception):
    """A host failed; its last message."""


def play(host: str, job: Job) -> Rows:
    """Return the rows of a host of `HOSTS`, run in a process of its own.

    Raises
    ------
    HostError
        The process did not end with 0.
    """
    with tempfile.TemporaryDirectory(prefix="bristle-host-") as folder:
        asked, answer = Path(folder, "job.json"), Path(folder, "rows.json")
        asked.write_text(json.dumps(job), encoding="utf-8")
        command = [sys.executable, "-m", "benchmarks._hosts", host, str(asked), str(answer)]
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        done = _run(command, folder, {**os.environ, "PYTHONPATH": path})
        if done.returncode:
            raise HostError(_last(done))
        rows: Rows = json.loads(answer.read_text(encoding="utf-8"))
        return rows


def _run(command: Sequence[object], folder: str, environment: dict[str, str]) -> Any:
    try:
        return subprocess.run(
            [str(part) for part in command], cwd=folder, env=environment, capture_output=True,
            text=True, timeout=LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise HostError(f"no answer within {LIMIT:g} s") from None


def _last(done: Any) -> str:
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    return f"exit {done.returncode}: {lines[-1] if lines else 'without a word'}"


def by_fmpy(job: Job) -> Rows:
    """Step an FMU in FMPy."""
    from fmpy.fmi2 import FMU2Slave

    folder = str(fmpy.extract(job["path"]))
    about = read_description(job["path"])
    slave = FMU2Slave(
        guid=about.guid, modelIdentifier=about.identifier, unzipDirectory=folder,
        instanceName="one",
    )  # fmt: skip
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    into = [about.variables[name].reference for name in job["inputs"]]
    slave.setReal(into, list(job["inputs"].values()))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    out = [about.variables[name].reference for name in job["outputs"]]
    rows = []
    for k in range(job["steps"]):
        slave.doStep(k * job["step"], job["step"])
        rows.append(slave.getReal(out))
    slave.terminate()
    slave.freeInstance()
    return rows


def by_libcosim(job: Job) -> Rows:
    """Step an FMU in libcosim."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_step_size(round(job["step"] * 1e9))
    local = CosimLocalSlave(job["path"], "one")
    slave = execution.add_local_slave(local)
    at = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    for name, value in job["inputs"].items():
        execution.real_initial_value(slave, at[name], value)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    wanted = [at[name] for name in job["outputs"]]
    rows = []
    for _ in range(job["steps"]):
        if not execution.step():
            raise HostError("a step failed")
        rows.append(list(observer.last_real_values(slave, wanted)))
    return rows


def by_ecos(job: Job) -> Rows:
    """Step an FMU in Ecos."""
    import ctypes

    threads = Path(sys.prefix) / "lib" / "libtbb.so.12"
    if threads.is_file():  # Ecos does not find it by itself
        ctypes.CDLL(str(threads), ctypes.RTLD_GLOBAL)
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    EcosLib.set_log_level("warn")
    rows = []
    with EcosSimulationStructure() as structure:
        structure.add_model("one", job["path"])
        given = {f"one::{name}": value for name, value in job["inputs"].items()}
        structure.add_parameter_set("given", given)
        with EcosSimulation(structure=structure, step_size=job["step"]) as simulation:
            if not simulation.init(parameter_set="given" if given else None):
                raise HostError("the initialisation failed")
            for _ in range(job["steps"]):
                simulation.step()
                rows.append([simulation.get_real(f"one::{name}") for name in job["outputs"]])
            simulation.terminate()
    return rows


HOSTS: dict[str, Callable[[Job], Rows]] = {
    "FMPy": by_fmpy,
    "libcosim": by_libcosim,
    "Ecos": by_ecos,
}


def libpython() -> Path | None:
    """Return the shared library of the running interpreter, None if it has none."""
    folder, name = (sysconfig.get_config_var(key) for key in ("LIBDIR", "INSTSONAME"))
    if not sysconfig.get_config_var("Py_ENABLE_SHARED") or not folder or not name:
        return None
    path = Path(folder) / name
    return path if path.is_file() else None


def c_host(folder: Path) -> Path | None:
    """Return the tests' host in C, compiled; None without a compiler or a shared libpython."""
    return compiled(ROOT / "tests" / "fmu" / "host.c", folder) if libpython() else None


def compiled(source: Path, folder: Path) -> Path | None:
    """Return a host in C, compiled into a folder; None without a compiler, or not on Linux."""
    headers = Path(fmpy.__file__).parent / "c-code"
    return made_in_c(source, folder / source.stem, "-O1", f"-I{headers}", "-ldl", "-lm")


def made_in_c(source: Path, target: Path, *options: str) -> Path | None:
    """Return what a C compiler makes of a source; None without a compiler, or not on Linux."""
    asked = (os.environ.get("CC", ""), "cc", "gcc", "clang")
    compiler = next(filter(None, map(shutil.which, asked)), None)
    if compiler is None or sys.platform != "linux":
        return None
    command = [compiler, source, "-o", target, *options]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    return target


def swung(about: Description) -> dict[str, tuple[float, float]]:
    """Return centre and amplitude of each input that the C host moves."""
    return {v.name: SWING[v.unit or ""] for v in about.of("input") if not v.optional}


def swing(values: tuple[float, float], place: int, k: int) -> float:
    """Return the value of the C host's input number `place` in step k."""
    centre, amplitude = values
    return centre + amplitude * math.sin(0.3 * k + 0.7 * place)


def by_c_host(program: Path, path: Path) -> list[float]:
    """Return the last outputs in the C host: two instances, a reset, a state replayed.

    Raises
    ------
    HostError
        The host ended with another code than 0.
    """
    about = read_description(path)
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    kept["PATH"] = f"{sys.base_prefix}/bin:{kept.get('PATH', '')}"  # its standard library is there
    with tempfile.TemporaryDirectory(prefix="bristle-host-") as folder:
        interpreted = about.capabilities.get("needsExecutionTool") == "true"
        command: list[object] = [program, libpython() if interpreted else "-", about.guid]
        for copy in ("one", "two"):
            unpacked = extract(path, Path(folder, copy))
            command += [unpacked / library_member(about.identifier)]
            command += [(unpacked / "resources").as_uri()]
        done = _run([*command, *_moved_and_read(about)], folder, kept)
    if done.returncode:
        raise HostError(_last(done))
    return [float(line) for line in done.stdout.split()]


def _moved_and_read(about: Description) -> tuple[str, str]:
    """Return two arguments of a host in C: the inputs that it moves, the outputs that it reads."""
    moved = ",".join(
        f"{about.variables[name].reference}:{centre!r}:{amplitude!r}"
        for name, (centre, amplitude) in swung(about).items()
    )
    read = ",".join(str(v.reference) for v in about.of("output") if v.kind == "Real")
    return moved, read


def times_of_steps(
    program: Path, path: Path, switches: Sequence[str], steps: int, passes: int
) -> list[int]:
    """Return what `steps.c` measures of a native FMU, in ns.

    Parameters
    ----------
    program : Path
        That source, compiled.
    path : Path
    switches : sequence of str
        Booleans that are on.
    steps, passes : int

    Raises
    ------
    HostError
        The host ended with another code than 0.
    """
    about = read_description(path)
    on = ",".join(str(about.variables[name].reference) for name in switches)
    moved, read = _moved_and_read(about)
    with tempfile.TemporaryDirectory(prefix="bristle-host-") as folder:
        unpacked = extract(path, Path(folder, "one"))
        resources = (unpacked / "resources").as_uri()
        library = unpacked / library_member(about.identifier)
        command = [program, library, about.guid, resources, on or "-", moved or "-", read]
        done = _run([*command, steps, passes], folder, {})
    if done.returncode:
        raise HostError(_last(done))
    return [int(number) for number in done.stdout.split()]


if __name__ == "__main__":
    rows = HOSTS[sys.argv[1]](json.loads(Path(sys.argv[2]).read_text(encoding="utf-8")))
    Path(sys.argv[3]).write_text(json.dumps(rows), encoding="utf-8")

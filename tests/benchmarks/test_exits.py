"""Processes that loaded FMUs end with 0, whatever became of the FMUs and whoever else is there."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import exits
from bristle.fmu.build import ensure

linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the binary ends in order")
compiles = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler on the path"
)

LOAD = """
import ctypes, gc, sys
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

def load(path):
    folder = str(extract(path))
    about = read_model_description(folder)
    fmu = FMU2Slave(
        guid=about.guid, modelIdentifier=about.coSimulation.modelIdentifier,
        unzipDirectory=folder, instanceName="one",
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 0.01)
    return fmu

fmus = [load(path) for path in sys.argv[2:]]
"""
ENDS = {
    "left": "",
    "some freed": "fmus.pop().freeInstance()",
}


def run(code: str, *arguments: object, **environment: str) -> tuple[int, str]:
    """Return the exit code and messages of a script that knows nothing of bristle."""
    done = subprocess.run(
        [sys.executable, "-I", "-c", code, *map(str, arguments)],
        capture_output=True, text=True, timeout=60, env={**os.environ, **environment},
    )  # fmt: skip
    return done.returncode, done.stderr


@linux
@compiles
@pytest.mark.parametrize("how", ENDS)
def test_no_memory_is_damaged_as_a_process_ends(how: str, tmp_path: Path) -> None:
    """Without malloc's cache, and with a library that takes memory last, damage always aborts."""
    fmus = ensure("ConstantVoltage"), ensure("BinghamDamper")
    last = "import atexit, ctypes, sys\natexit.register(ctypes.CDLL, sys.argv[1])\n"
    harsh = {"GLIBC_TUNABLES": "glibc.malloc.tcache_count=0"}
    library = exits.harsh_library(tmp_path)
    assert run(last + LOAD + ENDS[how], library, *fmus, **harsh) == (0, "")


INTERRUPTED = """
def step(slave, time, step):
    raise KeyboardInterrupt

slaves = [one for one in gc.get_objects() if hasattr(type(one), "_get_log_queue")]
for slave in slaves:
    type(slave).advance = step
del slave, slaves
for fmu in fmus:
    for _ in range(3):
        try:
            fmu.doStep(0.01, 0.01)
        except Exception as error:
            assert error.status == 4, error
    fmu.freeInstance()
gc.collect()
print("freed")
"""


@linux
def test_an_fmu_may_be_freed_after_ctrl_c_in_it() -> None:
    assert run(LOAD + INTERRUPTED, "", ensure("BinghamDamper")) == (0, "")


def test_scripts_differ_and_each_stays_the_same() -> None:
    texts = [exits.script(number) for number in range(40)]
    assert len(set(texts)) == 40
    assert texts == [exits.script(number) for number in range(40)]
    assert all(any(part in text for text in texts) for part in exits.PARTS.values())
    assert all('engine="compiled"' in text for text in texts)
    if exits.NATIVE:
        mixed = [all(f'form = "{form}"' in text for form in ("python", "native")) for text in texts]
        assert sum(mixed) > 20
    for text in texts:
        compile(text, "<script>", "exec")


def test_how_scripts_ended_is_counted() -> None:
    ends = [exits.End(0, 0, ""), exits.End(1, -6, "corrupted double-linked list"),
            exits.End(2, None, ""), exits.End(3, 0, "a warning")]  # fmt: skip
    (row,) = exits.rows(ends)
    assert row.measured == "2 of 4; exit codes of the others: {-6: 1, None: 1}; 1 with a message"
    assert row.ratio == 2.0
    assert str(ends[1]) == "script 1: exit -6, corrupted double-linked list"
    assert str(ends[2]) == "script 2: hung, without a word"


@pytest.mark.slow  # a process a way to end: exit codes where FMUs are loaded
@linux
@compiles
def test_scripts_of_users_end_with_0() -> None:
    ends = exits.count(range(1000, 1024), harsh=True)
    assert [str(end) for end in ends if not end.good] == []

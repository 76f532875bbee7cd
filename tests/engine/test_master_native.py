"""Foreign FMUs in C: called without the interpreter's lock, and able to take the process down."""

from __future__ import annotations

import logging
import os
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

import bristle
from bristle.engine.results import load_results
from bristle.engine.run import IncompleteRunError, run

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
pytestmark = pytest.mark.skipif(
    COMPILER is None or sys.platform == "win32",
    reason="no C compiler on the path (cc, gcc or clang), so no FMU in C",
)

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Native" guid="native">
  <CoSimulation modelIdentifier="native" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="twice" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="at" valueReference="3" causality="parameter" variability="fixed">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="how" valueReference="0" causality="parameter" variability="fixed">
      <Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/><Unknown index="3" dependencies="1"/></Outputs>
  </ModelStructure>
</fmiModelDescription>
"""
ABORT, HANG, DISCARD, ERROR, PENDING, WARN = range(1, 7)


@pytest.fixture(scope="session")
def native(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an FMU compiled from native.c."""
    return compiled(tmp_path_factory.mktemp("native"), DESCRIPTION)


def compiled(folder: Path, description: str, *flags: str) -> Path:
    """Return an FMU compiled from native.c into a folder, with a description and flags of its own.

    All of them hold a library of the same name.
    """
    folder.mkdir(exist_ok=True)
    library = folder / "native.so"
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(
        [str(COMPILER), "-shared", "-fPIC", "-O1", *flags, f"-I{headers}", "-o", str(library),
         str(Path(__file__).with_name("native.c"))],
        check=True, capture_output=True,
    )  # fmt: skip
    with zipfile.ZipFile(folder / "native.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{fmpy.platform}/native{fmpy.sharedLibraryExtension}")
    return folder / "native.fmu"


def scenario(
    native: Path, folder: Path, how: int = 0, at: float = 0.5, stop: float = 1.0,
    second: Path | None = None, more: str = "", algorithm: str = "gauss-seidel",
) -> Path:  # fmt: skip
    file = folder / "native.toml"
    file.write_text(f"""
        schema = 1
        title = "native"
        [run]
        stop = {stop}
        step = 0.1
        algorithm = "{algorithm}"
        [components.one]
        fmu = "{native}"
        parameters = {{ u = 1.0 }}
        [components.two]
        fmu = "{second or native}"
        {more}
        parameters = {{ how = {how}, at = {at} }}
        [connections]
        "two.u" = "one.y"
    """)
    return file


def test_native_fmus_are_summed_and_refreshed(native: Path, tmp_path: Path) -> None:
    frame = run(scenario(native, tmp_path))
    k = np.arange(11)
    assert frame["one.y"].to_numpy() == pytest.approx(k)
    assert frame["two.y"].to_numpy() == pytest.approx(k * (k + 1) / 2)
    assert frame["two.twice"].to_numpy() == pytest.approx(2 * k)


@pytest.mark.parametrize(
    ("how", "answer"), [(DISCARD, "Discard"), (ERROR, "Error"), (PENDING, "Pending")]
)
def test_answers_that_stop_a_run(native: Path, tmp_path: Path, how: int, answer: str) -> None:
    words = rf"two in the step from t = 0\.5 s: doStep answered {answer}.*\n  Inputs: u = 6"
    with pytest.raises(IncompleteRunError, match=words) as caught:
        run(scenario(native, tmp_path, how))
    assert len(caught.value.frame) == 6


def test_messages_are_formatted_and_found_by_name(native: Path, tmp_path: Path) -> None:
    # It passes no environment with this message, as many FMUs do.
    with pytest.raises(IncompleteRunError, match="It said: the answer is 42"):
        run(scenario(native, tmp_path, ERROR))


def test_warnings_do_not_stop_a_run(
    native: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="bristle"):
        frame = run(scenario(native, tmp_path, WARN))
    assert len(frame) == 11
    assert [r.getMessage() for r in caplog.records] == ["two: warm: 36.5 degrees"]


def started(file: Path, folder: Path) -> subprocess.Popen[str]:
    package = Path(bristle.__file__).resolve().parent.parent
    return subprocess.Popen(
        [sys.executable, "-m", "bristle.cli", "run", str(file), "--out", str(folder)],
        cwd=folder.parent, env={**os.environ, "PYTHONPATH": str(package)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_abort_leaves_a_readable_file(native: Path, tmp_path: Path) -> None:
    process = started(scenario(native, tmp_path, ABORT, at=4e4, stop=1e5), tmp_path / "out")
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGABRT
    frame = load_results(tmp_path / "out")
    assert frame.attrs["complete"] is False
    assert frame["one.y"].to_numpy() == pytest.approx(np.arange(len(frame)))


def test_ctrl_c_ends_a_hanging_native_fmu(native: Path, tmp_path: Path) -> None:
    process = started(scenario(native, tmp_path, HANG, at=0.5), tmp_path / "out")
    for _ in range(600):
        if (tmp_path / "hangs").exists():
            break
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130, errors
    assert "a component does not end its step. Rows up to t = 0.5 s are kept" in errors
    assert len(load_results(tmp_path / "out")) == 6

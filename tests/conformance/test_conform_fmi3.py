"""`bristle conform` on FMUs of FMI 3.0: the same probes, in the names of that version."""

from __future__ import annotations

import importlib.util
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
from test_conform_native import COMPILER, pytestmark

from bristle.cli import main
from bristle.conformance import conform
from bristle.conformance.probe import in_fmi3
from bristle.conformance.probes import PROBES
from bristle.errors import FmuError
from bristle.fmu.archive import library_member

__all__ = ["pytestmark"]  # without a C compiler this module is skipped too

REFERENCE = Path(__file__).parents[2].parent / "shared" / "fmi" / "reference_fmus" / "3.0"
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Toy3" instantiationToken="toy3">
  <CoSimulation modelIdentifier="Toy3" canHandleVariableCommunicationStepSize="true"/>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="u" valueReference="0" causality="input" start="0"/>
    <Float64 name="y" valueReference="1" causality="output"/>
    <Float32 name="single" valueReference="2" causality="input" start="0"/>
    <Float64 name="time" valueReference="3" causality="independent" variability="continuous"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1" dependencies=""/>
    <InitialUnknown valueReference="1"/>
  </ModelStructure>
</fmiModelDescription>
"""
NO_CALL = "not tried: FMI 3.0 has no call for derivatives of inputs, but intermediate updates of "

Compile = Callable[..., Path]


@pytest.fixture
def toy(tmp_path: Path) -> Compile:
    def make(trait: str = "HEALTHY", *changes: tuple[str, str]) -> Path:
        library, path = tmp_path / "Toy3.so", tmp_path / "Toy3.fmu"
        headers = Path(fmpy.__file__).parent / "c-code"
        flags = ["-shared", "-fPIC", "-O1", f"-DTRAIT={trait}", f"-I{headers}"]
        source = Path(__file__).with_name("toy_fmi3.c")
        command = [str(COMPILER), *flags, str(source), "-o", str(library)]
        subprocess.run(command, check=True, capture_output=True)
        text = DESCRIPTION
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", text)
            archive.write(library, library_member("Toy3", "3.0"))
        return path

    return make


def test_a_strict_fmu_conforms_and_no_probe_is_left_out(toy: Compile) -> None:
    report = conform(toy())
    assert report.ok, repr(report)
    assert [row.probe for row in report.rows] == [
        name for name, probe in PROBES.items() if probe.rule != "bristle"
    ]
    for name in ("input derivatives", "input derivative of order 0"):
        assert report.row(name).seen.startswith(NO_CALL)
    assert report.row("library").seen.endswith("version 3.0") or "missing" in (
        report.row("library").seen
    )
    assert report.row("value references").seen == "4 references, 0 aliases"
    assert report.row("set values stay").seen == "2 inputs keep their values"  # one of 32 bits
    assert report.row("state replay").seen == "not tried: canGetAndSetFMUState is not claimed"
    assert report.row("guid").seen == "toy3"
    both = [row for row in report.rows if not PROBES[row.probe].only_fmi2]
    texts = " ".join(f"{row.tried} {row.seen} {row.standard}" for row in both)
    assert "fmi2" not in texts
    assert "FMI 2.0" not in texts


@pytest.mark.parametrize(
    ("trait", "probe", "seen"),
    [
        ("RETURNS_EARLY", "legal run", "fmi3DoStep returned early, which it was not allowed to"),
        ("OTHER_ENVIRONMENT", "logging", "messages without name, status or text"),
        ("WRONG_VERSION", "library", "version b'2.0' instead of 3.0"),
        ("CRASH_ON_NULL", "free nothing", "crashed in fmi3FreeInstance: SIGSEGV"),
    ],
)
def test_spoilt_fmus_fail(toy: Compile, trait: str, probe: str, seen: str) -> None:
    row = conform(toy(trait), only=[probe]).row(probe)
    assert row.verdict == "fail"
    assert seen in row.seen


def test_an_fmu_that_asks_to_terminate_ends_its_run(toy: Compile) -> None:
    row = conform(toy("ENDS"), only=["legal run"]).row("legal run")
    assert row.verdict == "note"
    assert row.seen.startswith("the FMU ended the run itself at t = 0.3 s")


def test_two_variables_of_one_reference_fail(toy: Compile) -> None:
    twice = ('name="single" valueReference="2"', 'name="single" valueReference="0"')
    row = conform(toy("HEALTHY", twice), only=["value references"]).row("value references")
    assert (row.verdict, row.seen) == ("fail", "references that two variables have: 0")


def test_ports_that_are_arrays_are_refused_and_not_blamed(
    toy: Compile, capsys: pytest.CaptureFixture[str]
) -> None:
    array = (
        'causality="input" start="0"/>',
        'causality="input" start="0 0"><Dimension start="2"/></Float64>',
    )
    path = toy("HEALTHY", (f'"0" {array[0]}', f'"0" {array[1]}'))
    with pytest.raises(FmuError, match='"u" is an array'):
        conform(path)
    assert main(["conform", str(path)]) == 2
    assert capsys.readouterr().err.startswith("FmuError: ")


@pytest.mark.slow  # 7 s, all probes: FMI 2.0 has them by default
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="ziglang is not there")
def test_a_native_fmu_conforms_and_keeps_the_rules_for_faults() -> None:
    from bristle.native.build import ensure

    report = conform(ensure("ClippedOptimal", fmi=3))
    assert report.ok, repr(report)
    for probe in ("fault: input", "fault: step", "fault: order", "fault: earlier state"):
        assert report.row(probe).verdict == "pass"
    assert report.row("state across processes").verdict == "pass"


@pytest.mark.skipif(not REFERENCE.exists(), reason="the Reference-FMUs are not at hand")
@pytest.mark.slow  # 2 to 10 s each: the toy passes every probe, and FMI 2.0 has one by default
@pytest.mark.parametrize("name", ["Stair", "BouncingBall", "Dahlquist", "Feedthrough", "VanDerPol"])
def test_the_reference_fmus_violate_nothing_but_lack_robustness(name: str) -> None:
    report = conform(REFERENCE / f"{name}.fmu", timeout=2.0)
    assert report.conforms, repr(report)
    robustness = {row.probe for row in report.failures("robustness")}
    assert robustness == (set() if name == "Stair" else {"NaN step", "infinite step"})


@pytest.mark.skipif(not REFERENCE.exists(), reason="the Reference-FMUs are not at hand")
def test_a_step_that_the_fmu_does_not_name_holds_few_of_its_own() -> None:
    # Its experiment takes 1e8 s, and its solver 1 ms: a hundredth of the one never ends.
    report = conform(REFERENCE / "Roberts.fmu", timeout=5.0, only=["legal run"])
    assert report.row("legal run").verdict == "pass"
    assert "steps of 0.1 s" in report.row("legal run").seen


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("FMI 2.0 sections 2.1.6 and 4.2.4: values", "FMI 3.0: values"),
        ("FMI 2.0 section 4.2.2: a step; FMI 2.0 section 2.1.7: x", "FMI 3.0: a step; FMI 3.0: x"),
        ("fmi2Instantiate, fmi2GetReal", "fmi3InstantiateCoSimulation, fmi3GetFloat64"),
        ("fmi2DeSerializeFMUstate", "fmi3DeserializeFMUState"),
        ("canGetAndSetFMUstate is not claimed", "canGetAndSetFMUState is not claimed"),
        ("crashed in fmi3DoStep: SIGABRT", "crashed in fmi3DoStep: SIGABRT"),
    ],
)
def test_texts_in_the_names_of_fmi_3(old: str, new: str) -> None:
    assert in_fmi3(old) == new

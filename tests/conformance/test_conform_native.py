"""`bristle conform` on FMUs that are written in C: what Python FMUs cannot do, right or wrong."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
import test_conform

from bristle.conformance import conform
from bristle.conformance.probes import PROBES
from bristle.fmu.archive import library_member

SOURCE = Path(__file__).with_name("toy.c")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")

pytestmark = pytest.mark.skipif(
    COMPILER is None, reason="no C compiler on the path (cc, gcc or clang), so no FMU in C"
)

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Strict" guid="strict">
  <CoSimulation modelIdentifier="Strict" canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="2" causality="parameter" variability="fixed">
      <Real start="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/></Outputs>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

Compile = Callable[..., Path]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Compile:
    folder = tmp_path_factory.mktemp("strict")
    headers = Path(fmpy.__file__).parent / "c-code"

    def make(
        trait: str = "HEALTHY", *changes: tuple[str, str], flags: tuple[str, ...] = ()
    ) -> Path:
        library = folder / "Strict.so"
        define = [f"-DTRAIT={trait}", *flags, f"-I{headers}"]
        command = [
            str(COMPILER),
            "-shared",
            "-fPIC",
            "-O1",
            *define,
            str(SOURCE),
            "-o",
            str(library),
        ]
        subprocess.run(command, check=True, capture_output=True)
        text = DESCRIPTION
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = folder / "Strict.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", text)
            archive.write(library, library_member("Strict"))
        return path

    return make


def test_strict_fmu_conforms_and_refuses_with_error(compiled: Compile) -> None:
    report = conform(compiled())
    assert report.ok, repr(report)
    assert report.row("wrong guid").seen == "refused"
    for name in (
        "step before initialisation",
        "step in initialisation",
        "step after terminate",
        "initialise twice",
        "leave what was not entered",
        "fixed parameter in mid-run",
        "setting an output",
        "step past the stop time",
        "zero step",
        "negative step",
        "NaN step",
        "infinite step",
        "reading what is not there",
        "setting what is not there",
    ):
        assert report.row(name).seen == "refused with Error", name
        assert report.row(name).verdict == "pass"
    assert report.row("NaN input").seen == "u: Error"
    assert report.row("memory").seen.startswith("0 KiB per instance")


FAILING = [
    ("CRASH_ON_NULL", "free nothing", "crashed in fmi2FreeInstance: SIGSEGV"),
    ("NO_NAME_IN_LOG", "logging", "messages without name, status or text"),
    ("WRONG_VERSION", "library", "version b'2.1'"),
    ("REFUSE_SECOND", "many instances", "fmi2Instantiate answered NULL"),
    ("REFUSE_SECOND", "two instances", "fmi2Instantiate answered NULL"),
    ("EMPTY_STATE", "serialised state", "answered 0 bytes"),
    ("HUGE_STATE", "serialised state", "the probe broke off"),
    ("CRASH_AT_EXIT", "terminate and free", "crashed"),
    ("ODD_STATUS", "legal run", "answered 17, which is no status"),
    ("CRASH_ON_BAD_REFERENCE", "reading what is not there", "crashed in fmi2GetReal: SIGABRT"),
    ("CRASH_ON_BAD_REFERENCE", "setting what is not there", "crashed in fmi2SetReal: SIGABRT"),
    ("CRASH_ON_WRONG_GUID", "wrong guid", "crashed in fmi2Instantiate: SIGABRT"),
    ("CRASH_ON_EARLY_FREE", "free without terminate", "crashed in fmi2FreeInstance: SIGABRT"),
    ("CRASH_ON_EMPTY_LIST", "empty lists", "crashed in fmi2GetReal: SIGABRT"),
    ("COPY_CHANGES_RUN", "freeing states", "making copies changes the run: y at"),
    ("CRASH_ON_NULL_STATE", "freeing states", "crashed in fmi2FreeFMUstate: SIGSEGV"),
    *(
        ("ABORT_INSTEAD_OF_ERROR", probe, f"crashed in fmi2{function}: SIGABRT")
        for probe, function in {
            "step before initialisation": "DoStep",
            "step in initialisation": "DoStep",
            "step after terminate": "DoStep",
            "initialise twice": "EnterInitializationMode",
            "leave what was not entered": "ExitInitializationMode",
            "fixed parameter in mid-run": "SetReal",
            "setting an output": "SetReal",
            "step past the stop time": "DoStep",
            "zero step": "DoStep",
            "negative step": "DoStep",
            "NaN step": "DoStep",
            "infinite step": "DoStep",
        }.items()
    ),
]


@pytest.mark.parametrize(("trait", "probes"), test_conform.by_trait(FAILING).items())
def test_spoilt_fmu_fails(compiled: Compile, trait: str, probes: dict[str, str]) -> None:
    report = conform(compiled(trait), only=probes)
    assert not report.ok
    failed = [row for row in report.rows if row.verdict == "fail"]
    for seen in probes.values():
        assert any(seen in row.seen for row in failed), repr(report)


# Probes that judge nothing, and those with a test of their own in which they fail.
NEVER_FAIL = {"memory", "repeatable", "driven run"}
ELSEWHERE = {
    *("archive", "claimed capabilities", "input derivatives", "input derivative of order 0"),
}


def test_every_probe_has_an_fmu_that_fails_it() -> None:
    spoilt = (*FAILING, *test_conform.FAILING)
    failing = {probe for _, probe, _ in spoilt} | NEVER_FAIL | ELSEWHERE
    failing |= {row[2] for row in (*test_conform.BAD_FILES, *test_conform.BREAKS_RULES)}
    assert failing == set(PROBES)


def test_every_c_trait_is_used() -> None:
    traits = set(re.findall(r"#define (\w+) \d+", SOURCE.read_text()))
    used = {trait for trait, *_ in (*FAILING, *SPOILT_DERIVATIVES)}
    used |= {"HEALTHY", "LEAK_ON_FREE", "INTERPOLATES"}
    assert traits == used


def test_leak_is_noted(compiled: Compile) -> None:
    row = conform(compiled("LEAK_ON_FREE"), only=["memory"]).row("memory")
    assert row.verdict == "note"
    assert int(row.seen.split()[0]) >= 1024


def test_fmu_for_one_instance_per_process_is_not_blamed(compiled: Compile) -> None:
    once = (
        'modelIdentifier="Strict"',
        'modelIdentifier="Strict" canBeInstantiatedOnlyOncePerProcess="true"',
    )
    report = conform(compiled("REFUSE_SECOND", once))
    assert report.ok, repr(report)
    seen = report.row("two instances").seen
    assert seen == "not tried: canBeInstantiatedOnlyOncePerProcess is claimed"


@pytest.mark.parametrize(
    ("flag", "seen"),
    [
        ("canInterpolateInputs", "does not export fmi2SetRealInputDerivatives"),
        ("providesDirectionalDerivative", "does not export fmi2GetDirectionalDerivative"),
    ],
)
def test_claim_that_is_not_kept_fails(compiled: Compile, flag: str, seen: str) -> None:
    claim = ('modelIdentifier="Strict"', f'modelIdentifier="Strict" {flag}="true"')
    row = conform(compiled("HEALTHY", claim), only=["claimed capabilities"]).rows[0]
    assert row.verdict == "fail"
    assert seen in row.seen


INTERPOLATES = ('modelIdentifier="Strict"', 'modelIdentifier="Strict" canInterpolateInputs="true"')
DERIVATIVES = ["input derivatives", "input derivative of order 0"]
SPOILT_DERIVATIVES = [
    ("ZERO_MOVES", "input derivatives", "by derivatives of 0: y at t = "),
    ("SLOPE_OUTLIVES_RESET", "input derivatives", "fmi2Reset does not clear them: y at t = "),
    ("SLOPE_OUTSIDE_STATE", "input derivatives", "behind a copied state: y at t = "),
    ("CRASH_ON_ORDER_0", DERIVATIVES[1], "crashed in fmi2SetRealInputDerivatives: SIGABRT"),
]


def test_derivatives_of_inputs_are_tried_where_they_are_claimed(compiled: Compile) -> None:
    report = conform(compiled("INTERPOLATES", INTERPOLATES), only=DERIVATIVES)
    assert report.ok, repr(report)
    assert [report.row(name).seen for name in DERIVATIVES] == [
        "1 inputs moved by them; zero, a reset and a state hold", "refused with Error",
    ]  # fmt: skip
    unclaimed = conform(compiled("HEALTHY"), only=DERIVATIVES)
    assert {row.seen for row in unclaimed.rows} == {
        "not tried: canInterpolateInputs is not claimed"
    }


@pytest.mark.parametrize(("trait", "probe", "seen"), SPOILT_DERIVATIVES)
def test_spoilt_derivatives_fail(compiled: Compile, trait: str, probe: str, seen: str) -> None:
    row = conform(compiled(trait, INTERPOLATES), only=[probe]).row(probe)
    assert row.verdict == "fail"
    assert seen in row.seen


def test_unclaimed_state_is_not_tried(compiled: Compile) -> None:
    claim = ('canGetAndSetFMUstate="true" canSerializeFMUstate="true"', "")
    report = conform(compiled("HEALTHY", claim), only=["state replay", "serialised state"])
    assert [row.seen for row in report.rows] == [
        "not tried: canGetAndSetFMUstate is not claimed",
        "not tried: canSerializeFMUstate is not claimed",
    ]

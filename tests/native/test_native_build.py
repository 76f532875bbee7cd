"""Building native FMUs: what is in them, the same bytes every time, and errors in one message."""

from __future__ import annotations

import os
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from both_forms import both, native, needs_zig
from fmpy.validation import validate_fmu

from bristle.cli import main
from bristle.conformance import conform
from bristle.errors import BuildError
from bristle.fmu import build as python_fmus
from bristle.fmu.build import plan
from bristle.fmu.description import read_description
from bristle.native import build, zig
from bristle.native.build import build as build_build
from bristle.native.description import quoted
from bristle.native.entrance import plain_text
from bristle.native.zig import PLATFORMS, chosen, here
from bristle.version import __version__

pytestmark = needs_zig


# -- what is in it


def test_the_description_is_that_of_the_python_form_but_for_how_it_runs() -> None:
    mine = read_description(python_fmus.ensure("ClippedOptimal"))
    other = native("ClippedOptimal").about
    assert list(mine.variables.items()) == list(other.variables.items())
    assert mine.guid != other.guid
    flags = {key for key in mine.capabilities if mine.capabilities[key] != other.capabilities[key]}
    assert flags == {"needsExecutionTool", "canInterpolateInputs"}
    assert other.capabilities["needsExecutionTool"] == "false"
    assert validate_fmu(str(native("ClippedOptimal").path)) == []


def test_it_holds_a_library_and_what_it_reads_and_no_python() -> None:
    with zipfile.ZipFile(native("GroundMotion").path) as archive:
        names = archive.namelist()
    assert names == [
        f"binaries/{here().folder}/GroundMotion{here().suffix}",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "model.png",
        "modelDescription.xml",
        "resources/el_centro_1940_ns.csv",
    ]


def test_it_conforms_with_the_rules_for_faults() -> None:
    report = conform(native("ClippedOptimal").path, timeout=60.0)
    assert report.conforms
    tried = {row.probe: row.verdict for row in report.rows}
    assert [tried[f"fault: {kind}"] for kind in ("input", "step", "order")] == ["pass"] * 3


@pytest.mark.slow  # two builds for two platforms, nothing kept
def test_two_builds_are_identical_whatever_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    platforms = [here(), PLATFORMS["win64"]]
    found = []
    for name in ("one", "two"):
        monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / name))
        found.append(build_build(plan("ConstantVoltage"), tmp_path / f"{name}_out", platforms))
    assert found[0].read_bytes() == found[1].read_bytes()


@pytest.mark.slow  # libraries of another processor
def test_what_stands_there_already_is_kept_unless_a_platform_is_missing(tmp_path: Path) -> None:
    what = plan("ConstantVoltage")
    path = build_build(what, tmp_path, [here()])
    before = path.stat().st_mtime_ns
    assert build_build(what, tmp_path, [here()]).stat().st_mtime_ns == before
    other = PLATFORMS["aarch64-linux" if here().name != "aarch64-linux" else "linux64"]
    with zipfile.ZipFile(build_build(what, tmp_path, [here(), other])) as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if name[:3] == "bin"}
    assert folders == {here().folder, other.folder}


def test_a_changed_start_value_is_another_fmu_with_the_same_functions(tmp_path: Path) -> None:
    what = plan("ConstantVoltage", name="Three", starts={"level": 3.0})
    about = read_description(build_build(what, tmp_path, [here()]))
    assert about.variables["level"].start == 3.0
    assert about.guid != native("ConstantVoltage").about.guid


def test_a_saved_state_is_refused_where_it_is_damaged_or_of_another_fmu() -> None:
    from ctypes import c_void_p

    pair, other = both("ConstantVoltage"), both("SignalSource")
    pair.begin()
    other.begin()
    state = c_void_p()
    assert pair.one.save(state) == 0
    data = pair.one.serialise(state)[1]
    pair.native.messages.clear()
    spoilt = [b"", data[:20], data[:-1], data[:-9] + b"\x01" + data[-8:], b"x" * len(data)]
    for bytes_ in spoilt:
        assert pair.one.deserialise(bytes_, c_void_p()) == 3
    assert other.one.deserialise(data, c_void_p()) == 3
    assert "it is one of another FMU." in other.native.messages[-1][3]
    assert "it is damaged." in pair.native.messages[2][3]
    assert pair.step(0.0, 0.1) == (True, 0)  # the instance is as it was
    assert pair.one.forget(state) == 0
    pair.end()
    other.end()


# -- what goes wrong


def test_without_the_compiler_a_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    zig.version.cache_clear()
    monkeypatch.setattr(zig.importlib.util, "find_spec", lambda name: None)
    assert main(["build", "ConstantVoltage", "--native", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'bristle[native]'" in said
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_platform_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "ConstantVoltage", "--native", "--platform", "linux64,os2"]) == 2
    assert 'no platform is named "os2". There are: linux64, win64' in capsys.readouterr().err
    assert main(["build", "ConstantVoltage", "--platform", "linux64"]) == 2
    assert "--platform goes with --native" in capsys.readouterr().err
    assert [one.name for one in chosen(["win64,linux64", "win64"])] == ["win64", "linux64"]
    assert len(chosen([])) == 5


def test_a_platform_that_fails_leaves_no_archive(tmp_path: Path) -> None:
    broken = replace(here(), name="broken", target="x86_64-nowhere-none")
    with pytest.raises(BuildError, match=r"^broken: zig cannot compile this: "):
        build_build(plan("ConstantVoltage"), tmp_path / "out", [here(), broken])
    assert not (tmp_path / "out").exists()


def test_a_cache_that_is_a_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cache").write_text("")
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / "cache"))
    with pytest.raises(BuildError, match="cannot be written"):
        build_build(plan("ConstantVoltage"), tmp_path / "out", [here()])


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root writes anywhere")
def test_a_cache_that_is_read_only_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache" / "native").mkdir(parents=True)
    (tmp_path / "cache" / "native").chmod(0o500)
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / "cache"))
    with pytest.raises(BuildError, match=r"cannot be written \(read-only\)"):
        build_build(plan("ConstantVoltage"), tmp_path / "out", [here()])


def test_a_full_disk_is_one_message_and_no_half_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", full)
    with pytest.raises(BuildError, match=r"ConstantVoltage.fmu: .* \(No space left on device\)"):
        build_build(plan("ConstantVoltage"), tmp_path, [here()])
    assert list(tmp_path.iterdir()) == []


def test_a_full_cache_is_one_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> Path:
        raise OSError(28, "No space left on device", str(tmp_path / "cache"))

    monkeypatch.setattr(build, "keep", full)
    what = plan("ConstantVoltage", name="Other")
    with pytest.raises(BuildError, match=r"cache: cannot be written \(No space left on device\)"):
        build_build(what, tmp_path / "out", [here()])


def test_text_that_calls_what_no_host_has_is_refused() -> None:
    text = 'define i32 @"root"() {\n}\ndeclare ptr @PyErr_Occurred()\ndeclare double @exp(double)\n'
    with pytest.raises(BuildError, match="call PyErr_Occurred, which no host has"):
        plain_text(text, "root")
    assert "@bristle_entrance()" in plain_text(text.replace("PyErr_Occurred", "sin"), "root")


def test_texts_become_c() -> None:
    assert quoted('a "b" ü\n?') == r'"a \042b\042 \303\274\012\077"'


# -- what users bring

BAD = """
from bristle.fmu.own_controller import OwnController


class Bad(OwnController):
    def command(self, measured, memory):
        table = {"speed": measured.base_velocity}
        return table["speed"], ()
"""


def test_a_controller_that_the_compiler_refuses_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bad.py"
    file.write_text(BAD)
    assert main(["build", str(file), "--native", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert f"{file}, line 8: the compiler refuses this: " in said
    assert "no text, list, dict" in said
    assert "Without --native it builds as it is." in said
    assert main(["build", str(file), "--out", str(tmp_path)]) == 0


def test_a_controller_of_ones_own_needs_no_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "controller", "my_controller"]) == 0
    assert main(["build", "my_controller.py", "--native", "--platform", here().name]) == 0
    assert "MyController.fmu: built" in capsys.readouterr().out
    about = read_description(tmp_path / "MyController.fmu")
    assert about.capabilities["needsExecutionTool"] == "false"
    with zipfile.ZipFile(tmp_path / "MyController.fmu") as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert root.get("generationTool") == f"bristle native {__version__}"

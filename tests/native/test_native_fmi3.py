"""Native FMUs of FMI 3.0: their description, and the rows of the form of FMI 2.0."""

from __future__ import annotations

import ctypes
import math
import random
import re
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from both_forms import SIZES, folder, native, needs_zig
from fmi3_form import LIGHT, Three, built, unpacked
from fmpy.validation import validate_fmu

import bristle
from bristle.cli import main
from bristle.fmu import catalogue
from bristle.fmu.archive import library_member
from bristle.fmu.build import built_guid, plan
from bristle.fmu.description import read_description
from bristle.native.build import build
from bristle.native.description import TYPES
from bristle.native.zig import PLATFORMS, here

pytestmark = needs_zig

HEADER = Path(fmpy.__file__).parent / "c-code" / "fmi3Functions.h"


# -- the description


def described_alike(component: str) -> None:
    """Assert that an FMU says of itself what its form of FMI 2.0 says, and is valid."""
    two, three = native(component).about, read_description(built(component))
    assert three.version == "3.0"
    variables = dict(three.variables)
    time = variables.pop("time")
    assert (time.causality, time.unit, time.reference) == ("independent", "s", len(two.variables))
    assert list(variables) == list(two.variables)
    for one, other in zip(variables.values(), two.variables.values(), strict=True):
        if one.type == "Int32" and other.minimum is other.maximum is None:
            assert (one.minimum, one.maximum) == (-(2.0**31), 2.0**31 - 1)  # what the type holds
            one = replace(one, minimum=None, maximum=None)
        assert replace(one, type="") == other
    assert all(v.type == TYPES[v.kind] for v in variables.values())
    assert set(three.capabilities.items()) <= set(two.capabilities.items())
    assert three.guid != two.guid
    assert built_guid(built(component)) == three.guid
    assert validate_fmu(str(built(component))) == []  # the schema of the standard too


def test_the_description_says_what_that_of_fmi_2_says() -> None:
    described_alike(LIGHT)
    about = read_description(built(LIGHT))
    assert about.capabilities["needsExecutionTool"] == "false"
    assert about.capabilities["canSerializeFMUstate"] == "true"
    assert about.variables["base_velocity"].over_step == "sampled"
    parameter = about.variables["v_max"]
    assert (parameter.start, parameter.unit, parameter.minimum) == (8.0, "V", 0.001)


def test_folders_are_those_of_fmi_3() -> None:
    with zipfile.ZipFile(built("GroundMotion")) as archive:
        assert archive.namelist() == [
            library_member("GroundMotion", "3.0"),
            "documentation/index.html",
            "documentation/licenses/license.txt",
            "modelDescription.xml",
            "resources/el_centro_1940_ns.csv",
            "terminalsAndIcons/icon.png",
            "terminalsAndIcons/terminalsAndIcons.xml",
        ]
    assert {one.place("X", 3) for one in PLATFORMS.values()} == {
        "binaries/x86_64-linux/X.so", "binaries/x86_64-windows/X.dll",
        "binaries/x86_64-darwin/X.dylib", "binaries/aarch64-linux/X.so",
        "binaries/aarch64-darwin/X.dylib",
    }  # fmt: skip


def test_the_library_exports_all_of_fmi_3_and_nothing_of_fmi_2() -> None:
    functions = re.findall(r"^FMI3_Export fmi3(\w+)TYPE", HEADER.read_text(), re.MULTILINE)
    assert len(functions) == 75
    library = ctypes.CDLL(str(unpacked(LIGHT) / library_member(LIGHT, "3.0")))
    assert [name for name in functions if not hasattr(library, f"fmi3{name}")] == []
    assert not hasattr(library, "fmi2DoStep")
    library.fmi3GetVersion.restype = ctypes.c_char_p
    assert library.fmi3GetVersion() == b"3.0"


# -- values and steps


def largest_difference(component: str, steps: int = 150, **values: Any) -> float:
    """Return how far outputs lie from those of the form of FMI 2.0, as inputs and steps change."""
    three, two, draw = Three(component), native(component).instance(), random.Random(1)
    about = native(component).about
    for name, value in values.items():
        variable = about.variables[name]
        assert three.set(name, value) == two.set(variable.kind, [variable.reference], [value]) == 0
    three.begin()
    assert [two.setup(0.0, None), two.enter(), two.leave()] == [0, 0, 0]
    outputs = [v for v in about.of("output") if v.kind == "Real"]
    references, time, rows = [v.reference for v in outputs], 0.0, []
    for k in range(steps):
        for i, v in enumerate(about.of("input")):
            motion = SIZES.get(v.unit or "", 1.0) * math.sin(0.07 * k + 0.9 * i)
            value = float(v.start or 0.0) + motion
            assert three.set(v.name, value) == two.set("Real", [v.reference], [value]) == 0
        length = draw.choice((0.002, 0.001, 0.0005))
        assert three.step(time, length) == two.step(time, length) == 0
        time += length
        assert three.last.value == three.get("time")[0] == pytest.approx(time, abs=1e-12)
        rows.append((three.slave.getFloat64(references), two.get("Real", references)[1]))
    three.end()
    two.free()
    mine, other = (np.array([row[side] for row in rows]) for side in (0, 1))
    assert np.isfinite(mine).all()
    return float((abs(mine - other) / np.maximum(abs(other).max(axis=0), 1e-300)).max())


@pytest.mark.parametrize(
    ("component", "values"),
    [(LIGHT, {"velocity": "filtered", "f_min": 0.1}), ("GroundMotion", {"peak": 3.0})],
)
def test_outputs_are_those_of_the_form_of_fmi_2(component: str, values: dict[str, Any]) -> None:
    assert largest_difference(component, **values) == 0.0


def test_fmpy_simulates_it() -> None:
    two, three = (
        fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.01)
        for path in (native("GroundMotion").path, built("GroundMotion"))
    )
    assert len(three) == 101
    peak = np.abs(two["ground_acceleration"]).max()
    assert peak > 0.01
    difference = np.abs(two["ground_acceleration"] - three["ground_acceleration"])
    assert difference.max() <= 1e-12 * peak


SCENARIO = """
schema = 1
title = "a controller without a building"
[run]
stop = 1.0
step = 0.002
[components.ground]
fmu = "{ground}"
parameters = {{ peak = 3.0 }}
[components.motion]
fmu = "{motion}"
parameters = {{ kind = "chirp", amplitude = 0.01 }}
[components.controller]
fmu = "{controller}"
parameters = {{ f_min = 0.1, velocity = "filtered", damper_force = 3.0 }}
[connections]
"controller.floor_acceleration" = "ground.ground_acceleration"
"controller.base_displacement" = "motion.displacement"
"controller.base_velocity" = "motion.velocity"
"""


def test_the_master_gives_the_same_rows(tmp_path: Path) -> None:
    rows = []
    for choose in (built, lambda name: native(name).path):
        file = tmp_path / "scenario.toml"
        ground, motion = choose("GroundMotion"), choose("PrescribedMotion")
        text = SCENARIO.format(ground=ground, motion=motion, controller=choose(LIGHT))
        file.write_text(text, encoding="utf-8")
        rows.append(bristle.run(file))
    assert list(rows[0].columns) == list(rows[1].columns)
    assert rows[0].dtypes.equals(rows[1].dtypes)
    # Only FMI 2.0 has input derivatives, which the master uses where they save a call: its rows
    # differ by rounding.
    two, three = (one.to_numpy() for one in rows)
    assert np.max(np.abs(two - three) / np.maximum(np.max(np.abs(two), axis=0), 1e-12)) < 1e-12
    assert rows[0]["motion.displacement"].abs().max() > 0.005


# -- the commands


def test_the_command_builds_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    order = ["build", "ConstantVoltage", "--native", "--fmi", "3", "--platform", here().name]
    assert main(order) == 0
    assert "ConstantVoltage.fmu: built" in capsys.readouterr().out
    assert read_description(tmp_path / "ConstantVoltage.fmu").version == "3.0"
    assert main(["build", "ConstantVoltage", "--fmi", "3"]) == 2
    assert "--fmi 3 goes with --native" in capsys.readouterr().err


# -- all of it, slowly


@pytest.mark.slow  # every component is compiled
@pytest.mark.parametrize("component", catalogue.component_names())
def test_every_component_has_this_form(component: str) -> None:
    described_alike(component)
    assert largest_difference(component, steps=60) == 0.0


@pytest.mark.slow  # a damper with all effects is compiled
def test_booleans_switch_effects() -> None:
    assert largest_difference("BinghamDamper", **{"stribeck.on": True}) == 0.0


@pytest.mark.slow  # libraries of five platforms
def test_every_platform_has_a_library_of_its_own() -> None:
    path = build(plan("ConstantVoltage"), folder() / "fmi3_all", list(PLATFORMS.values()), fmi=3)
    with zipfile.ZipFile(path) as archive:
        places = [name for name in archive.namelist() if name.startswith("binaries/")]
        assert places == sorted(one.place("ConstantVoltage", 3) for one in PLATFORMS.values())
        for place in places:
            assert b"fmi3InstantiateCoSimulation" in archive.read(place)
    assert validate_fmu(str(path)) == []

"""What other tools show of an FMU: its origin, quantities, icon and page; the effects asked for."""

from __future__ import annotations

import zipfile
from html import escape
from math import sin
from pathlib import Path
from xml.etree import ElementTree

import pytest
from built import COMPONENTS, DAMPERS, built
from fmpy.validation import validate_fmu

from bristle import units
from bristle.cli import main
from bristle.fmu import catalogue
from bristle.fmu.build import build, plan
from bristle.fmu.description import read_description
from bristle.physics.laws import LAWS
from bristle.version import DATE, __version__


def tree(path: Path) -> ElementTree.Element:
    with zipfile.ZipFile(path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml"))


def page(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read("documentation/index.html").decode()


def rows(
    component: str, offers: list[str] | None, on: list[str], drive: str = ""
) -> list[list[float]]:
    """Return the outputs of a component as a Python object over some steps."""
    slave = catalogue.instantiate(component, drive=drive, offers=offers)
    for name in on:
        slave._values[slave._index[f"{name}.on"]] = True
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    found = []
    for k in range(200):
        values = [0.01 * sin(0.1 * k + n) for n in range(len(slave._inputs))]
        slave.set_real(slave._inputs, values)
        assert slave.do_step(0.002 * k, 0.002)
        found.append(slave.get_real(slave._outputs))
    return found


@pytest.mark.parametrize("component", COMPONENTS)
def test_a_tool_sees_who_made_it_what_it_is_and_how_large_its_numbers_are(component: str) -> None:
    path = built(component)
    root = tree(path)
    assert root.get("generationTool") == f"bristle {__version__}"
    assert root.get("version") == __version__
    assert root.get("generationDateAndTime") == f"{DATE}T00:00:00Z"
    assert all(root.get(key) for key in ("description", "author", "copyright", "license"))
    types = {one.get("name"): one[0] for one in root.iterfind("TypeDefinitions/SimpleType")}
    shown = {
        one.get("name"): {display.get("name") for display in one.iterfind("DisplayUnit")}
        for one in root.iterfind("UnitDefinitions/Unit")
    }
    for node in root.iterfind("ModelVariables/ScalarVariable"):
        value, name = node[0], node.get("name")
        if node.get("causality") == "parameter":
            assert node.get("variability") == "fixed", name
        if value.tag != "Real":
            continue
        start = float(value.get("start", "0"))
        if value.get("declaredType"):
            kind = types[value.get("declaredType")]
            assert kind.get("quantity"), name
            assert kind.get("unit") == value.get("unit"), name
            assert kind.get("displayUnit", value.get("unit")) in {
                *shown[value.get("unit")], value.get("unit")
            }  # fmt: skip
        if value.get("declaredType") or start:
            assert float(value.attrib["nominal"]) > 0.0, name
    unit = root.find("UnitDefinitions/Unit[@name='m']")
    if unit is not None:
        assert float(unit[1].attrib["factor"]) == 1.0 / units.parse("mm").factor


@pytest.mark.parametrize("component", COMPONENTS)
def test_icon_licence_and_a_page_with_ports_equation_ranges_and_sources(component: str) -> None:
    path = built(component)
    with zipfile.ZipFile(path) as archive:
        assert archive.read("model.png").startswith(b"\x89PNG")
        assert b"MIT License" in archive.read("documentation/licenses/license.txt")
    text, about = page(path), read_description(path)
    for variable in about.variables.values():
        assert f"<td>{variable.name}</td>" in text
    if component in DAMPERS:
        law = LAWS[DAMPERS[component]]
        assert "<pre>" in text
        assert escape(law.source) in text
        for parameter in law.parameters.values():
            assert "<td>{:g} to {:g}</td>".format(*parameter.bounds) in text


def test_the_date_is_that_of_the_source_where_it_is_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    root = tree(build(plan("ConstantVoltage"), tmp_path))
    assert root.get("generationDateAndTime") == "1970-01-02T00:00:00Z"


@pytest.mark.parametrize("component", [*DAMPERS, "Structure"])
def test_an_fmu_without_effects_computes_what_one_does_with_all_of_them_off(component: str) -> None:
    assert rows(component, [], []) == rows(component, None, [])


@pytest.mark.parametrize("on", [["gas_spring"], ["coil_lag", "mount_compliance", "temperature"]])
def test_the_effects_asked_for_compute_what_they_do_among_all(on: list[str]) -> None:
    few = rows("LuGreDamper", on, on)
    assert few == rows("LuGreDamper", None, on)
    assert few != rows("LuGreDamper", None, [])


def test_build_takes_the_effects_asked_for_and_switches_them_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["build", "LuGreDamper", "--name", "Bare"]) == 0
    assert "12 parameters" in capsys.readouterr().out
    assert main(["build", "LuGreDamper", "--effects", "gas_spring, coil_lag"]) == 0
    about = read_description(tmp_path / "LuGreDamper.fmu")
    switches = {v.name: v.start for v in about.of("parameter") if v.name.endswith(".on")}
    assert switches == {"coil_lag.on": True, "gas_spring.on": True}
    assert validate_fmu("LuGreDamper.fmu") == []
    with zipfile.ZipFile("LuGreDamper.fmu") as archive:
        effects = {Path(n).stem for n in archive.namelist() if "/physics/effects/" in n}
    assert effects == {"__init__", "coil_lag", "gas_spring"}
    text = page(tmp_path / "LuGreDamper.fmu")
    assert "Effect: gas spring" in text
    assert "stribeck" not in text
    assert main(["build", "LuGreDamper", "--effects", "all", "--name", "Full"]) == 0
    full = read_description(tmp_path / "Full.fmu")
    assert {v.start for v in full.of("parameter") if v.name.endswith(".on")} == {False}
    capsys.readouterr()
    assert main(["build", "LuGreDamper", "--effects", "gas_sprin"]) == 2
    assert 'Did you mean "gas_spring"?' in capsys.readouterr().err
    assert main(["build", "ConstantVoltage", "--effects", "gas_spring"]) == 2
    assert "There are none" in capsys.readouterr().err


OWN = '''"""Bump: a force at rest."""

from bristle.physics.effect import Effect, Parameter


class Bump(Effect):
    """Bump: a force that grows with the displacement alone.

        F = k x
    """

    name = "bump"
    site = "damper"
    needs = ("x",)
    passive = True
    source = "made here"
    expect = "force in phase with displacement"
    parameters = {"k": Parameter(10.0, "N/m", (0.0, 1e3), "stiffness")}

    @staticmethod
    def force(q, z, p):
        return p.k * q.x
'''


def test_an_effect_of_ones_own_is_off_until_it_is_asked_for_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bump.py").write_text(OWN)
    order = ["build", "BinghamDamper", "--effect", "bump.py", "--trust"]
    for name, more, on in (("Off", [], False), ("On", ["--effects", "bump,gas_spring"], True)):
        assert main([*order, "--name", name, *more]) == 0
        parameters = read_description(tmp_path / f"{name}.fmu").variables
        assert parameters["bump.on"].start is on
        assert ("gas_spring.on" in parameters) is on

"""FMUs of FMI 3.0 in a scenario: the same rows as their twins of FMI 2.0, and clear refusals."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bristle
from bristle.engine.run import IncompleteRunError
from bristle.errors import FmuError, ScenarioError
from bristle.fmu import description
from bristle.fmu.archive import platform_folder
from bristle.fmu.description import read_description

REFERENCE = Path(__file__).parents[2].parent / "shared" / "fmi" / "reference_fmus"
needs_fmus = pytest.mark.skipif(
    not (REFERENCE / "3.0").is_dir() or platform_folder() != "linux64",
    reason="the Reference-FMUs are not beside the project, or not built for this platform",
)

FEEDTHROUGH = {
    "Float32_continuous_input": 0.0, "Float32_discrete_input": 0.0,
    "Float64_continuous_input": 0.0, "Float64_discrete_input": 0.0,
    "Int8_input": 0, "UInt8_input": 0, "Int16_input": 0, "UInt16_input": 0, "Int32_input": 0,
    "UInt32_input": 0, "Int64_input": 0, "UInt64_input": 0, "Boolean_input": False,
    "String_input": "text", "Enumeration_input": 1,
}  # fmt: skip


def scenario(
    folder: Path, components: dict[str, Any], wires: str = "", stop: float = 1.0, step: float = 0.1
) -> Path:
    """Write a scenario; components: name to (version, FMU, parameters)."""
    lines = ["schema = 1", 'title = "FMI"', "[run]", f"stop = {stop}", f"step = {step}"]
    for name, (version, fmu, parameters) in components.items():
        lines += [f"[components.{name}]", f'fmu = "{REFERENCE / version / fmu}.fmu"']
        values = ", ".join(f'"{key}" = {_toml(value)}' for key, value in parameters.items())
        lines.append(f"parameters = {{ {values} }}")
    file = folder / "scenario.toml"
    file.write_text("\n".join([*lines, "[connections]", wires]), encoding="utf-8")
    return file


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value).replace("'", '"')


@needs_fmus
@pytest.mark.parametrize(
    ("name", "stop", "step"),
    [("Dahlquist", 10.0, 0.1), ("BouncingBall", 3.0, 0.01), ("VanDerPol", 20.0, 0.01),
     ("Stair", 8.0, 0.2)],
)  # fmt: skip
def test_rows_are_those_of_the_same_model_in_fmi_2(
    name: str, stop: float, step: float, tmp_path: Path
) -> None:
    two, three = (
        bristle.run(scenario(tmp_path, {"one": (version, name, {})}, stop=stop, step=step))
        for version in ("2.0", "3.0")
    )
    assert list(two.columns) == list(three.columns)
    assert two.dtypes.equals(three.dtypes)
    assert np.array_equal(two.to_numpy(), three.to_numpy())
    if name == "Dahlquist":  # explicit Euler with the step 0.1 that it has inside
        assert three["one.x"].iloc[-1] == pytest.approx(0.9**100, rel=1e-12)
    if name == "BouncingBall":  # before the first bounce; Euler steps of 1 ms
        assert three["one.h"].iloc[40] == pytest.approx(1 - 9.81 * 0.4**2 / 2, abs=3e-3)
        assert three.attrs["units"] == {"time": "s", "one.h": "m", "one.v": "m/s"}


def chain(folder: Path, **given: Any) -> Path:
    """Return a scenario in which values of several types are passed through."""
    wired = ("Float64_continuous_input", "Float32_continuous_input", "Int32_input", "Int16_input")
    values = {key: value for key, value in FEEDTHROUGH.items() if key not in wired} | given
    wires = """
        "pass.Float64_continuous_input" = "decay.x"
        "pass.Float32_continuous_input" = { from = "decay.x", factor = 2.0, offset = 1.0 }
        "pass.Int32_input" = "stair.counter"
        "pass.Int16_input" = "stair.counter"
    """
    parts = {
        "decay": ("3.0", "Dahlquist", {"k": 0.5}),
        "stair": ("3.0", "Stair", {}),
        "pass": ("3.0", "Feedthrough", values),
    }
    return scenario(folder, parts, wires, stop=2.0)


@needs_fmus
@pytest.mark.parametrize("algorithm", ["midpoint", "gauss-seidel", "jacobi"])
def test_values_of_every_type_come_through(algorithm: str, tmp_path: Path) -> None:
    given = {
        "Int8_input": -100, "UInt8_input": 200, "UInt16_input": 60_000, "Int64_input": 7,
        "UInt32_input": 5, "UInt64_input": 9, "Boolean_input": True, "Enumeration_input": 2,
        "Float32_discrete_input": 0.5, "Float64_discrete_input": 0.1,
    }  # fmt: skip
    rows = bristle.run(chain(tmp_path, **given), {"run.algorithm": algorithm})
    for name, value in given.items():
        assert (rows[f"pass.{name.replace('input', 'output')}"] == value).all(), name
    assert np.array_equal(rows["decay.x"], rows["pass.Float64_continuous_output"])
    assert rows["decay.x"].iloc[-1] == pytest.approx(0.95**20, rel=1e-12)
    narrow = (2.0 * rows["decay.x"] + 1.0).to_numpy().astype(np.float32)
    assert np.array_equal(narrow, rows["pass.Float32_continuous_output"])
    for name in ("Int32", "Int16"):
        assert np.array_equal(rows["stair.counter"], rows[f"pass.{name}_output"])
    assert rows["stair.counter"].iloc[[0, -1]].tolist() == [1, 3]


@needs_fmus
def test_a_state_is_kept_and_restored(tmp_path: Path) -> None:
    """In a loop of feedthroughs nothing changes; the iteration goes back by FMI 3.0's functions."""
    values = {k: v for k, v in FEEDTHROUGH.items() if k != "Float64_continuous_input"}
    wires = """
        "a.Float64_continuous_input" = "b.Float64_discrete_output"
        "b.Float64_continuous_input" = "a.Float64_discrete_output"
    """
    parts = dict.fromkeys(("a", "b"), ("3.0", "Feedthrough", values))
    rows = bristle.run(scenario(tmp_path, parts, wires), {"run.algorithm": "midpoint-iterated"})
    assert len(rows) == 11
    assert (rows["a.Float64_continuous_output"] == 0.0).all()


@needs_fmus
def test_an_fmu_that_asks_to_end_says_so(tmp_path: Path) -> None:
    file = scenario(tmp_path, {"one": ("3.0", "Stair", {})}, stop=10.0, step=0.2)
    with pytest.raises(IncompleteRunError, match="it asks to end the simulation at t = 9 s") as end:
        bristle.run(file)
    assert end.value.frame.index[-1] == pytest.approx(8.8)


@needs_fmus
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"Int8_input": 300}, "pass.Int8_input = 300 lies above 127"),
        ({"UInt16_input": -1}, "pass.UInt16_input = -1 lies below 0"),
        ({"Boolean_input": 1}, "true or false is right"),
        ({"Binary_input": "666f6f"}, 'no parameter "Binary_input"'),
    ],
)
def test_values_that_do_not_fit_are_refused(
    given: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as refusal:
        bristle.run(chain(tmp_path, **given))
    assert words in str(refusal.value)


@needs_fmus
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Clocks", "not for co-simulation (scheduled execution only)"),
        ("StateSpace", '"u" is an array. Ports are single numbers here.'),
    ],
)
def test_what_cannot_run_is_refused(name: str, words: str) -> None:
    with pytest.raises(FmuError) as refusal:
        read_description(REFERENCE / "3.0" / f"{name}.fmu")
    assert words in str(refusal.value)


@needs_fmus
def test_what_knows_fmi_2_alone_refuses_it() -> None:
    with pytest.raises(FmuError, match=r"FMI version 3\.0; FMI 2\.0 for co-simulation is right"):
        read_description(REFERENCE / "3.0" / "Dahlquist.fmu", versions=("2.0",))


DESCRIPTION = """
<fmiModelDescription fmiVersion="3.0" modelName="Plant" instantiationToken="{x}">
  <CoSimulation modelIdentifier="Plant" canGetAndSetFMUState="true"/>
  <TypeDefinitions><Float64Type name="Force" unit="N" min="-5"/></TypeDefinitions>
  <ModelVariables>
    <Float64 name="u" valueReference="1" causality="input" declaredType="Force" start="1.5">
      <Annotations><Annotation type="bristle"><overStep>held</overStep></Annotation></Annotations>
    </Float64>
    <Float64 name="y" valueReference="2" causality="output" unit="m" nominal="0.1">
      <Annotations>
        <Annotation type="other"><jumpsWithout>v</jumpsWithout></Annotation>
        <Annotation type="bristle"><jumpsWithout>u</jumpsWithout></Annotation>
      </Annotations>
    </Float64>
    <Int8 name="n" valueReference="3" causality="parameter" variability="fixed" max="9"/>
    <String name="s" valueReference="4" causality="parameter" variability="fixed">
      <Start value="text"/></String>
    <Float64 name="A" valueReference="5" causality="parameter" start="1 2">
      <Dimension start="2"/></Float64>
    <Binary name="b" valueReference="6" causality="parameter"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="2" dependencies="1 3"/></ModelStructure>
  <Annotations><Annotation type="bristle"><optional>u</optional></Annotation></Annotations>
</fmiModelDescription>
"""


def test_a_description_is_read_as_in_fmi_2() -> None:
    found = description.describe_fmi3(ElementTree.fromstring(DESCRIPTION))
    assert (found.version, found.guid, found.identifier) == ("3.0", "{x}", "Plant")
    assert found.capabilities == {"canGetAndSetFMUstate": "true"}
    assert list(found.variables) == ["u", "y", "n", "s"]  # arrays and binaries are no ports here
    u, y, n, s = found.variables.values()
    assert (u.kind, u.type, u.unit, u.minimum, u.start) == ("Real", "Float64", "N", -5.0, 1.5)
    assert (u.over_step, y.jumps_without, u.optional, y.optional) == ("held", "u", True, False)
    assert (u.variability, n.variability) == ("continuous", "fixed")
    assert (y.unit, y.nominal, y.dependencies) == ("m", 0.1, ("u",))
    assert (n.kind, n.minimum, n.maximum) == ("Integer", -128.0, 9.0)
    assert (s.kind, s.start) == ("String", "text")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('causality="output" unit', 'causality="output" clocks="9" unit', "belongs to a clock"),
        ('name="y"', 'name="u"', "variables defined twice: u"),
        ('name="y" ', "", "a variable has no name"),
        ('valueReference="2" causality', 'valueReference="x" causality', "no unsigned integer"),
        ('start="1.5"', 'start="many"', "the start 'many' is no Real"),
        ("held", "often", "the annotation overStep is 'often', none of "),
        (">u</jumpsWithout>", ">n</jumpsWithout>", '"y" may jump without "n", but no input has'),
        ("<optional>u", "<optional>y", 'calls "y" optional, but no input has that name'),
        ('max="9"', 'max="nine"', "max is 'nine', not a number"),
    ],
)
def test_contradictions_are_refused(old: str, new: str, words: str) -> None:
    assert old in DESCRIPTION
    with pytest.raises(FmuError) as refusal:
        description.describe_fmi3(ElementTree.fromstring(DESCRIPTION.replace(old, new)))
    assert words in str(refusal.value)


def test_model_exchange_alone_and_a_missing_binary_are_told(tmp_path: Path) -> None:
    file = tmp_path / "Plant.fmu"
    for text, words in (
        (DESCRIPTION.replace("<CoSimulation", "<ModelExchange"), "(model exchange only)"),
        (DESCRIPTION, f"binaries/{platform_folder('3.0')}/Plant"),
    ):
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("modelDescription.xml", text.strip())
        with pytest.raises(FmuError) as refusal:
            read_description(file)
        assert words in str(refusal.value)
    assert read_description(file, any_platform=True).version == "3.0"

"""Values of one type that feed another: whole numbers are converted, all else is refused early."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path

import pytest
from described import (
    ENUMERATION,
    component,
    connection,
    port,
    write_fmu,
    write_scenario,
    write_ssp,
)
from toys import Maker

import bristle
from bristle.cli import main
from bristle.errors import ScenarioError
from bristle.system.model import ALGORITHMS

COUNTERS = {
    "b.number": "a.count", "a.number": "b.count", "b.flag": "a.flipped", "a.flag": "b.flipped",
}  # fmt: skip
"""Two that count each other up."""
SPEEDS = '<Item name="slow" value="2"/><Item name="fast" value="5"/>'


def told(file: Path, capsys: pytest.CaptureFixture[str], code: int) -> list[tuple[str, str]]:
    """Return level and text of what `bristle check` finds; it ends with this exit code."""
    assert main(["check", "--json", str(file)]) == code
    findings = json.loads(capsys.readouterr().out)["files"][0]["findings"]
    return [(one["level"], one["text"]) for one in findings]


@pytest.mark.parametrize("algorithm", [a for a in ALGORITHMS if a != "midpoint-iterated"])
@pytest.mark.parametrize("step", [None, 0.05])
def test_a_whole_number_feeds_a_real(
    algorithm: str, step: float | None, scenario_of: Maker
) -> None:
    file = scenario_of(
        {"a": "Logic", "b": "Logic", "gain": "Gain", "sum": "Integrator"},
        {**COUNTERS, "gain.u": "a.count", "sum.u": "gain.y"},
        steps={"gain": step} if step else None,
        algorithm=algorithm,
    )
    frame = bristle.run(file)
    counts = frame["a.count"].to_numpy()
    assert counts[-1] >= 10
    assert frame["a.count"].dtype == "int64"
    assert frame["gain.y"].tolist() == (2.0 * counts).tolist()


def test_a_whole_number_is_transformed_on_its_way(scenario_of: Maker) -> None:
    file = scenario_of({"a": "Logic", "b": "Logic", "gain": "Gain"}, COUNTERS)
    wire = '"gain.u" = { from = "a.count", factor = 0.5, offset = 3.0 }\n'
    file.write_text(file.read_text() + wire)
    frame = bristle.run(file)
    assert frame["gain.y"].tolist() == (2.0 * (0.5 * frame["a.count"] + 3.0)).tolist()


def test_the_coupled_engine_refuses_what_it_does_not_convert(tmp_path: Path) -> None:
    file = tmp_path / "my.toml"
    file.write_text(
        "schema = 1\n[run]\nstop = 0.1\nstep = 0.01\n"
        '[components.motion]\nfmu = "PrescribedMotion"\n'
        '[components.damper]\nfmu = "BinghamDamper"\n'
        '[connections]\n"damper.displacement" = "motion.displacement"\n'
        '"damper.velocity" = "motion.velocity"\n"damper.voltage" = "motion.fault"\n'
    )
    with pytest.raises(ScenarioError, match=r'"damper.voltage" is Real and is fed by Integer'):
        bristle.run(file, engine="compiled")


@pytest.fixture(params=["2.0", "3.0"])
def version(request: pytest.FixtureRequest) -> str:
    found: str = request.param
    return found


NAMES = {
    "2.0": ("Integer", "Boolean", "String", "Enumeration"),
    "3.0": ("Int32", "Boolean", "String", "Enumeration"),
}


def of_all_types(file: Path, version: str) -> Path:
    """Write an FMU with an input and an output of each type."""
    whole, boolean, text, enumeration = NAMES[version]
    named = 'declaredType="Speed"'
    kinds = [("real", "Real", ""), ("whole", whole, ""), ("yes", boolean, ""), ("text", text, ""),
             ("speed", enumeration, named)]  # fmt: skip
    ports = []
    for kind, name, more in kinds:
        start = {"yes": 'start="false"', "speed": 'start="2"', "text": ""}.get(kind, 'start="0"')
        start = 'start="on"' if kind == "text" and version == "2.0" else start
        both = (("in", "input", f"{more} {start}"), ("out", "output", more))
        for end, causality, attributes in both:
            ports.append(port(len(ports), f"{kind}_{end}", causality, name, attributes, version))
    tag = ENUMERATION[version]
    inner = SPEEDS if version == "3.0" else f"<Enumeration>{SPEEDS}</Enumeration>"
    types = f'<{tag} name="Speed">{inner}</{tag}>'
    return write_fmu(file, "".join(ports), types=types, version=version)


INPUTS = {"real": "0.0", "whole": "0", "yes": "false", "text": '"on"', "speed": "2"}


def wired(folder: Path, version: str, source: str, target: str) -> Path:
    """Write a scenario of two such FMUs, an output of one into an input of the other."""
    fmu = of_all_types(folder / "all.fmu", version)
    held = {name: f"{name}_in = {value}" for name, value in INPUTS.items()}
    left = ", ".join(text for name, text in held.items() if name != target)
    return write_scenario(
        folder / "my.toml",
        {"a": (fmu, ", ".join(held.values())), "b": (fmu, left)},
        f'"b.{target}_in" = "a.{source}_out"',
    )


REFUSED = {
    ("real", "whole"): "both must be alike", ("real", "yes"): "both must be alike",
    ("real", "speed"): "both must be alike", ("yes", "real"): "both must be alike",
    ("yes", "whole"): "both must be alike", ("yes", "text"): "both must be alike",
    ("text", "real"): "both must be alike", ("text", "text"): "texts are set in parameters",
    ("whole", "yes"): "both must be alike", ("speed", "yes"): "both must be alike",
}  # fmt: skip


@pytest.mark.parametrize("pair", REFUSED, ids="-".join)
def test_what_cannot_be_passed_on_is_refused_before_a_run_and_in_a_package(
    pair: tuple[str, str], version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ((level, text),) = told(wired(tmp_path, version, *pair), capsys, 2)
    assert level == "error"
    assert REFUSED[pair] in text
    fmu = tmp_path / "all.fmu"
    wires = f"<d:Connections>{connection(f'a.{pair[0]}_out', f'b.{pair[1]}_in')}</d:Connections>"
    body = f"<d:Elements>{component('a')}{component('b')}</d:Elements>{wires}"
    package = write_ssp(tmp_path / "my.ssp", body, {"a": fmu, "b": fmu})
    for command in (["run"], ["check"], ["import-ssp", "-o", str(tmp_path / "out")]):
        assert main([command[0], str(package), *command[1:]]) == 2
        said = "".join(capsys.readouterr())
        assert f'<Connection a.{pair[0]}_out to b.{pair[1]}_in>: "a.{pair[0]}_out" is' in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "pair",
    [("whole", "real"), ("speed", "real"), ("speed", "whole"), ("whole", "speed"),
     ("speed", "speed"), ("whole", "whole"), ("yes", "yes")],
    ids="-".join,
)  # fmt: skip
def test_what_loses_nothing_is_passed_on(
    pair: tuple[str, str], version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = told(wired(tmp_path, version, *pair), capsys, 0)
    levels = ["note"] if pair == ("whole", "speed") else []
    assert [level for level, _ in found] == levels
    assert all("it takes slow = 2, fast = 5" in text for _, text in found)


def test_values_of_an_enumeration_are_items(
    version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmu = of_all_types(tmp_path / "all.fmu", version)
    for value, right in ((2, True), (5, True), (3, False), (0, False), (-5, False)):
        values = ", ".join(f"{name}_in = {text}" for name, text in INPUTS.items())
        values = values.replace("speed_in = 2", f"speed_in = {value}")
        file = write_scenario(tmp_path / "my.toml", {"a": (fmu, values)})
        found = told(file, capsys, 0 if right else 2)
        wrong = f"a.speed_in is {value}, which is no item; slow = 2, fast = 5 are right."
        assert found == ([] if right else [("error", wrong)])
    named = write_scenario(tmp_path / "my.toml", {"a": (fmu, values.replace("= -5", '= "fast"'))})
    right = 'a.speed_in is the text "fast"; slow = 2, fast = 5 are right.'
    assert told(named, capsys, 2) == [("error", right)]


def test_items_that_an_enumeration_does_not_know_are_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simple = '<SimpleType name="{}"><Enumeration>{}</Enumeration></SimpleType>'
    a = write_fmu(
        tmp_path / "a.fmu", port(0, "y", "output", "Enumeration", 'declaredType="More"'),
        types=simple.format("More", SPEEDS + '<Item name="off" value="7"/>'),
    )  # fmt: skip
    b = write_fmu(
        tmp_path / "b.fmu", port(0, "u", "input", "Enumeration", 'declaredType="S" start="2"'),
        types=simple.format("S", SPEEDS),
    )  # fmt: skip
    file = write_scenario(tmp_path / "my.toml", {"a": (a, ""), "b": (b, "")}, '"b.u" = "a.y"')
    ((level, text),) = told(file, capsys, 0)
    assert level == "warning"
    assert text == '"a.y" may be off, which "b.u" does not know: it takes slow = 2, fast = 5.'


def test_an_integer_runs_into_an_enumeration_and_through_systems_into_a_real(
    toys: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    speeds = "".join(f'<Item name="s{k}" value="{k}"/>' for k in range(50))
    types = f'<SimpleType name="S"><Enumeration>{speeds}</Enumeration></SimpleType>'
    listed = tmp_path / "listed.fmu"
    with zipfile.ZipFile(toys["Logic"]) as source, zipfile.ZipFile(listed, "w") as sink:
        for info in source.infolist():
            data = source.read(info)
            if info.filename == "modelDescription.xml":
                text = data.decode()
                text = text.replace(
                    "<ModelVariables>",
                    f"<TypeDefinitions>{types}</TypeDefinitions><ModelVariables>",
                )
                text, count = re.subn(
                    r'(name="number".*?)<Integer ', r'\1<Enumeration declaredType="S" ', text,
                    count=1, flags=re.DOTALL,
                )  # fmt: skip
                assert count == 1
                data = text.encode()
            sink.writestr(info, data)
    joint = '<d:Connector name="x" kind="input"><c:{}/></d:Connector>'
    rig = (
        f'<d:System name="rig"><d:Connectors>{joint}</d:Connectors><d:Elements>'
        f"{component('gain')}</d:Elements><d:Connections>{connection('x', 'gain.u')}"
        "</d:Connections></d:System>"
    )
    wires = [connection("a.count", "b.number"), connection("b.count", "a.number"),
             connection("a.count", "rig.x")]  # fmt: skip
    for kind, notes in (("Real", 0), ("Integer", 0), ("Boolean", 1)):
        body = (
            f"<d:Elements>{component('a')}{component('b')}{rig.format(kind)}</d:Elements>"
            f"<d:Connections>{''.join(wires)}</d:Connections>"
        )
        fmus = {"a": toys["Logic"], "b": listed, "gain": toys["Gain"]}
        experiment = '<d:DefaultExperiment startTime="0" stopTime="1"/>'
        package = write_ssp(tmp_path / f"{kind}.ssp", body, fmus, more=experiment)
        assert main(["import-ssp", str(package), "-o", str(tmp_path / kind)]) == 0
        said = capsys.readouterr().out
        assert said.count('"rig.x" between them is Boolean') == notes
        frame = bristle.run(package, {"run.step": 0.1})
        counts = frame["a.count"].to_numpy()
        assert counts[-1] >= 10
        assert frame["rig_gain.y"].tolist() == (2.0 * counts).tolist()


@pytest.mark.parametrize(("item", "number"), [("fast", 5), ("quick", None)])
def test_an_item_that_a_package_gives_by_its_name(tmp_path, capsys, item, number) -> None:
    ports = port(0, "mode", "parameter", "Enumeration", 'declaredType="Speed" start="2"')
    types = f'<SimpleType name="Speed"><Enumeration>{SPEEDS}</Enumeration></SimpleType>'
    fmu = write_fmu(
        tmp_path / "a.fmu",
        ports.replace('"parameter"', '"parameter" variability="fixed"'), types=types,
    )  # fmt: skip
    value = f'<v:Parameter name="mode"><v:Enumeration value="{item}"/></v:Parameter>'
    inner = (
        "<d:ParameterBindings><d:ParameterBinding><d:ParameterValues><v:ParameterSet>"
        f"<v:Parameters>{value}</v:Parameters></v:ParameterSet></d:ParameterValues>"
        "</d:ParameterBinding></d:ParameterBindings>"
    )
    body = f"<d:Elements>{component('a', inner)}</d:Elements>"
    package = write_ssp(tmp_path / "p.ssp", body, {"a": fmu})
    code = main(["import-ssp", str(package), "-o", str(tmp_path / "out")])
    if number is None:
        assert code == 2
        said = capsys.readouterr().err
        assert '<Parameter "mode">: "quick" is no item; slow = 2, fast = 5 are right.' in said
    else:
        assert code == 0
        assert f"mode = {number}" in (tmp_path / "out" / "p.toml").read_text()


def test_an_input_of_a_type_that_is_not_read_is_told(tmp_path: Path, capsys) -> None:
    binary = '<Binary name="radar" valueReference="1" causality="input"/>'
    ports = port(0, "y", "output", version="3.0") + binary
    fmu = write_fmu(tmp_path / "a.fmu", ports, version="3.0")
    assert main(["check", str(write_scenario(tmp_path / "my.toml", {"a": (fmu, "")}))]) == 0
    assert (
        "of type Binary, which is not read, its FMU has the input radar" in capsys.readouterr().out
    )

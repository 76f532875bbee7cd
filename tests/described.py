"""FMUs that say what they are and cannot run, and packages of them: what checks read of others."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

from bristle.fmu.archive import library_member

HEAD = {
    "2.0": '<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{name}">',
    "3.0": '<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{name}">',
}
ENUMERATION = {"2.0": "SimpleType", "3.0": "EnumerationType"}
_REAL = {"2.0": "Real", "3.0": "Float64"}
_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
_SSD = (
    f'<d:SystemStructureDescription xmlns:d="{_SSP}Description" xmlns:c="{_SSP}Common" '
    f'xmlns:v="{_SSP}ParameterValues" xmlns:m="{_SSP}ParameterMapping" version="1.0" name="others">'
)


def write_fmu(
    file: Path, ports: str, *, units: str = "", types: str = "", experiment: str = "",
    claims: str = "", version: str = "2.0",
) -> Path:  # fmt: skip
    """Write an FMU whose library is the first bytes of this platform's Python.

    Parameters
    ----------
    file : its path, NAME.fmu
    ports : variables, as `port` returns them
    units, types : what stands in UnitDefinitions and TypeDefinitions
    experiment, claims : attributes of the default experiment, and of CoSimulation
    version : of FMI
    """
    name = file.stem
    parts = [f'<CoSimulation modelIdentifier="{name}" {claims}/>']
    parts += [f"<UnitDefinitions>{units}</UnitDefinitions>"] if units else []
    parts += [f"<TypeDefinitions>{types}</TypeDefinitions>"] if types else []
    parts += [f"<DefaultExperiment {experiment}/>"] if experiment else []
    parts += [f"<ModelVariables>{ports}</ModelVariables>", "<ModelStructure/>"]
    text = HEAD[version].format(name=name) + "".join(parts) + "</fmiModelDescription>"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.writestr(
            library_member(name, version), Path(sys.executable).resolve().read_bytes()[:64]
        )
    return file


def port(
    reference: int, name: str, causality: str, kind: str = "Real", more: str = "",
    version: str = "2.0",
) -> str:  # fmt: skip
    """Return a variable; `more` are attributes of its value, such as a unit."""
    if causality == "input" and "start" not in more and kind != "String":
        more += ' start="0"'
    if version == "3.0":
        kind, changes = _REAL[version] if kind == "Real" else kind, ""
        start = '<Start value="on"/>' if kind == "String" and causality == "input" else ""
        attributes = f'name="{name}" valueReference="{reference}" causality="{causality}"'
        return f"<{kind} {attributes} {changes} {more}>{start}</{kind}>"
    attributes = f'name="{name}" valueReference="{reference}" causality="{causality}"'
    return f"<ScalarVariable {attributes}><{kind} {more}/></ScalarVariable>"


def unit(name: str, base: str | None = None) -> str:
    """Return a unit; `base` are the attributes of its BaseUnit, None without one."""
    inner = "" if base is None else f"<BaseUnit {base}/>"
    return f'<Unit name="{name}">{inner}</Unit>'


def write_ssp(
    file: Path, body: str, fmus: Mapping[str, Path], *, units: str = "", more: str = "",
    texts: Mapping[str, str] | None = None,
) -> Path:  # fmt: skip
    """Write a package: `body` is what stands in its system, `more` what follows that."""
    inner = f"<d:Units>{units}</d:Units>" if units else ""
    text = (
        f'{_SSD}<d:System name="root">{body}</d:System>{inner}{more}</d:SystemStructureDescription>'
    )
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for name, fmu in fmus.items():
            archive.write(fmu, f"resources/{name}.fmu")
        for name, content in (texts or {}).items():
            archive.writestr(name, content)
    return file


def component(name: str, inner: str = "") -> str:
    """Return a component of a package, of the FMU of its name."""
    return f'<d:Component name="{name}" source="resources/{name}.fmu">{inner}</d:Component>'


def connection(start: str, end: str, inner: str = "") -> str:
    """Return a connection, "element.connector" to the same or to "connector" of the system."""
    sides = []
    for side, text in (("start", start), ("end", end)):
        element, _, name = text.rpartition(".")
        sides += [f'{side}Element="{element}"'] if element else []
        sides.append(f'{side}Connector="{name}"')
    return f"<d:Connection {' '.join(sides)}>{inner}</d:Connection>"


def write_scenario(file: Path, components: Mapping[str, tuple[Path, str]], wires: str = "") -> Path:
    """Write a scenario: components by name, with FMU and parameters as TOML has them."""
    lines = ["schema = 1", "[run]", "stop = 0.1", "step = 0.01"]
    for name, (fmu, parameters) in components.items():
        lines += [f"[components.{name}]", f'fmu = "{fmu.as_posix()}"']
        lines += [f"parameters = {{ {parameters} }}"] if parameters else []
    file.write_text("\n".join([*lines, "[connections]", wires, ""]), encoding="utf-8")
    return file

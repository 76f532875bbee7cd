"""A scenario as an SSP package, for other tools."""

from __future__ import annotations

import os
import re
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..core.files import writing
from ..errors import ScenarioError
from ..fmu.build import BuildPlan, build, plan
from ..fmu.description import Value, Variable
from ..units import DIMENSIONS, Unit, alike
from .model import FILE_PARAMETERS, Component, Connection, System
from .ssp_read import FMU_TYPE, NAMESPACES, OMS, OSP, OWN, OWN_TYPE, STRUCTURE
from .toml import signal_file

Element = ElementTree.Element


Sources = Mapping[str, str]
"""The FMU of each component by its name, relative to the text that names it."""


def ssd_text(system: System, sources: Sources) -> str:
    """Return the text of SystemStructure.ssd, SSP 1.0.

    The step stands in it as libcosim and Ecos read it and as OMSimulator does.
    """
    root = Element("ssd:SystemStructureDescription", {f"xmlns:{k}": v for k, v in NAMESPACES})
    root.set("name", system.title)
    root.set("version", "1.0")
    whole = _add(root, "ssd:System", name=_NAME_OF_SYSTEM)
    elements = _add(whole, "ssd:Elements")
    ports = {component.name: _ports(component, system) for component in system.components.values()}
    declared = _declared(ports.values())
    boxes = _boxes(system, ports)
    for component in system.components.values():
        values = _values(component)
        element = _add(
            elements, "ssd:Component", name=component.name, type=FMU_TYPE,
            source=sources[component.name],
        )  # fmt: skip
        box = boxes[component.name]
        _component(element, component.name, ports[component.name], values, declared, box)
    if system.wires:
        connections = _add(whole, "ssd:Connections")
        for connection in system.wires:
            _connection(connections, connection)
    _add(whole, "ssd:SystemGeometry", **_corners(_around(boxes.values())))
    information = _add(_annotation(whole, OMS), "oms:Annotations")
    information = _add(information, "oms:SimulationInformation")
    step = repr(system.step)
    _add(
        information, "oms:FixedStepMaster", description="oms-ma", stepSize=step,
        absoluteTolerance=_OMS_TOLERANCE, relativeTolerance=_OMS_TOLERANCE,
    )  # fmt: skip
    _units(root, declared)
    experiment = _add(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(system.stop))
    annotations = _add(experiment, "ssd:Annotations")
    algorithm = _add(_add(annotations, "ssc:Annotation", type=OSP), "osp:Algorithm")
    _add(algorithm, "osp:FixedStepAlgorithm", baseStepSize=step)
    own = _add(annotations, "ssc:Annotation", type=OWN_TYPE)
    _add(own, f"{OWN}:Run", algorithm=system.algorithm)
    return _text(root)


_NAME_OF_SYSTEM = "system"
_OMS_TOLERANCE = "0.0001"
"""Beside a fixed step, as OMSimulator itself writes it."""


def _component(
    element: Element, name: str, ports: list[Variable], values: list[tuple[Variable, Value]],
    declared: Mapping[str, Unit], box: Box,
) -> None:  # fmt: skip
    if ports:
        connectors = _add(element, "ssd:Connectors")
        for port in ports:
            connector = _add(connectors, "ssd:Connector", name=port.name, kind=port.causality)
            _add(connector, f"ssc:{_kind(port)}", **_unit(port, declared))
            side = [one for one in ports if one.causality == port.causality]
            height = 1.0 - (side.index(port) + 1) / (len(side) + 1)
            at = {"x": str(float(port.causality == "output")), "y": f"{height:.4g}"}
            _add(connector, "ssd:ConnectorGeometry", **at)
    _add(element, "ssd:ElementGeometry", **_corners(box))
    if values:
        binding = _add(_add(element, "ssd:ParameterBindings"), "ssd:ParameterBinding")
        found = _add(
            _add(binding, "ssd:ParameterValues"), "ssv:ParameterSet", version="1.0", name=name
        )
        parameters = _add(found, "ssv:Parameters")
        for variable, value in values:
            parameter = _add(parameters, "ssv:Parameter", name=variable.name)
            _add(parameter, f"ssv:{_kind(variable)}", value=_written(value))


Box = tuple[float, float, float, float]
"""Left, lower, right and upper end of a drawn part."""
_WIDTH, _GAP, _PER_PORT = 40.0, 20.0, 10.0


def _boxes(system: System, ports: Mapping[str, list[Variable]]) -> dict[str, Box]:
    """Return where each component is drawn: to the right of those before it that feed it."""
    columns: dict[str, int] = {}
    for name in system.components:
        feeding = [columns.get(one.source, -1) for one in system.wires if one.target == name]
        columns[name] = 1 + max(feeding, default=-1)
    tops: dict[int, float] = {}
    found = {}
    for name, column in columns.items():
        sides = [one.causality for one in ports[name]]
        most = max(sides.count("input"), sides.count("output"))
        left, top = column * (_WIDTH + _GAP), tops.get(column, 0.0)
        bottom = top - _PER_PORT * (most + 1)
        found[name] = left, bottom, left + _WIDTH, top
        tops[column] = bottom - _GAP
    return found


def _around(boxes: Iterable[Box]) -> Box:
    left, lower, right, upper = zip(*boxes, strict=True)
    return min(left) - _GAP, min(lower) - _GAP, max(right) + _GAP, max(upper) + _GAP


def _corners(box: Box) -> dict[str, str]:
    return dict(zip(("x1", "y1", "x2", "y2"), map(repr, box), strict=True))


def _connection(connections: Element, connection: Connection) -> None:
    element = _add(
        connections, "ssd:Connection", startElement=connection.source,
        startConnector=connection.output, endElement=connection.target,
        endConnector=connection.input,
    )  # fmt: skip
    if connection.transformed:
        element.set("suppressUnitConversion", "true")
    if connection.changes:
        factor, offset = repr(connection.factor), repr(connection.offset)
        _add(element, "ssc:LinearTransformation", factor=factor, offset=offset)


def _declared(ports: Iterable[Iterable[Variable]]) -> dict[str, Unit]:
    """Return the units of the ports by name, but for names by which FMUs mean different ones."""
    found: dict[str, Unit | None] = {}
    for port in (port for own in ports for port in own):
        measure = port.measure if port.kind == "Real" else None
        if measure is None or measure.unit is None:  # a foreign FMU's own
            continue
        first = found.setdefault(measure.name, measure.unit)
        if first is not None and not alike(first, measure.unit):
            found[measure.name] = None
    return {name: unit for name, unit in found.items() if unit is not None}


def _units(root: Element, declared: Mapping[str, Unit]) -> None:
    if not declared:
        return
    units = _add(root, "ssd:Units")
    for name, unit in sorted(declared.items()):
        powers = {
            base: str(power)
            for base, power in zip(DIMENSIONS, unit.dimension, strict=True)
            if power
        }
        if unit.factor != 1.0:
            powers["factor"] = repr(unit.factor)
        if unit.offset:
            powers["offset"] = repr(unit.offset)
        _add(_add(units, "ssc:Unit", name=name), "ssc:BaseUnit", **powers)


def _unit(port: Variable, declared: Mapping[str, Unit]) -> dict[str, str]:
    """Return the unit of a connector, none where it cannot be declared."""
    known = port.kind == "Real" and port.unit in declared
    return {"unit": str(port.unit)} if known else {}


def _kind(variable: Variable) -> str:
    return "Integer" if variable.kind == "Enumeration" else variable.kind


def _annotation(parent: Element, kind: str) -> Element:
    return _add(_add(parent, "ssd:Annotations"), "ssc:Annotation", type=kind)


def _written(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _text(root: Element) -> str:
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


# What a component is made from (building, controller, record, own effects) is inside its FMU, and
# so are its values: tools differ in what they make of a package's own.

RESOURCES = "resources"
Build = Callable[[BuildPlan, Path], Path]
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold


@dataclass(frozen=True)
class ExportedPackage:
    """The file that was written, and what is otherwise in other tools, a text each."""

    file: Path
    notes: tuple[str, ...]


def export_ssp(scenario: System, file: Path, build: Build = build) -> ExportedPackage:
    """Write a scenario as an SSP package.

    Parameters
    ----------
    scenario : System
        A checked scenario.
    file : Path
        FILE.ssp, in place of an older one.
    build : callable
        Builds a planned FMU into a folder and returns its path.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    BuildError, RecordError
        If an FMU cannot be built.
    """
    if file.suffix.lower() != ".ssp":
        raise ScenarioError(f"{file}: the name of an SSP package ends with .ssp.")
    with tempfile.TemporaryDirectory(prefix="bristle_ssp_") as temporary:
        fmus = _fmus(scenario, Path(temporary), build)
        inside = {name: f"{RESOURCES}/{fmu.name}" for name, fmu in fmus.items()}
        with writing(file, ScenarioError):
            _pack(file, ssd_text(scenario, inside), list(fmus.values()))
    return ExportedPackage(file, tuple(_notes(scenario)))


def _fmus(scenario: System, folder: Path, build: Build) -> dict[str, Path]:
    """Return the FMU of each component, built with its values or copied, each of a name its own."""
    found: dict[str, Path] = {}
    taken: set[str] = set()
    for component in scenario.components.values():
        stem = re.sub(r"[^A-Za-z0-9_]", "_", component.name)
        stem = stem if re.match(r"[A-Za-z_]", stem) else f"_{stem}"
        while stem.lower() in taken:
            stem += "_"
        taken.add(stem.lower())
        found[component.name] = _fmu(component, folder, stem, build)
    return found


def _fmu(component: Component, folder: Path, name: str, build: Build) -> Path:
    if component.path is not None:
        target = folder / f"{name}.fmu"
        target.write_bytes(component.path.read_bytes())
        return target
    values = component.taken_values(only_on=True)
    files = {key: Path(str(values.pop(key))) for key in FILE_PARAMETERS if values.get(key)}
    if component.signal is not None:
        files[component.plays] = signal_file(component.signal, folder / f"{name}.csv")
    what = plan(
        component.made_of(),
        name=name,
        record=files.get("record"),
        samples=files.get("file"),
        starts=values,
        offers=component.effects_on(),
        **component.made_with(),
    )
    return build(what, folder)


def _ports(component: Component, scenario: System) -> list[Variable]:
    """Return the connected inputs and outputs of a component."""
    ends = {(c.target, c.input) for c in scenario.wires}
    ends |= {(c.source, c.output) for c in scenario.wires}
    there = component.description.variables.values()
    return [variable for variable in there if (component.name, variable.name) in ends]


def _values(component: Component) -> list[tuple[Variable, Value]]:
    """Return the values that stand in the package; files of built-in ones are in their FMUs."""
    inside = FILE_PARAMETERS if component.path is None else ()
    values = component.taken_values(only_on=True).items()
    variables = component.description.variables
    return [(variables[key], value) for key, value in values if key not in inside]


def _notes(scenario: System) -> Iterator[str]:
    for component in scenario.components.values():
        if component.step is not None and component.step != scenario.step:
            yield (
                f"{component.name} steps every {1e3 * component.step:g} ms here; SSP has no word "
                f"for that, and tools step it every {1e3 * scenario.step:g} ms."
            )
        if component.path is not None and component.values:
            yield (
                f"{component.name}: a foreign FMU is packed as it is. Its values stand in the "
                "package alone, which some tools leave aside."
            )
        names = [key for key in FILE_PARAMETERS if component.values.get(key)]
        if component.path is not None and names:
            yield f"{component.name} reads a file of this computer: {', '.join(names)}."


def _pack(file: Path, text: str, fmus: list[Path]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    if file.is_dir():
        raise ScenarioError(f"{file}: is a folder; another name is right.")
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}-")
    draft = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w") as archive:
            _write(archive, STRUCTURE, text.encode())
            for fmu in fmus:
                _write(archive, f"{RESOURCES}/{fmu.name}", fmu.read_bytes())
        draft.chmod(0o644)
        draft.replace(file)
    finally:
        draft.unlink(missing_ok=True)


def _write(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, data)

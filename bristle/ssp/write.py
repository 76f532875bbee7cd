"""A flat system as the texts of other tools: SystemStructure.ssd and OspSystemStructure.xml."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ..fmu.description import Value, Variable
from ..units import DIMENSIONS, Unit, alike
from .names import FMU_TYPE, NAMESPACES, OMS, OSP, OSP_SYSTEM, OWN, OWN_TYPE

Element = ElementTree.Element


@dataclass(frozen=True)
class WrittenComponent:
    """A component of a flat system that is written.

    `source` is its FMU, relative to the text; `ports` are its connected inputs and outputs;
    `values` those of parameters, and of inputs that are held, with their variables; `step` its own
    step [s], None for the system's.
    """

    name: str
    source: str
    ports: tuple[Variable, ...]
    values: tuple[tuple[Variable, Value], ...]
    step: float | None = None


@dataclass(frozen=True)
class WrittenConnection:
    """Component and port that give a value, those that take factor value + offset.

    `transformed` is whether factor and offset are told: no unit is converted then.
    """

    source: str
    output: str
    target: str
    input: str
    factor: float = 1.0
    offset: float = 0.0
    transformed: bool = False

    @property
    def changes(self) -> bool:
        """Whether a value changes on its way."""
        return (self.factor, self.offset) != (1.0, 0.0)


@dataclass(frozen=True)
class WrittenSystem:
    """A flat system: title, stop and step [s], algorithm, components, connections."""

    title: str
    stop: float
    step: float
    algorithm: str
    components: tuple[WrittenComponent, ...]
    connections: tuple[WrittenConnection, ...] = field(default=())


def ssd_text(system: WrittenSystem) -> str:
    """Return the text of SystemStructure.ssd, SSP 1.0.

    The step stands in it as libcosim and Ecos read it and as OMSimulator does.
    """
    root = Element("ssd:SystemStructureDescription", {f"xmlns:{k}": v for k, v in NAMESPACES})
    root.set("name", system.title)
    root.set("version", "1.0")
    whole = _add(root, "ssd:System", name=_NAME_OF_SYSTEM)
    elements = _add(whole, "ssd:Elements")
    declared = _declared(system.components)
    for component in system.components:
        _component(elements, component, declared)
    if system.connections:
        connections = _add(whole, "ssd:Connections")
        for connection in system.connections:
            _connection(connections, connection)
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
    elements: Element, component: WrittenComponent, declared: Mapping[str, Unit]
) -> None:
    element = _add(
        elements, "ssd:Component", name=component.name, type=FMU_TYPE, source=component.source,
    )  # fmt: skip
    if component.ports:
        connectors = _add(element, "ssd:Connectors")
        for port in component.ports:
            connector = _add(connectors, "ssd:Connector", name=port.name, kind=port.causality)
            _add(connector, f"ssc:{_kind(port)}", **_unit(port, declared))
    if component.values:
        binding = _add(_add(element, "ssd:ParameterBindings"), "ssd:ParameterBinding")
        values = _add(binding, "ssd:ParameterValues")
        found = _add(values, "ssv:ParameterSet", version="1.0", name=component.name)
        parameters = _add(found, "ssv:Parameters")
        for variable, value in component.values:
            parameter = _add(parameters, "ssv:Parameter", name=variable.name)
            _add(parameter, f"ssv:{_kind(variable)}", value=_written(value))


def _connection(connections: Element, connection: WrittenConnection) -> None:
    element = _add(
        connections,
        "ssd:Connection",
        startElement=connection.source,
        startConnector=connection.output,
        endElement=connection.target,
        endConnector=connection.input,
    )
    if connection.transformed:
        element.set("suppressUnitConversion", "true")
    if connection.changes:
        _add(
            element,
            "ssc:LinearTransformation",
            factor=repr(connection.factor),
            offset=repr(connection.offset),
        )


def _declared(components: Iterable[WrittenComponent]) -> dict[str, Unit]:
    """Return the units of the ports by name, but for names by which FMUs mean different ones."""
    found: dict[str, Unit | None] = {}
    for port in (port for component in components for port in component.ports):
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


def osp_text(system: WrittenSystem) -> str:
    """Return the text of OspSystemStructure.xml."""
    root = Element("OspSystemStructure", {"xmlns": OSP_SYSTEM, "version": "0.1"})
    for name, text in (
        ("StartTime", "0.0"),
        ("EndTime", repr(system.stop)),
        ("BaseStepSize", repr(system.step)),
        ("Algorithm", "fixedStep"),
    ):
        _add(root, name).text = text
    simulators = _add(root, "Simulators")
    for component in system.components:
        simulator = _add(simulators, "Simulator", name=component.name, source=component.source)
        if component.step is not None:
            simulator.set("stepSize", repr(component.step))
        if component.values:
            values = _add(simulator, "InitialValues")
            for variable, value in component.values:
                initial = _add(values, "InitialValue", variable=variable.name)
                _add(initial, _kind(variable), value=_written(value))
    changed = [one for one in system.connections if one.changes]
    if changed:
        functions = _add(root, "Functions")
        for one in changed:
            _add(
                functions, "LinearTransformation", name=_function(one), factor=repr(one.factor),
                offset=repr(one.offset),
            )  # fmt: skip
    if system.connections:
        connections = _add(root, "Connections")
        for one in system.connections:
            _osp_connection(connections, one)
    return _text(root)


def _function(connection: WrittenConnection) -> str:
    # A dot, which no component has in its name: d_x.in and d.x_in are two.
    return f"{connection.target}.{connection.input}"


def _osp_connection(connections: Element, one: WrittenConnection) -> None:
    if not one.changes:
        joined = _add(connections, "VariableConnection")
        _add(joined, "Variable", simulator=one.source, name=one.output)
        _add(joined, "Variable", simulator=one.target, name=one.input)
        return
    into = _add(connections, "SignalConnection")
    _add(into, "Variable", simulator=one.source, name=one.output)
    _add(into, "Signal", function=_function(one), name="in")
    out = _add(connections, "SignalConnection")
    _add(out, "Signal", function=_function(one), name="out")
    _add(out, "Variable", simulator=one.target, name=one.input)


def _written(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _text(root: Element) -> str:
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'

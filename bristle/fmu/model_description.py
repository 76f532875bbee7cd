"""What pythonfmu's model description leaves out: origin, units, types, bounds, dependencies.

This module is bundled in every FMU: standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime, timezone
from math import isfinite
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement

from .. import units
from ..version import DATE, __version__

AUTHOR = "The bristle developers"
COPYRIGHT = f"Copyright (c) 2026 {AUTHOR}"
LICENSE = "MIT (the code of bristle)"

TOOL = "bristle"
"""Name of the tool whose annotations these are."""

OVER_STEP_TAG = "overStep"
"""Annotation of an input: how it is taken over a step."""

JUMPS_TAG = "jumpsWithout"
"""Annotation of an output that may jump while an input is not connected: the name of that input."""


class Quantity(NamedTuple):
    """What a unit measures: the type's name, Modelica's name, the unit to show, a usual size."""

    type: str
    name: str
    shown: str
    nominal: float


QUANTITIES = {
    "m": Quantity("Displacement", "Length", "mm", 0.01),
    "m/s": Quantity("Velocity", "Velocity", "mm/s", 0.1),
    "m/s2": Quantity("Acceleration", "Acceleration", "m/s2", 1.0),
    "N": Quantity("Force", "Force", "N", 10.0),
    "J": Quantity("Energy", "Energy", "J", 1.0),
    "V": Quantity("Voltage", "ElectricPotential", "V", 1.0),
    "A": Quantity("Current", "ElectricCurrent", "A", 1.0),
    "T": Quantity("FluxDensity", "MagneticFluxDensity", "mT", 0.1),
    "kg": Quantity("Mass", "Mass", "kg", 1.0),
    "s": Quantity("Time", "Time", "s", 1.0),
    "Hz": Quantity("Frequency", "Frequency", "Hz", 1.0),
    "degC": Quantity("Temperature", "ThermodynamicTemperature", "degC", 20.0),
    "N/m": Quantity("Stiffness", "TranslationalSpringConstant", "N/mm", 1e3),
    "N.s/m": Quantity("Damping", "TranslationalDampingConstant", "N.s/m", 100.0),
    "1": Quantity("Ratio", "Dimensionless", "1", 1.0),
}
"""Quantities by their unit; others have no type."""


def usual_size(unit: str | None, start: float) -> float | None:
    """Return a usual size of a variable from its start value, else from its unit."""
    known = QUANTITIES.get(unit or "")
    return abs(start) or (known and known.nominal) or None


def complete(root: Element, slave: Any) -> None:
    """Add to a description what a component declares beyond pythonfmu's variables, in place."""
    root.set("generationTool", f"{TOOL} {__version__}")
    root.set("generationDateAndTime", _date())
    names = slave._units.values()
    root.insert(1, unit_definitions(names))
    types = type_definitions(names, "SimpleType")
    if len(types):
        root.insert(2, types)
    variables = root.find("ModelVariables")
    assert variables is not None
    for node in variables:
        name = node.attrib["name"]
        add_attributes(node[0], slave._units.get(name), slave._bounds.get(name, (None,) * 3))
        for tag, texts in ((OVER_STEP_TAG, slave._over_step), (JUMPS_TAG, slave._jumps)):
            if name in texts:
                annotate(SubElement(node, "Annotations"), {tag: texts[name]})
    if slave._optional:
        annotations = Element("VendorAnnotations")
        annotate(annotations, {"optional": " ".join(slave._optional)})
        root.insert(list(root).index(variables), annotations)


def annotate(annotations: Element, texts: Mapping[str, str]) -> None:
    """Add this tool's annotations: tag to text."""
    tool = SubElement(annotations, "Tool", name=TOOL)
    for tag, text in texts.items():
        SubElement(tool, tag).text = text


def add_attributes(
    value: Element, unit: str | None, bounds: tuple[float | None, float | None, float | None]
) -> None:
    """Add unit, min, max and nominal to the element of a variable's type."""
    if unit is not None:
        value.set("unit", unit)
    if unit in QUANTITIES:
        value.set("declaredType", QUANTITIES[unit].type)
    for key, number in zip(("min", "max", "nominal"), bounds):
        if number is not None and isfinite(number):
            value.set(key, repr(number))


def _date() -> str:
    """Return the date of a build, which its inputs decide: two builds of one source are equal."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch.isdecimal():
        return f"{DATE}T00:00:00Z"
    return f"{datetime.fromtimestamp(int(epoch), timezone.utc):%Y-%m-%dT%H:%M:%SZ}"


def type_definitions(names: Iterable[str], tag: str) -> Element:
    """Return the types of quantities with these units.

    The tag is that of a type: "SimpleType" in FMI 2.0, where its numbers are within, "Float64Type"
    in FMI 3.0.
    """
    types = Element("TypeDefinitions")
    for unit in sorted({*names} & {*QUANTITIES}):
        one = QUANTITIES[unit]
        outer = SubElement(types, tag, name=one.type)
        inner = SubElement(outer, "Real") if tag == "SimpleType" else outer
        inner.attrib.update(quantity=one.name, unit=unit)
        if one.shown != unit:
            inner.set("displayUnit", one.shown)
    return types


def unit_definitions(names: Iterable[str]) -> Element:
    """Return the definitions of units by their dimensions."""
    definitions = Element("UnitDefinitions")
    for name in sorted(set(names)):
        unit = units.parse(name)
        exponents = {
            base: str(power) for base, power in zip(units.DIMENSIONS, unit.dimension) if power
        }
        if unit.factor != 1.0:
            exponents["factor"] = repr(unit.factor)
        if unit.offset != 0.0:
            exponents["offset"] = repr(unit.offset)
        element = SubElement(definitions, "Unit", name=name)
        SubElement(element, "BaseUnit", exponents)
        shown = QUANTITIES[name].shown if name in QUANTITIES else name
        if shown != name:
            factor = repr(unit.factor / units.parse(shown).factor)
            SubElement(element, "DisplayUnit", name=shown, factor=factor)
    return definitions


def add_dependencies(
    structure: Element, inputs_of: Callable[[int], list[int]], parameters: list[int]
) -> None:
    """Add what outputs follow, and the initial unknowns; variables count from 1."""
    outputs = structure.find("Outputs")
    if outputs is None:
        return
    unknowns = SubElement(structure, "InitialUnknowns")
    for node in outputs:
        inputs = inputs_of(int(node.attrib["index"]))
        node.set("dependencies", " ".join(map(str, inputs)))
        known = " ".join(map(str, sorted(inputs + parameters)))
        SubElement(unknowns, "Unknown", index=node.attrib["index"], dependencies=known)

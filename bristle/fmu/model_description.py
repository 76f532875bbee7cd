"""What pythonfmu's model description leaves out: units, bounds, dependencies, annotations.

This module is bundled in every FMU: standard library only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import isfinite
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from .. import units

TOOL = "bristle"
"""Name of the tool whose annotations these are."""

OVER_STEP_TAG = "overStep"
"""Annotation of an input: how it is taken over a step."""

JUMPS_TAG = "jumpsWithout"
"""Annotation of an output that may jump while an input is not connected: the name of that input."""


def complete(root: Element, slave: Any) -> None:
    """Add to a description what a component declares beyond pythonfmu's variables, in place."""
    del root.attrib["generationDateAndTime"]  # two builds of one source are identical
    root.insert(1, unit_definitions(slave._units.values()))
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
    for key, number in zip(("min", "max", "nominal"), bounds):
        if number is not None and isfinite(number):
            value.set(key, repr(number))


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
        SubElement(SubElement(definitions, "Unit", name=name), "BaseUnit", exponents)
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

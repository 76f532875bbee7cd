"""What an FMI 3.0 FMU for co-simulation says of itself, in the words of FMI 2.0 where it has them.

Numbers keep the type that FMI 3.0 gives them in `Variable.type`; their kind is that of FMI 2.0, so
that scenarios and the master need not ask for the version. Arrays and binaries that are no ports
are left out: nothing here sets or shows them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import replace

from ..errors import FmuError
from ..units import Measure
from .model_description import JUMPS_TAG, OVER_STEP_TAG, TOOL
from .variables import (
    Description,
    Variable,
    begins,
    check_jumps,
    items_of,
    mark_optional,
    number_of,
    over_step_of,
    reference_of,
    start_of,
    unit_of,
    units_of,
)

KINDS = {
    **dict.fromkeys(("Float64", "Float32"), "Real"),
    **dict.fromkeys(("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32"), "Integer"),
    **dict.fromkeys(("Int64", "UInt64"), "Integer"),
    "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration",
}  # fmt: skip
"""The kind of each type's values."""
_BITS = {"Int8": 8, "Int16": 16, "Int32": 32}
_RANGES = {
    **{name: (-(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1) for name, bits in _BITS.items()},
    **{f"U{name}": (0.0, 2.0**bits - 1) for name, bits in _BITS.items()},
    "UInt64": (0.0, None),
}
"""What an integer of a type can hold, where that is less than the master's 32 bits or unsigned."""
_CAPABILITIES = {
    "canGetAndSetFMUState": "canGetAndSetFMUstate",
    "canSerializeFMUState": "canSerializeFMUstate",
    "providesDirectionalDerivatives": "providesDirectionalDerivative",
}
"""Capabilities by another name than in FMI 2.0."""


def describe(root: ElementTree.Element) -> Description:
    """Return the description in an XML tree of FMI 3.0 for co-simulation.

    Raises
    ------
    FmuError
        It contradicts itself, or has ports that are arrays or belong to clocks.
    """
    slave = root.find("CoSimulation")
    assert slave is not None  # read_root refuses what has none
    types = {child.get("name", ""): child for child in root.iterfind("TypeDefinitions/*")}
    units = units_of(root)
    variables: dict[str, Variable] = {}
    check_ports(root)
    for element in root.iterfind("ModelVariables/*"):
        name = element.get("name", "")
        if element.tag in KINDS and element.find("Dimension") is None:
            if name in variables:
                raise FmuError(f"variables defined twice: {name}.")
            variables[name] = _variable(element, types, units)
    _add_dependencies(root, variables)
    mark_optional(variables, _annotation(root, "optional") or "")
    check_jumps(variables)
    return Description(
        name=root.get("modelName", ""),
        guid=root.get("instantiationToken", ""),
        identifier=slave.get("modelIdentifier", ""),
        description=root.get("description", ""),
        variables=variables,
        capabilities={
            _CAPABILITIES.get(k, k): v for k, v in slave.attrib.items() if k != "modelIdentifier"
        },
        version="3.0",
        begins=begins(root),
    )


def check_ports(root: ElementTree.Element) -> None:
    """Refuse ports that a scenario cannot connect and the master cannot step.

    Raises
    ------
    FmuError
        If a port is an array or belongs to a clock.
    """
    for element in root.iterfind("ModelVariables/*"):
        _refuse(element)


def _refuse(element: ElementTree.Element) -> None:
    name = element.get("name")
    if not name:
        raise FmuError("a variable has no name.")
    if element.get("causality") not in ("input", "output"):
        return
    if element.tag == "Clock" or element.get("clocks"):
        raise FmuError(
            f'"{name}" belongs to a clock. Values are passed on at communication points only; an '
            "FMU without clocks is right."
        )
    if element.find("Dimension") is not None:
        raise FmuError(f'"{name}" is an array. Ports are single numbers here.')


def _variable(
    element: ElementTree.Element,
    types: Mapping[str, ElementTree.Element],
    units: Mapping[str, Measure],
) -> Variable:
    name, kind = element.attrib["name"], KINDS[element.tag]
    declared = types.get(element.get("declaredType", ""))
    own = {**(declared.attrib if declared is not None else {}), **element.attrib}
    low, high = _RANGES.get(element.tag, (None, None))
    least, most = (number_of(name, key, own.get(key)) for key in ("min", "max"))
    start = element.get("start")
    if kind == "String" and (given := element.find("Start")) is not None:
        start = given.get("value")
    return Variable(
        name=name,
        kind=kind,
        causality=element.get("causality", "local"),
        variability=element.get("variability", "continuous" if kind == "Real" else None),
        reference=reference_of(name, element.get("valueReference")),
        unit=own.get("unit"),
        start=start_of(name, kind, start),
        minimum=low if least is None else least,
        maximum=high if most is None else most,
        nominal=number_of(name, "nominal", own.get("nominal")),
        description=element.get("description", ""),
        over_step=over_step_of(name, _annotation(element, OVER_STEP_TAG)),
        jumps_without=_annotation(element, JUMPS_TAG),
        type=element.tag,
        defined=unit_of(own, units),
        items=items_of(name, declared if kind == "Enumeration" else None),
    )


def _annotation(element: ElementTree.Element, tag: str) -> str | None:
    """Return the text of one of bristle's annotations of a variable, or of the whole FMU."""
    for own in element.iterfind("Annotations/Annotation"):
        text = own.findtext(tag)
        if own.get("type") == TOOL and text is not None:
            return text
    return None


def _add_dependencies(root: ElementTree.Element, variables: dict[str, Variable]) -> None:
    """Say of each output which inputs it follows; the description names value references."""
    named = {v.reference: v for v in variables.values()}
    for element in root.iterfind("ModelStructure/Output"):
        output = named.get(reference_of("Output", element.get("valueReference")))
        text = element.get("dependencies")
        if output is None or text is None:
            continue
        causes = [named.get(reference_of(output.name, one)) for one in text.split()]
        inputs = tuple(v.name for v in causes if v is not None and v.causality == "input")
        variables[output.name] = replace(output, dependencies=inputs)

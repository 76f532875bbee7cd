"""modelDescription.xml of a native FMU of FMI 3.0, made from that of FMI 2.0.

What FMI 3.0 says otherwise: a variable is an element named by its type; the model structure names
value references instead of places; an annotation has a type instead of a tool; there is one
independent variable, the time.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from ..fmu.component import ComponentSlave
from ..fmu.model_description import unit_definitions
from .description import description_tree, text_of

TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
"""What FMI 3.0 calls the types of FMI 2.0."""

_ROOT = ("modelName", "description", "generationTool", "variableNamingConvention")
_CAPABILITIES = {
    "modelIdentifier": "modelIdentifier",
    "needsExecutionTool": "needsExecutionTool",
    "canBeInstantiatedOnlyOncePerProcess": "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate": "canGetAndSetFMUState",
    "canSerializeFMUstate": "canSerializeFMUState",
    "canHandleVariableCommunicationStepSize": "canHandleVariableCommunicationStepSize",
}
"""Capabilities of FMI 2.0 that FMI 3.0 knows too, and by which name."""


def description_fmi3(slave: ComponentSlave, guid: str) -> str:
    """Return the model description, in FMI 3.0, of a component that runs without Python.

    Parameters
    ----------
    slave, guid
        As in `description.description`; the guid is the instantiation token.
    """
    old = description_tree(slave, guid)
    root = Element("fmiModelDescription", fmiVersion="3.0", instantiationToken=guid)
    root.attrib.update({key: old.attrib[key] for key in _ROOT if key in old.attrib})
    has = _part(old, "CoSimulation").attrib
    capabilities = {new: has[key] for key, new in _CAPABILITIES.items() if key in has}
    SubElement(root, "CoSimulation", capabilities)
    root.append(unit_definitions([*slave._units.values(), "s"]))
    root.append(_log_categories(_part(old, "LogCategories")))
    root.append(_part(old, "DefaultExperiment"))
    variables = SubElement(root, "ModelVariables")
    variables.extend([_variable(node) for node in _part(old, "ModelVariables")])
    variables.append(_time(variables))
    root.append(_structure(old))
    optional = old.find("VendorAnnotations")
    if optional is not None:
        root.append(_annotations(optional))
    return text_of(root)


def _part(root: Element, tag: str) -> Element:
    found = root.find(tag)
    assert found is not None  # pythonfmu writes them all
    return found


def _log_categories(old: Element) -> Element:
    new = Element("LogCategories")
    for node in old:
        text = node.attrib["description"].replace("fmi2", "fmi3")
        SubElement(new, "Category", name=node.attrib["name"], description=text)
    return new


def _variable(old: Element) -> Element:
    """Return a variable as FMI 3.0 has it: annotations come first, a text's start is an element."""
    value = old[0]
    new = Element(TYPES[value.tag], {**old.attrib, **value.attrib})
    annotations = old.find("Annotations")
    if annotations is not None:
        new.append(_annotations(annotations))
    if value.tag == "String" and "start" in value.attrib:
        SubElement(new, "Start", value=new.attrib.pop("start"))
    return new


def _annotations(old: Element) -> Element:
    new = Element("Annotations")
    for tool in old:
        SubElement(new, "Annotation", type=tool.attrib["name"]).extend(list(tool))
    return new


def _time(variables: Element) -> Element:
    """Return the independent variable; its value reference is the one behind all others."""
    names, name = {node.attrib["name"] for node in variables}, "time"
    while name in names:
        name += "_"
    return Element(
        "Float64", name=name, valueReference=str(len(variables)), description="simulated time",
        causality="independent", variability="continuous", unit="s",
    )  # fmt: skip


def _structure(old: Element) -> Element:
    """Return outputs and initial unknowns, by value reference instead of by place from 1."""
    references = [node.attrib["valueReference"] for node in _part(old, "ModelVariables")]
    new, structure = Element("ModelStructure"), _part(old, "ModelStructure")
    for group, tag in (("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")):
        for node in structure.iterfind(f"{group}/Unknown"):
            known = " ".join(references[int(k) - 1] for k in node.attrib["dependencies"].split())
            reference = references[int(node.attrib["index"]) - 1]
            SubElement(new, tag, valueReference=reference, dependencies=known)
    return new

"""modelDescription.xml of a native FMU: that of its Python form, but for how it runs."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, indent, tostring

from ..fmu.component import ComponentSlave
from ..fmu.description import NATIVE

_CAPABILITIES = {
    "needsExecutionTool": False,
    "canHandleVariableCommunicationStepSize": True,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
}


def description(slave: ComponentSlave, guid: str) -> str:
    """Return the model description of a component that runs without Python.

    Parameters
    ----------
    slave : ComponentSlave
        The component as a Python object, its parameters at their start values.
    guid : str
        Of the FMU.
    """
    return text_of(description_tree(slave, guid))


def description_tree(slave: ComponentSlave, guid: str) -> Element:
    """Return the XML tree of that description; the parameters are as in `description`."""
    options: dict[str, Any] = {**_CAPABILITIES, "canInterpolateInputs": bool(slave._inputs)}
    root: Element = slave.to_xml(options)
    root.set("guid", guid)
    root.set("generationTool", NATIVE)
    return root


def text_of(root: Element) -> str:
    """Return an XML tree as the text of a file."""
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text.decode()

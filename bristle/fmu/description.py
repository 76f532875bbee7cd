"""What an FMU says of itself: its variables with units, starts and dependencies."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..errors import FmuError
from ..findings import listed
from ..units import Measure
from . import description_fmi3
from .archive import (
    DESCRIPTION,
    MAX_DESCRIPTION,
    check_library,
    extract,
    open_archive,
    read_member,
)
from .model_description import JUMPS_TAG, OVER_STEP_TAG, TOOL
from .variables import (
    Description,
    Value,
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
    unsigned,
)
from .xml_text import parse_xml

__all__ = ["Description", "Value", "Variable", "extract", "read_description"]

VERSIONS = ("2.0", "3.0")
"""Versions of FMI that are read."""
NATIVE = "bristle native"
"""Generation tool of bristle's FMUs that need no Python."""
_OTHER_KINDS = {"ModelExchange": "model exchange", "ScheduledExecution": "scheduled execution"}
_KINDS = ("Real", "Integer", "Boolean", "String", "Enumeration")
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def read_description(
    path: Path | str, *, any_platform: bool = False, versions: Sequence[str] = VERSIONS
) -> Description:
    """Return what a co-simulation FMU of FMI 2.0 or 3.0 says of itself.

    Parameters
    ----------
    path : Path or str
        The .fmu file. Nothing is unpacked and no code of it runs.
    any_platform : bool
        Accept an FMU that has no binary for this platform.
    versions : sequence of str
        Versions of FMI that are accepted.

    Returns
    -------
    Description
        All variables in the order of the file; units spelled as the file spells them.

    Raises
    ------
    FmuError
        If the file cannot or must not be opened (see `bristle.fmu.archive.open_archive`), is
        not FMI 2.0 or 3.0 for co-simulation, has no binary for this platform, contradicts itself,
        or has ports of FMI 3.0 that are arrays or belong to clocks.
    """
    path = Path(path)
    root = read_root(path, any_platform=any_platform, versions=versions)
    try:
        return describe(root)
    except FmuError as error:
        raise FmuError(f"{path} {DESCRIPTION}: {error}") from None


def read_root(
    path: Path, *, any_platform: bool = False, versions: Sequence[str] = VERSIONS
) -> ElementTree.Element:
    """Return the XML root of an FMU that may be opened; FmuError says why it may not."""
    with open_archive(path) as archive:
        data = read_member(path, archive, DESCRIPTION, MAX_DESCRIPTION)
        root = parse_xml(data, f"{path}: {DESCRIPTION}")
        identifier = _check_kind(path, root, versions)
        if not any_platform:
            check_library(path, archive, identifier, root.get("fmiVersion", ""))
    return root


def describe(root: ElementTree.Element) -> Description:
    """Return the description in an XML tree that `read_root` let through."""
    if root.get("fmiVersion") == "3.0":
        return description_fmi3.describe(root)
    slave = root.find("CoSimulation")
    assert slave is not None  # read_root refuses what has none
    types = {
        name: child
        for simple in root.iterfind("TypeDefinitions/SimpleType")
        if (name := simple.get("name"))
        for child in simple
    }
    units = units_of(root)
    every = [_variable(e, types, units) for e in root.iterfind("ModelVariables/ScalarVariable")]
    variables = {v.name: v for v in every}
    if len(variables) != len(every):
        twice = sorted(n for n, times in Counter(v.name for v in every).items() if times > 1)
        raise FmuError(f"variables defined twice: {listed(twice)}.")
    _add_dependencies(root, every, variables)
    _mark_optional(root, variables)
    check_jumps(variables)
    return Description(
        name=root.get("modelName", ""),
        guid=root.get("guid", ""),
        identifier=slave.get("modelIdentifier", ""),
        description=root.get("description", ""),
        variables=variables,
        capabilities={k: v for k, v in slave.attrib.items() if k != "modelIdentifier"},
        begins=begins(root),
    )


def _check_kind(path: Path, root: ElementTree.Element, versions: Sequence[str]) -> str:
    """Return the model identifier of a co-simulation FMU, or raise FmuError."""
    if root.tag != "fmiModelDescription":
        raise FmuError(f"{path}: the root of {DESCRIPTION} is <{root.tag}>, not FMI's.")
    version = root.get("fmiVersion", "")
    if version not in versions:
        raise FmuError(
            f"{path}: FMI version {version or 'not given'}; FMI {' or '.join(versions)} for "
            "co-simulation is right here."
        )
    slave = root.find("CoSimulation")
    if slave is None:
        others = [words for tag, words in _OTHER_KINDS.items() if root.find(tag) is not None]
        only = f" ({' and '.join(others)} only)" if others else ""
        raise FmuError(f"{path}: not for co-simulation{only}; bristle runs co-simulation FMUs.")
    identifier = slave.get("modelIdentifier", "")
    if not _IDENTIFIER.fullmatch(identifier):
        raise FmuError(
            f"{path}: the model identifier {identifier!r} is no name that C could use, "
            "and its library cannot be found by it."
        )
    return identifier


def _variable(
    element: ElementTree.Element, types: dict[str, ElementTree.Element], units: dict[str, Measure]
) -> Variable:
    name = element.get("name")
    if not name:
        raise FmuError("a variable has no name.")
    value = next((child for child in element if child.tag in _KINDS), None)
    if value is None:
        raise FmuError(f'variable "{name}" has no type (one of {", ".join(_KINDS)}).')
    declared = types.get(value.get("declaredType", ""))
    inherited = dict(declared.attrib) if declared is not None else {}
    own = inherited | value.attrib
    return Variable(
        name=name,
        kind=value.tag,
        causality=element.get("causality", "local"),
        variability=element.get("variability", "continuous" if value.tag == "Real" else None),
        reference=reference_of(name, element.get("valueReference")),
        unit=own.get("unit"),
        start=start_of(name, value.tag, value.get("start")),
        minimum=number_of(name, "min", own.get("min")),
        maximum=number_of(name, "max", own.get("max")),
        nominal=number_of(name, "nominal", own.get("nominal")),
        description=element.get("description", ""),
        over_step=over_step_of(name, _annotation(element, OVER_STEP_TAG)),
        jumps_without=_annotation(element, JUMPS_TAG),
        defined=unit_of(own, units),
        items=items_of(name, declared),
    )


def _annotation(element: ElementTree.Element, tag: str) -> str | None:
    """Return the text of one of bristle's annotations of a variable."""
    for tool in element.iterfind("Annotations/Tool"):
        text = tool.findtext(tag)
        if tool.get("name") == TOOL and text is not None:
            return text
    return None


def _add_dependencies(
    root: ElementTree.Element, every: list[Variable], variables: dict[str, Variable]
) -> None:
    for unknown in root.iterfind("ModelStructure/Outputs/Unknown"):
        output = _indexed(every, unknown.get("index"))
        text = unknown.get("dependencies")
        if text is None:
            continue
        causes = [_indexed(every, index) for index in text.split()]
        names = tuple(v.name for v in causes if v.causality == "input")
        variables[output.name] = replace(variables[output.name], dependencies=names)


def _indexed(every: list[Variable], text: str | None) -> Variable:
    number = unsigned(text)
    if number is None or not 1 <= number <= len(every):
        raise FmuError(
            f"ModelStructure names variable {text!r}; the variables are 1 to {len(every)}."
        )
    return every[number - 1]


def _mark_optional(root: ElementTree.Element, variables: dict[str, Variable]) -> None:
    for tool in root.iterfind("VendorAnnotations/Tool"):
        if tool.get("name") != TOOL:
            continue
        mark_optional(variables, tool.findtext("optional", ""))

"""What an FMU says of itself in FMI 2.0 or 3.0: variables with units, starts and dependencies."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..component import OVER_STEP
from ..core.text import listed
from ..errors import FmuError, UnitError
from ..units import Measure, Unit, definitions
from .archive import (
    DESCRIPTION,
    MAX_DESCRIPTION,
    check_library,
    extract,
    open_archive,
    parse_xml,
    read_member,
)
from .model_description import JUMPS_TAG, OVER_STEP_TAG, TOOL

__all__ = ["Description", "Value", "Variable", "extract", "read_description"]

Value = float | int | bool | str


@dataclass(frozen=True, slots=True)
class Variable:
    """One scalar variable of an FMU.

    `kind` is "Real", "Integer", "Boolean", "String" or "Enumeration"; `unit` is None where the
    FMU gives none ("1" for a dimensionless real that says so). `dependencies` are the names of
    the inputs that the output follows directly, None where the FMU does not say. `over_step` is how
    an input is taken over a step, one of `component.OVER_STEP`, None where the FMU does not say.
    `jumps_without` names the input without which an output may jump, None where the FMU names none.
    `type` is FMI 3.0's ("Float64", "Int32" ...), "" in FMI 2.0. `defined` is what the FMU's
    BaseUnit says the unit is, None where it has none. `items` are the values of an Enumeration by
    name, none where the FMU does not list them.
    """

    name: str
    kind: str
    causality: str
    variability: str | None
    reference: int
    unit: str | None = None
    start: Value | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    description: str = ""
    dependencies: tuple[str, ...] | None = None
    optional: bool = False
    over_step: str | None = None
    jumps_without: str | None = None
    type: str = ""
    defined: Unit | None = None
    items: Mapping[str, int] = field(default_factory=dict)

    @property
    def measure(self) -> Measure | None:
        """The unit with what the FMU defines it as, None without a unit."""
        return Measure(self.unit, self.defined) if self.unit else None


_WITHOUT_LOSS = {
    ("Integer", "Real"), ("Enumeration", "Real"), ("Enumeration", "Integer"),
    ("Integer", "Enumeration"),
}  # fmt: skip


def passes(given: str, wanted: str) -> bool:
    """Return whether an output of one kind can feed an input of another: a text feeds nothing."""
    return given == wanted != "String" or (given, wanted) in _WITHOUT_LOSS


@dataclass(frozen=True)
class Description:
    """What a scenario needs to know of a component before it runs; `version` is that of FMI.

    `begins` is the start time of its default experiment as the file writes it, "" without one;
    `unread` are its inputs of a type that is not read, which keep what the FMU begins with.
    """

    name: str
    guid: str
    identifier: str
    description: str = ""
    variables: dict[str, Variable] = field(default_factory=dict)
    capabilities: dict[str, str] = field(default_factory=dict)
    version: str = "2.0"
    begins: str = ""
    unread: tuple[str, ...] = ()

    def of(self, causality: str) -> list[Variable]:
        """Return the variables of one causality ("input", "output", "parameter"), in order."""
        return [v for v in self.variables.values() if v.causality == causality]


def units_of(root: ElementTree.Element) -> dict[str, Measure]:
    """Return the units that an FMU defines, by name.

    Raises
    ------
    FmuError
        If one cannot be read, or is defined twice and differently.
    """
    told = []
    for element in root.iterfind("UnitDefinitions/Unit"):
        base = element.find("BaseUnit")
        told.append((element.get("name", ""), None if base is None else base.attrib))
    try:
        return definitions(told)
    except UnitError as error:
        raise FmuError(str(error)) from None


def unit_of(own: Mapping[str, str], units: Mapping[str, Measure]) -> Unit | None:
    """Return what the FMU defines a variable's unit as; a difference has no offset.

    Parameters
    ----------
    own : attributes of the variable, those of its type included
    units : the FMU's, by name
    """
    name = own.get("unit", "")
    unit = units.get(name, Measure(name)).defined
    if unit is not None and own.get("relativeQuantity", "").strip() in ("true", "1"):
        return unit._replace(offset=0.0)
    return unit


def items_of(name: str, declared: ElementTree.Element | None) -> dict[str, int]:
    """Return the values of an Enumeration by the names of its items.

    Raises
    ------
    FmuError
        If a value is no whole number.
    """
    found = {}
    for item in () if declared is None else declared.iterfind("Item"):
        try:
            found[item.get("name", "")] = int(item.get("value", ""))
        except ValueError:
            text = f'the item "{item.get("name")}" has the value {item.get("value")!r}'
            raise FmuError(f'variable "{name}": {text}, no whole number.') from None
    return found


def reference_of(name: str, text: str | None) -> int:
    """Return a value reference of the variable of this name."""
    number = unsigned(text)
    if number is None or number >= 2**32:
        raise FmuError(f'variable "{name}": the value reference {text!r} is no unsigned integer.')
    return number


def unsigned(text: str | None) -> int | None:
    """Return a number without a sign, None where the text is none."""
    digits = (text or "").strip()
    return int(digits) if digits.isdecimal() and len(digits) <= 10 else None


def number_of(name: str, attribute: str, text: str | None) -> float | None:
    """Return the number in an attribute of a variable, None where it has none."""
    if text is None:
        return None
    try:
        number = float(text)
    except ValueError:
        raise FmuError(f'variable "{name}": {attribute} is {text!r}, not a number.') from None
    if math.isnan(number):
        raise FmuError(f'variable "{name}": {attribute} is not a number.')
    return number


def start_of(name: str, kind: str, text: str | None) -> Value | None:
    """Return the start value of a variable, None where it has none."""
    if text is None or kind == "String":
        return text
    try:
        if kind == "Real":
            return float(text)
        if kind == "Boolean":
            return {"true": True, "1": True, "false": False, "0": False}[text.strip()]
        return int(text)
    except (ValueError, KeyError):
        raise FmuError(f'variable "{name}": the start {text!r} is no {kind}.') from None


def over_step_of(name: str, text: str | None) -> str | None:
    """Return what an annotation says of how an input is taken over a step, None without one."""
    if text is not None and text not in OVER_STEP:
        known = ", ".join(OVER_STEP)
        said = f"the annotation {OVER_STEP_TAG} is {text!r}, none of {known}."
        raise FmuError(f'variable "{name}": {said}')
    return text


def check_jumps(variables: dict[str, Variable]) -> None:
    """Refuse an output that may jump without an input which is none."""
    for variable in variables.values():
        cure = variable.jumps_without
        if cure is not None and (cure not in variables or variables[cure].causality != "input"):
            raise FmuError(
                f'"{variable.name}" may jump without "{cure}", but no input has that name.'
            )


def mark_optional(variables: dict[str, Variable], names: str) -> None:
    """Mark the inputs that an annotation names as optional, in place."""
    for name in names.split():
        if name not in variables or variables[name].causality != "input":
            raise FmuError(f'the annotation calls "{name}" optional, but no input has that name.')
        variables[name] = replace(variables[name], optional=True)


# What an FMI 3.0 FMU for co-simulation says of itself, in the words of FMI 2.0 where it has them.
#
# Numbers keep the type that FMI 3.0 gives them in `Variable.type`; their kind is that of FMI 2.0,
# so that scenarios and the master need not ask for the version. Arrays and binaries that are no
# ports are left out: nothing here sets or shows them.

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


def describe_fmi3(root: ElementTree.Element) -> Description:
    """Return the description in an XML tree of FMI 3.0 for co-simulation.

    Raises
    ------
    FmuError
        It contradicts itself, or has ports that are arrays or belong to clocks.
    """
    types = {child.get("name", ""): child for child in root.iterfind("TypeDefinitions/*")}
    units = units_of(root)
    variables: dict[str, Variable] = {}
    check_ports(root)
    for element in root.iterfind("ModelVariables/*"):
        name = element.get("name", "")
        if element.tag in KINDS and element.find("Dimension") is None:
            if name in variables:
                raise FmuError(f"variables defined twice: {name}.")
            variables[name] = _variable_fmi3(element, types, units)
    _add_dependencies_fmi3(root, variables)
    mark_optional(variables, _annotation_fmi3(root, "optional") or "")
    described = _described(root, root.get("instantiationToken", ""), variables, "3.0")
    unread = root.iterfind("ModelVariables/Binary[@causality='input']")
    return replace(described, unread=tuple(one.get("name", "") for one in unread))


def _described(
    root: ElementTree.Element, guid: str, variables: dict[str, Variable], version: str
) -> Description:
    """Return what an FMU of either version says of itself besides its variables, with these."""
    check_jumps(variables)
    slave = root.find("CoSimulation")
    assert slave is not None  # read_root refuses what has none
    flags = {_CAPABILITIES.get(key, key): value for key, value in slave.attrib.items()}
    identifier, experiment = flags.pop("modelIdentifier", ""), root.find("DefaultExperiment")
    return Description(
        root.get("modelName", ""), guid, identifier, root.get("description", ""), variables, flags,
        version, "" if experiment is None else experiment.get("startTime", ""),
    )  # fmt: skip


def check_ports(root: ElementTree.Element) -> None:
    """Refuse ports that a scenario cannot connect and the master cannot step.

    Raises
    ------
    FmuError
        If a port is an array or belongs to a clock.
    """
    for element in root.iterfind("ModelVariables/*"):
        name = element.get("name")
        if not name:
            raise FmuError("a variable has no name.")
        if element.get("causality") not in ("input", "output"):
            continue
        if element.tag == "Clock" or element.get("clocks"):
            raise FmuError(
                f'"{name}" belongs to a clock. Values are passed on at communication points only; '
                "an FMU without clocks is right."
            )
        if element.find("Dimension") is not None:
            raise FmuError(f'"{name}" is an array. Ports are single numbers here.')


def _variable_fmi3(
    element: ElementTree.Element,
    types: Mapping[str, ElementTree.Element],
    units: Mapping[str, Measure],
) -> Variable:
    kind, declared = KINDS[element.tag], types.get(element.get("declaredType", ""))
    start = element.get("start")
    if kind == "String" and (given := element.find("Start")) is not None:
        start = given.get("value")
    listed_in = declared if kind == "Enumeration" else None
    read = _read_variable(element, kind, element, declared, start, units, _annotation_fmi3)
    low, high = _RANGES.get(element.tag, (None, None))
    return replace(
        read,
        minimum=low if read.minimum is None else read.minimum,
        maximum=high if read.maximum is None else read.maximum,
        type=element.tag,
        items=items_of(read.name, listed_in),
    )


def _read_variable(
    element: ElementTree.Element,
    kind: str,
    value: ElementTree.Element,
    declared: ElementTree.Element | None,
    start: str | None,
    units: Mapping[str, Measure],
    annotation: Callable[[ElementTree.Element, str], str | None],
) -> Variable:
    """Return what both versions of FMI say alike of a variable.

    Parameters
    ----------
    element, value : of the variable, and that which has the attributes of its type
    kind : of its values
    declared : the type that it refers to, None without one
    start : text of its start value
    units : the FMU's, by name
    annotation : reads one of bristle's annotations of the variable
    """
    name = element.attrib["name"]
    own = {**(declared.attrib if declared is not None else {}), **value.attrib}
    return Variable(
        name=name,
        kind=kind,
        causality=element.get("causality", "local"),
        variability=element.get("variability", "continuous" if kind == "Real" else None),
        reference=reference_of(name, element.get("valueReference")),
        unit=own.get("unit"),
        start=start_of(name, kind, start),
        minimum=number_of(name, "min", own.get("min")),
        maximum=number_of(name, "max", own.get("max")),
        nominal=number_of(name, "nominal", own.get("nominal")),
        description=element.get("description", ""),
        over_step=over_step_of(name, annotation(element, OVER_STEP_TAG)),
        jumps_without=annotation(element, JUMPS_TAG),
        defined=unit_of(own, units),
    )


def _annotation_fmi3(element: ElementTree.Element, tag: str) -> str | None:
    """Return the text of one of bristle's annotations of a variable, or of the whole FMU."""
    for own in element.iterfind("Annotations/Annotation"):
        text = own.findtext(tag)
        if own.get("type") == TOOL and text is not None:
            return text
    return None


def _add_dependencies_fmi3(root: ElementTree.Element, variables: dict[str, Variable]) -> None:
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
        return describe_fmi3(root)
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
    for tool in root.iterfind("VendorAnnotations/Tool"):
        if tool.get("name") == TOOL:
            mark_optional(variables, tool.findtext("optional", ""))
    return _described(root, root.get("guid", ""), variables, "2.0")


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
    start, kind = value.get("start"), value.tag
    read = _read_variable(element, kind, value, declared, start, units, _annotation)
    return replace(read, items=items_of(name, declared))


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

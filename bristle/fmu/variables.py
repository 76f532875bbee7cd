"""What is known of an FMU's variables, whatever version of FMI it follows, and how numbers read."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..component import OVER_STEP
from ..errors import FmuError, UnitError
from ..units import Measure, Unit, definitions
from .model_description import OVER_STEP_TAG

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

    `begins` is the start time of its default experiment as the file writes it, "" without one.
    """

    name: str
    guid: str
    identifier: str
    description: str = ""
    variables: dict[str, Variable] = field(default_factory=dict)
    capabilities: dict[str, str] = field(default_factory=dict)
    version: str = "2.0"
    begins: str = ""

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


def begins(root: ElementTree.Element) -> str:
    """Return the start time of an FMU's default experiment as it writes it, "" without one."""
    experiment = root.find("DefaultExperiment")
    return "" if experiment is None else experiment.get("startTime", "")


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

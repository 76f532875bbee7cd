"""Units that a package declares, and the linear change from one to another."""

from __future__ import annotations

import math

from ..errors import ScenarioError, UnitError
from ..units import Measure, definitions
from .package import Element, Package, child, children

Change = tuple[float, float]
"""Factor and offset: what a value v becomes is factor v + offset."""

SAME: Change = (1.0, 0.0)


def read_units(units: Element | None, package: Package, where: str) -> dict[str, Measure]:
    """Return the units that an element declares, by name."""
    told = []
    for entry in children(units, "Unit"):
        base = child(entry, "BaseUnit")
        told.append((entry.get("name", ""), None if base is None else base.attrib))
    try:
        return definitions(told)
    except UnitError as error:
        raise package.error(where, str(error)) from None


def measure(name: str | None, declared: dict[str, Measure]) -> Measure | None:
    """Return a unit by name, as declared where it is; None for no name."""
    return declared.get(name, Measure(name)) if name else None


def convert(given: Measure | None, wanted: Measure | None) -> Change:
    """Return the change of a value in one unit to the other; none where one side has no unit.

    Raises
    ------
    ScenarioError
        If nothing says how, or they are units of different quantities.
    """
    if given is None or wanted is None:
        return SAME
    try:
        return given.change_to(wanted)
    except UnitError as error:
        cure = ""
        if given.unit is None or wanted.unit is None:
            cure = " Declare it in <Units> with its <BaseUnit>."
        raise ScenarioError(f"{error}{cure}") from None


def after(first: Change, second: Change) -> Change:
    """Return two changes, one after the other, as one."""
    return second[0] * first[0], second[0] * first[1] + second[1]


def linear(element: Element, package: Package, where: str) -> Change:
    """Return the linear transformation in a connection or a mapping.

    Raises
    ------
    ScenarioError
        If it has one of another kind.
    """
    for name in ("Boolean", "Integer", "Enumeration"):
        if child(element, f"{name}MappingTransformation") is not None:
            text = f"<{name}MappingTransformation> is not read; <LinearTransformation> is."
            raise package.error(where, text)
    found = child(element, "LinearTransformation")
    if found is None:
        return SAME
    return (
        number(found, "factor", 1.0, package, where),
        number(found, "offset", 0.0, package, where),
    )


def number(element: Element, key: str, usual: float, package: Package, where: str) -> float:
    """Return a finite number in an attribute.

    Parameters
    ----------
    element, key : the element, and the name of its attribute
    usual : the number where the attribute is not there
    package, where : what it is read from, and the place that an error names
    """
    text = element.get(key)
    if text is None:
        return usual
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise package.error(where, f'{key} = "{text}" is no finite number.')
    return value


def is_true(element: Element, key: str) -> bool:
    """Return whether a Boolean attribute is set."""
    return element.get(key, "false").strip() in ("true", "1")

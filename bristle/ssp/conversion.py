"""Units that a package declares, and the linear change from one to another."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..errors import ScenarioError, UnitError
from ..units import DIMENSIONS, Unit, parse
from .package import Element, Package, child, children

Change = tuple[float, float]
"""Factor and offset: what a value v becomes is factor v + offset."""

SAME: Change = (1.0, 0.0)


class Measure(NamedTuple):
    """A unit by its name in the package; `unit` is None where nothing says what it is."""

    name: str
    unit: Unit | None


def read_units(units: Element | None, package: Package, where: str) -> dict[str, Measure]:
    """Return the units that an element declares, by name."""
    found = {}
    for entry in children(units, "Unit"):
        name, base = entry.get("name", ""), child(entry, "BaseUnit")
        inside = f'{where}: <Unit "{name}">'
        if base is None:
            found[name] = Measure(name, None)
            continue
        powers = [number(base, key, 0.0, package, inside) for key in DIMENSIONS]
        if any(power != int(power) for power in powers):
            raise package.error(inside, "powers of base units are whole numbers.")
        factor = number(base, "factor", 1.0, package, inside)
        if factor == 0.0:
            raise package.error(inside, "its factor is 0; a unit has another one.")
        offset = number(base, "offset", 0.0, package, inside)
        found[name] = Measure(name, Unit(name, factor, tuple(int(p) for p in powers), offset))
    return found


def measure(name: str | None, declared: dict[str, Measure]) -> Measure | None:
    """Return a unit by name: as declared, else as bristle reads it; None for no name."""
    if name is None or name == "":
        return None
    if name in declared and declared[name].unit is not None:
        return declared[name]
    try:
        return Measure(name, parse(name))
    except UnitError:
        return Measure(name, None)


def convert(given: Measure | None, wanted: Measure | None) -> Change:
    """Return the change of a value in one unit to the other; none where one side has no unit.

    Raises
    ------
    ScenarioError
        If nothing says how, or they are units of different quantities.
    """
    if given is None or wanted is None:
        return SAME
    if given.unit is None or wanted.unit is None:
        if given.name == wanted.name:
            return SAME
        strange = given.name if given.unit is None else wanted.name
        raise ScenarioError(
            f"[{given.name}] into [{wanted.name}]: nothing says what the unit "
            f'"{strange}" is. Declare it in <Units> with its <BaseUnit>.'
        )
    if given.unit.dimension != wanted.unit.dimension:
        raise ScenarioError(f"[{given.name}] does not convert into [{wanted.name}].")
    factor = given.unit.factor / wanted.unit.factor
    return factor, (given.unit.offset - wanted.unit.offset) / wanted.unit.factor


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

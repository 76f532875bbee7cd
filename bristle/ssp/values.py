"""Parameter values of a package: sets inline and in .ssv, mappings inline and in .ssm."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from ..fmu.description import Value
from ..units import Measure
from .conversion import SAME, Change, is_true, linear, measure, number, read_units
from .package import Element, Package, child, children, local

_REAL = re.compile(r"Real|Float(32|64)")
_INTEGER = re.compile(r"Integer|U?Int(8|16|32|64)")


@dataclass(frozen=True)
class Given:
    """A value that a package gives to what is called `name` where it is bound.

    `unit` is the value's own; `change` comes after the conversion of units, or in its place where
    `converts` is false. `where` is its file and element.
    """

    name: str
    value: Value
    unit: Measure | None
    where: str
    change: Change = SAME
    converts: bool = True


def read_bindings(element: Element, package: Package, file: str, where: str) -> tuple[Given, ...]:
    """Return the values bound to a system or component, those that win last.

    Parameters
    ----------
    element : the system or component
    package : the package
    file : the member in which it stands
    where : file and element, for messages
    """
    found: list[Given] = []
    for binding in children(child(element, "ParameterBindings"), "ParameterBinding"):
        inside = f"{where} <ParameterBinding>"
        kind = binding.get("type", "application/x-ssp-parameter-set")
        if kind != "application/x-ssp-parameter-set":
            raise package.error(inside, f'type "{kind}" is not read; parameter sets are.')
        given = _set(binding, package, file, inside)
        prefix = binding.get("prefix", "")
        given = [replace(one, name=prefix + one.name) for one in given]
        mapping = child(binding, "ParameterMapping")
        found += given if mapping is None else _mapped(given, mapping, package, file, inside)
    return tuple(found)


def _set(binding: Element, package: Package, file: str, where: str) -> list[Given]:
    source = binding.get("source")
    values = child(binding, "ParameterValues")
    if source:
        _refuse_base(binding, package, where)
        file = package.member(source, file, where)
        found: Element | None = package.xml(file, "ParameterSet")
    else:
        found = child(values, "ParameterSet")
    if found is None:
        return []
    units = read_units(child(found, "Units"), package, file)
    items = {
        (kind.get("name", ""), item.get("name", "")): item.get("value", "")
        for kind in children(child(found, "Enumerations"), "Enumeration")
        for item in children(kind, "Item")
    }
    given = []
    for parameter in children(child(found, "Parameters"), "Parameter"):
        inside = f'{file}: <Parameter "{parameter.get("name", "")}">'
        given += [
            Given(
                parameter.get("name", ""),
                _value(entry, items, package, inside),
                measure(entry.get("unit"), units),
                inside,
            )
            for entry in parameter
            if local(entry) not in ("Annotations", "Dimension")
        ]
    return given


def _refuse_base(element: Element, package: Package, where: str) -> None:
    if element.get("sourceBase", "SSD") != "SSD":
        raise package.error(where, "a source inside a component is not read; one beside it is.")


def _value(
    entry: Element, items: dict[tuple[str, str], str], package: Package, where: str
) -> Value:
    kind, text = local(entry), entry.get("value")
    if text is None:
        raise package.error(where, f"<{kind}> has no value.")
    if _REAL.fullmatch(kind):
        return number(entry, "value", 0.0, package, where)
    if kind == "String":
        return text
    if kind == "Boolean" and text.strip() in ("true", "1", "false", "0"):
        return text.strip() in ("true", "1")
    if kind == "Enumeration":
        text = items.get((entry.get("name", ""), text), text)
    if kind == "Enumeration" or _INTEGER.fullmatch(kind):
        try:
            return int(text)
        except ValueError:
            if kind == "Enumeration":
                return text  # an item of the FMU's own type
            raise package.error(where, f'"{text}" is no whole number.') from None
    raise package.error(where, f'<{kind} value="{text}"> is not read.')


def _mapped(
    given: list[Given], mapping: Element, package: Package, file: str, where: str
) -> list[Given]:
    """Return values under the names that a mapping gives them; others are left aside."""
    source = mapping.get("source")
    found: Element | None = child(mapping, "ParameterMapping")
    if source:
        _refuse_base(mapping, package, where)
        file = package.member(source, file, where)
        found = package.xml(file, "ParameterMapping")
    by_name = {one.name: one for one in given}
    left = dict(by_name)
    mapped = []
    for entry in children(mapping if found is None else found, "MappingEntry"):
        name, target = entry.get("source", ""), entry.get("target", "")
        inside = f'{file}: <MappingEntry "{name}" to "{target}">'
        if name not in by_name:
            package.note(inside, f'no parameter is called "{name}": left aside.')
        else:
            left.pop(name, None)
            change = linear(entry, package, inside)
            converts = not is_true(entry, "suppressUnitConversion")
            one = by_name[name]
            mapped.append(replace(one, name=target, change=change, converts=converts, where=inside))
    for one in left.values():
        package.note(one.where, "the mapping does not name it: left aside.")
    return mapped

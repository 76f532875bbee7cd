"""Checks of the connections: both ends there, the right way round, equal units, every input fed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..core.config import Document
from ..core.text import listed, nearest, number, unknown, written
from ..core.toml_lines import KeyPath
from ..errors import UnitError
from ..fmu.description import Variable, passes
from ..units import Measure
from .model import Connection, Part, shown_items
from .overrides import flatten
from .ssp_read import SAME

FROM, FACTOR, OFFSET = TRANSFORMED = ("from", "factor", "offset")
"""Keys of a connection whose value is transformed on its way: input = factor output + offset."""

_ARTICLE = {"input": "an input", "output": "an output"}


def check_connections(
    document: Document, connections: Mapping[str, Any], parts: Mapping[str, Part]
) -> list[Connection]:
    """Check every connection and that every input has exactly one source."""
    wires: dict[str, Connection] = {}
    claimed: set[str] = set()  # inputs whose connection stands in the file, right or wrong
    if not isinstance(document.data.get("connections", {}), dict):
        return []  # without asking for a source of every input
    for target, source, path in flatten(connections, ("connections",), whole=_is_transformed):
        if target in claimed:
            document.error(path, f'"{target}" has two sources; one connection per input is right.')
            continue
        claimed.add(target)
        if isinstance(source, list):
            document.error(
                path,
                f'"{target}" is fed by a list; an input has one source, one text in quotes. To add '
                "forces up use a second input, such as structure.extra_force.",
            )
        elif not isinstance(source, str | dict):
            document.error(
                path, f'"{target}" is fed by {written(source)}; "component.output" is right.'
            )
        else:
            wire = _check_wire(target, source, path, parts, document)
            if wire:
                wires[target] = wire
            else:
                claimed |= _meant(target, source, parts) if isinstance(source, str) else set()
    _check_inputs(parts, wires, claimed, document)
    return list(wires.values())


def _is_transformed(name: str, table: Mapping[str, object]) -> bool:
    """Return whether a table is a connection of its own, and no part of a dotted name."""
    return "." in name and FROM in table and set(table) <= set(TRANSFORMED)


def _transformation(
    target: str, table: Mapping[str, object], path: KeyPath, document: Document
) -> tuple[float, float] | None:
    """Return factor and offset of a connection; None after saying what is wrong with them."""
    found = [number(table.get(key, usual)) for key, usual in ((FACTOR, 1.0), (OFFSET, 0.0))]
    for key, value in zip((FACTOR, OFFSET), found, strict=True):
        if isinstance(value, str):
            document.error((*path, key), f'"{target}": {key} {value}; a number is right.')
    factor, offset = found
    return None if isinstance(factor, str) or isinstance(offset, str) else (factor, offset)


def _check_wire(
    target: str,
    said: str | dict[str, object],
    path: KeyPath,
    parts: Mapping[str, Part],
    document: Document,
) -> Connection | None:
    source = said[FROM] if isinstance(said, dict) else said
    if not isinstance(source, str):
        document.error(
            (*path, FROM), f'"{target}" is fed by {written(source)}; "component.output" is right.'
        )
        return None
    transformation = (1.0, 0.0)
    if isinstance(said, dict):
        found = _transformation(target, said, path, document)
        if found is None:
            return None
        transformation = found
    into = _end(target, path, "input", parts, document)
    out = _end(source, path, "output", parts, document)
    if into is None or out is None:
        return None
    (to, entry), (origin, exit_) = into, out
    if (entry.causality, exit_.causality) == ("output", "input"):
        document.error(
            path,
            f'"{target}" is an output and "{source}" an input: the wrong way round. Input = '
            f'output is right: "{source}" = "{target}".',
        )
        return None
    right = True
    for end, part, variable, wanted in (
        (target, to, entry, "input"),
        (source, origin, exit_, "output"),
    ):
        if variable.causality != wanted:
            document.error(path, _wrong_end(end, part, variable, wanted))
            right = False
    if not right:
        return None
    _check_kinds(target, entry, source, exit_, path, isinstance(said, dict), document)
    if entry.kind == "Real" and passes(exit_.kind, "Real") and isinstance(said, str):
        _check_units(target, entry.measure, source, exit_.measure or origin.played, path, document)
    if entry.name in to.places:
        document.error(
            path,
            f'"{target}" is connected here and set in the parameters of {to.name} too; '
            "one of them must go.",
        )
    return Connection(
        to.name, entry.name, origin.name, exit_.name, *transformation, isinstance(said, dict), path
    )


def _meant(target: str, source: str, parts: Mapping[str, Part]) -> set[str]:
    """Return the inputs that a wrong connection was for, so that none is called open as well."""
    name, _, port = target.partition(".")
    part = parts.get(name)
    inputs = [v.name for v in part.description.of("input")] if part and part.description else []
    return {source, *(f"{name}.{close}" for close in nearest(port, inputs))}


def _end(
    text: str, path: KeyPath, wanted: str, parts: Mapping[str, Part], document: Document
) -> tuple[Part, Variable] | None:
    """Return the component and variable that one end of a connection names."""
    name, dot, port = text.partition(".")
    if not dot or not port:
        document.error(path, f'"{text}" is no port; "component.{wanted}" is right.')
        return None
    part = parts.get(name)
    if part is None:
        document.error(path, f'"{text}": {unknown("component", name, parts)}')
        return None
    if part.description is None:
        return None  # what is wrong with the component has been said
    if port not in part.variables:
        names = [variable.name for variable in part.description.of(wanted)]
        words = unknown(wanted, port, names, part.ports_command)
        document.error(path, f'"{text}": {part.kind}: {words}')
        return None
    return part, part.variables[port]


def _wrong_end(end: str, part: Part, variable: Variable, wanted: str) -> str:
    """Return the words for a variable on the wrong side of a connection."""
    kind = _ARTICLE.get(variable.causality, f"a {variable.causality}")
    names = [v.name for v in part.description.of(wanted)] if part.description else []
    if variable.causality == "parameter" and wanted == "input":
        return (
            f'"{end}" is a parameter, which cannot be connected: set it in the parameters of '
            f"{part.name}."
        )
    place = "left" if wanted == "input" else "right"
    return (
        f'"{end}" is {kind}; {_ARTICLE[wanted]} belongs on the {place} of "=". '
        f"{part.kind} has: {listed(names) or 'none'}."
    )


def _check_kinds(
    target: str,
    entry: Variable,
    source: str,
    exit_: Variable,
    path: KeyPath,
    transformed: bool,
    document: Document,
) -> None:
    """Check that values can be passed on: whole numbers feed reals and enumerations too."""
    ends = f'"{target}" is {entry.kind} and "{source}" is {exit_.kind}'
    if entry.kind == exit_.kind == "String":
        text = "texts are set in parameters, only numbers and Booleans are passed on."
        document.error(path, f"{ends}: {text}")
    elif not passes(exit_.kind, entry.kind):
        document.error(path, f"{ends}; both must be alike.")
    elif transformed and entry.kind != "Real":
        text = f'"{target}" is {entry.kind}: only Real has a factor and an offset.'
        document.error(path, text)
    elif entry.items:
        strange = [name for name, value in exit_.items.items() if value not in entry.items.values()]
        right = f"it takes {shown_items(entry)}"
        if strange:
            text = f'"{source}" may be {", ".join(strange)}'
            document.warning(path, f'{text}, which "{target}" does not know: {right}.')
        elif not exit_.items:
            text = f'{ends}: {right}, and nothing checks that "{source}" gives no other'
            document.note(path, f"{text} value.")


def _check_units(
    target: str,
    wanted: Measure | None,
    source: str,
    given: Measure | None,
    path: KeyPath,
    document: Document,
) -> None:
    if wanted is None and given is None:
        return
    if given is None:
        assert wanted is not None
        text = f'"{source}" has no unit; "{target}" takes its values as {wanted.shown}.'
        document.note(path, text)
        return
    if wanted is None:
        text = f'"{target}" names no unit; it takes "{source}" in {given.shown} as it comes.'
        document.note(path, text)
        return
    ends = f'"{target}" {wanted.shown} is fed by "{source}" {given.shown}'
    into, out = wanted.unit, given.unit
    try:
        factor, offset = given.change_to(wanted)
    except UnitError:
        if into is not None and out is not None:
            text = f"{ends}: another quantity. An output in [{wanted.name}] is right."
            document.error(path, text)
            return
        strange = wanted if into is None else given
        document.warning(
            path,
            f'{ends}; the unit "{strange.name}" is not known here, so whether they agree is for '
            "you to see.",
        )
        return
    if (factor, offset) != SAME:
        shift = f", offset = {offset:.9g}" if offset else ""
        document.error(
            path,
            f"{ends}: the same quantity in another unit, and nothing converts it. An output in "
            f'[{wanted.name}] is right, or {{ from = "{source}", factor = {factor:.9g}{shift} }}.',
        )
    elif into is not None and out is not None and into.dimension != out.dimension:
        document.note(path, f"{ends}: one of them counts an angle as a dimension.")


def _check_inputs(
    parts: Mapping[str, Part],
    wires: Mapping[str, Connection],
    claimed: set[str],
    document: Document,
) -> None:
    """Report every input that nothing feeds."""
    for part in parts.values():
        if part.description is None:
            continue
        for variable in part.description.of("input"):
            name = f"{part.name}.{variable.name}"
            if variable.optional or name in claimed or variable.name in part.places:
                continue
            unit = f" [{variable.unit}]" if variable.unit else ""
            document.error(
                part.path,
                f'"{name}"{unit} has no source: connect it{_candidates(part, variable, parts)} '
                f"or set it in the parameters of {part.name}.",
            )


def _candidates(part: Part, wanted: Variable, parts: Mapping[str, Part]) -> str:
    """Return the connection that would feed an input, if there is one of its name or unit."""
    outputs = [
        (other.name, output)
        for other in parts.values()
        if other is not part and other.description
        for output in other.description.of("output")
        if output.kind == wanted.kind != "String" and _unit_fits(output, wanted)
    ]
    same_name = [pair for pair in outputs if pair[1].name == wanted.name]
    ends_alike = [pair for pair in outputs if pair[1].name.split("_")[-1] in wanted.name]
    same_unit = [pair for pair in outputs if pair[1].unit is not None]
    for found in (same_name, ends_alike, same_unit):
        if found:
            source, output = found[0]
            return f', e.g. "{part.name}.{wanted.name}" = "{source}.{output.name}",'
    return ""


def _unit_fits(output: Variable, wanted: Variable) -> bool:
    """Return whether an output's values can be taken as they are, as far as its unit says."""
    given, into = output.measure, wanted.measure
    if given is None or into is None:
        return given is None
    try:
        return given.change_to(into) == SAME
    except UnitError:
        return False

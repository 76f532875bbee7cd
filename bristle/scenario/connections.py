"""Checks of the connections: both ends there, the right way round, equal units, every input fed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import UnitError
from ..findings import Findings, nearest, number, unknown, written
from ..fmu.description import Variable
from ..lines import KeyPath
from ..units import Unit, parse
from .checks import table
from .document import Document, flatten
from .parts import Part

FROM, FACTOR, OFFSET = TRANSFORMED = ("from", "factor", "offset")
"""Keys of a connection whose value is transformed on its way: input = factor output + offset."""

_ARTICLE = {"input": "an input", "output": "an output"}


@dataclass(frozen=True)
class Wire:
    """One connection that could be read, with the path of its key; input = factor output + offset.

    `transformed` is whether the scenario says so, even if by 1 and 0.
    """

    target: str
    input: str
    source: str
    output: str
    path: KeyPath
    factor: float = 1.0
    offset: float = 0.0
    transformed: bool = False

    def given(self, value: float) -> float:
        """Return what the input gets where the output has a value."""
        return self.factor * value + self.offset


def check_connections(
    document: Document, parts: Mapping[str, Part], findings: Findings
) -> list[Wire]:
    """Check every connection and that every input has exactly one source."""
    wires: dict[str, Wire] = {}
    claimed: set[str] = set()  # inputs whose connection stands in the file, right or wrong
    data = table(findings, document.data, ("connections",))
    if data is None:
        return []
    for target, source, path in flatten(data, ("connections",), whole=_is_transformed):
        if target in claimed:
            findings.error(path, f'"{target}" has two sources; one connection per input is right.')
            continue
        claimed.add(target)
        if isinstance(source, list):
            findings.error(
                path,
                f'"{target}" is fed by a list; an input has one source, one text in quotes. To add '
                "forces up use a second input, such as structure.extra_force.",
            )
        elif not isinstance(source, str | dict):
            findings.error(
                path, f'"{target}" is fed by {written(source)}; "component.output" is right.'
            )
        else:
            wire = _check_wire(target, source, path, parts, findings)
            if wire:
                wires[target] = wire
            else:
                claimed |= _meant(target, source, parts) if isinstance(source, str) else set()
    _check_inputs(parts, wires, claimed, findings)
    return list(wires.values())


def _is_transformed(name: str, table: Mapping[str, object]) -> bool:
    """Return whether a table is a connection of its own, and no part of a dotted name."""
    return "." in name and FROM in table and set(table) <= set(TRANSFORMED)


def _transformation(
    target: str, table: Mapping[str, object], path: KeyPath, findings: Findings
) -> tuple[float, float] | None:
    """Return factor and offset of a connection; None after saying what is wrong with them."""
    found = [number(table.get(key, usual)) for key, usual in ((FACTOR, 1.0), (OFFSET, 0.0))]
    for key, value in zip((FACTOR, OFFSET), found, strict=True):
        if isinstance(value, str):
            findings.error((*path, key), f'"{target}": {key} {value}; a number is right.')
    factor, offset = found
    return None if isinstance(factor, str) or isinstance(offset, str) else (factor, offset)


def _check_wire(
    target: str,
    said: str | dict[str, object],
    path: KeyPath,
    parts: Mapping[str, Part],
    findings: Findings,
) -> Wire | None:
    source = said[FROM] if isinstance(said, dict) else said
    if not isinstance(source, str):
        findings.error(
            (*path, FROM), f'"{target}" is fed by {written(source)}; "component.output" is right.'
        )
        return None
    transformation = (1.0, 0.0)
    if isinstance(said, dict):
        found = _transformation(target, said, path, findings)
        if found is None:
            return None
        transformation = found
    into = _end(target, path, "input", parts, findings)
    out = _end(source, path, "output", parts, findings)
    if into is None or out is None:
        return None
    (to, entry), (origin, exit_) = into, out
    if (entry.causality, exit_.causality) == ("output", "input"):
        findings.error(
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
            findings.error(path, _wrong_end(end, part, variable, wanted))
            right = False
    if not right:
        return None
    if entry.kind != exit_.kind:
        findings.error(
            path, f'"{target}" is {entry.kind} and "{source}" is {exit_.kind}; both must be alike.'
        )
    elif isinstance(said, dict):
        if entry.kind != "Real":
            findings.error(
                path, f'"{target}" is {entry.kind}: only Real has a factor and an offset.'
            )
    elif entry.kind == "Real":
        _check_units(target, entry.unit, source, exit_.unit, path, findings)
    if entry.name in to.places:
        findings.error(
            path,
            f'"{target}" is connected here and set in the parameters of {to.name} too; '
            "one of them must go.",
        )
    return Wire(
        to.name, entry.name, origin.name, exit_.name, path, *transformation, isinstance(said, dict)
    )


def _meant(target: str, source: str, parts: Mapping[str, Part]) -> set[str]:
    """Return the inputs that a wrong connection was for, so that none is called open as well."""
    name, _, port = target.partition(".")
    part = parts.get(name)
    inputs = [v.name for v in part.description.of("input")] if part and part.description else []
    return {source, *(f"{name}.{close}" for close in nearest(port, inputs))}


def _end(
    text: str, path: KeyPath, wanted: str, parts: Mapping[str, Part], findings: Findings
) -> tuple[Part, Variable] | None:
    """Return the component and variable that one end of a connection names."""
    name, dot, port = text.partition(".")
    if not dot or not port:
        findings.error(path, f'"{text}" is no port; "component.{wanted}" is right.')
        return None
    part = parts.get(name)
    if part is None:
        findings.error(path, f'"{text}": {unknown("component", name, parts)}')
        return None
    if part.description is None:
        return None  # what is wrong with the component has been said
    if port not in part.variables:
        names = [variable.name for variable in part.description.of(wanted)]
        words = unknown(wanted, port, names, part.ports_command)
        findings.error(path, f'"{text}": {part.fmu}: {words}')
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
    listed = ", ".join(names) if names else "none"
    return (
        f'"{end}" is {kind}; {_ARTICLE[wanted]} belongs on the {place} of "=". '
        f"{part.fmu} has: {listed}."
    )


def _check_units(
    target: str,
    wanted: str | None,
    source: str,
    given: str | None,
    path: KeyPath,
    findings: Findings,
) -> None:
    if not wanted and not given:
        return
    if not given:
        findings.note(
            path, f'"{source}" has no unit; "{target}" takes its values as {_shown(wanted)}.'
        )
        return
    if not wanted:
        findings.note(
            path, f'"{target}" names no unit; it takes "{source}" in {_shown(given)} as it comes.'
        )
        return
    into, out = _unit(wanted), _unit(given)
    if into is None or out is None:
        if wanted != given:
            strange = wanted if into is None else given
            findings.warning(
                path,
                f'"{target}" {_shown(wanted)} is fed by "{source}" {_shown(given)}; the unit '
                f'"{strange}" is not known here, so whether they agree is for you to see.',
            )
        return
    if into.dimension != out.dimension:
        words = "another quantity"
    elif (into.factor, into.offset) != (out.factor, out.offset):
        words = "the same quantity in another unit, and nothing converts it"
    else:
        return
    findings.error(
        path,
        f'"{target}" {_shown(wanted)} is fed by "{source}" {_shown(given)}: {words}. An output '
        f"in {_shown(wanted)} is right.",
    )


def _unit(text: str) -> Unit | None:
    try:
        return parse(text)
    except UnitError:
        return None


def _shown(unit: str | None) -> str:
    return f"[{unit}]"


def _check_inputs(
    parts: Mapping[str, Part], wires: Mapping[str, Wire], claimed: set[str], findings: Findings
) -> None:
    """Report every input that nothing feeds."""
    for part in parts.values():
        if part.description is None:
            continue
        for variable in part.description.of("input"):
            name = f"{part.name}.{variable.name}"
            if variable.optional or name in claimed or variable.name in part.places:
                continue
            unit = f" {_shown(variable.unit)}" if variable.unit else ""
            findings.error(
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
        if output.kind == wanted.kind and (output.unit == wanted.unit or output.unit is None)
    ]
    same_name = [pair for pair in outputs if pair[1].name == wanted.name]
    ends_alike = [pair for pair in outputs if pair[1].name.split("_")[-1] in wanted.name]
    same_unit = [pair for pair in outputs if pair[1].unit is not None]
    for found in (same_name, ends_alike, same_unit):
        if found:
            source, output = found[0]
            return f', e.g. "{part.name}.{wanted.name}" = "{source}.{output.name}",'
    return ""

"""Checks of a component's parameters: names, types, bounds, and the files that they name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..core.config import Document
from ..errors import RecordError
from ..findings import LIST_AT_MOST, number, unknown, written
from ..fmu.description import Value, Variable
from .document import FILE_PARAMETERS
from .library import Library
from .parts import Part
from .signals import check_signal

_INTEGER_RANGE = (-(2**31), 2**31 - 1)
_CHOICES = re.compile(r"\bone of:? ((?:[\w-]+, )*[\w-]+)")


def check_parameter(
    part: Part, name: str, value: object, folder: Path, library: Library, document: Document
) -> None:
    """Check one parameter, and keep its value in `part.parameters` if it is right.

    Parameters
    ----------
    part : Part
        The component; `part.places` knows where the parameter stands.
    name, value : str, object
        Its name, and its value as the file has it.
    folder : Path
        The scenario's; relative names of files begin there.
    library : Library
        Reads ground motions.
    document : Document
        Takes what is found.
    """
    where, place = f"{part.name}.{name}", part.places[name]
    variable = part.variables.get(name)
    if variable is None:
        settable = [v.name for v in part.variables.values() if v.causality == "parameter"]
        words = unknown("parameter", name, settable, part.ports_command)
        document.error(place, f"[components.{part.name}]: {words}")
        return
    if variable.causality not in ("parameter", "input"):
        kind = {"output": "an output", "local": "internal"}.get(
            variable.causality, f"a {variable.causality}"
        )
        document.error(place, f"{where} is {kind}; only parameters and inputs can be set.")
        return
    checked = typed(variable, value)
    if isinstance(checked, Wrong):
        document.error(place, f"{where} {checked.words}")
        return
    part.parameters[name] = checked
    if variable.kind == "String" and name in FILE_PARAMETERS:
        _check_file(part, name, str(checked), folder, library, document)


@dataclass(frozen=True)
class Wrong:
    """Why a value does not fit a variable, in words that follow the variable's name."""

    words: str


def typed(variable: Variable, value: object) -> Value | Wrong:
    """Return a value in the type of a variable, within its bounds, or what is wrong with it."""
    unit = f" {variable.unit}" if variable.unit and variable.unit != "1" else ""
    if variable.kind == "Boolean":
        if isinstance(value, bool):
            return value
        return Wrong(f"is {written(value)}; true or false is right.")
    if variable.kind == "String":
        return _text(variable, value)
    if variable.kind in ("Integer", "Enumeration"):
        if isinstance(value, bool) or not isinstance(value, int):
            return Wrong(f"is {written(value)}; a whole number is right.")
        least, most = _INTEGER_RANGE
        if not least <= value <= most:
            return Wrong(f"is {written(value)}; FMI holds whole numbers from {least} to {most}.")
        if variable.items and value not in variable.items.values():
            return Wrong(f"is {value}, which is no item; {shown_items(variable)} are right.")
        real = float(value)
    else:
        found = number(value)
        if isinstance(found, str):
            return Wrong(f"{found}; a number{f' in{unit}' if unit else ''} is right.")
        real = found
        value = found
    low, high = variable.minimum, variable.maximum
    if low is not None and real < low:
        return Wrong(f"= {real:g}{unit} lies below {low:g}{unit}; {_range(low, high, unit)}.")
    if high is not None and real > high:
        return Wrong(f"= {real:g}{unit} lies above {high:g}{unit}; {_range(low, high, unit)}.")
    return value


def _range(low: float | None, high: float | None, unit: str) -> str:
    if high is None:
        return f"{low:g}{unit} or more is right"
    if low is None:
        return f"{high:g}{unit} or less is right"
    return f"{low:g} to {high:g}{unit} is right"


def shown_items(variable: Variable) -> str:
    """Return the items of an Enumeration as words: `slow = 2, fast = 5`."""
    items = [f"{name} = {value}" for name, value in variable.items.items()]
    more = f" and {len(items) - LIST_AT_MOST} more" if len(items) > LIST_AT_MOST else ""
    return ", ".join(items[:LIST_AT_MOST]) + more


def choices(variable: Variable) -> tuple[str, ...]:
    """Return the texts that a String variable takes, where its description lists them.

    FMI 2.0 has no bounds for texts; bristle's components write "one of a, b, c".
    """
    match = _CHOICES.search(variable.description)
    return tuple(match[1].split(", ")) if match else ()


def _text(variable: Variable, value: object) -> Value | Wrong:
    if not isinstance(value, str):
        return Wrong(f"is {written(value)}; a text in quotes is right.")
    if "\0" in value:
        return Wrong("holds a null character, which no FMU can take.")
    allowed = choices(variable)
    if allowed and value not in allowed:
        return Wrong(f'= "{value}": {unknown(variable.name, value, allowed)}')
    return value


def _check_file(
    part: Part, name: str, value: str, folder: Path, library: Library, document: Document
) -> None:
    """Check a file that a parameter names: a ground motion is read as the run will read it."""
    if part.fmu != "GroundMotion" or name != "record":
        return
    try:
        library.read_record(value, folder)
    except RecordError as error:
        document.error(part.places[name], f"{part.name}.{name}: {error}")


def check_together(part: Part, folder: Path, document: Document) -> None:
    """Check parameters that need one another: switches of effects, kinds of signals."""
    for name in part.parameters:
        switch = f"{name.rpartition('.')[0]}.on"
        if name != switch and switch in part.variables and part.value(switch) is not True:
            document.warning(
                part.places[name],
                f"{part.name}.{name} does nothing while {part.name}.{switch} is false.",
            )
    check_signal(part, folder, document)

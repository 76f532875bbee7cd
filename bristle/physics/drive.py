"""What commands a damper: the voltage of its coil, its current, a duty cycle or a flux density.

Laws and effects are declared for a voltage [V]. With another drive the same numbers are per ampere,
per cent or per tesla: `declared_for` says a parameter so. No value changes by that.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from .parameter import Parameter


class Drive(NamedTuple):
    """A kind of command.

    Attributes
    ----------
    name : str
        Of the channel, and of the damper's input in an FMU.
    unit : str
        In which all of bristle has it, and FMUs as well.
    word : str
        That unit in words, as in "yield force per volt".
    limit : str
        The FMU's parameter for the largest value.
    largest : float
        Its default.
    symbol : str
        In equations.
    """

    name: str
    unit: str
    word: str
    limit: str
    largest: float
    symbol: str


VOLTAGE = Drive("voltage", "V", "volt", "v_max", 8.0, "V")

DRIVES = {
    one.name: one
    for one in (
        VOLTAGE,
        Drive("current", "A", "ampere", "current_max", 8.0, "I"),
        Drive("duty", "%", "per cent of duty", "duty_max", 100.0, "D"),
        Drive("field", "T", "tesla", "field_max", 8.0, "B"),
    )
}
"""All kinds of commands by name; the first is that for which laws are declared."""


def drive_named(name: str) -> Drive:
    """Return a kind of command; without a name that for which laws are declared."""
    return DRIVES[name] if name else VOLTAGE


def unit_for(unit: str, drive: Drive, declared: str = VOLTAGE.unit) -> str:
    """Return a unit of a law or effect as it is with a command: `N/V` is `N/A` with a current.

    Parameters
    ----------
    unit : as it is with a command in the unit `declared`
    drive : the command
    """
    return re.sub(rf"(?<![A-Za-z%]){re.escape(declared)}(?![A-Za-z%])", drive.unit, unit)


def text_for(text: str, drive: Drive) -> str:
    """Return a text of a law or effect as it is with a command: "per ampere", "the current".

    What a text on the voltage calls by the name of the command, as the field behind a coil, is
    another one: that in the damper.
    """
    if drive.name == VOLTAGE.name:
        return text
    if re.search(r"\bvoltage\b", text):
        text = re.sub(rf"\bthe {drive.name}\b", r"\g<0> in the damper", text)
    text = re.sub(r"\bvolts?\b", drive.word, re.sub(r"\bvoltage\b", drive.name, text))
    return re.sub(r"\bV\b", drive.unit, text.replace("Voltage", drive.name.capitalize()))


def states_for(states: Iterable[str], drive: Drive) -> dict[str, str]:
    """Return how an effect's states are called with a command: a held voltage is a held current.

    Where another state has the command's name, as the field behind a coil, it is `held_field`.

    Parameters
    ----------
    states : names as the effect declares them
    drive : the command
    """
    names = list(states)
    taken = drive.name != VOLTAGE.name and drive.name in names
    own = f"held_{drive.name}" if taken else drive.name
    return {name: own if name == VOLTAGE.name else name for name in names}


def declared_for(parameter: Parameter, drive: Drive) -> Parameter:
    """Return a parameter of a law or effect with unit and text for a command."""
    return parameter._replace(
        unit=unit_for(parameter.unit, drive), text=text_for(parameter.text, drive)
    )

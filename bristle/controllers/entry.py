"""A controller as it stands in the scenarios of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .folder import Part

OFF, ON, BEST, LIMIT = "passive off", "passive on", "best constant", "limit"
"""What every comparison has besides the controllers."""
CONSTANT = "ConstantVoltage"


@dataclass(frozen=True)
class Entry:
    """A controller as it stands in the scenarios.

    Attributes
    ----------
    name : str
        In tables.
    part : Part
        Its component.
    wires : mapping
        Its inputs to the columns that feed them.
    output : str
        Its output that commands the damper.
    built_in : bool
        Whether the coupled engine has it.
    period : float or None
        Sample period [s], None of one without a clock.
    about : str
        What it is, a sentence.
    carries : bool
        Whether it has a design, which belongs to one building.
    anew : bool
        Whether that design was made by the comparison.
    """

    name: str
    part: Part
    wires: Mapping[str, str]
    output: str
    built_in: bool
    period: float | None
    about: str
    carries: bool = False
    anew: bool = False


def constant(name: str, level: float, about: str) -> Entry:
    """Return a constant voltage [V] as an entry."""
    part = Part({"fmu": CONSTANT}, {"level": level})
    return Entry(name, part, {}, "voltage", True, None, about)

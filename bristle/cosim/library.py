"""What a check asks of the rest of bristle: components, records, buildings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..fmu.description import Description


@dataclass(frozen=True)
class Library:
    """Where a check looks things up; tests put their own in its place.

    Attributes
    ----------
    names
        () -> names of the built-in components.
    describe
        (name, building file or None, controller file or None, files of effects if any) ->
        Description of a built-in component; raises BristleError where a file is wrong.
    describe_file
        (path) -> Description of an FMU file; raises FmuError.
    read_record
        (record, folder) -> the ground motion; raises RecordError.
    check_controller
        (name, controller file or None, building file or None); raises BristleError where the
        component carries a design for another building.
    driven_mass
        (building file or None) -> mass [kg] that a damper's force acts on; raises PhysicsError.
    """

    names: Callable[[], Sequence[str]]
    describe: Callable[..., Description]
    describe_file: Callable[[Path], Description]
    read_record: Callable[[str, Path], object]
    driven_mass: Callable[[Path | None], float]
    check_controller: Callable[[str, Path | None, Path | None], None]


def installed() -> Library:
    """Return the library of what is installed."""
    from ..fmu import catalogue
    from ..fmu.description import read_description
    from ..records import read_ground_motion

    return Library(
        names=catalogue.component_names,
        describe=catalogue.describe,
        describe_file=read_description,
        read_record=read_ground_motion,
        driven_mass=driven_mass,
        check_controller=catalogue.check_controller,
    )


def driven_mass(building: Path | None) -> float:
    """Return the mass [kg] that a damper's force acts on: the base, or floor 1 of a fixed base."""
    from ..physics.building import paper_building, read_building

    return (read_building(building) if building else paper_building()).M[0][0]

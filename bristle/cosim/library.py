"""What a check asks of the rest of bristle: components, records, buildings."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..control.controller import KINDS, Controller, parse_controller
from ..errors import DesignError, PhysicsError
from ..fmu.description import Description


@dataclass(frozen=True)
class Library:
    """Where a check looks things up; tests put their own in its place.

    Attributes
    ----------
    names
        () -> names of the built-in components.
    describe
        (name, building file or None) -> Description of a built-in component.
    describe_file
        (path) -> Description of an FMU file; raises FmuError.
    read_record
        (record, folder) -> the ground motion; raises RecordError.
    driven_mass
        (building file or None) -> mass [kg] that a damper's force acts on; raises PhysicsError.
    unsuited
        (component, its FMU file or None, building file or None) -> the words for why a designed
        controller is not for that building; "" where it is, or is no designed controller.
    """

    names: Callable[[], Sequence[str]]
    describe: Callable[[str, Path | None], Description]
    describe_file: Callable[[Path], Description]
    read_record: Callable[[str, Path], object]
    driven_mass: Callable[[Path | None], float]
    unsuited: Callable[[str, Path | None, Path | None], str] = lambda name, file, building: ""


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
        unsuited=unsuited,
    )


def driven_mass(building: Path | None) -> float:
    """Return the mass [kg] that a damper's force acts on: the base, or floor 1 of a fixed base."""
    from ..physics.building import paper_building, read_building

    return (read_building(building) if building else paper_building()).M[0][0]


def unsuited(name: str, file: Path | None, building: Path | None) -> str:
    """Return why a designed controller is not for a building, "" where it is."""
    from ..physics.building import paper_building, read_building

    controller = _controller_in(file) if file else _built_in_controller(name)
    if controller is None:
        return ""
    try:
        controller.check_building(read_building(building) if building else paper_building(), name)
    except DesignError as error:
        return str(error)
    except PhysicsError:  # the check of the building itself says so
        return ""
    return ""


def _built_in_controller(name: str) -> Controller | None:
    from ..fmu import catalogue

    found = getattr(catalogue.instantiate(name), "controller", None)
    return found if isinstance(found, Controller) else None


def _controller_in(file: Path) -> Controller | None:
    """Return the controller that an FMU carries; None where it carries none that can be read."""
    try:
        with zipfile.ZipFile(file) as archive:
            for kind in KINDS:
                name = f"resources/{kind}.json"
                if name in archive.namelist():
                    return parse_controller(archive.read(name).decode(), f"{file}: {name}")
    except (OSError, zipfile.BadZipFile, UnicodeDecodeError, DesignError):
        return None  # the FMU's own check says what is wrong with it
    return None

"""The building of a comparison, and where in it the damper acts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..batch.plan import Output
from ..control.controller import Controller
from ..core.config import toml_content
from ..data.building_file import read_building
from ..errors import DesignError, ScenarioError
from ..fmu import catalogue
from ..fmu.controller import MEASURED
from ..physics.building import PAPER, Building, frequencies, paper_building
from ..physics.device import Device, Ports
from .folder import Folder, Part

STRUCTURE, DAMPER, CONTROLLER, GROUND = "structure", "damper", "controller", "ground"
"""The components of every scenario of a comparison."""


@dataclass(frozen=True)
class Site:
    """A building, and the place of the damper that controllers command.

    `data` is the content of its file; `part` the Structure of the scenarios; `file` the
    building's, None for the library's own; `notes` what a reader has to know.
    """

    building: Building
    data: dict[str, Any]
    device: Device
    part: Part
    file: Path | None = None
    notes: tuple[str, ...] = ()

    @property
    def ports(self) -> Ports:
        """The Structure's ports at the damper."""
        return self.building.ports(self.device)

    def check_design(self, controller: Controller, where: str) -> None:
        """Refuse a controller that was designed for another building, or another of its dampers.

        Parameters
        ----------
        controller : as read from its file, or designed
        where : what the message calls it

        Raises
        ------
        DesignError
            Naming both.
        """
        controller.check_building(self.building, where)
        made, n = str(controller.design.get("device", "")), self.building.size
        known = made in ("", *(device.name for device in self.building.devices))
        if known and self.building.device(made).incidence(n) == self.device.incidence(n):
            return
        first = "the damper on the first level"
        raise DesignError(
            f"{where}: was designed for {made or first}, not for {self.device.name or first}; "
            "--device says which damper controllers command."
        )

    @property
    def top(self) -> str:
        """Column of the top level's absolute acceleration."""
        return f"{STRUCTURE}.{self.building.levels()[-1]}_acceleration_absolute"

    @property
    def drifts(self) -> list[str]:
        """Columns of the storeys' drifts, from below."""
        floors = self.building.size - self.building.isolated
        return [f"{STRUCTURE}.drift{i + 1}" for i in range(floors)]

    @property
    def travel(self) -> str:
        """Column of the displacement across the damper."""
        return f"{STRUCTURE}.{self.ports.displacement}"

    @property
    def measured(self) -> dict[str, str]:
        """The column of each of a controller's usual inputs."""
        at = (self.ports.displacement, self.ports.velocity)
        columns = (self.top, *(f"{STRUCTURE}.{port}" for port in at), f"{DAMPER}.force")
        return dict(zip(MEASURED, columns, strict=True))

    @property
    def frequencies(self) -> list[float]:
        """Natural frequencies [Hz], ascending."""
        return frequencies(self.building)

    def shown(self) -> list[str]:
        """Return the names of the Structure's outputs."""
        return [v.name for v in catalogue.describe("Structure", self.file).of("output")]

    def outputs(self, command: str) -> tuple[Output, ...]:
        """Return what is kept of every run: peak and RMS of each quantity.

        Parameters
        ----------
        command : column of what commands the damper
        """
        levels = self.building.levels()
        accelerations = [f"{STRUCTURE}.{name}_acceleration_absolute" for name in reversed(levels)]
        columns = dict.fromkeys(accelerations, "m/s2")
        if self.building.isolated:
            columns[f"{STRUCTURE}.base_displacement"] = "m"
        columns |= dict.fromkeys(self.drifts, "m")
        columns |= {self.travel: "m", f"{DAMPER}.force": "N", command: "V"}
        return tuple(
            Output(column, statistic, unit)
            for column, unit in columns.items()
            for statistic in ("peak", "rms")
        )


def site_from(file: str | Path | None, device: str, folder: Folder) -> Site:
    """Return the building of a file, None for the library's own, with the damper's place.

    Parameters
    ----------
    file : a building file
    device : name of the building's device that controllers command; "" the damper on the first
        level, or the only device that there is
    folder : of the comparison, which keeps the file

    Raises
    ------
    PhysicsError
        If the file is no building, or it has no such device.
    ScenarioError
        If the building has several devices and none is named.
    """
    if file is None:
        part = Part({"fmu": "Structure"}, {})
        return Site(paper_building(), PAPER, paper_building().device(device), part)
    building = read_building(file)
    names = [one.name for one in building.devices]
    if not device and len(names) == 1:
        device = names[0]
    if not device and names:
        raise ScenarioError(
            f"{file}: has the devices {', '.join(names)}; --device says which of them the "
            "controllers command."
        )
    idle = [name for name in names if name != device]
    notes = [f"No damper acts at {name}: its force is 0." for name in idle]
    source = {"fmu": "Structure", "building": folder.keep(Path(file))}
    parameters = {building.device(name).ports.force: 0.0 for name in idle}
    return Site(
        building,
        toml_content(Path(file)),
        building.device(device),
        Part(source, parameters),
        Path(file),
        tuple(notes),
    )

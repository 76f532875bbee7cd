"""What each damper of a coupled system pushes: a device of a structure, whose motion it feels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from ..physics.building import Building
from ..physics.device import GROUND, Device

Port = tuple[str, str]


class Pushed(NamedTuple):
    """What a damper feels and pushes: the device, and the number of its structure.

    `holding` is the slot of the force that would hold it.
    """

    structure: int
    device: Device
    holding: int


def pushed_by(
    damper: str,
    buildings: Mapping[str, Building],
    source_of: Mapping[Port, Port],
    slots: Mapping[Port, int],
) -> Pushed | None:
    """Return what a damper both feels and pushes; None where it is not one and the same.

    Parameters
    ----------
    damper : name of the component
    buildings : those of the structures by the component's name, in their order
    source_of : each connected input to its output
    slots : where the signals are
    """
    name, felt = source_of.get((damper, "velocity"), ("", ""))
    if name not in buildings:
        return None
    building = buildings[name]
    moves = {f"{level}_velocity": (GROUND, i) for i, level in enumerate(building.levels())}
    moves |= {device.ports[2]: device.levels for device in building.devices}
    first = building.device("")
    forces = dict.fromkeys(("damper_force", "extra_force"), (first, "holding_force"))
    forces |= {device.ports[0]: (device, device.ports[3]) for device in building.devices}
    for port, (device, holding) in forces.items():
        pushes = source_of.get((name, port)) == (damper, "force")
        if pushes and device.levels == moves.get(felt):
            return Pushed(list(buildings).index(name), device, slots[name, holding])
    return None


def velocity_per_force(structure: Any, felt: Device, pushed: Device) -> float:
    """Return the velocity of a device's ends per force of another over a substep [m/(N.s)].

    Parameters
    ----------
    structure : its record, see `records.structure_record`
    felt, pushed : the device that moves, and the one that pushes
    """
    n, total = int(structure["n"]), 0.0
    for i, up in zip(felt.levels, (-1.0, 1.0), strict=True):
        for j, along in zip(pushed.levels, (-1.0, 1.0), strict=True):
            if i != GROUND and j != GROUND:
                total += up * along * float(structure["held"][(n + i) * (n + 1) + j])
    return total

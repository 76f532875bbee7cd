"""What each damper of a coupled system pushes: a device of a structure, whose motion it feels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

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
    moves |= {device.ports.velocity: device.levels for device in building.devices}
    first = building.device("")
    forces = dict.fromkeys((building.ports(first).force, "extra_force"), first)
    forces |= {device.ports.force: device for device in building.devices}
    for port, device in forces.items():
        pushes = source_of.get((name, port)) == (damper, "force")
        if pushes and device.levels == moves.get(felt):
            holding = building.ports(device).holding_force
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


def sharing(structure: Any, sticking: Sequence[Device]) -> float:
    """Return by how much dampers that stick together must each hold less than it would alone.

    What one holds moves the others' ends. All correct their forces at once, which is Richardson's
    iteration: it settles soonest at half the sum of its least and largest eigenvalue (Saad 2003,
    Iterative Methods for Sparse Linear Systems, example 4.1). At one place that is their number.

    Parameters
    ----------
    structure : its record
    sticking : what each of its dampers that stick pushes
    """
    if len({device.levels for device in sticking}) < 2:
        return float(max(1, len(sticking)))
    G = np.array([[-velocity_per_force(structure, a, b) for b in sticking] for a in sticking])
    scale = np.sqrt(np.diag(G))
    values = np.linalg.eigvalsh(G / np.outer(scale, scale))
    moving = values[values > 1e-9 * values[-1]]  # forces against each other move nothing
    return max(1.0, 0.5 * float(moving[0] + moving[-1]))

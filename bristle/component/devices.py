"""What devices do to a structure: they act between two levels, or between the ground and one.

A device's displacement and velocity are those of its upper level relative to its lower one, and
its force acts on both, once either way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..physics.device import GROUND
from ..physics.linear import Row
from ..physics.structure import add_force

if TYPE_CHECKING:
    from .structure import Constants

GROUND_ACCELERATION, DAMPER_FORCE, EXTRA_FORCE, DEVICE_FORCES = range(4)
"""Inputs; behind the damper's force and the extra one, both on the first level, those of the
building's own devices."""

PER_LEVEL = 3
"""Outputs of each level: displacement, velocity, absolute acceleration.

The drifts follow, then the holding force, then `PER_DEVICE` outputs of each device.
"""

PER_DEVICE = 3
"""Outputs of each device: displacement and velocity of its ends, holding force."""


def add_devices(before: Row, now: Row, c: Constants, new_state: Row) -> None:
    """Add what the forces of the building's own devices do over a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `structure.start`
    c : Constants
    new_state : state at the end, changed in place
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        f1 = now[DEVICE_FORCES + k]
        f0 = before[DEVICE_FORCES + k] if c.linear else f1
        add_force(c.n, c.held, c.ramp, upper, f0, f1, new_state)
        if lower != GROUND:
            add_force(c.n, c.held, c.ramp, lower, -f0, -f1, new_state)


def forces_between(before: Row, now: Row, share: float, c: Constants, forces: Row) -> None:
    """Fill `forces` with those of all devices on each level within a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `structure.start`
    share : of the step that has passed [1]; counts where forces are linear over it
    c : Constants
    forces : (n,) N, positive against +x
    """
    for i in range(c.n):
        forces[i] = 0.0
    f1 = now[DAMPER_FORCE] + now[EXTRA_FORCE]
    f0 = before[DAMPER_FORCE] + before[EXTRA_FORCE] if c.linear else f1
    forces[0] = f0 + share * (f1 - f0)
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        f1 = now[DEVICE_FORCES + k]
        f0 = before[DEVICE_FORCES + k] if c.linear else f1
        force = f0 + share * (f1 - f0)
        forces[upper] += force
        if lower != GROUND:
            forces[lower] -= force


def devices_at_first_level(inputs: Row, c: Constants) -> float:
    """Return the force of the building's own devices on the first level [N]."""
    total = 0.0
    for k in range(c.devices):
        if c.ends[2 * k + 1] == 0:
            total += inputs[DEVICE_FORCES + k]
        elif c.ends[2 * k] == 0:
            total -= inputs[DEVICE_FORCES + k]
    return total


def show_device_motion(c: Constants, state: Row, outputs: Row, at: int) -> None:
    """Give displacement and velocity of each device.

    Parameters
    ----------
    c : Constants
    state : begins with displacements and velocities of the n levels (2n,) [m, m/s]
    outputs : as in `structure.start`, changed in place
    at : place of the first device's outputs
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        for j in range(2):
            i = upper + j * c.n
            below = state[lower + j * c.n] if lower != GROUND else 0.0
            outputs[at + j] = state[i] - below
        at += PER_DEVICE


def load_upper_levels(inputs: Row, c: Constants, outputs: Row) -> None:
    """Add to the accelerations what devices do on the levels above the first.

    Parameters
    ----------
    inputs : (3 + d,) as in `structure.start`
    c : Constants
    outputs : as in `structure.start`, the absolute accelerations among them changed in place
    """
    n = c.n
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        force = inputs[DEVICE_FORCES + k]
        for i in range(n):
            row, at = i * n, PER_LEVEL * i + 2
            if upper > 0:
                outputs[at] -= c.m_inverse[row + upper] * force
            if lower > 0:
                outputs[at] += c.m_inverse[row + lower] * force


def show_holding_forces(
    inputs: Row, left: float, first: float, c: Constants, free: Row, outputs: Row, at: int
) -> None:  # fmt: skip
    """Give the force at which the ends of each device would not accelerate to each other.

    The other devices' forces stay. So does that of a contact, but for a device between the ground
    and the first level: as the damper, it holds first.

    Parameters
    ----------
    inputs : (3 + d,) as in `structure.start`
    left : what all devices' forces on the first level leave of what would hold it [N]
    first : force on the first level of all but the building's own devices [N]
    c : Constants
    free : (n,) absolute accelerations without any of these forces [m/s2]
    outputs : as in `structure.start`; the holding forces are filled
    at : place of the first device's
    """
    for k in range(c.devices):
        lower, upper = int(c.ends[2 * k]), int(c.ends[2 * k + 1])
        if upper == 0:
            outputs[at] = left + inputs[DEVICE_FORCES + k]
        else:
            apart = free[upper] - gain(GROUND, 0, lower, upper, c) * first
            apart -= free[lower] if lower != GROUND else inputs[GROUND_ACCELERATION]
            for j in range(c.devices):
                if j != k:  # else its own force would count by its rounding
                    each = gain(int(c.ends[2 * j]), int(c.ends[2 * j + 1]), lower, upper, c)
                    apart -= each * inputs[DEVICE_FORCES + j]
            outputs[at] = apart / gain(lower, upper, lower, upper, c)
        at += PER_DEVICE


def gain(lower: int, upper: int, below: int, above: int, c: Constants) -> float:
    """Return what a device's force takes off the acceleration of another's ends [1/kg].

    Parameters
    ----------
    lower, upper : levels that the first device connects
    below, above : levels that the other one connects, or the same
    c : Constants
    """
    total: float = c.m_inverse[above * c.n + upper]
    if lower != GROUND:
        total -= c.m_inverse[above * c.n + lower]
    if below != GROUND:
        total -= c.m_inverse[below * c.n + upper]
        if lower != GROUND:
            total += c.m_inverse[below * c.n + lower]
    return total

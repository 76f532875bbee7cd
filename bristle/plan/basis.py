"""Parts without a form, along a coordinate: what runs must cover for a curve to be learned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..diagnose.learned.along import ALONG
from ..identify.model import Run
from ..identify.structure import StructureRun
from .rig_limits import RESERVE, RigLimits

Array = NDArray[np.float64]

KNOTS = 7
"""Knots of a curve along a coordinate."""

USUAL = ("displacement", "speed", "acceleration", "voltage", "recent_speed")
"""Coordinates that a plan covers where nobody names others."""

FADES = 0.5
"""Time [s] over which a memory of a coordinate fades."""

SHARE = 0.8
"""Largest mean of the speed of late, over the largest speed."""

SIGNED = ("velocity",)
"""Coordinates along which a force has its sign already; along others it may be friction."""


@dataclass(frozen=True)
class Basis:
    """Hat functions along a coordinate, as an added force and as friction.

    `name` of the coordinate, one of `ALONG`; `knots` (k,) of it, in SI; `memory` the parameters of
    its history.
    """

    name: str
    knots: tuple[float, ...]
    memory: tuple[tuple[str, float], ...] = ()

    @property
    def friction(self) -> bool:
        """Whether the part may turn with the velocity."""
        return self.name not in SIGNED

    @property
    def size(self) -> int:
        """The number of columns."""
        return len(self.knots) * (2 if self.friction else 1)

    def history(self, run: Run) -> Array:
        """Return the coordinate (n,) on a run, at the samples that count."""
        along, memory = ALONG[self.name], dict(self.memory)
        if isinstance(run, StructureRun) and run.whole is not None:
            return along.history(run.whole, memory)[run.keep]
        return along.history(run, memory)

    def columns(self, run: Run) -> Array:
        """Return the parts (n, size) on a run, 1 where they are whole."""
        at = self.history(run)
        hats = np.stack([np.interp(at, self.knots, row) for row in np.eye(len(self.knots))], axis=1)
        return np.hstack([hats, hats * np.sign(run.v)[:, None]]) if self.friction else hats


def ranges(limits: RigLimits) -> dict[str, tuple[float, float]]:
    """Return what each coordinate spans within a rig's limits, in SI."""
    stroke, speed = RESERVE * limits.stroke, RESERVE * limits.speed
    quick = 2.0 * np.pi * limits.usable_band[1] * speed
    acceleration = min(quick, RESERVE * limits.acceleration)
    found = {
        "displacement": (-stroke, stroke), "recent_displacement": (-stroke, stroke),
        "travel": (0.0, 2.0 * stroke), "speed": (0.0, speed), "velocity": (-speed, speed),
        "recent_speed": (0.0, SHARE * speed), "acceleration": (-acceleration, acceleration),
        "slowing": (-acceleration, acceleration), "rebuilding": (0.0, 1.0),
        "voltage": limits.command, "recent_voltage": limits.command,
    }  # fmt: skip
    return {name: one for name, one in found.items() if one[1] > one[0]}


def basis_along(name: str, limits: RigLimits) -> Basis:
    """Return the basis along a coordinate of `ranges` over what a rig's limits span."""
    low, high = ranges(limits)[name]
    known = {"tau": FADES, "way": limits.stroke}
    memory = tuple((one, known[one]) for one in ALONG[name].memory)
    return Basis(name, tuple(np.linspace(low, high, KNOTS).tolist()), memory)

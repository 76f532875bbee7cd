"""A plan of a building: ground motions with commands, and sensors that would show more."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..physics.drive import DRIVES
from ..quantity import plain, quantity
from .added_sensors import Added, place_of
from .folder import PlannedRun
from .motions import Waveform
from .outcome import Outcome
from .plan import Plan
from .planned_test import Signals

if TYPE_CHECKING:
    from ..draw.style import Page

Array = NDArray[np.float64]

ONE_FORCE = "distance, if they have exactly the forms of the model"
"""The figure of rivals that add up to one force while the damper's is not measured."""


@dataclass(frozen=True)
class BuildingPlan(Plan):
    """The next tests of a building.

    Attributes
    ----------
    predicted : tuple of (n,) arrays
        The displacement of the first level [m] in each test, simulated with the study's model.
    sensors : tuple of Added
        What sensors that the study lacks would show besides, the most useful one first.
    level : str
        The first level.
    """

    predicted: tuple[Array, ...] = field(default=(), repr=False)
    sensors: tuple[Added, ...] = ()
    level: str = "base"
    rig: ClassVar[str] = "structure"

    def runs(self) -> list[PlannedRun]:
        """Return the runs as a plan's folder holds them."""
        drive = DRIVES.get(self.drive)
        out = []
        for k, (test, one) in enumerate(zip(self.tests, self.signals, strict=True)):
            channels = {"ground_acceleration": one.a}
            about = _words(test.motion, one)
            if drive is not None:
                channels[drive.name] = one.V
                about += f", {test.command.words(drive.name, drive.unit)}"
            moved = quantity(float(np.max(np.abs(self.predicted[k]))), "m")
            about += f"; {place_of(self.level)} moves by {moved}"
            out.append(PlannedRun(self.name(k), self.roles[k], about, one.time, channels))
        return out

    def sentences(self) -> list[str]:
        """Return the plan as an engineer would say it."""
        told = [*super().sentences(), *(one.sentence() for one in self.sensors)]
        if self.worth and not super().worth:
            told.append("Without that sensor these tests show nothing new: add it before them.")
        return told

    @property
    def worth(self) -> bool:
        """Whether the tests would show what the runs at hand do not, with a sensor if need be."""
        return super().worth or any(one.settles for one in self.sensors)

    def _why(self, one: Outcome) -> str:
        if one.what == ONE_FORCE:
            return "they add up to one force while the damper's is not measured; no motion helps."
        return super()._why(one)

    def files(self) -> dict[str, str | bytes]:
        """Return the further files of the plan's folder by name."""
        from .building_picture import building_files

        return building_files(self)

    def _page(self, k: int) -> Page:
        from .building_picture import draw_shaking

        return draw_shaking(self.runs()[k], self.predicted[k], self.drive, self.level)

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {**super().as_dict(), "sensors": [one.as_dict() for one in self.sensors]}


def _words(motion: Waveform, signals: Signals) -> str:
    """Return a ground motion in words, a recorded one with its scale."""
    peak = quantity(float(np.max(np.abs(signals.a))), "m/s2")
    if motion.kind != "record":
        return motion.words(peak)
    factor = float(np.max(np.abs(signals.x)) / np.max(np.abs(motion.record)))
    return f"{motion.name} times {plain(factor, 2)}, {peak}"

"""Where the damper of a study sits: on a bench, on the first level, or between two levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..data.checks.motion import ACROSS, with_motion_across
from ..data.measurement import Measurement
from ..physics.device import GROUND
from .rig import building_of
from .study import Study


@dataclass(frozen=True)
class Place:
    """Where a damper sits.

    `level` is what stands before its displacement and velocity in a run as it is `seen`; `ends` are
    the levels that a device of the building connects, "" for the ground, () for the damper on the
    first level and for a bench; `text` says where, in words; `on_first` whether it is between the
    ground and the first level.
    """

    level: str = ""
    ends: tuple[str, str] | tuple[()] = ()
    text: str = "base"
    on_first: bool = True

    def seen(self, run: Measurement) -> Measurement:
        """Return a run with the motion across the damper."""
        return with_motion_across(run, *self.ends) if self.ends else run


def place_of_damper(study: Study, runs: Sequence[Measurement]) -> Place:
    """Return where the damper of a study's building sits: without devices on the base or floor 1.

    Parameters
    ----------
    study : with a building
    runs : its measurements
    """
    named = bool(study.settings.device)
    building = building_of(study, study.model(to_show=True)) if named else None
    if building is None:
        based = any(name.startswith("base_") for run in runs for name in run.channels)
        return Place("base" if based else "floor1")
    levels, device = building.levels(), building.device(building.studied)
    lower, upper = ("" if i == GROUND else levels[i] for i in device.levels)
    text = f"{device.name} ({device.place(levels)})"
    return Place(ACROSS, (lower, upper), text, device.on_first)

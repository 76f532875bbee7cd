"""The rig of a study: what its settings say was measured, as sites.

Here alone a study's `rig` decides; identification, comparison and diagnosis ask the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..data.building_file import read_building
from ..data.checks.motion import ACROSS, with_motion_across
from ..data.cut_off import without_cut_off
from ..data.measurement import Measurement
from ..identification.rig import Rig, bench_rig, building_rig
from ..model.model import Model
from ..physics.building import GROUND, Building, paper_building, with_damper
from .runs import Runs
from .study import Study


def rig_of(study: Study, model: Model, runs: Runs) -> Rig:
    """Return the rig of a study with its runs; what a channel's range cut off is not judged.

    Raises
    ------
    RecordError
        If a building lacks a channel, or has other levels than were measured.
    """
    building = building_of(study, model)
    marked, notes = without_cut_off(runs.all)
    train, holdout = marked[: len(runs.train)], marked[len(runs.train) :]
    rig = bench_rig(train, holdout) if building is None else building_rig(train, holdout, building)
    return replace(rig, notes=(*rig.notes, *notes))


def building_of(study: Study, model: Model) -> Building | None:
    """Return the building of a study: its file, or the paper's where it names none.

    None where the damper was measured on a test bench. The building knows which of its devices the
    study is about.

    Raises
    ------
    PhysicsError
        If the building has several devices and study.toml names none of them, or its file is wrong.
    """
    if not study.settings.has_building:
        return None
    file = study.folder / model.building
    building = read_building(file) if model.building else paper_building()
    return with_damper(building, study.settings.device)


# Where the damper of a study sits: on a bench, on the first level, or between two levels.


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

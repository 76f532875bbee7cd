"""The rig of a study: what its settings say was measured, as sites.

Here alone a study's `rig` decides; identification, comparison and diagnosis ask the rig.
"""

from __future__ import annotations

from dataclasses import replace

from ..data.building_file import read_building
from ..data.cut_off import without_cut_off
from ..data.model import StudyModel
from ..identify.rig import Rig, bench_rig, building_rig
from ..physics.building import Building, paper_building, with_damper
from .runs import Runs
from .study import Study


def rig_of(study: Study, model: StudyModel, runs: Runs) -> Rig:
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


def building_of(study: Study, model: StudyModel) -> Building | None:
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

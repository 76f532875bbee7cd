"""The rig of a study: what its settings say was measured, as sites.

Here alone a study's `rig` decides; identification, comparison and diagnosis ask the rig.
"""

from __future__ import annotations

from ..data.model import StudyModel
from ..identify.rig import Rig, bench_rig, building_rig
from ..physics.building import Building, paper_building, read_building
from .study import Runs, Study


def rig_of(study: Study, model: StudyModel, runs: Runs) -> Rig:
    """Return the rig of a study with its runs.

    Raises
    ------
    RecordError
        If a building lacks a channel, or has other levels than were measured.
    """
    if study.settings.has_building:
        return building_rig(runs.train, runs.holdout, building_of(study, model))
    return bench_rig(runs.train, runs.holdout)


def building_of(study: Study, model: StudyModel) -> Building:
    """Return the building of a study: its file, or the paper's where it names none."""
    return read_building(study.folder / model.building) if model.building else paper_building()

"""A study's model compared with its runs."""

from __future__ import annotations

from ..compare.comparison import Comparison
from ..compare.rig import RigComparer
from ..data.model import StudyModel
from .identification import as_model
from .rig import rig_of
from .study import Study


def comparer(study: Study, role: str = "holdout") -> RigComparer:
    """Return what compares models with the runs of one role, "holdout" or "train".

    The runs are read and prepared once, so that several models can be compared with them.

    Raises
    ------
    StudyError
        If an effect of the present model acts at no site of the rig.
    RecordError
        If a run cannot be read or lacks a channel that is needed.
    """
    model = study.model()
    return RigComparer(rig_of(study, model, study.runs()), role, as_model(model))


def compare_study(
    study: Study, model: StudyModel | None = None, *, role: str = "holdout"
) -> Comparison:
    """Compare a study's model, the present one by default, with its runs of one role.

    Of a building it tells all sites, and at length the one where the present model fails the most.

    Raises
    ------
    StudyError, RecordError
        As `comparer`, and if nothing tells what error is large.
    """
    return comparer(study, role).compare(as_model(model or study.model()))

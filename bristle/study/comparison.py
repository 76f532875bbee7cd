"""A study's model compared with its runs."""

from __future__ import annotations

from dataclasses import replace

from ..compare.comparison import Comparison
from ..compare.rig import RigComparer
from ..data.model import StudyModel
from ..progress import tell
from .identification import as_model
from .openings import count_opening, opened_text, openings, runs_for_test
from .rig import rig_of
from .run_file import TEST
from .study import Study


def comparer(study: Study, role: str = "holdout") -> RigComparer:
    """Return what compares models with the runs of one role, "holdout", "train" or "test".

    The runs are read and prepared once, so that several models can be compared with them. The study
    counts how often its test runs are opened here.

    Raises
    ------
    StudyError
        If an effect of the present model acts at no site of the rig, or there is no test run; if
        study.toml is another one than the study was opened with.
    RecordError
        If a run cannot be read or lacks a channel that is needed.
    """
    model = study.model()
    study.refuse_if_changed()  # where it was opened before others wrote in it
    runs = study.runs()
    if role == TEST:
        runs = runs_for_test(study, runs)
    tell("holding the model against the runs")
    made = RigComparer(rig_of(study, model, runs), role, as_model(model))
    if role == TEST:  # before anybody can have seen an error
        count_opening(study)
    return made


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
    found = comparer(study, role).compare(as_model(model or study.model()))
    if role != TEST:
        return found
    said = opened_text(len(openings(study)))
    return replace(found, sentences=(*found.sentences, said))

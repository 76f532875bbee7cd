"""What the report of a study tells: everything that is read and computed for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..errors import BristleError
from ..progress import counted, tell
from ..study.run_file import TEST
from ..study.staircase import HistoryStep, history_steps

if TYPE_CHECKING:
    from ..compare.comparison import Comparison
    from ..compare.rig import RigComparer
    from ..data.model import StudyModel
    from ..identify.rig_fit import SiteModel
    from ..study.history import Step
    from ..study.study import Study


@dataclass(frozen=True)
class Content:
    """What a report tells: everything that was read and computed for it.

    `now` is the present model on held-out runs, `before` the model before the last effect that was
    added, `test` the present one on the test runs; None where there is none. `trouble` says why the
    model could not be compared. `what_if` is the section with sliders and `linked` that of
    pictures in which samples can be chosen, "" without; `damper` the damper with what predicts it,
    None where the model could not be compared.
    """

    study: Study
    model: StudyModel
    verdict: dict[str, Any] | None
    steps: tuple[Step, ...]
    history_steps: tuple[HistoryStep, ...]
    now: Comparison | None
    before: Comparison | None
    added: str
    notes: tuple[str, ...]
    trouble: str
    test: Comparison | None = None
    what_if: str = ""
    linked: str = ""
    damper: SiteModel | None = None


def gather(study: Study, *, open_test: bool = True, what_if: bool = False) -> Content:
    """Return what the report of a study tells; it compares the models before and after.

    `open_test` False leaves test runs closed; else the study counts that they were opened.
    `what_if` adds sliders that compute the model in the page, which needs zig.
    """
    from ..data.model import read_model
    from ..study.comparison import compare_study, comparer
    from ..study.identification import as_model
    from .what_if import what_if_section

    moved = what_if_section(study) if what_if else ""  # first: it may lack its compiler
    model, steps = study.model(to_show=True), tuple(study.steps())
    runs = study.runs()
    now = before = test = damper = None
    trouble, added = "", ""
    found = history_steps(steps)
    try:
        study.model()  # raises where the code of an effect waits for consent
        against = comparer(study)
        now, damper = against.compare(as_model(model)), against.damper(as_model(model))
        for step in reversed(steps):
            gone = set(read_model(study.history.model_file(step.number), study.folder).effects)
            if step.number == 0 or not gone <= set(model.effects):
                break
            earlier = read_model(study.history.model_file(step.number - 1), study.folder)
            new = [name for name in model.effects if name not in earlier.effects]
            if new:
                tell("the model before its last effect")
                before, added = against.compare(as_model(earlier)), " and ".join(new)
                break
        found = [_with_error(one, against, study) for one in counted(found, "step")]
        if open_test and study.files(TEST):
            test = compare_study(study, role=TEST)
    except BristleError as error:
        trouble = str(error)
    return Content(
        study, model, study.verdict(), steps, tuple(found), now, before, added, runs.notes, trouble,
        test, moved, damper=damper,
    )  # fmt: skip


def _with_error(step: HistoryStep, against: RigComparer, study: Study) -> HistoryStep:
    """Return a step with its z where the history does not tell it: an edit by hand."""
    import numpy as np

    from ..data.model import read_model
    from ..identify.search import z_scale
    from ..study.identification import as_model

    if step.z is not None or step.number == 0:
        return step  # the model that a study begins with is nobody's guess of this damper
    then = read_model(study.history.model_file(step.number), study.folder)
    runs = against.predictions(as_model(then))
    if not all(one.noise_known for one in runs):
        return step
    return replace(step, z=z_scale(np.concatenate([one.normalised for one in runs])))

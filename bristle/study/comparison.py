"""A study's model as a fit uses it, its runs prepared, and both held against each other."""

from __future__ import annotations

from ..compare.comparison import Comparison, compare
from ..identify.fit import FIXED, Model, Problem
from ..identify.prepare import prepare
from ..physics.effect import EFFECTS
from .errors import StudyError
from .model import STANDARD, StudyModel
from .study import Study


def fit_model(model: StudyModel) -> Model:
    """Return a study's model as `bristle.identify` uses it: values in SI, what is held.

    Raises
    ------
    StudyError
        If an effect is not one of the damper: a bench has no structure and no instruments.
    """
    foreign = [name for name in model.effects if EFFECTS[name].site != "damper"]
    if foreign:
        raise StudyError(
            f"{', '.join(foreign)}: not of the damper, and on a bench there is nothing else. Take "
            "it out of model.toml."
        )
    free = set(model.free())
    values = model.values()
    held = tuple(name for name in values if name not in free and name not in FIXED)
    if model.law in STANDARD:
        values["exponent"] = 0.0
    return Model(model.base_law, tuple(model.effects), values, held)


def problem_of(study: Study, role: str = "holdout", draws: int = 12) -> Problem:
    """Return the runs of one role, "train" or "holdout", prepared for a fit or a comparison.

    Raises
    ------
    StudyError
        If the rig is a structure: its force follows from equilibrium, not from one channel.
    RecordError
        If a run lacks a channel that is needed.
    """
    if study.settings.rig != "bench":
        raise StudyError(f'{study.folder}: rig = "{study.settings.rig}"; this compares a "bench".')
    runs = study.runs()
    return Problem([prepare(run, draws) for run in getattr(runs, role)])


def compare_study(
    study: Study, model: StudyModel | None = None, *, role: str = "holdout"
) -> Comparison:
    """Hold a study's model, the present one by default, against its runs; see `compare`."""
    chosen = fit_model(model or study.model())
    return compare(problem_of(study, role), chosen, seen=role == "train")

"""Two models of a study, without and with an effect: what the effect takes from the error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..compare.errors import run_error
from ..compare.prediction import RunPrediction
from ..data.model import StudyModel, read_model
from ..identify.model import Model
from ..physics.effect import EFFECTS
from ..physics.forms import joined_form
from .comparison import comparer
from .identification import as_model
from .study import Study


@dataclass(frozen=True)
class BeforeAfter:
    """A model without and with effects.

    `step` is the number of the step of the history that added them, None where they are those that
    the present verdict's diagnosis refined, and not added.
    """

    effects: tuple[str, ...]
    before: Model
    after: Model
    step: int | None = None


@dataclass(frozen=True, eq=False)
class TwoPredictions:
    """The same held-out runs at the same site, predicted by the models of a `BeforeAfter`."""

    before: tuple[RunPrediction, ...]
    after: tuple[RunPrediction, ...]

    @property
    def z_before(self) -> float:
        """Error / noise over all runs without the effects."""
        return run_error("all runs", self.before).z

    @property
    def z_after(self) -> float:
        """Error / noise over all runs with them."""
        return run_error("all runs", self.after).z


def before_after(study: Study) -> BeforeAfter | None:
    """Return the effect that the present verdict refined, else the last one that was added.

    None where the verdict has none and no step of the history added one.

    Raises
    ------
    StudyError, TrustError
        If a model of the study cannot be read, or has an effect whose code must not run yet.
    """
    model, verdict = study.model(), study.verdict() or {}
    if any(one not in EFFECTS for one in (verdict.get("refined") or {}).get("effects", ())):
        study.usable_effects()  # one of the user's own, which no model has yet
    return _refined(model, verdict) or _added(study)


def _refined(model: StudyModel, verdict: Mapping[str, Any]) -> BeforeAfter | None:
    """Return the present model, and that which a diagnosis refined; None where there is none."""
    refined = verdict.get("refined") or {}
    effects = tuple(refined.get("effects", ()))
    unknown = any(one not in EFFECTS or one in model.effects for one in effects)
    other_law = verdict.get("laws") and model.law != joined_form(verdict["law"], verdict["command"])
    if not effects or unknown or other_law:
        return None
    before, joined = as_model(model), model
    for one in effects:
        joined = joined.with_effect(one)
    after = as_model(joined)
    known = {name: float(v) for name, v in refined["values"].items() if name in after.values}
    return BeforeAfter(effects, before, replace(after, values={**after.values, **known}))


def _added(study: Study) -> BeforeAfter | None:
    """Return the models on both sides of the last step that added an effect; None without one."""
    numbers = study.history.numbers()
    later: StudyModel | None = None
    for number in reversed(numbers):
        model = read_model(study.history.model_file(number), study.folder)
        model = model.with_drive(study.drive or model.drive)
        new = () if later is None else tuple(n for n in later.effects if n not in model.effects)
        if later is not None and new:
            step = numbers[numbers.index(number) + 1]
            return BeforeAfter(new, as_model(model), as_model(later), step)
        later = model
    return None


def predictions(study: Study, pair: BeforeAfter) -> TwoPredictions:
    """Return the held-out runs predicted by both models, at the site that `bristle compare` shows.

    Raises
    ------
    StudyError, RecordError
        As `comparison.comparer`.
    """
    made = comparer(study)
    return TwoPredictions(tuple(made.predictions(pair.before)), tuple(made.predictions(pair.after)))

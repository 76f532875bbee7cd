"""A model compared with the runs of a rig: at one site at length, at all others in short."""

from __future__ import annotations

from dataclasses import replace

from ..errors import RecordError
from ..identify.model import Model
from ..identify.rig import DAMPER, Rig
from ..identify.rig_fit import SiteModel, SiteModels, site_models
from .comparison import Comparison, compare_predictions
from .prediction import RunPrediction, run_predictions
from .sites import compare_sites, site_errors


class RigComparer:
    """Compares models with the runs of one role, always at the same site.

    The site is that where the present model errs the most; where it errs nowhere, the one where the
    law without any effect does. The runs are prepared once, for all models.

    Parameters
    ----------
    rig : Rig
    role : str
        "holdout" or "train"; "test" where the rig has test runs in place of those held out.
    present : Model
        The model that the site is chosen by.
    seen : bool or None
        Whether models were fitted to these runs, as they are to those of "train"; None where nobody
        knows.

    Raises
    ------
    StudyError, RecordError
        If an effect of the model acts at no site, or a run cannot be held against a model.
    """

    def __init__(self, rig: Rig, role: str, present: Model, *, seen: bool | None = False) -> None:
        self.rig, self.role = rig, role
        self.seen = seen if seen is None else seen or role == "train"
        self._last: tuple[Model, SiteModels] | None = None
        self.site = self._chosen(present)

    def predictions(self, model: Model) -> list[RunPrediction]:
        """Return the runs held against a model at the site."""
        return self._predictions(self._models(model)[self.site])

    def compare(self, model: Model) -> Comparison:
        """Compare a model at the site, and tell how it stands at the others, if there are any."""
        here = self._models(model)[self.site]
        if not here.site.shown:
            return compare_predictions(self._predictions(here), seen=self.seen, role=self.role)
        return compare_sites(self._everywhere(model), self.site, seen=self.seen, role=self.role)

    def damper(self, model: Model) -> SiteModel | None:
        """Return the damper and the part of a model that predicts it; None where it is no site."""
        return self._models(model).get(DAMPER)

    def _models(self, model: Model) -> SiteModels:
        """Return what predicts the runs; that of the last model is kept: lines take long."""
        if self._last is None or self._last[0] != model:
            self._last = model, site_models(self.rig, model)
        return self._last[1]

    def _everywhere(self, model: Model) -> dict[str, list[RunPrediction]]:
        return {name: self._predictions(at) for name, at in self._models(model).items()}

    def _predictions(self, at: SiteModel) -> list[RunPrediction]:
        site, problem = at.site, at.site.problem_of(self.role)
        if problem is None:
            raise RecordError("there is no run to compare with.")
        return [
            replace(one, quantity=site.quantity, unit=site.unit, site=site.shown)
            for one in run_predictions(problem, at.model)
        ]

    def _chosen(self, present: Model) -> str:
        sites = self.rig.sites(present)
        if not next(iter(sites.values())).shown:
            return next(iter(sites))
        worst = site_errors(self._everywhere(present))[0]
        if not worst.fails and present.effects:
            worst = site_errors(self._everywhere(without_effects(present)))[0]
        if not worst.fails and DAMPER in sites:
            return DAMPER  # nothing fails anywhere: it is what a study is about
        return worst.site


def without_effects(model: Model) -> Model:
    """Return the law of a model alone."""

    def own(name: str) -> bool:
        return "." not in name

    return replace(
        model,
        effects=(),
        values={name: value for name, value in model.values.items() if own(name)},
        fixed=tuple(name for name in model.fixed if own(name)),
        limits={name: bounds for name, bounds in model.limits.items() if own(name)},
    )

"""A model held against runs that it has not seen: how wrong, where, and where not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..core.arrays import Array
from ..errors import RecordError
from ..identification.rig import DAMPER, Rig
from ..identification.rig_fit import SiteModel, SiteModels, site_models
from ..model.model import Model
from ..physics.drive import DRIVES
from .conditions import label_errors, regimes
from .misfit import (
    MIN_SAMPLES,
    SiteMisfit,
    interval_of_z,
    refuse,
    run_error,
    total_error,
    with_failures,
    without_z,
)
from .patterns import FLIPS, Finder
from .predictions import RunPrediction, run_predictions
from .result import Comparison
from .spectrum import spectrum
from .words import sentences

FEWER_FLIPS = 299
"""Patterns of signs at a site that is not compared at length: enough for a chance of 1 %."""


def compare_predictions(
    predictions: Sequence[RunPrediction],
    *,
    seen: bool | None = False,
    others: Sequence[SiteMisfit] = (),
    role: str = "",
    every: Sequence[RunPrediction] = (),
) -> Comparison:
    """Compare one output, measured and predicted, whatever predicted it.

    Parameters
    ----------
    predictions : one per run, of the same output at the same site
    seen : whether the model was fitted to these runs; None where that is not known
    others : the errors at the other sites of a building
    role : the role of the runs in a study, if that is known
    every : these and the runs that are too short for z: the error is over all of them

    Raises
    ------
    RecordError
        If there is no run, or one is too short, not finite or without noise.
    """
    finder, normalised, along = _searched(predictions, FLIPS)
    runs = tuple(run_error(one.name, [one]) for one in predictions)
    found = finder.ranked(finder.normalised)
    second = None
    if found and found[0].significant:
        left = finder.without(finder.normalised, found[0])
        raw = finder.without(finder.raw, found[0])
        rest = finder.ranked(left, raw, [found[0].coordinate])
        second = rest[0] if rest and rest[0].significant else None
    comparison = Comparison(
        predictions[0].quantity, predictions[0].unit, runs,
        total_error(predictions, every or predictions), interval_of_z(normalised, finder),
        tuple(found), second, spectrum(predictions),
        tuple(regimes(normalised, along, DRIVES[predictions[0].drive])), tuple(predictions),
        seen=seen, labels=label_errors(predictions), role=role,
    )  # fmt: skip
    if not predictions[0].noise_known:
        comparison = _without_z(comparison)
    if others:
        here = SiteMisfit(
            comparison.site, comparison.quantity, comparison.unit, comparison.runs,
            comparison.total, comparison.z_interval, comparison.first,
        )  # fmt: skip
        comparison = replace(comparison, sites=with_failures([here, *others]))
    return replace(comparison, sentences=sentences(comparison, finder))


def _searched(
    predictions: Sequence[RunPrediction], flips: int
) -> tuple[Finder, list[Array], list[dict[str, Array]]]:
    """Return the search for patterns, the normalised residuals (n,) of runs, their coordinates.

    Of the samples that count.
    """
    refuse(predictions)
    normalised = [one.only_judged(one.normalised) for one in predictions]
    residuals = [one.only_judged(one.residual) for one in predictions]
    along = [one.judged_along() for one in predictions]
    return Finder(normalised, residuals, along, flips), normalised, along


def _without_z(comparison: Comparison) -> Comparison:
    """Return a comparison whose noise is not known: nothing says how much of an error it is."""
    none = float("nan")
    bands = tuple(replace(one, z=none, share=none, p=none) for one in comparison.spectrum.bands)
    patterns = tuple(replace(one, of_excess=none) for one in comparison.patterns)
    return replace(
        comparison, total=without_z(comparison.total), runs=tuple(map(without_z, comparison.runs)),
        z_interval=(none, none), patterns=patterns,
        spectrum=replace(comparison.spectrum, bands=bands),
        regimes=tuple(replace(one, z=none) for one in comparison.regimes),
        labels=tuple(replace(one, z=none) for one in comparison.labels),
    )  # fmt: skip


# A building's model held against its runs at every site: the damper, the layer, each storey.


def compare_sites(
    predictions: Mapping[str, Sequence[RunPrediction]],
    site: str = "",
    *,
    seen: bool | None = False,
    role: str = "",
) -> Comparison:
    """Compare a building's sites: one at length, the worst by default, and how the others stand.

    Parameters
    ----------
    predictions : mapping
        Site to its runs.
    site : str
        The one to compare at length; "" for that of the largest z.
    seen, role
        As `compare_predictions` takes them.

    Raises
    ------
    RecordError
        As `compare_predictions`.
    """
    errors = site_errors(predictions)
    site = site or errors[0].site
    others = [one for one in errors if one.site != site]
    return compare_predictions(
        usable(predictions[site]), seen=seen, others=others, role=role,
        every=predictions[site],
    )  # fmt: skip


def site_errors(
    predictions: Mapping[str, Sequence[RunPrediction]],
) -> tuple[SiteMisfit, ...]:
    """Return how wrong a model is at every site, the worst one first."""
    return with_failures([*map(site_error, predictions.values())])


def usable(predictions: Sequence[RunPrediction]) -> list[RunPrediction]:
    """Return the runs that are long enough; of a base that hardly slides little is left."""
    return [one for one in predictions if len(one.measured) > one.skip + MIN_SAMPLES]


def site_error(predictions: Sequence[RunPrediction]) -> SiteMisfit:
    """Return how wrong a model is at a site, and along what, without the rest of a comparison."""
    first, every, predictions = predictions[0], predictions, usable(predictions)
    total, nothing = total_error(predictions, every), float("nan")
    if not predictions:
        return SiteMisfit(first.site, first.quantity, first.unit, (), total, (nothing,) * 2, None)
    finder, normalised, _ = _searched(predictions, FEWER_FLIPS)
    runs = tuple(run_error(one.name, [one]) for one in predictions)
    found = finder.ranked(finder.normalised)
    pattern = found[0] if found and found[0].significant else None
    interval = interval_of_z(normalised, finder)
    if not first.noise_known:
        total, runs, interval = without_z(total), tuple(map(without_z, runs)), (nothing, nothing)
        pattern = replace(pattern, of_excess=nothing) if pattern else None
    return SiteMisfit(first.site, first.quantity, first.unit, runs, total, interval, pattern)


# A model compared with the runs of a rig: at one site at length, at all others in short.


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
            worst = site_errors(self._everywhere(present.only(())))[0]
        if not worst.fails and DAMPER in sites:
            return DAMPER  # nothing fails anywhere: it is what a study is about
        return worst.site

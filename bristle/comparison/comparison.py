"""A model held against runs that it has not seen: how wrong, where, and where not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..identification.error import ForceError
from ..identification.fit import Fit
from ..identification.problem import Model, Problem
from ..identification.rig import DAMPER, Rig
from ..identification.rig_fit import SiteModel, SiteModels, site_models
from ..physics.drive import DRIVES, Drive
from ..view import Viewable
from .conditions import LabelError, Regime, label_errors, regimes
from .misfit import (
    CLOSE,
    FEWEST,
    RunError,
    SiteError,
    interval_of_z,
    pattern_dict,
    refuse,
    run_dict,
    run_error,
    total_error,
    with_failures,
    without_z,
)
from .patterns import FLIPS as FLIPS_PATTERNS
from .patterns import Finder, ResidualPattern
from .predictions import RunPrediction, run_predictions
from .spectrum import Spectrum, spectrum
from .words import sentences

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Viewable):
    """A prediction held against measured runs; `bristle.compare` returns it, a notebook shows it.

    Attributes
    ----------
    quantity, unit : str
        What is compared: "force", "N".
    runs : tuple of RunError
        The error of each run; `total` over all.
    z_interval : tuple of float
        The 95 % interval of the total z, which is error / noise.
    patterns : tuple of ResidualPattern
        On which coordinate the residual depends, the most telling first; `second` is that of what
        is left after the first, None where chance explains the rest.
    spectrum : Spectrum
        The residual's against the noise's.
    regimes : tuple of Regime
        z in classes of speed and command.
    predictions : tuple of RunPrediction
        The runs themselves, measured and predicted.
    sentences : tuple of str
        What an engineer would say.
    seen : bool or None
        Whether the runs were those of the fit, None where nobody knows.
    role : str
        "test" where the runs are those that neither a fit nor a verdict has seen.
    sites : tuple of SiteError
        The errors of a building's sites, the worst first, of which this is the comparison of one,
        `site`.
    labels : tuple of LabelError
        The error by what is known of whole runs, where that differs between them.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> v = 72e-3 * np.cos(9.0 * t)  # m/s
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> run = {"time": t, "velocity": v, "force": 5.0 * np.sign(v) + 90.0 * v + noise}  # s, m/s, N
    >>> comparison = bristle.compare(run, "bingham_standard")  # at its defaults
    >>> comparison.right, comparison.z > 2.0
    (False, True)
    """

    quantity: str
    unit: str
    runs: tuple[RunError, ...]
    total: RunError
    z_interval: tuple[float, float]
    patterns: tuple[ResidualPattern, ...]
    second: ResidualPattern | None
    spectrum: Spectrum
    regimes: tuple[Regime, ...]
    predictions: tuple[RunPrediction, ...]
    sentences: tuple[str, ...] = ()
    seen: bool | None = False
    sites: tuple[SiteError, ...] = ()
    role: str = ""
    labels: tuple[LabelError, ...] = ()

    @property
    def site(self) -> str:
        """The site of a building that is compared, "" on a bench."""
        return self.predictions[0].site

    @property
    def drive(self) -> Drive:
        """What commands the damper in these runs."""
        return DRIVES[self.predictions[0].drive]

    @property
    def z(self) -> float:
        """RMS(residual)/noise expected of a true model, over all runs."""
        return self.total.z

    @property
    def error(self) -> ForceError:
        """The error over all runs."""
        return self.total.error

    @property
    def noise_known(self) -> bool:
        """Whether z says something: else it is NaN."""
        return self.z == self.z

    @property
    def right(self) -> bool:
        """Whether noise explains the error; of a building's site, with all sites looked at."""
        if not self.noise_known:
            return False
        if self.sites:
            return not next(one.fails for one in self.sites if one.site == self.site)
        return self.z <= CLOSE

    @property
    def first(self) -> ResidualPattern | None:
        """The coordinate that organises the residual most, None where chance explains all."""
        return self.patterns[0] if self.patterns and self.patterns[0].significant else None

    @property
    def worst(self) -> RunPrediction:
        """The run with the largest z."""
        name = max(self.runs, key=lambda run: run.z).name
        return next(one for one in self.predictions if one.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON has it, without the samples."""
        of_building = {"site": self.site, "sites": [one.as_dict() for one in self.sites]}
        return {
            **(of_building if self.sites else {}),
            "quantity": self.quantity,
            "unit": self.unit,
            "held_out": None if self.seen is None else not self.seen,
            "sentences": list(self.sentences),
            "z": self.z,
            "z_interval": list(self.z_interval),
            "total": run_dict(self.total),
            "runs": [run_dict(run) for run in self.runs],
            "places": [pattern_dict(one) for one in self.patterns],
            "second": pattern_dict(self.second) if self.second else None,
            "bands": [asdict(band) for band in self.spectrum.bands],
            "regimes": [one.as_dict() for one in self.regimes],
            **({"labels": [one.as_dict() for one in self.labels]} if self.labels else {}),
        }


def compare(
    problem: Problem, model: Fit | Model, *, draws: int = 12, seen: bool = False, seed: int = 0
) -> Comparison:
    """Hold a damper's model against measured runs.

    Parameters
    ----------
    problem : Problem
        The runs; held-out ones, unless `seen`.
    model : Fit or Model
    draws : int
        How many draws of the inputs' error are carried through the model.
    seen : bool
        Whether the model was fitted to these runs; the sentences then say so.
    seed : int
        Of the random signs of blocks that say what chance would give.

    Returns
    -------
    Comparison
        The same for the same runs and model, whatever else ran before.

    Raises
    ------
    RecordError
        If there is no run, or a residual is not finite.
    """
    chosen = model.model if isinstance(model, Fit) else model
    return compare_predictions(run_predictions(problem, chosen, draws), seen=seen, seed=seed)


def compare_predictions(
    predictions: Sequence[RunPrediction],
    *,
    seen: bool | None = False,
    seed: int = 0,
    flips: int = FLIPS_PATTERNS,
    others: Sequence[SiteError] = (),
    role: str = "",
    every: Sequence[RunPrediction] = (),
) -> Comparison:
    """Compare one output, measured and predicted, whatever predicted it; see `compare`.

    Parameters
    ----------
    predictions : one per run, of the same output at the same site
    seen : whether the model was fitted to these runs; None where that is not known
    seed : of the random signs of blocks
    flips : how many random patterns of signs say what chance would give
    others : the errors at the other sites of a building
    role : the role of the runs in a study, if that is known
    every : these and the runs that are too short for z: the error is over all of them

    Raises
    ------
    RecordError
        If there is no run, or one is too short, not finite or without noise.
    """
    refuse(predictions)
    normalised = [one.only_judged(one.normalised) for one in predictions]
    residuals = [one.only_judged(one.residual) for one in predictions]
    along = [one.judged_along() for one in predictions]
    runs = tuple(run_error(one.name, [one]) for one in predictions)
    finder = Finder(normalised, residuals, along, flips, seed)
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
        comparison = replace(comparison, sites=with_failures([site_of(comparison), *others]))
    return replace(comparison, sentences=sentences(comparison, finder))


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


def site_of(comparison: Comparison) -> SiteError:
    """Return the site that is compared at length as one among the others."""
    return SiteError(
        comparison.site, comparison.quantity, comparison.unit, comparison.runs, comparison.total,
        comparison.z_interval, comparison.first,
    )  # fmt: skip


# A building's model held against its runs at every site: the damper, the layer, each storey.

FLIPS = 299
"""Patterns of signs at a site that is not compared at length: enough for a chance of 1 %."""


def compare_sites(
    predictions: Mapping[str, Sequence[RunPrediction]],
    site: str = "",
    *,
    seen: bool | None = False,
    seed: int = 0,
    role: str = "",
) -> Comparison:
    """Compare a building's sites: one at length, the worst by default, and how the others stand.

    Parameters
    ----------
    predictions : mapping
        Site to its runs.
    site : str
        The one to compare at length; "" for that of the largest z.
    seen, seed, role
        As `compare_predictions` takes them.

    Raises
    ------
    RecordError
        As `compare_predictions`.
    """
    errors = site_errors(predictions, seed)
    site = site or errors[0].site
    others = [one for one in errors if one.site != site]
    able = usable(predictions[site])
    return compare_predictions(
        able, seen=seen, seed=seed, others=others, role=role, every=predictions[site]
    )


def site_errors(
    predictions: Mapping[str, Sequence[RunPrediction]], seed: int = 0
) -> tuple[SiteError, ...]:
    """Return how wrong a model is at every site, the worst one first."""
    return with_failures([site_error(runs, seed) for runs in predictions.values()])


def usable(predictions: Sequence[RunPrediction]) -> list[RunPrediction]:
    """Return the runs that are long enough; of a base that hardly slides little is left."""
    return [one for one in predictions if len(one.measured) > one.skip + FEWEST]


def site_error(predictions: Sequence[RunPrediction], seed: int = 0) -> SiteError:
    """Return how wrong a model is at a site, and along what, without the rest of a comparison."""
    first, every, predictions = predictions[0], predictions, usable(predictions)
    total, nothing = total_error(predictions, every), float("nan")
    if not predictions:
        return SiteError(first.site, first.quantity, first.unit, (), total, (nothing,) * 2, None)
    refuse(predictions)
    runs = tuple(run_error(one.name, [one]) for one in predictions)
    normalised = [one.only_judged(one.normalised) for one in predictions]
    residuals = [one.only_judged(one.residual) for one in predictions]
    along = [one.judged_along() for one in predictions]
    finder = Finder(normalised, residuals, along, FLIPS, seed)
    found = finder.ranked(finder.normalised)
    pattern = found[0] if found and found[0].significant else None
    interval = interval_of_z(normalised, finder)
    if not first.noise_known:
        total, runs, interval = without_z(total), tuple(map(without_z, runs)), (nothing, nothing)
        pattern = replace(pattern, of_excess=nothing) if pattern else None
    return SiteError(first.site, first.quantity, first.unit, runs, total, interval, pattern)


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

"""A building's model held against its runs at every site: the damper, the layer, each storey."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from .comparison import Comparison, compare_predictions
from .errors import (
    FEWEST,
    SiteError,
    interval_of_z,
    refuse,
    run_error,
    total_error,
    with_failures,
    without_z,
)
from .patterns import Finder
from .prediction import RunPrediction

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

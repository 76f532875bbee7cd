"""A building's model held against its runs at every site: the damper, the layer, each storey."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .comparison import Comparison, compare_held
from .errors import (
    FEWEST,
    RunError,
    SiteError,
    interval_of_z,
    judged,
    refuse,
    run_error,
)
from .held import Held
from .where import Finder

FLIPS = 299
"""Patterns of signs at a site that is not compared at length: enough for a chance of 1 %."""


def compare_sites(
    held: Mapping[str, Sequence[Held]],
    site: str = "",
    *,
    seen: bool | None = False,
    seed: int = 0,
) -> Comparison:
    """Compare a building's sites: one at length, the worst by default, and how the others stand.

    Parameters
    ----------
    held : mapping
        Site to its runs.
    site : str
        The one to compare at length; "" for that of the largest z.

    Raises
    ------
    RecordError
        As `compare_held`.
    """
    errors = site_errors(held, seed)
    site = site or errors[0].site
    others = [one for one in errors if one.site != site]
    return compare_held(usable(held[site]), seen=seen, seed=seed, others=others)


def site_errors(held: Mapping[str, Sequence[Held]], seed: int = 0) -> tuple[SiteError, ...]:
    """Return how wrong a model is at every site, the worst one first."""
    return judged([site_error(runs, seed) for runs in held.values()])


def usable(held: Sequence[Held]) -> list[Held]:
    """Return the runs that are long enough; of a base that hardly slides little is left."""
    return [one for one in held if len(one.measured) > one.skip + FEWEST]


def site_error(held: Sequence[Held], seed: int = 0) -> SiteError:
    """Return how wrong a model is at a site, and along what, without the rest of a comparison."""
    first, held, nothing = held[0], usable(held), float("nan")
    if not held:
        total = RunError("all runs", 0, *[nothing] * 7)
        return SiteError(first.site, first.quantity, first.unit, (), total, (nothing,) * 2, None)
    refuse(held)
    runs = tuple(run_error(one.name, [one]) for one in held)
    normalised = [one.normalised for one in held]
    residuals, along = [one.residual for one in held], [one.along() for one in held]
    finder = Finder(normalised, residuals, along, FLIPS, seed)
    found = finder.ranked(finder.normalised)
    place = found[0] if found and found[0].significant else None
    interval = interval_of_z(normalised, finder)
    total = run_error("all runs", held)
    return SiteError(first.site, first.quantity, first.unit, runs, total, interval, place)

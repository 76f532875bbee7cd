"""A building's model held against its runs at every site: the damper, the layer, each storey."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

from .comparison import (
    CLOSE,
    FEWEST,
    Comparison,
    RunError,
    compare_held,
    interval_of_z,
    place_dict,
    refuse,
    run_dict,
    run_error,
)
from .held import Held
from .where import LEVEL, Finder, Place

FLIPS = 299
"""Patterns of signs at a site that is not compared at length: enough for a chance of 1 %."""


@dataclass(frozen=True)
class SiteError:
    """How wrong a model is at one site of a building.

    `site` is "damper", "layer", "storey1" ...; `quantity`, `unit` what is compared there; `runs`
    the error of each run, `total` over all; `z_interval` the 95 % interval of the total z; `place`
    the coordinate that organises the error most, None where chance explains all. `fails`: the
    error is more than noise, and chance is no fair explanation of that, all sites together.
    """

    site: str
    quantity: str
    unit: str
    runs: tuple[RunError, ...]
    total: RunError
    z_interval: tuple[float, float]
    place: Place | None
    fails: bool = False

    @property
    def z(self) -> float:
        """RMS(residual)/noise expected of a true model, over all runs; NaN without a sample."""
        return self.total.z

    @property
    def told(self) -> bool:
        """Whether there are samples to tell it by: a base that hardly slides leaves too few."""
        return self.z == self.z

    def as_dict(self) -> dict[str, Any]:
        """Return the error as JSON has it."""
        return {
            "site": self.site,
            "quantity": self.quantity,
            "unit": self.unit,
            "z": self.z,
            "z_interval": list(self.z_interval),
            "fails": self.fails,
            "total": run_dict(self.total),
            "runs": [run_dict(run) for run in self.runs],
            "place": place_dict(self.place) if self.place else None,
        }


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


def judged(sites: Iterable[SiteError]) -> tuple[SiteError, ...]:
    """Return sites of which it is known which ones fail, those first, then by z.

    Of twenty storeys one has a large z by chance: a site fails if the chance of its z is small for
    the largest of all of them (Bonferroni), by the scatter that its interval states.
    """
    sites = list(sites)
    far = NormalDist().inv_cdf(1.0 - LEVEL / max(len(sites), 1)) / 1.96

    def fails(one: SiteError) -> bool:
        high = one.z_interval[1]
        return one.z > CLOSE and one.z**2 - far * (high**2 - one.z**2) > 1.0

    found = [replace(one, fails=fails(one)) for one in sites]
    return tuple(sorted(found, key=lambda one: (not one.fails, -one.z if one.told else 0.0)))


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


def site_of(comparison: Comparison) -> SiteError:
    """Return the site that is compared at length as one among the others."""
    return SiteError(
        comparison.site, comparison.quantity, comparison.unit, comparison.runs, comparison.total,
        comparison.z_interval, comparison.first,
    )  # fmt: skip

"""Single cycles of a motion: their loops can be read where those of a whole run are a tangle."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array, Indices

DEAD = 0.05
"""Speed over its RMS below which a motion keeps its direction: noise about rest is no reversal."""
STEADY = 0.1
"""Range of a level within a cycle, over its range in all of them, up to which it counts as held."""
_UNSTEADY = 0.1
"""What the travel of a cycle counts whose level is not held."""


class Cycle(NamedTuple):
    """A motion out and back: samples `begin` to `end` of a run, its level, and its travel.

    `run` numbers the runs; `level` is the median over the cycle, `spread` the range of its middle
    90 %, `travel` how far the motion reaches from end to end, in its unit.
    """

    run: int
    begin: int
    end: int
    level: float
    spread: float
    travel: float

    @property
    def part(self) -> slice:
        """The samples, the last one included."""
        return slice(self.begin, self.end + 1)


def cycles(runs: Sequence[tuple[Array, Array, Array]], skip: int = 0) -> list[Cycle]:
    """Return the cycles of motions: each from one turn to the next turn of the same kind.

    Parameters
    ----------
    runs : per run displacement (n,), velocity (n,) and level (n,), evenly spaced in time
    skip : samples at the start of each run that do not count
    """
    found = []
    for number, (x, v, level) in enumerate(runs):
        turns = [int(k) for k in _turns(v) if k >= skip]
        for begin, end in pairwise(turns):
            own = level[begin : end + 1]
            low, middle, high = (float(q) for q in np.quantile(own, [0.05, 0.5, 0.95]))
            travel = float(np.ptp(x[begin : end + 1]))
            found.append(Cycle(number, begin, end, middle, high - low, travel))
    return found


def by_level(found: Sequence[Cycle], most: int = 4) -> list[Cycle]:
    """Return at most one cycle in each of `most` equal ranges of the level, from below.

    The one of the largest travel among those at a level that is held, so far as there are any.
    Where all cycles share one level it is a single one.
    """
    if not found:
        return []
    low, range_of_all = _range(found)
    chosen: dict[int, tuple[float, Cycle]] = {}
    for one in found:
        place = int(most * (one.level - low) / range_of_all) if range_of_all > 0.0 else 0
        worth = one.travel * (1.0 if steady(one, found) else _UNSTEADY)
        place = min(place, most - 1)
        if place not in chosen or worth > chosen[place][0]:
            chosen[place] = worth, one
    most_travel = max(one.travel for _, one in chosen.values())
    told = [chosen[place][1] for place in sorted(chosen)]
    return [one for one in told if one.travel >= 0.1 * most_travel]


def largest(x: Array, v: Array) -> slice | None:
    """Return the samples of the cycle of the largest travel; None where there is none.

    Parameters
    ----------
    x, v : displacement and velocity (n,), evenly spaced in time
    """
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        return None
    found = cycles([(x, v, np.zeros(len(x)))])
    return max(found, key=lambda one: one.travel).part if found else None


def steady(one: Cycle, found: Sequence[Cycle]) -> bool:
    """Return whether the level of a cycle is held, as compared with all that were found."""
    range_of_all = _range(found)[1]
    return range_of_all == 0.0 or one.spread <= STEADY * range_of_all


def _range(found: Sequence[Cycle]) -> tuple[float, float]:
    """Return the lowest level of cycles and the range of all."""
    levels = [one.level for one in found]
    return min(levels), max(levels) - min(levels)


def _turns(v: Array) -> Indices:
    """Return the samples (k,) from which on a velocity (n,) is positive again."""
    size = float(np.sqrt(np.mean(v**2)))
    side = np.where(v > DEAD * size, 1, np.where(v < -DEAD * size, -1, 0))
    known = np.maximum.accumulate(np.where(side != 0, np.arange(len(v)), 0))
    kept = side[known]
    return np.flatnonzero((kept[1:] > 0) & (kept[:-1] < 0)) + 1

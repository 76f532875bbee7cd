"""The largest size of an effect that runs still allow, where the likelihood has fallen enough."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ..identify.search import HUBER, losses
from ..physics.effect import EFFECTS
from .effect_size import Known, Sized
from .resolved_size import LARGEST

Array = NDArray[np.float64]

TURNS = 4
"""Sizes that are tried between two that a limit lies between."""

ALIKE = 0.1
"""Relative change of a size below which it is found."""

ONE_SIDED, TWO_SIDED = 1.645, 1.96
"""Standard deviations of a 95 % limit."""

STEP = 2.0
"""Factor by which a size is raised until it is beyond what is sought."""

NEARLY = 0.1
"""By how much a likelihood may differ, of its fall, from that of a change in proportion."""

AHEAD, RISES = 6, 2
"""Sizes beyond the first one that are looked at where that one is excluded already, at most; rises
of the likelihood in succession after which it will not fall again."""

BESIDE = (-0.1, -0.05, 0.0, 0.05, 0.1)
"""Sizes beside one, over it, from which the roughness of a likelihood is taken."""


def largest_allowed(sized: Sized, least: float) -> float:
    """Return the largest size that the runs allow at 95 %: the profile of the likelihood over it.

    Parameters
    ----------
    sized : the effect
    least : where it is looked at first, resolved
    """
    apart = (TWO_SIDED if sized.signed else ONE_SIDED) ** 2
    return max(
        _end(sized, least, sign, apart) for sign in ((1.0, -1.0) if sized.signed else (1.0,))
    )


def _end(sized: Sized, least: float, sign: float, apart: float) -> float:
    """Return the size at which a likelihood has fallen so far below its best.

    Parameters
    ----------
    sized, least : the effect, and the size at which it is looked at first
    sign : of the effect
    apart : twice the fall of the logarithm of the likelihood
    """
    known, lowest = sized.known, 0.0

    def above(size: float) -> float:
        """Return twice the logarithm of the likelihood, over `apart`, with its sign turned."""
        change = known.beyond(sized.change(sign * size))
        length = float(np.linalg.norm(change))
        if length == 0.0:
            return 0.0
        rise = 2.0 * (float(np.sum(losses(known.refitted(known.plain + change)))) - known.lowest)
        return rise / (apart * known.scatter(change / length) ** 2)

    first = known.beyond(sized.change(sign * least))
    if not first.any() and not sized.change(sign).any():
        return 0.0  # it has one sign alone
    straight, lowest_there = _if_linear(known, first / least, apart)
    if least < straight < LARGEST and abs(above(straight) - lowest_there - 1.0) <= NEARLY:
        return straight
    size = low = best = least
    found = above(least)
    if found >= 1.0:
        ahead = _falls_again(above, least, found)
        if ahead is None:
            return least
        size, found = ahead
    unsure: float | None = None if EFFECTS[sized.name].joint else 0.0
    while True:
        while found < lowest + 1.0 + (unsure or 0.0):
            if size >= LARGEST:
                return LARGEST
            if found < lowest:
                lowest, best = found, size
            low, size = size, min(STEP * size, LARGEST)
            found = above(size)
        if unsure is not None:
            break
        unsure = _roughness(above, best)
    return crossing(lambda at: above(at) - lowest - 1.0 - unsure, low, size)


def _falls_again(
    likelihood: Callable[[float], float], size: float, found: float
) -> tuple[float, float] | None:
    """Return where a rough likelihood falls below that of none, and its value there; None: nowhere.

    Parameters
    ----------
    likelihood : with its sign turned, 0 of none
    size, found : where it is above that, and what it is there
    """
    rises = 0
    for _ in range(AHEAD):
        size, before = STEP * size, found
        found = likelihood(size)
        if found < 0.0:
            return size, found
        rises = rises + 1 if found > before else 0
        if rises == RISES:
            break
    return None


def _roughness(likelihood: Callable[[float], float], size: float) -> float:
    """Return what chance does to a likelihood near a size: twice its scatter about a parabola.

    Which impacts of a joint come a sample later is chance, and moves the likelihood by more than
    the noise does.
    """
    shares = np.array(BESIDE)
    found = [likelihood(size * (1.0 + share)) for share in shares]
    left = found - np.polyval(np.polyfit(shares, found, 2), shares)
    return 2.0 * sqrt(float(left @ left) / (len(shares) - 3))


def _if_linear(known: Known, slope: Array, apart: float) -> tuple[float, float]:
    """Return where a likelihood ends, and its best, if the change is in proportion to the size.

    Parameters
    ----------
    known : the runs
    slope : (n,) change per size
    apart : twice the fall of the logarithm of the likelihood, the unit of what is returned
    """
    near = slope[np.abs(known.plain) <= HUBER]  # beyond, the robust loss is straight
    sharp, size = float(near @ near), float(np.linalg.norm(slope))
    if sharp == 0.0:
        return LARGEST, 0.0
    unit = apart * known.scatter(slope / size) ** 2
    push = float(slope @ known.left)
    lowest = -(push**2) / sharp if push < 0.0 else 0.0
    return (-push + sqrt(push**2 + sharp * (lowest + unit))) / sharp, lowest / unit


def crossing(rising: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function between two sizes is zero: regula falsi (Illinois) in logarithms."""
    at_low, at_high = rising(low), rising(high)
    for _ in range(TURNS):
        share = -at_low / (at_high - at_low) if at_high > at_low else 0.5
        size = low * (high / low) ** min(max(share, 0.05), 0.95)
        at = rising(size)
        if at < 0.0:
            low, at_low, at_high = size, at, 0.5 * at_high
        else:
            high, at_high, at_low = size, at, 0.5 * at_low
        if high / low <= 1.0 + ALIKE:
            break
    return high

"""From what size on a verdict names an effect 9 times of 10."""

from __future__ import annotations

from math import sqrt

import numpy as np

from .allowed_size import ALIKE, STEP, crossing
from .effect_size import Sized
from .resolved_size import LARGEST, SMALLEST
from .rule import BENCH, DecisionRule

UNSHOWN = 0.05
"""What the runs that decide show of an effect at the least, over those that are fitted to."""

NINE_OF_TEN = 1.282
"""Standard deviations above the mean that 9 of 10 stay below."""

MARGIN = 1.08
"""Factor on the distance from which an effect is named: z is robust, so that large residuals count
less than their squares, and other effects absorb a part. `python -m benchmarks limits --named`
counts what comes of it."""

STRAIGHT = 2
"""How often a size is sought in proportion to its change."""


def named_distance(samples: int, held_out: int, rule: DecisionRule = BENCH) -> float:
    """Return the distance, in standard deviations, from which 9 of 10 verdicts name an effect.

    A verdict asks that z on held-out runs falls by `rule.gain`, which scatters with the noise.

    Parameters
    ----------
    samples : over which the distance is taken
    held_out : samples that decide
    rule : the numbers that decide
    """
    asked = held_out * ((1.0 + rule.gain) ** 2 - 1.0)
    whole = NINE_OF_TEN + sqrt(NINE_OF_TEN**2 + asked)
    return MARGIN * whole * sqrt(samples / held_out)


def named_size(sized: Sized, least: float) -> tuple[float | None, float | None]:
    """Return the value and the share of the force from which 9 of 10 verdicts name an effect.

    Both are None where that is beyond the parameter's bounds.

    Parameters
    ----------
    sized : the effect
    least : the size that the runs still allow
    """
    known = sized.known
    wanted = named_distance(len(known.plain), known.held_out, known.rule)
    size = _distant(sized, least, wanted)
    if size is not None and known.judging is not None:
        wanted /= max(_shown_there(sized, size), UNSHOWN)
        size = _distant(sized, size, wanted)
    if size is not None and size <= least:
        # Where the model errs, the runs allow sizes that they would name beside a true one.
        size = None if sized.ended(least) else least
        wanted = float(np.linalg.norm(known.beyond(sized.change(least))))
    return (None, None) if size is None else (sized.value(size), wanted / known.size)


def _shown_there(sized: Sized, size: float) -> float:
    """Return what a sample that decides shows of an effect, over one that is fitted to."""
    there = sized.change_there(size)
    here = sized.known.beyond(sized.change(size))
    return float(np.linalg.norm(there) / np.linalg.norm(here) * sqrt(len(here) / len(there)))


def _distant(sized: Sized, least: float, wanted: float) -> float | None:
    """Return the size at which an effect is so many standard deviations from none.

    None beyond the parameter's bounds; `least` is the size that is looked at first.
    """
    known, size = sized.known, least

    def beyond(size: float) -> float:
        return float(np.linalg.norm(known.beyond(sized.change(size)))) / wanted - 1.0

    for _ in range(STRAIGHT):  # in proportion, as a rule
        size = float(np.clip(size / (1.0 + beyond(size)), SMALLEST, LARGEST))
        off = beyond(size)
        if not sized.ended(size) and abs(off) <= ALIKE:
            return size / (1.0 + off)
    low = size = least
    while beyond(size) < 0.0:
        if sized.ended(size) or size >= LARGEST:
            return None
        low, size = size, STEP * size
    size = crossing(beyond, low, size) if low < size else size
    return None if sized.ended(size) else size

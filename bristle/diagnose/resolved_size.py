"""From what size on what an effect changes is its own, not that of the integration's steps."""

from __future__ import annotations

import numpy as np

from ..identify.search import HUBER
from ..physics.effect import EFFECTS
from .effect_size import Sized

SMALLEST, LARGEST = 1e-4, 1e3
"""Sizes between which an effect is looked at, over that of a first guess."""

GROWS = 1.1
"""By what factor a change must grow with twice the size to be the effect's own."""

ROUGHEST, RIGID = 1e-2, 0.1
"""Size below which the impacts of a joint are those of the integration, over a first guess; share
of it at which the joint counts as rigid."""

STANDS_OUT = 1.5
"""How large a joint's change must be, over that of a rigid one."""


def resolved(sized: Sized, size: float) -> float:
    """Return a size, raised to where the effect's change is its own.

    Below that the steps of the integration decide: a lag of less than half a sample, where the
    change no longer falls with the size; a joint that is nearly rigid, whose impacts and stops are
    those of the integration, so that the change must stand out of that of a joint still stiffer.
    An impact that comes a sample later is a spike of any height: each sample counts so far as the
    robust loss is quadratic.
    """
    known = sized.known

    def beyond(size: float) -> float:
        change = known.beyond(sized.change(size))
        return float(np.linalg.norm(np.clip(change, -HUBER, HUBER) if rough else change))

    rough = bool(EFFECTS[sized.name].joint)
    size = float(np.clip(size, ROUGHEST if rough else SMALLEST, 1.0))
    floor = STANDS_OUT * beyond(RIGID * ROUGHEST) if rough else GROWS * beyond(0.5 * size)
    while size < 1.0:
        whole = beyond(size)
        if whole >= floor:
            break
        size, floor = 2.0 * size, floor if rough else GROWS * whole
    return size

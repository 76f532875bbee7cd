"""Which mode of what holds the load cell promises to explain a residual."""

from __future__ import annotations

from itertools import product

import numpy as np

from .curve import Curve
from .normal import Normal
from .promise import Promise
from .ring import RING, frequencies, ringing

DAMPINGS = (0.01, 0.03, 0.1)
"""Damping ratios at which the scan looks."""

STEPS = (1.06, 1.02, 1.005)
"""Factors by which the frequency is changed afterwards, one after the other."""

WIDER = (0.6, 1.0, 1.6)
"""Factors by which the damping ratio is changed with it."""


def best_mode(known: Normal) -> Promise | None:
    """Return the mode of what holds the load cell that promises most; None where none does."""
    residual = known.residual
    if not residual.shown:
        return None
    nodes = product(
        map(float, frequencies(residual.coarsest_step, residual.shortest_length)), DAMPINGS
    )
    found = [one for one in (_rings_at(known, *node) for node in nodes) if one is not None]
    if not found:
        return None
    best = min(found, key=lambda one: one.loss)
    for step in STEPS:
        for factor, damping in product((1.0 / step, 1.0, step), WIDER):
            at = dict(best.curve.memory)
            tried = _rings_at(known, at["frequency"] * factor, at["damping"] * damping)
            if tried is not None and tried.loss < best.loss:
                best = tried
    return best


def _rings_at(known: Normal, frequency: float, damping: float) -> Promise | None:
    """Return a mode with the share that fits best; None where that is none."""
    residual = known.residual
    column = np.concatenate(
        [
            ringing(force, run.dt, frequency, damping)[keep]
            for force, run, keep in zip(residual.shown, residual.runs, residual.keeps, strict=True)
        ]
    )
    normal = known.with_columns((column / residual.sigma)[:, None])
    none = np.zeros_like(normal.grams[0])
    gram, side = normal.grams.sum(axis=0) + normal.ridge(), normal.sides.sum(axis=0)
    share = float(np.linalg.solve(gram, side)[-1])
    if not 0.0 < share < 1.0:
        return None
    memory = (("frequency", frequency), ("damping", damping))
    curve = Curve(RING, RING, memory, (0.0,), (share,), drive=residual.drive)
    return Promise(curve, normal.left_out(none))

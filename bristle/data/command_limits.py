"""A command as it reaches the coil: limited in slew or in range behind the point of its record.

A supply or an amplifier gives no more than its limit, and changes it no faster than it can. What
was recorded before it is the command, and not what the damper felt.
"""

from __future__ import annotations

from math import copysign

import numpy as np
from numpy.typing import NDArray

from .table import Array

LIMITS = ("range", "slew")
"""Faults of a command that `limited` knows, in the order in which they are put on it."""

JUMP = 8.0
"""How many times the changes beside it a change of a command exceeds that is a jump."""


def jumps(V: Array) -> NDArray[np.bool_]:
    """Return at which samples of a command (n,) it jumps: it was held until then."""
    change = np.abs(np.diff(V, prepend=V[:1]))
    beside = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    found: NDArray[np.bool_] = change > JUMP * beside
    return found


def limited(V: Array, step: float, fault: str, value: float) -> Array:
    """Return a command (n,) as it reaches the coil.

    Parameters
    ----------
    V : (n,) the command, in its unit
    step : sampling step [s]
    fault : "range", no more than `value` on either side of zero; "slew", no faster than `value`
        per second
    value : the limit, in the command's unit, or in that per second
    """
    if fault == "range":
        return np.clip(V, -value, value)
    return _slowed(V, value * step)


def _slowed(V: Array, most: float) -> Array:
    """Return a command (n,) that changes by so much per sample at the most.

    A jump falls on a sample: until then the command was held, so that a ramp begins there.
    """
    if not np.any(np.abs(np.diff(V)) > most):
        return V
    held = np.append(V[:1], V[:-1])
    target = np.where(jumps(V), held, V)
    out = target.copy()
    count, done = len(V), 0
    for first in (1 + np.flatnonzero(np.abs(np.diff(target)) > most)).tolist():
        k = max(first, done)
        y = float(out[k - 1])
        while k < count and abs(gap := float(target[k]) - y) > most:
            y += copysign(most, gap)
            out[k] = y
            k += 1
        done = max(done, k)
    return out

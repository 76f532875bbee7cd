"""Parallel elastic-slip elements: springs, each with a slider that gives way beyond a travel.

Iwan (1966), J. Appl. Mech. 33(4), 893-900; the same are called Maxwell-slip elements, and their
forces are the weights of a Prandtl-Ishlinskii operator: play and breakaway after a reversal.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...identify.fit import Run
from .along import Along

Array = NDArray[np.float64]

SLIP = "slip"
"""Name of the part of the model that these elements are, and of what their forces depend on."""

SHARES = tuple(0.02 * 1.5**k for k in range(12))
"""Travels at which the elements give way, in RMS displacements."""


def slips(run: Run, travels: Array) -> Array:
    """Return the states (n, k) of elements of some travels (k,) [m]: -1 to 1, where they slip."""
    steps = np.diff(run.x, prepend=run.x[:1])
    out, now = np.empty((len(steps), len(travels))), np.zeros(len(travels))
    ways = steps[:, None] / travels
    for k in range(len(steps)):
        now = np.minimum(np.maximum(now + ways[k], -1.0), 1.0)
        out[k] = now
    return out


def signal_of(travels: Sequence[float]) -> Along:
    """Return what elements of some travels [m] need in a hook; `history` gives their states (n, k).

    Parameters
    ----------
    travels : at which they give way, ascending
    """
    names = [f"slip_{k}" for k, _ in enumerate(travels, 1)]
    moved = [
        f"    {name} = min(max(z.{name} + q.v * q.dt / KNOTS[{k}], -1.0), 1.0)"
        for k, name in enumerate(names)
    ]
    return Along(
        SLIP, "m", "the travel at which each gives way", ("v", "dt"), "",
        lambda run, _: slips(run, np.array(travels)),
        tuple((name, "1") for name in names), (),
        "\n".join([*moved, f"    return ({', '.join(names)},)"]),
    )  # fmt: skip


def force_source(count: int) -> str:
    """Return the force of a number of elements as a hook computes it."""
    return " + ".join(f"p.curve[{k}] * z.slip_{k + 1}" for k in range(count))

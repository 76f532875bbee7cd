"""A mode of what holds the load cell: the force that it shows rings.

    shown = F + share (r - F),   r'' + 2 damping w r' + w^2 r = w^2 F,   w = 2 pi frequency

Meirovitch (2001), Fundamentals of Vibrations, ch. 3: a mass on a spring and a dashpot. Steps are
those of the trapezoidal rule, here and in the effect's file, so that both are the same mode.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter, lfilter_zi

from .along import Along

Array = NDArray[np.float64]

RING = "resonance"
"""Name of the part of the model that this mode is, and of what its share depends on."""

ADVANCE = """    w = 6.283185307179586 * p.frequency
    half = 0.5 * q.dt
    loss, stiff = 2.0 * p.damping * w * half, (w * half) ** 2
    push = half * w * w * (z.last + q.value - 2.0 * z.ring)
    rate = (z.rate * (1.0 - loss - stiff) + push) / (1.0 + loss + stiff)
    return z.ring + half * (z.rate + rate), rate, q.value"""

SIGNAL = Along(  # it follows the force, which is no signal of the motion: `modes` scans it
    RING, "1", "a mode of what holds the load cell", ("value", "dt"), "",
    lambda run, _: np.zeros(len(run.force)),
    (("ring", "N"), ("rate", "N/s"), ("last", "N")), (("ring", "value"), ("last", "value")),
    ADVANCE, ("frequency", "damping"),
)  # fmt: skip


def frequencies(dt: float, length: float) -> Array:
    """Return the frequencies (k,) [Hz] at which the scan looks.

    Parameters
    ----------
    dt, length : step and length of the runs [s]
    """
    low, high = 5.0 / length, 0.2 / dt
    count = max(2, 1 + int(np.ceil(np.log(high / low) / np.log(1.08))))
    return np.geomspace(low, high, count) if high > low else np.array([])


@lru_cache(maxsize=8)
def _filter(dt: float, frequency: float, damping: float) -> tuple[Array, Array]:
    w = 2.0 * np.pi * frequency
    b, a = bilinear([w * w], [1.0, 2.0 * damping * w, w * w], 1.0 / dt)
    return np.asarray(b), np.asarray(a)


def ringing(force: Array, dt: float, frequency: float, damping: float) -> Array:
    """Return r - F (n,) [N], at rest at the first sample.

    Parameters
    ----------
    force : F (n,) [N]
    dt : step [s]
    frequency, damping : Hz and ratio
    """
    b, a = _filter(dt, frequency, damping)
    shown, _ = lfilter(b, a, force, zi=lfilter_zi(b, a) * force[0])
    return np.asarray(shown - force)


def response(share: float, frequency: float, damping: float, at: Array) -> Array:
    """Return shown over true force (n,), the amplitude.

    Parameters
    ----------
    share, frequency, damping : of the mode: 1, Hz, 1
    at : frequencies (n,) [Hz]
    """
    s = 1j * at / frequency
    mode = 1.0 / (1.0 + 2.0 * damping * s + s * s)
    return np.asarray(np.abs(1.0 + share * (mode - 1.0)))

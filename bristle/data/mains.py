"""Where the mains and their harmonics show in a record, those beyond half its rate included."""

from __future__ import annotations

from collections.abc import Sequence

MAINS = (50.0, 60.0)
"""Frequencies of the mains [Hz]."""

MAINS_OFF = 2e-3  # share by which the mains may be off
_GRID_OFF = 4e-4  # what a grid keeps to: of the ripple of rectifiers, aliased, or chance names it
_LOW = 5  # the highest harmonic that is no such ripple
_BEYOND = (1, 2, 3, 4, 5, 6, 12)
"""Harmonics of the mains that are looked for beyond half the sampling rate.

The sixth and the twelfth are the ripple of rectifiers on three phases (6 and 12 pulses a period):
that of the amplifiers which drive rig and coil.
"""


def mains_lines(step: float) -> list[float]:
    """Return where the harmonics of the mains show at a sampling step [s], in Hz."""
    return [_folded(order * mains, step) for mains in MAINS for order in _orders(mains, step)]


def _orders(mains: float, step: float) -> list[int]:
    """Return the harmonics that are looked for: all up to half the rate, and those of `_BEYOND`."""
    below = range(1, int(0.5 / (step * mains)) + 1)
    return [*below, *(order for order in _BEYOND if order not in below)]


def _folded(frequency: float, step: float) -> float:
    """Return where a frequency [Hz] shows that is sampled every `step` [s]."""
    rate = 1.0 / step
    return abs(frequency - rate * round(frequency / rate))


def mains_of(
    frequency: float, step: float, width: float, among: Sequence[float] = MAINS
) -> tuple[float, int, bool]:
    """Return the mains frequency [Hz] that a line is of, the order, and whether it is folded.

    Parameters
    ----------
    frequency : Hz, as recorded
    step : sampling step [s]
    width : Hz within which it is known
    among : mains frequencies [Hz] that it may be of

    Returns
    -------
    (mains, order, folded)
        (0, 0, False) where it is none of the mains.
    """
    half = 0.5 / step
    for folded in (False, True):
        for mains in among:
            for order in _orders(mains, step):
                whole = order * mains
                if (whole > half) is not folded:
                    continue
                off = _GRID_OFF if folded and order > _LOW else MAINS_OFF
                if abs(_folded(whole, step) - frequency) <= max(off * whole, width):
                    return mains, order, folded
    return 0.0, 0, False

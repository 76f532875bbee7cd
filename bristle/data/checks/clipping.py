"""Whether a channel was cut off at the end of its range, by three measures for three questions.

All look at stretches of equal samples at an extreme, and none can stand for another. Before any
model a channel of any sampling is asked, and a peak in coarse steps must not be taken for a cut:
`clipped_ends`, which knows the step. A diagnosis leaves out what may have been cut, so chance must
not cut it short: `stands_at_top`, on one side, its limits those of a decision rule. A fit refuses a
force that carries nothing but its ends, whatever did that: `saturated_share`, both sides together,
coarse steps included.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LONG = 5
"""Equal samples in a row at an extreme that a moving force does not show."""


def stretches(flat: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the first sample and the one after the last (k, 2) of each stretch that is true."""
    padded = np.concatenate([[0], flat.astype(np.int8), [0]])
    return np.asarray(np.flatnonzero(np.diff(padded)).reshape(-1, 2), dtype=np.int64)


def saturated_share(values: Array) -> float:
    """Return the share of samples (n,) that repeat an extreme in stretches of `LONG` or more."""
    count = 0
    for extreme in (values.max(), values.min()):
        lengths = np.diff(stretches(values == extreme))
        count += int(lengths[lengths >= LONG].sum())
    return count / len(values)


def stands_at_top(values: Array, near: float, longest: int, crowded: float) -> bool:
    """Return whether a signal (n,) is cut at its largest value.

    At a cut the very same number comes many times in a row; a noisy signal never does that. One in
    coarse steps does at its turns, but not many times more often than one step below.

    Parameters
    ----------
    values : (n,) in the channel's unit
    near : distance from the largest value that counts as equal, in the same unit
    longest : samples of a stretch at a turn at the most
    crowded : how many times as many samples as one step below a cut holds at the least
    """
    at_end = values >= values.max() - near
    stays, often = np.diff(stretches(at_end)).ravel(), int(at_end.sum())
    # Once may be a rest before or after the test, at that end of the stroke.
    if np.count_nonzero(stays >= longest) < 2 or often < 2 * longest:
        return False
    _, below = np.unique(values[~at_end], return_counts=True)
    return bool(len(below)) and often > crowded * float(np.mean(below[-longest:]))


def clipped_ends(values: Array, quantum: float) -> list[tuple[float, float, int]]:
    """Return (share of samples, level, stretches) of each end where a channel is cut off.

    A stretch is three or more equal samples at the largest or smallest value, away from the ends of
    the record. A turning point of a signal written in steps dwells there too, but then almost as
    long on the next step.
    """
    span = float(np.ptp(values))
    tolerance = max(0.5 * quantum, 1e-9 * span)
    found = []
    for extreme in (float(values.max()), float(values.min())):
        distance = np.abs(values - extreme)
        edges = stretches(distance <= tolerance).tolist()
        inner = [(a, b) for a, b in edges if b - a >= 3 and a > 0 and b < len(values)]
        count = sum(b - a for a, b in inner)
        near = max(quantum, 5e-3 * span) + tolerance
        beside = int(((distance > tolerance) & (distance <= near)).sum())
        levels = max(1.0, 5e-3 * span / quantum) if quantum else 1.0
        # How much longer a round peak dwells on the last step than on each of the next.
        round_peak = 0.707 * levels / ((levels + 0.5) ** 0.5 - 0.707)
        often = count >= 5 and (len(inner) > 1 or count >= 10)
        if often and count > 4.0 * round_peak * beside / levels:
            found.append((count / len(values), extreme, len(inner)))
    return sorted(found, key=lambda end: -end[0])

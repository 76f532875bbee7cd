"""How far a measured signal differs from the planned one at the same instants."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data.channels import channel_unit
from ..quantity import plain, scale

Array = NDArray[np.float64]

DIFFERS = 0.05
"""Share from which a difference is told."""
EDGE = 0.02
"""Share of a planned range that counts as its upper, or its lower, end."""
OFF = 0.1
"""Share of a command's range by which it may differ at any instant."""
LATEST = 0.5
"""Seconds up to which a command may come late, or early."""
AS_GOOD = 0.01
"""Correlation by which a nearer peak may be lower than the highest one."""


def share_reached(measured: Array, planned: Array) -> float:
    """Return which share of the planned range was reached, at the instants of its ends."""
    low, high = float(np.min(planned)), float(np.max(planned))
    edge = EDGE * (high - low)
    upper, lower = planned >= high - edge, planned <= low + edge
    if high == low:
        return float(np.mean(measured)) / high if high else 1.0
    # Medians: at the ends of a command that comes late, some samples show another level.
    reached = float(np.median(measured[upper]) - np.median(measured[lower]))
    return reached / float(np.median(planned[upper]) - np.median(planned[lower]))


def command_differences(name: str, measured: Array, planned: Array, step: float) -> list[str]:
    """Return how a measured command differs from the planned one: its range, then its time.

    Parameters
    ----------
    name : the channel of the command
    measured, planned : (n,) in its unit
    step : sampling step [s]
    """
    late = _late(measured, planned, step)
    in_time, wanted = _shifted(measured, planned, late)
    share, reached, clipped = _reached(in_time, wanted)
    goal = np.minimum(planned, reached) if clipped else share * planned
    wrong = _off(measured, goal)
    if _off(*_shifted(measured, goal, late)) > DIFFERS:
        wrong = _off(measured, planned)
        return [f"the {name} was another one than planned for {percent_of(wrong)} of the run"]
    out = []
    if abs(share - 1.0) > DIFFERS:
        top = float(np.max(planned))
        factor, unit = scale(channel_unit(name), top)
        how = f"was clipped at {plain(factor * reached)} {unit}, " if clipped else "reached "
        told = percent_of(reached / top if clipped and top > 0.0 else share)
        out.append(f"the {name} {how}{told} of what was planned")
    if late and wrong > DIFFERS:
        way = "late" if late > 0 else "early"
        out.append(
            f"the {name} came {plain(1e3 * abs(late) * step)} ms {way}, and was another "
            f"one than planned for {percent_of(wrong)} of the run"
        )
    return out


def _reached(measured: Array, planned: Array) -> tuple[float, float, bool]:
    """Return the share of a command that was reached, its upper level, and whether it is cut."""
    share, top = share_reached(measured, planned), float(np.max(planned))
    reached = float(np.median(measured[planned >= top - EDGE * float(np.ptp(planned))]))
    if abs(share - 1.0) <= DIFFERS:
        return 1.0, reached, False
    clipped = _off(measured, np.minimum(planned, reached)) < _off(measured, share * planned)
    return share, reached, share < 1.0 and clipped


def _off(measured: Array, goal: Array) -> float:
    """Return the share of instants at which a command is another one [1]."""
    size = float(np.ptp(goal)) or abs(float(goal[0])) or 1.0
    return float(np.mean(np.abs(measured - goal) > OFF * size))


def _late(measured: Array, goal: Array, step: float) -> int:
    """Return by how many samples a command is late, less than 0 where it is early.

    By the correlation, which neither clipping nor a weaker command moves. Of peaks alike, as a
    periodic command has them, the nearest one.
    """
    most = min(round(LATEST / step), goal.size // 4)
    lags = np.arange(-most, most + 1)
    alike = np.array([_likeness(*_shifted(measured, goal, int(lag))) for lag in lags])
    beside = np.pad(alike, 1, constant_values=-np.inf)
    peaks = (alike >= beside[:-2]) & (alike >= beside[2:]) & (alike >= np.max(alike) - AS_GOOD)
    return int(min(lags[peaks], key=abs))


def _likeness(measured: Array, goal: Array) -> float:
    """Return the correlation of two signals, 0 where one is constant."""
    own, other = measured - np.mean(measured), goal - np.mean(goal)
    size = float(np.linalg.norm(own) * np.linalg.norm(other))
    return float(own @ other) / size if size > 0.0 else 0.0


def _shifted(measured: Array, goal: Array, late: int) -> tuple[Array, Array]:
    """Return a command that is late by some samples, and its goal, at the same instants."""
    size = goal.size
    own = slice(max(late, 0), size + min(late, 0))
    return measured[own], goal[slice(max(-late, 0), size - max(late, 0))]


def percent_of(share: float) -> str:
    """Return a share as text, two digits below 100 %."""
    return f"{plain(100.0 * share, 2 if share < 1.0 else 3)} %"

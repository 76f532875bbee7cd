"""The levels that the command of runs keeps to, and whether they tell more than a straight line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..measurement import Measurement
from .runs import drive_levels

LEAST_LEVELS = 3
"""Levels of the command that tell more than a straight line."""

_APART = 0.02  # of the largest level: closer ones are one


def drives_of(runs: Sequence[Measurement]) -> list[tuple[Measurement, str]]:
    """Return the runs that have a command, each with the name of its channel."""
    return [(run, run.drive) for run in runs if run.drive]


def command_levels(runs: Sequence[Measurement]) -> list[float] | None:
    """Return the levels [V, or A] that the command keeps to, None where it moves continuously.

    Empty where no run has a command.
    """
    drives = drives_of(runs)
    found = [drive_levels(run[name], run.step, run.noise[name]) for run, name in drives]
    if not found:
        return []
    if not all(found):
        return None
    return _merged(sorted(level for one in found for level, _ in one))


def tells_a_bend(runs: Sequence[Measurement]) -> bool:
    """Return whether the command of runs has so many levels that a parabola has a meaning."""
    levels = command_levels(runs)
    return levels is None or len(levels) >= LEAST_LEVELS


def _merged(levels: list[float]) -> list[float]:
    """Return levels that differ, each the mean of those that are nearly one."""
    apart = _APART * max(map(abs, levels))
    groups: list[list[float]] = [[levels[0]]]
    for level in levels[1:]:
        if level - groups[-1][0] > apart:
            groups.append([level])
        else:
            groups[-1].append(level)
    return [float(np.mean(group)) for group in groups]

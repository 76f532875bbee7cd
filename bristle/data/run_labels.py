"""A label of all runs together: its levels, whether it only counts them, what moves with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.arrays import Array
from .channels import DRIVE, Label, Labels, label_unit, varying

MOVED = ("frequency", "amplitude", *DRIVE)
"""Labels that say what the motion or the command was."""

TOGETHER = 0.98
"""Correlation of a label with something else above which these runs cannot separate the two."""


@dataclass(frozen=True)
class LabelOfRuns:
    """A label of all runs: `values` (k,) as they are told."""

    name: str
    values: tuple[Label, ...]

    @cached_property
    def levels(self) -> list[Label]:
        """Its values, each once, in order."""
        return sorted({*self.values}, key=lambda one: (isinstance(one, str), one))

    @property
    def is_number(self) -> bool:
        """Whether it is a number in all runs."""
        return not any(isinstance(one, str) for one in self.values)

    @property
    def counts(self) -> bool:
        """Whether it only names the runs, or counts them from 0 or 1 on: each has its own value."""
        if len(self.levels) < len(self.values) or len(self.values) < 3 or label_unit(self.name):
            return False
        first = self.levels[0]
        return not self.is_number or (
            first in (0.0, 1.0) and self.levels == [first + k for k in range(len(self.levels))]
        )

    def numbers(self) -> Array:
        """Return it as numbers (k,), words by their place from 1 on."""
        places = {one: k + 1.0 for k, one in enumerate(self.levels)}
        return np.array([y if not isinstance(y, str) else places[y] for y in self.values])

    def steps(self) -> Array:
        """Return columns (k, levels - 1) that are 1 in the runs at a level, without the first."""
        return np.array([[float(one == level) for level in self.levels[1:]] for one in self.values])

    def goes_with(self, other: Array) -> bool:
        """Return whether something else (k,) moves together with it, so that none is separable."""
        if not float(np.ptp(other)) > 1e-2 * float(np.max(np.abs(other), initial=0.0)):
            return False
        one = np.ones((len(other), 1))
        own = self.numbers()[:, None] if self.is_number else self.steps()
        whole, (left, rank) = left_by(other, one)[0], left_by(other, np.hstack([one, own]))
        return len(other) > rank and left <= (1.0 - TOGETHER**2) * whole


def labels_of(known: Sequence[Labels]) -> list[LabelOfRuns]:
    """Return the labels that all runs have and differ in, that tell more than motion or number.

    Parameters
    ----------
    known : the labels of each run
    """
    found = [LabelOfRuns(name, tuple(one[name] for one in known)) for name in varying(known)]
    return [
        label
        for label in found
        if label.name not in MOVED
        and not label.counts
        and len({isinstance(one, str) for one in label.values}) == 1
    ]


def left_by(values: Array, columns: Array) -> tuple[float, int]:
    """Return the squares that columns (k, c) leave of values (k,), and how many columns count."""
    found, _, rank, _ = np.linalg.lstsq(columns, values, rcond=1e-9)
    left = values - columns @ found
    return float(left @ left), int(rank)

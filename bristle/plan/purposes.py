"""What a plan is for: figures that are to become small, from what runs say of questions.

- separate: how far rival models are apart, once each is fitted again;
- see: from what size an effect is named;
- sharpen: standard deviations of parameters;
- learn: how well a part without a form is held along its coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, log

import numpy as np

from ..diagnose.named_size import named_distance
from ..diagnose.rule import BENCH, DecisionRule
from .knowledge import Known

PURPOSES = ("separate", "see", "sharpen", "learn")

ENOUGH = 3.0
"""How many times as far apart as a verdict asks rivals are of no more use."""

SMALL = 0.0003
"""Share of its size to which a parameter need not be known better."""

SEEN = 0.003
"""Size, over that of a first guess, from which an effect that is seen is of no more use."""

HELD = 1e-3
"""Standard deviation of a curve, or of a force, over noise, from which less is of no more use."""

HIDDEN = 1e6
"""What is not seen at all costs as much as a figure so many times what is enough."""

LEAST = 1e-3
"""Share of an effect's change that must be left; below that it is the error of sensitivities."""


@dataclass(frozen=True)
class Figure:
    """A number that a plan makes smaller.

    `purpose` one of PURPOSES; `name` of effect, pair, parameter or coordinate; `value` of it, in
    `unit`; `enough` what need not be less.
    """

    purpose: str
    name: str
    value: float
    enough: float

    @property
    def cost(self) -> float:
        """What a plan is to make small: the logarithm, no more than flat below what is enough."""
        return log(min(max(self.value / self.enough, 1.0), HIDDEN))


def seen(
    known: Known, rule: DecisionRule = BENCH, least: Mapping[str, float] | None = None
) -> list[Figure]:
    """Return from what size each effect would be named, over the size that was asked for.

    Parameters
    ----------
    known : what runs say
    rule : the numbers that decide
    least : by effect, the size over the one asked for below which the integration's steps decide:
        no test shows less
    """
    least = least or {}
    held_out = known.told.held_out
    wanted = named_distance(known.told.samples, held_out, rule) if held_out else inf
    left, kept = known.distances(), known.kept()
    return [
        Figure(
            "see", name,
            wanted / left[name] if kept[name] > LEAST and left[name] > 0.0 else inf,
            max(SEEN, least.get(name, 0.0)),
        )
        for name in left
    ]  # fmt: skip


def separated(known: Sequence[Known], rule: DecisionRule = BENCH) -> list[Figure]:
    """Return by how much rivals are too near to be told apart: 1 where a verdict just can."""
    apart: dict[str, float] = {}
    for one in known:
        for name, distance in one.distances().items():
            apart[name] = min(apart.get(name, inf), distance)
    return [
        Figure("separate", name, rule.tells / distance if distance else inf, 1.0 / ENOUGH)
        for name, distance in apart.items()
    ]


def sharpened(known: Known, names: Sequence[str]) -> list[Figure]:
    """Return the standard deviation of each parameter, over its size."""
    found = known.deviations()
    return [Figure("sharpen", name, found[name], SMALL) for name in names or found]


def learned(known: Known) -> list[Figure]:
    """Return how well a part without a form is held: over all the rig can do, or by coordinate."""
    if known.typical is not None:
        return [Figure("learn", "force", known.of_force(), HELD)]
    return [
        Figure("learn", name, float(np.sqrt(np.mean(spread**2))), HELD)
        for name, spread in known.of_bases().items()
    ]


def cost_of(figures: Sequence[Figure]) -> float:
    """Return what a plan is to make small: the mean of each purpose's figures, of all purposes."""
    purposes = {one.purpose for one in figures}
    parts = [float(np.mean([f.cost for f in figures if f.purpose == one])) for one in purposes]
    return float(np.mean(parts)) if parts else 0.0

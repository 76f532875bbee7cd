"""The goal of a plan: its purposes as questions, and the figures that it is judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..diagnose.rule import BENCH, DecisionRule
from ..identify.model import Model, Problem, Run
from .knowledge import Asked, Known, Question
from .purposes import Figure, cost_of, learned, seen, separated, sharpened
from .questions import SizedRival
from .seen import Goal

DRAWN = 2
"""Further values of the parameters at which a plan is judged: it holds beside the fitted ones."""

UNSURE = 0.02
"""Standard deviation of a parameter, over its size, from which that is worth its cost."""


@dataclass(frozen=True)
class Measured:
    """The runs at hand; none of them before the first measurement."""

    train: Sequence[Run] = ()
    held_out: Sequence[Run] = ()


@dataclass(frozen=True)
class Purposes:
    """What a plan is for; a purpose that is not asked is empty.

    `effects` to be seen; `rivals` questions whose rivals are each other; `parameters` to be
    sharpened; `parts` the question with a part without a form, None where nothing is to be learned;
    `rule` the numbers that decide there; `drive` the channel of the command, "" for none.
    """

    model: Model
    effects: tuple[SizedRival, ...] = ()
    rivals: tuple[Question, ...] = ()
    parameters: tuple[str, ...] = ()
    parts: Question | None = None
    rule: DecisionRule = BENCH
    drive: str = ""

    @property
    def judged(self) -> bool:
        """Whether a verdict is asked for."""
        return bool(self.effects or self.rivals)

    def questions(self) -> list[Question]:
        """Return the questions, in the order in which `figures` takes them."""
        rivals = tuple(one.rival() for one in self.effects)
        bases = self.parts.bases if self.parts is not None else ()
        own = Question(self.model, rivals, bases)
        return [own, *self.rivals]

    def figures(self, known: Sequence[Known]) -> list[Figure]:
        """Return what a plan makes smaller, of what runs say of the questions."""
        own, *rivals = known
        least = {one.sized.name: one.least / one.size for one in self.effects}
        out = seen(own, self.rule, least) if self.effects else []
        out += separated(rivals) if rivals else []
        out += sharpened(own, self.parameters) if self.parameters else []
        return out + (learned(own) if self.parts is not None else [])


@dataclass(frozen=True)
class Stated:
    """A goal with what it is made of.

    `asked`, `known` of the fitted parameters alone: what a table tells; `goal` with others drawn.
    """

    purposes: Purposes
    asked: tuple[Asked, ...]
    known: tuple[Known, ...]
    goal: Goal = field(repr=False)


def stated(purposes: Purposes, problem: Problem, measured: Measured, z: float, seed: int) -> Stated:
    """Return the goal that purposes are.

    Parameters
    ----------
    purposes : what the plan is for
    problem : runs that stand for the sizes of the rig
    measured : the runs at hand
    z : error over noise of the model
    seed : of the values that are drawn
    """
    asked = tuple(Asked(one, problem, z) for one in purposes.questions())
    known = tuple(_known(one, measured) for one in asked)
    generator = np.random.default_rng(seed)
    unsure = max((max(one.deviations().values(), default=0.0) for one in known), default=0.0)
    drawn = DRAWN if unsure > UNSURE else 0
    sets = [asked]
    for _ in range(drawn):
        sets.append(tuple(a.drawn(k, generator) for a, k in zip(asked, known, strict=True)))
    width = len(asked)

    def cost(found: Sequence[Known]) -> float:
        parts = [found[k : k + width] for k in range(0, len(found), width)]
        return float(np.mean([cost_of(purposes.figures(one)) for one in parts]))

    goal = Goal(
        tuple(a for one in sets for a in one), known * len(sets), width, cost, purposes.judged
    )
    return Stated(purposes, asked, known, goal)


def _known(asked: Asked, measured: Measured) -> Known:
    train, held_out = (asked.evidence(runs) for runs in (measured.train, measured.held_out))
    return Known(asked.question, train + held_out.judging())

"""A test as it would be seen, and what tests are to serve: the goal that a search makes small."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .knowledge import Asked, Evidence, Known
from .planned_test import Signals, Test

HELD_OUT = 4
"""Of so many tests one is held out where parameters and curves are all that is asked for."""


def roles_of(count: int, judged: bool) -> list[bool]:
    """Return of each of so many tests whether it is held out; one that is follows its like.

    Parameters
    ----------
    count : of the tests
    judged : whether a verdict is asked for, which held-out runs decide: then every second one is
    """
    every = 2 if judged or count < HELD_OUT else HELD_OUT
    return [k % every == 1 for k in range(count)]


@dataclass(frozen=True, eq=False)
class Seen:
    """A test as it would be seen: what it prescribes.

    `shown` what it would say per question if it is fitted to; `held_out` whether it is to judge by.
    """

    test: Test
    signals: Signals
    shown: tuple[Evidence, ...]
    held_out: bool = False

    @property
    def role(self) -> str:
        """What the test is for, as files have it."""
        return "holdout" if self.held_out else "train"

    def told(self, k: int) -> Evidence:
        """Return what it would say of a question."""
        return self.shown[k].judging() if self.held_out else self.shown[k]


@dataclass(frozen=True)
class Goal:
    """What a plan is to reach.

    `asked` the questions, over and over where parameters are drawn, the `count` first ones with the
    fitted ones; `known` what the runs at hand say of them; `cost` what is to become small, of what
    runs would say; `judged` whether it is a verdict, which the tests that are held out decide.
    """

    asked: tuple[Asked, ...]
    known: tuple[Known, ...]
    count: int
    cost: Callable[[Sequence[Known]], float]
    judged: bool = True

    def with_tests(self, tests: Sequence[Seen]) -> list[Known]:
        """Return what the runs at hand and tests would say of each question."""
        return [known.with_runs(one.told(k) for one in tests) for k, known in enumerate(self.known)]

    def with_pair(self, one: Seen) -> list[Known]:
        """Return what the runs at hand, a test and another one to judge by would say."""
        return self.with_tests([one, replace(one, held_out=True)])

    def among(self, tests: Sequence[Seen]) -> Goal:
        """Return the goal where tests show what the rig can do."""
        known = []
        for k, one in enumerate(self.known):
            told = [test.shown[k] for test in tests if test.shown[k].samples]
            normals = [each.normal / each.samples for each in told]
            known.append(replace(one, typical=np.mean(normals, axis=0) if told else None))
        return replace(self, known=tuple(known))

    def value(self, tests: Sequence[Seen]) -> float:
        """Return the cost of the runs at hand with tests."""
        return self.cost(self.with_tests(tests))

"""The trials of effects at the damper: single ones, and pairs as far as they are asked for."""

from __future__ import annotations

from functools import cached_property

from ..compare.patterns import ResidualPattern
from ..identify.search_context import refine
from ..identify.structure import StructureProblem
from .candidates import SECONDS, Trial, judge, try_all, try_members
from .opening import Opening, Progress, of_layer, silent
from .remaining_residual import patterns_of
from .sites import try_effect

CONTENDERS, NEAR = 3, 1.03
"""How many trials at most are fitted to all that was recorded, and up to which z as a multiple of
the best one's: rivals are told apart on equal terms."""


class Trials:
    """The trials of single effects, and of `pairs` as far as they are asked for."""

    def __init__(self, opened: Opening, say: Progress = silent) -> None:
        self.opened, self.say = opened, say
        self.before = opened.before
        self.pairs: list[Trial] = []
        say("trying every effect inside the model")
        self.single = self._all(self.before, None)

    @cached_property
    def patterns(self) -> list[ResidualPattern]:
        """Along which coordinates the present model's residual is organised."""
        return patterns_of(self.before, self.opened.held_out)

    def grow(self, first: Trial) -> list[Trial]:
        """Return the trials of all effects added to a trial's model."""
        self.say(f"no single effect suffices: adding a second one to {first.effects[-1]}")
        grown = self._all(first, SECONDS)
        self.pairs += grown
        return grown

    def reduce(self, pair: Trial) -> list[Trial]:
        """Return the trials of a pair's members alone."""
        return try_members(pair, self.before.model, self.opened.problem, self.opened.held_out)

    def _all(self, first: Trial, most: int | None) -> list[Trial]:
        opened = self.opened
        held_out = opened.held_out
        trials = try_all(first.model, opened.searched, held_out, shown=opened.shown, most=most)
        trials = sorted([*trials, *self._of_layer(first)], key=lambda trial: trial.z)
        if opened.searched is not opened.problem:
            best = trials[0].z
            for k, one in enumerate(trials[:CONTENDERS]):
                if one.refined and one.z <= NEAR * best:
                    trials[k] = judge(refine(one.model, opened.problem), opened.problem, held_out)
        return sorted(trials, key=lambda trial: trial.z)

    def _of_layer(self, first: Trial) -> list[Trial]:
        """Return the trials of the layer's effects, of which a reconstructed force has a share."""
        problem, held_out = self.opened.problem, self.opened.held_out
        if not (isinstance(problem, StructureProblem) and isinstance(held_out, StructureProblem)):
            return []
        names = of_layer(first.model, problem)
        return [try_effect(name, first.model, problem, held_out) for name in names]
